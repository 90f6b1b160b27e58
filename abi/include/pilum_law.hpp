/* For authors of laws in C++17: a law is a class.
 *
 *     class Joint {
 *     public:
 *         static constexpr const char *name = "...", *author = "...", *licence = "...",
 *                                     *doc = "...", *references = "...";
 *         static constexpr pilum_parameter parameters[] = {pilum::parameter(...).above(0.0), ...};
 *         static constexpr pilum_variable states[] = {pilum::state(...), ...};
 *         static constexpr pilum_formulation formulations[] = {pilum::interface_2d(states)};
 *
 *         explicit Joint(const double *parameter);    // may throw pilum::Refusal
 *         pilum_status update(const pilum_point &point, pilum_tangent tangent,
 *                             pilum_response &end) const;
 *     };
 *     PILUM_EXPORT_LAW(Joint, "joint", "1.0")
 *
 * Exceptions stop here: one that leaves `update` is reported as a defect of the law, which is then
 * not called again. Failures that belong to the law are returned, since throwing allocates. */
#ifndef PILUM_LAW_HPP
#define PILUM_LAW_HPP

#include "pilum_point.h"

#include <atomic>
#include <exception>
#include <limits>
#include <new>
#include <string>
#include <utility>

namespace pilum {

/* Thrown by the constructor of a law whose parameters do not go together. */
class Refusal : public std::exception {
public:
    /* The id of the parameter to change, and what is wrong with it, value before bound. */
    Refusal(const std::string &parameter, const std::string &reason)
        : text_(parameter + ": " + reason) {}
    const char *what() const noexcept override { return text_.c_str(); }

private:
    std::string text_;
};

/* A parameter without bounds or default, and what may be added to it. */
struct Parameter : pilum_parameter {
    constexpr Parameter(const char *its_id, const char *its_symbol, const char *its_unit,
                        const char *its_doc)
        : pilum_parameter{sizeof(pilum_parameter), 0, its_id, its_symbol, its_unit, its_doc,
                          std::numeric_limits<double>::quiet_NaN(),
                          -std::numeric_limits<double>::infinity(),
                          std::numeric_limits<double>::infinity(),
                          -std::numeric_limits<double>::infinity(),
                          std::numeric_limits<double>::infinity(), nullptr} {}
    /* Admits values >= x. */
    constexpr Parameter at_least(double x) const { return with(0, &Parameter::lower, x); }
    /* Admits values > x. */
    constexpr Parameter above(double x) const {
        return with(PILUM_P_OPEN_LOWER, &Parameter::lower, x);
    }
    /* Admits values <= x. */
    constexpr Parameter at_most(double x) const { return with(0, &Parameter::upper, x); }
    /* Admits values < x. */
    constexpr Parameter below(double x) const {
        return with(PILUM_P_OPEN_UPPER, &Parameter::upper, x);
    }
    /* Values outside draw a warning. */
    constexpr Parameter usual(double from, double to) const {
        return with(0, &Parameter::usual_lower, from).with(0, &Parameter::usual_upper, to);
    }
    /* Value if left out. */
    constexpr Parameter otherwise(double x) const { return with(0, &Parameter::default_value, x); }
    /* May be left out; the law then receives NaN. */
    constexpr Parameter optional() const {
        return with(PILUM_P_OPTIONAL, &Parameter::default_value, default_value);
    }

private:
    constexpr Parameter with(uint32_t flag, double pilum_parameter::*field, double x) const {
        Parameter changed = *this;
        changed.flags |= flag;
        changed.*field = x;
        return changed;
    }
};

/* A parameter: id, symbol, unit, one sentence. */
constexpr Parameter parameter(const char *id, const char *symbol, const char *unit,
                              const char *doc) {
    return Parameter(id, symbol, unit, doc);
}

/* An internal variable that is one number, 0 at first. */
constexpr pilum_variable state(const char *id, const char *symbol, const char *unit,
                               const char *doc) {
    return PILUM_STATE(id, symbol, unit, doc);
}

constexpr pilum_formulation formulation(pilum_hypothesis hypothesis, const pilum_variable &gradient,
                                        const pilum_variable &flux, const pilum_variable *states,
                                        uint32_t n_states, uint32_t flags) {
    return {sizeof(pilum_formulation), hypothesis, flags, 1, 1, n_states, &gradient, &flux, states};
}

/* The formulations a law may offer; `flags` are PILUM_T_ values. */
template <uint32_t n>
constexpr pilum_formulation interface_2d(const pilum_variable (&states)[n], uint32_t flags = 0) {
    return formulation(PILUM_H_INTERFACE_2D, pilum_jump, pilum_traction, states, n, flags);
}
template <uint32_t n>
constexpr pilum_formulation plane_strain(const pilum_variable (&states)[n], uint32_t flags = 0) {
    return formulation(PILUM_H_PLANE_STRAIN, pilum_strain_4, pilum_stress_4, states, n, flags);
}
template <uint32_t n>
constexpr pilum_formulation axisymmetric(const pilum_variable (&states)[n], uint32_t flags = 0) {
    return formulation(PILUM_H_AXISYMMETRIC, pilum_strain_4, pilum_stress_4, states, n, flags);
}
template <uint32_t n>
constexpr pilum_formulation three_d(const pilum_variable (&states)[n], uint32_t flags = 0) {
    return formulation(PILUM_H_3D, pilum_strain_6, pilum_stress_6, states, n, flags);
}

/* The functions of the contract for a class, with the barrier against exceptions. */
template <class Law> struct Exported {
    struct Instance {
        Law law;
        uint32_t n_components;
        uint32_t n_states;
        /* An exception left the law: it is defective and is not called again. */
        mutable std::atomic<bool> is_defective;
    };

    static pilum_status create(const pilum_law *law, const pilum_host *, uint32_t formulation,
                               const double *parameter, uint32_t n_parameters,
                               pilum_instance **out, char *message, size_t capacity) noexcept {
        pilum_status status = pilum_check_parameters(law, formulation, parameter, n_parameters,
                                                     out, message, capacity);
        if (status != PILUM_OK) {
            return status;
        }
        try {
            const pilum_formulation &f = Law::formulations[formulation];
            auto *instance = new Instance{Law(parameter), f.flux->n_components, f.n_states, {false}};
            *out = reinterpret_cast<pilum_instance *>(instance);
            return PILUM_OK;
        } catch (const Refusal &refusal) {
            pilum_say(message, capacity, "%s", refusal.what());
            return PILUM_E_PARAMETER;
        } catch (const std::exception &error) {
            pilum_say(message, capacity, "threw in its constructor: %s", error.what());
        } catch (...) {
            pilum_say(message, capacity, "threw in its constructor");
        }
        return PILUM_E_INTERNAL;
    }

    static pilum_status update(const pilum_instance *opaque, const pilum_point *point,
                               pilum_tangent tangent, pilum_response *end) noexcept {
        const auto *instance = reinterpret_cast<const Instance *>(opaque);
        try {
            return instance->law.update(*point, tangent, *end);
        } catch (const std::exception &error) {
            thread_local char text[200];
            pilum_say(text, sizeof text, "threw: %s", error.what());
            end->reason = text;
        } catch (...) {
            end->reason = "threw an exception";
        }
        instance->is_defective = true;
        return PILUM_E_INTERNAL;
    }

    static pilum_status integrate(const pilum_instance *opaque, const pilum_batch *batch) noexcept {
        const auto *instance = reinterpret_cast<const Instance *>(opaque);
        if (!instance) {
            return pilum_each_point(opaque, batch, 0, 0, update);
        }
        if (instance->is_defective) {
            if (batch && PILUM_HAS(batch, pilum_batch, message_capacity)) {
                pilum_say(batch->message, batch->message_capacity,
                          "the law threw before and is not called again");
            }
            return PILUM_E_INTERNAL;
        }
        return pilum_each_point(opaque, batch, instance->n_components, instance->n_states, update);
    }

    static void destroy(pilum_instance *opaque) noexcept {
        try {
            delete reinterpret_cast<Instance *>(opaque);
        } catch (...) {
        }
    }
};

/* Number of entries of a table. */
template <class T, uint32_t n> constexpr uint32_t count(const T (&)[n]) { return n; }

} // namespace pilum

/* Exports a class as the only law of a library; id and version are string literals. */
#define PILUM_EXPORT_LAW(Class, id, version)                                                       \
    static constexpr pilum_law pilum_the_law{                                                      \
        sizeof(pilum_law),                                                                         \
        0,                                                                                         \
        pilum::count(Class::parameters),                                                           \
        pilum::count(Class::formulations),                                                         \
        id,                                                                                        \
        Class::name,                                                                               \
        version,                                                                                   \
        Class::author,                                                                             \
        Class::licence,                                                                            \
        Class::doc,                                                                                \
        Class::references,                                                                         \
        Class::parameters,                                                                         \
        Class::formulations,                                                                       \
        pilum::Exported<Class>::create,                                                            \
        nullptr,                                                                                   \
        pilum::Exported<Class>::integrate,                                                         \
        pilum::Exported<Class>::destroy,                                                           \
    };                                                                                             \
    static constexpr const pilum_law *pilum_the_laws[] = {&pilum_the_law};                         \
    static constexpr pilum_plugin pilum_the_plugin{sizeof(pilum_plugin), 1, pilum_the_laws,        \
                                                   nullptr};                                       \
    const pilum_magic_block pilum_magic = PILUM_MAGIC_BLOCK("pilum-c++ 1.0");                      \
    PILUM_MANIFEST("pilum 1\n" id " " version "\n");                                               \
    const pilum_plugin *pilum_entry(const pilum_host *) { return &pilum_the_plugin; }

#endif /* PILUM_LAW_HPP */
