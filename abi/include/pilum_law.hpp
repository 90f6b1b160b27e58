/* For authors of laws in C++17: a law is a class.
 *
 *     class Joint {
 *     public:
 *         static constexpr const char *id = "joint", *version = "1.0", *name = "...",
 *                                     *author = "...", *licence = "...", *doc = "...",
 *                                     *references = "...";
 *         static constexpr pilum_parameter parameters[] = {pilum::parameter(...).above(0.0), ...};
 *         static constexpr pilum_variable states[] = {pilum::state(...), ...};
 *         static constexpr pilum_formulation formulations[] = {pilum::interface_2d(states)};
 *
 *         explicit Joint(const double *parameter);    // may throw pilum::Refusal
 *         pilum_status update(const pilum_point &point, pilum_tangent tangent,
 *                             pilum_response &end) const;
 *
 *         // The rest as needed. Internal variables that depend on the initial stress, which has n
 *         // components:
 *         pilum_status initial_state(uint32_t n, const double *flux, double *state,
 *                                    const char *&reason) const;
 *         // The consistent tangent by differences, as pilum_differentiate has it; update is then
 *         // asked for the elastic operator or none:
 *         double difference_size() const;
 *     };
 *     PILUM_EXPORT_LAWS(Joint, Soil)
 *
 * A class without `parameters` has none, one whose formulations name no states has no internal
 * variables. PILUM_EXPORT_LAW(Class, id, version) exports one class, which then needs neither `id`
 * nor `version`.
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
#include <type_traits>
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
    /* One of several labels, an array of texts that ends in nullptr; the value is the number of the
     * label, from 0. */
    template <uint32_t n> constexpr Parameter one_of(const char *const (&labels)[n]) const {
        Parameter changed = *this;
        changed.lower = 0.0;
        changed.upper = labels[n - 1] ? throw "the labels must end in nullptr" : n - 2.0;
        changed.choices = labels;
        return changed;
    }
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

/* An internal variable, and what may be added to it. */
struct Variable : pilum_variable {
    constexpr explicit Variable(const pilum_variable &declared) : pilum_variable(declared) {}
    /* Its value at first, where the law has no `initial_state`. */
    constexpr Variable initially(double x) const {
        Variable changed = *this;
        changed.initial_value = x;
        return changed;
    }
    /* A result to look at, which the law does not read back. */
    constexpr Variable output_only() const {
        Variable changed = *this;
        changed.flags |= PILUM_V_OUTPUT_ONLY;
        return changed;
    }
};

/* An internal variable that is one number, 0 at first. */
constexpr Variable state(const char *id, const char *symbol, const char *unit, const char *doc) {
    return Variable(PILUM_STATE(id, symbol, unit, doc));
}

constexpr pilum_formulation formulation(pilum_hypothesis hypothesis, const pilum_variable &gradient,
                                        const pilum_variable &flux, const pilum_variable *states,
                                        uint32_t n_states, uint32_t flags) {
    return {sizeof(pilum_formulation), hypothesis, flags, 1, 1, n_states, &gradient, &flux, states};
}

/* The formulations a law may offer, with internal variables or without; `flags` are PILUM_T_
 * values. */
template <uint32_t n>
constexpr pilum_formulation interface_2d(const pilum_variable (&states)[n], uint32_t flags = 0) {
    return formulation(PILUM_H_INTERFACE_2D, pilum_jump, pilum_traction, states, n, flags);
}
constexpr pilum_formulation interface_2d(uint32_t flags = 0) {
    return formulation(PILUM_H_INTERFACE_2D, pilum_jump, pilum_traction, nullptr, 0, flags);
}
template <uint32_t n>
constexpr pilum_formulation interface_3d(const pilum_variable (&states)[n], uint32_t flags = 0) {
    return formulation(PILUM_H_INTERFACE_3D, pilum_jump_3, pilum_traction_3, states, n, flags);
}
constexpr pilum_formulation interface_3d(uint32_t flags = 0) {
    return formulation(PILUM_H_INTERFACE_3D, pilum_jump_3, pilum_traction_3, nullptr, 0, flags);
}
template <uint32_t n>
constexpr pilum_formulation plane_strain(const pilum_variable (&states)[n], uint32_t flags = 0) {
    return formulation(PILUM_H_PLANE_STRAIN, pilum_strain_4, pilum_stress_4, states, n, flags);
}
constexpr pilum_formulation plane_strain(uint32_t flags = 0) {
    return formulation(PILUM_H_PLANE_STRAIN, pilum_strain_4, pilum_stress_4, nullptr, 0, flags);
}
template <uint32_t n>
constexpr pilum_formulation axisymmetric(const pilum_variable (&states)[n], uint32_t flags = 0) {
    return formulation(PILUM_H_AXISYMMETRIC, pilum_strain_4, pilum_stress_4, states, n, flags);
}
constexpr pilum_formulation axisymmetric(uint32_t flags = 0) {
    return formulation(PILUM_H_AXISYMMETRIC, pilum_strain_4, pilum_stress_4, nullptr, 0, flags);
}
template <uint32_t n>
constexpr pilum_formulation three_d(const pilum_variable (&states)[n], uint32_t flags = 0) {
    return formulation(PILUM_H_3D, pilum_strain_6, pilum_stress_6, states, n, flags);
}
constexpr pilum_formulation three_d(uint32_t flags = 0) {
    return formulation(PILUM_H_3D, pilum_strain_6, pilum_stress_6, nullptr, 0, flags);
}

/* What a class offers beside `update`. */
template <class Law, class = void> struct HasInitialState : std::false_type {};
template <class Law>
struct HasInitialState<Law, std::void_t<decltype(&Law::initial_state)>> : std::true_type {};
template <class Law, class = void> struct HasDifferences : std::false_type {};
template <class Law>
struct HasDifferences<Law, std::void_t<decltype(&Law::difference_size)>> : std::true_type {};
template <class Law, class = void> struct HasParameters : std::false_type {};
template <class Law>
struct HasParameters<Law, std::void_t<decltype(Law::parameters)>> : std::true_type {};

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
            auto *instance = new Instance{Law(parameter), f.flux->n_components,
                                          pilum_count_states(&f), {false}};
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

    /* Calls the law, and reports an exception that leaves it as its defect. */
    template <class Call>
    static pilum_status guarded(const Instance *instance, const char *&reason, Call call) noexcept {
        try {
            return call(instance->law);
        } catch (const std::exception &error) {
            thread_local char text[200];
            pilum_say(text, sizeof text, "threw: %s", error.what());
            reason = text;
        } catch (...) {
            reason = "threw an exception";
        }
        instance->is_defective = true;
        return PILUM_E_INTERNAL;
    }

    static pilum_status initial(const pilum_instance *opaque, const double *flux, double *state,
                                const char **reason) noexcept {
        const auto *instance = reinterpret_cast<const Instance *>(opaque);
        return guarded(instance, *reason, [&](const Law &law) {
            if constexpr (HasInitialState<Law>::value) {
                /* Without the count, as it was declared at first. */
                if constexpr (std::is_invocable_v<decltype(&Law::initial_state), const Law &,
                                                  const double *, double *, const char *&>) {
                    return law.initial_state(flux, state, *reason);
                } else {
                    return law.initial_state(instance->n_components, flux, state, *reason);
                }
            } else {
                (void)law, (void)flux, (void)state;
                return PILUM_OK;
            }
        });
    }

    static pilum_status update_once(const pilum_instance *opaque, const pilum_point *point,
                                    pilum_tangent tangent, pilum_response *end) noexcept {
        const auto *instance = reinterpret_cast<const Instance *>(opaque);
        return guarded(instance, end->reason,
                       [&](const Law &law) { return law.update(*point, tangent, *end); });
    }

    static pilum_status update(const pilum_instance *opaque, const pilum_point *point,
                               pilum_tangent tangent, pilum_response *end) noexcept {
        if constexpr (HasDifferences<Law>::value) {
            if (tangent == PILUM_TANGENT_CONSISTENT) {
                pilum_status status = update_once(opaque, point, PILUM_TANGENT_NONE, end);
                if (status != PILUM_OK && status != PILUM_OK_UNRELIABLE) {
                    return status;
                }
                double size = reinterpret_cast<const Instance *>(opaque)->law.difference_size();
                const char *reason = end->reason;
                pilum_status differences =
                    pilum_differentiate(opaque, point, update_once, size, end);
                if (status == PILUM_OK ||
                    (differences != PILUM_OK && differences != PILUM_OK_UNRELIABLE)) {
                    return differences;
                }
                end->reason = reason;
                return status;
            }
        }
        return update_once(opaque, point, tangent, end);
    }

    /* Whether the law may be called; a message if not. */
    static bool is_sound(const Instance *instance, const pilum_batch *batch) noexcept {
        bool is_defective = instance && instance->is_defective;
        if (is_defective && batch && PILUM_HAS(batch, pilum_batch, rates)) {
            pilum_say(batch->message, batch->message_capacity,
                      "the law threw before and is not called again");
        }
        return !is_defective;
    }

    static pilum_status init_state(const pilum_instance *opaque,
                                   const pilum_batch *batch) noexcept {
        const auto *instance = reinterpret_cast<const Instance *>(opaque);
        if (!is_sound(instance, batch)) {
            return PILUM_E_INTERNAL;
        }
        return pilum_each_start(opaque, batch, instance ? instance->n_components : 0,
                                instance ? instance->n_states : 0, initial);
    }

    static pilum_status integrate(const pilum_instance *opaque, const pilum_batch *batch) noexcept {
        const auto *instance = reinterpret_cast<const Instance *>(opaque);
        if (!is_sound(instance, batch)) {
            return PILUM_E_INTERNAL;
        }
        return pilum_each_point(opaque, batch, instance ? instance->n_components : 0,
                                instance ? instance->n_states : 0, update);
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

/* Most values of internal variables in the formulations of a class. */
template <class Law> constexpr uint32_t most_states() {
    uint32_t most = 0;
    for (const pilum_formulation &f : Law::formulations) {
        uint32_t n = 0;
        for (uint32_t i = 0; i < f.n_states; i++) {
            n += f.state[i].n_components;
        }
        most = n > most ? n : most;
    }
    return most;
}

/* A class in the contract's terms. */
template <class Law> constexpr pilum_law described(const char *id, const char *version) {
    static_assert(most_states<Law>() <= PILUM_MAX_STATES,
                  "more internal variables than PILUM_MAX_STATES: define it before the header");
    const pilum_parameter *parameters = nullptr;
    uint32_t n_parameters = 0;
    if constexpr (HasParameters<Law>::value) {
        parameters = Law::parameters;
        n_parameters = count(Law::parameters);
    }
    return {sizeof(pilum_law),
            0,
            n_parameters,
            count(Law::formulations),
            id,
            Law::name,
            version,
            Law::author,
            Law::licence,
            Law::doc,
            Law::references,
            parameters,
            Law::formulations,
            Exported<Law>::create,
            HasInitialState<Law>::value ? Exported<Law>::init_state : nullptr,
            Exported<Law>::integrate,
            Exported<Law>::destroy};
}

template <class Law> inline constexpr pilum_law law_of = described<Law>(Law::id, Law::version);

/* The manifest of these laws: a text in an array, padded with NUL. */
struct Manifest {
    char text[1024];
};
template <class... Laws> constexpr Manifest manifest() {
    Manifest made{};
    uint32_t n = 0;
    auto push = [&](const char *part) {
        for (; *part; part++) {
            made.text[n++] = *part;
        }
    };
    push("pilum 1\n");
    ((push(Laws::id), push(" "), push(Laws::version), push("\n")), ...);
    return made;
}

/* What `pilum_entry` returns. */
template <class... Laws> struct Library {
    static constexpr const pilum_law *laws[] = {&law_of<Laws>...};
    static constexpr pilum_plugin plugin{sizeof(pilum_plugin), sizeof...(Laws), laws, nullptr};
};

} // namespace pilum

/* Exports classes, which name their `id` and `version`, as the laws of a library. */
#define PILUM_EXPORT_LAWS(...)                                                                     \
    __attribute__((PILUM_MANIFEST_ATTRIBUTES)) static constexpr pilum::Manifest pilum_manifest =   \
        pilum::manifest<__VA_ARGS__>();                                                            \
    const pilum_magic_block pilum_magic = PILUM_MAGIC_BLOCK("pilum-c++ 1.1");                      \
    const pilum_plugin *pilum_entry(const pilum_host *) {                                          \
        return &pilum::Library<__VA_ARGS__>::plugin;                                               \
    }

/* Exports a class as the only law of a library; id and version are string literals. */
#define PILUM_EXPORT_LAW(Class, its_id, its_version)                                               \
    static constexpr pilum_law pilum_the_law = pilum::described<Class>(its_id, its_version);       \
    static constexpr const pilum_law *pilum_the_laws[] = {&pilum_the_law};                         \
    static constexpr pilum_plugin pilum_the_plugin{sizeof(pilum_plugin), 1, pilum_the_laws,        \
                                                   nullptr};                                       \
    const pilum_magic_block pilum_magic = PILUM_MAGIC_BLOCK("pilum-c++ 1.1");                      \
    PILUM_MANIFEST("pilum 1\n" its_id " " its_version "\n");                                       \
    const pilum_plugin *pilum_entry(const pilum_host *) { return &pilum_the_plugin; }

#endif /* PILUM_LAW_HPP */
