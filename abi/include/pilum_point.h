/* For authors of laws in C: one integration point at a time.
 *
 * pilum_law.h is the contract. This header holds what every law does alike: it refuses broken
 * arguments and parameters outside their bounds, walks the batch, and writes outcomes and the one
 * message. What is left to the author is a description, `create`, and a function that carries one
 * point over one increment. Nothing here allocates, locks or prints. */
#ifndef PILUM_POINT_H
#define PILUM_POINT_H

#include "pilum_law.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Most components of a gradient or flux, and most values of internal variables, that this header
 * carries. A law with more values defines PILUM_MAX_STATES before it includes the header; else its
 * parameters are refused with a message, and C++ does not compile it. */
#define PILUM_MAX_COMPONENTS 6
#ifndef PILUM_MAX_STATES
#define PILUM_MAX_STATES 256
#endif

/* Which operator the host wants beside the update. */
typedef enum pilum_tangent {
    /* None. */
    PILUM_TANGENT_NONE,
    /* The elastic operator in the end state. */
    PILUM_TANGENT_ELASTIC,
    /* The derivative of the update. */
    PILUM_TANGENT_CONSISTENT
} pilum_tangent;

/* One integration point at the start of an increment, and the increment. */
typedef struct pilum_point {
    /* Number of components: 2 for interfaces in the plane, 3 in space; 4 for solids in the plane, 6 in
     * space. */
    uint32_t n;
    /* Number of values of internal variables. */
    uint32_t n_states;
    /* Strain or jump at the start; components from n on are zero, here and below. */
    double gradient[PILUM_MAX_COMPONENTS];
    /* Its increment. */
    double increment[PILUM_MAX_COMPONENTS];
    /* Stress or traction at the start, kPa. */
    double flux[PILUM_MAX_COMPONENTS];
    /* Internal variables at the start. */
    double state[PILUM_MAX_STATES];
    /* Time at the start, and its increment. */
    double time, time_increment;
    /* Time at the start, counted from the start of the phase or segment. */
    double step_time;
} pilum_point;

/* The same point at the end of the increment; all zero when the author receives it. */
typedef struct pilum_response {
    /* Stress or traction, kPa. */
    double flux[PILUM_MAX_COMPONENTS];
    /* Internal variables. */
    double state[PILUM_MAX_STATES];
    /* d flux / d gradient, `tangent[row * n + column]`. */
    double tangent[PILUM_MAX_COMPONENTS * PILUM_MAX_COMPONENTS];
    /* With any outcome but PILUM_OK: why, a static text. */
    const char *reason;
    /* With PILUM_CUT_STEP: the fraction of the increment, in (0, 1), that the law can follow. NaN,
     * which it is at first, leaves the choice to the host. */
    double step_factor;
} pilum_response;

/* Initial internal variables of a point that carries this flux before anything has happened; `flux`
 * has PILUM_MAX_COMPONENTS entries, zero beyond those of the hypothesis, and `state`
 * is all zero when the author receives it. With any other outcome than PILUM_OK, `reason` is a
 * static text. A pure function of its arguments. */
typedef pilum_status (*pilum_initial)(const pilum_instance *instance, const double *flux,
                                      double *state, const char **reason);

/* Carries one point over one increment. A pure function of its arguments. */
typedef pilum_status (*pilum_update)(const pilum_instance *instance, const pilum_point *point,
                                     pilum_tangent tangent, pilum_response *end);

/* Writes a message, cut short to the buffer, which may be null. */
#if defined(__GNUC__)
__attribute__((format(printf, 3, 4), unused))
#endif
static inline void pilum_say(char *message, size_t capacity, const char *format, ...) {
    if (message && capacity > 0) {
        va_list values;
        va_start(values, format);
        vsnprintf(message, capacity, format, values);
        va_end(values);
    }
}

/* Number of values of the internal variables of a formulation. */
static inline uint32_t pilum_count_states(const pilum_formulation *formulation) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < formulation->n_states; i++) {
        n += formulation->state[i].n_components;
    }
    return n;
}

/* Refuses what `create` must refuse before it looks at the law: a wrong number of parameters, and
 * values outside their declared bounds. PILUM_OK: everything is as declared. */
static inline pilum_status pilum_check_parameters(const pilum_law *law, uint32_t formulation,
                                                  const double *parameter, uint32_t n_parameters,
                                                  pilum_instance **out, char *message,
                                                  size_t capacity) {
    pilum_say(message, capacity, "%s", "");
    if (formulation >= law->n_formulations) {
        pilum_say(message, capacity, "there is no formulation number %" PRIu32, formulation);
        return PILUM_E_ARGUMENT;
    }
    if (n_parameters != law->n_parameters || (n_parameters > 0 && !parameter) || !out) {
        pilum_say(message, capacity, "%" PRIu32 " parameters given, %" PRIu32 " expected",
                  n_parameters, law->n_parameters);
        return PILUM_E_ARGUMENT;
    }
    uint32_t n_states = pilum_count_states(&law->formulation[formulation]);
    if (n_states > PILUM_MAX_STATES) {
        pilum_say(message, capacity,
                  "the law has %" PRIu32 " values of internal variables and was compiled for %d: "
                  "define PILUM_MAX_STATES",
                  n_states, PILUM_MAX_STATES);
        return PILUM_E_INTERNAL;
    }
    for (uint32_t i = 0; i < n_parameters; i++) {
        const pilum_parameter *declared = &law->parameter[i];
        double value = parameter[i];
        if (isnan(value) && (declared->flags & PILUM_P_OPTIONAL)) {
            continue;
        }
        int above = declared->flags & PILUM_P_OPEN_LOWER ? value > declared->lower
                                                         : value >= declared->lower;
        int below = declared->flags & PILUM_P_OPEN_UPPER ? value < declared->upper
                                                         : value <= declared->upper;
        int is_label = !declared->choices || !(value < floor(value) || value > floor(value));
        if (!isfinite(value) || !above || !below || !is_label) {
            pilum_say(message, capacity, "%s: %g is not admissible", declared->id, value);
            return PILUM_E_PARAMETER;
        }
    }
    return PILUM_OK;
}

/* Whether `a` is a more severe outcome than `b`: errors, the most negative first, then
 * PILUM_CUT_STEP, then PILUM_OK_UNRELIABLE. */
static inline int pilum_is_worse(pilum_status a, pilum_status b) {
    return a < 0 || b < 0 ? a < b : a > b;
}

/* Tells the outcome of point `i`, and returns the most severe one so far. A defect of the law is the
 * outcome of all points from there on. */
static inline pilum_status pilum_tell(const pilum_batch *batch, uint64_t i, pilum_status status,
                                      pilum_status worst, const char *reason) {
    uint64_t end = status == PILUM_E_INTERNAL ? batch->n_points : i + 1;
    for (uint64_t k = i; batch->status && k < end; k++) {
        batch->status[k] = status;
    }
    if (!pilum_is_worse(status, worst)) {
        return worst;
    }
    pilum_say(batch->message, batch->message_capacity, "point %" PRIu64 ": %s",
              batch->first_point + i, reason);
    return status;
}

/* Does `init_state` for a law with these numbers of components and values of internal variables. */
static inline pilum_status pilum_each_start(const pilum_instance *instance,
                                            const pilum_batch *batch, uint32_t n_components,
                                            uint32_t n_states, pilum_initial initial) {
    if (!batch || !PILUM_HAS(batch, pilum_batch, rates)) {
        return PILUM_E_ARGUMENT;
    }
    pilum_say(batch->message, batch->message_capacity, "%s", "");
    if (batch->request != 0) {
        pilum_say(batch->message, batch->message_capacity, "an unknown request");
        return PILUM_E_UNSUPPORTED;
    }
    int is_null = !batch->flux0.p || (n_states > 0 && !batch->state1.p);
    if (!instance || n_states > PILUM_MAX_STATES || (batch->n_points > 0 && is_null)) {
        pilum_say(batch->message, batch->message_capacity, "%s",
                  instance ? "a view that is needed is null" : "the instance is null");
        return PILUM_E_ARGUMENT;
    }
    pilum_status worst = PILUM_OK;
    for (uint64_t i = 0; i < batch->n_points; i++) {
        double flux[PILUM_MAX_COMPONENTS] = {0.0}, state[PILUM_MAX_STATES];
        int is_finite = 1;
        for (uint32_t c = 0; c < n_components; c++) {
            flux[c] = PILUM_AT(batch->flux0, i, c);
            is_finite = is_finite && isfinite(flux[c]);
        }
        for (uint32_t s = 0; s < n_states; s++) {
            state[s] = 0.0;
        }
        const char *reason = is_finite ? "the law gives no reason" : "an input is not finite";
        pilum_status status =
            is_finite ? initial(instance, flux, state, &reason) : PILUM_E_NUMERIC;
        for (uint32_t s = 0; status == PILUM_OK && s < n_states; s++) {
            PILUM_AT(batch->state1, i, s) = state[s];
            is_finite = is_finite && isfinite(state[s]);
        }
        if (status == PILUM_OK && !is_finite) {
            status = PILUM_E_NUMERIC;
            reason = "a result is not finite";
        }
        worst = pilum_tell(batch, i, status, worst, reason);
        if (status == PILUM_E_INTERNAL) {
            break;
        }
    }
    return worst;
}

/* The response as the author receives it: as many zeros as the point has components and values. */
static inline void pilum_clear(const pilum_point *point, pilum_response *end) {
    for (uint32_t c = 0; c < point->n; c++) {
        end->flux[c] = 0.0;
    }
    for (uint32_t s = 0; s < point->n_states; s++) {
        end->state[s] = 0.0;
    }
    for (uint32_t k = 0; k < point->n * point->n; k++) {
        end->tangent[k] = 0.0;
    }
    end->reason = "the law gives no reason";
    end->step_factor = (double)NAN;
}

/* Does `integrate` for a law with these numbers of components and values of internal variables. */
static inline pilum_status pilum_each_point(const pilum_instance *instance,
                                            const pilum_batch *batch, uint32_t n_components,
                                            uint32_t n_states, pilum_update update) {
    const uint32_t known = PILUM_REQ_FLUX | PILUM_REQ_TANGENT | PILUM_REQ_ELASTIC;
    if (!batch || !PILUM_HAS(batch, pilum_batch, rates)) {
        return PILUM_E_ARGUMENT;
    }
    pilum_say(batch->message, batch->message_capacity, "%s", "");
    pilum_tangent tangent = batch->request & PILUM_REQ_ELASTIC   ? PILUM_TANGENT_ELASTIC
                            : batch->request & PILUM_REQ_TANGENT ? PILUM_TANGENT_CONSISTENT
                                                                 : PILUM_TANGENT_NONE;
    if (batch->request & ~known) {
        pilum_say(batch->message, batch->message_capacity, "an unknown request");
        return PILUM_E_UNSUPPORTED;
    }
    int is_null = !batch->gradient0.p || !batch->gradient1.p || !batch->flux0.p ||
                  !batch->flux1.p || (n_states > 0 && (!batch->state0.p || !batch->state1.p)) ||
                  (tangent != PILUM_TANGENT_NONE && !batch->tangent.p);
    if (!instance || n_states > PILUM_MAX_STATES || (batch->n_points > 0 && is_null)) {
        pilum_say(batch->message, batch->message_capacity, "%s",
                  instance ? "a view that is needed is null" : "the instance is null");
        return PILUM_E_ARGUMENT;
    }
    pilum_status worst = PILUM_OK;
    for (uint64_t i = 0; i < batch->n_points; i++) {
        pilum_point point;
        pilum_response end;
        int is_finite = 1;
        point.n = n_components;
        point.n_states = n_states;
        pilum_clear(&point, &end);
        for (uint32_t c = 0; c < n_components; c++) {
            point.gradient[c] = PILUM_AT(batch->gradient0, i, c);
            point.increment[c] = PILUM_AT(batch->gradient1, i, c) - point.gradient[c];
            point.flux[c] = PILUM_AT(batch->flux0, i, c);
            is_finite = is_finite && isfinite(point.gradient[c]) && isfinite(point.increment[c]) &&
                        isfinite(point.flux[c]);
        }
        for (uint32_t c = n_components; c < PILUM_MAX_COMPONENTS; c++) {
            point.gradient[c] = point.increment[c] = point.flux[c] = 0.0;
        }
        for (uint32_t s = 0; s < n_states; s++) {
            point.state[s] = PILUM_AT(batch->state0, i, s);
            is_finite = is_finite && isfinite(point.state[s]);
        }
        point.time = batch->time;
        point.time_increment = batch->time_increment;
        point.step_time = batch->step_time;
        if (!is_finite) {
            end.reason = "an input is not finite";
        }
        pilum_status status =
            is_finite ? update(instance, &point, tangent, &end) : PILUM_E_NUMERIC;
        if (status == PILUM_OK || status == PILUM_OK_UNRELIABLE) {
            for (uint32_t c = 0; c < n_components; c++) {
                PILUM_AT(batch->flux1, i, c) = end.flux[c];
                is_finite = is_finite && isfinite(end.flux[c]);
            }
            for (uint32_t s = 0; s < n_states; s++) {
                PILUM_AT(batch->state1, i, s) = end.state[s];
                is_finite = is_finite && isfinite(end.state[s]);
            }
            for (uint32_t k = 0; k < n_components * n_components; k++) {
                if (tangent != PILUM_TANGENT_NONE) {
                    PILUM_AT(batch->tangent, i, k) = end.tangent[k];
                    is_finite = is_finite && isfinite(end.tangent[k]);
                }
            }
            if (!is_finite) {
                status = PILUM_E_NUMERIC;
                end.reason = "a result is not finite";
            }
        }
        if (status == PILUM_CUT_STEP && batch->step_factor) {
            batch->step_factor[i] = end.step_factor;
        }
        worst = pilum_tell(batch, i, status, worst, end.reason);
        if (status == PILUM_E_INTERNAL) {
            break;
        }
    }
    return worst;
}

/* The consistent tangent by central differences, for a law that has written none: two more updates
 * for each component. `size` is a strain or jump over which the response bends, such as strength
 * over stiffness; where the response is smooth over 1e-5 of it and the update is good to round-off,
 * the error is about 1e-10 of the stiffness. At a kink the result lies between those of its sides.
 * `update` is called with PILUM_TANGENT_NONE. Its outcome, if one of the updates fails;
 * PILUM_OK_UNRELIABLE with its reason, if one of them is unreliable. */
static inline pilum_status pilum_differentiate(const pilum_instance *instance,
                                               const pilum_point *point, pilum_update update,
                                               double size, pilum_response *end) {
    const double step = 6e-6 * size;
    const uint32_t n = point->n;
    pilum_point moved = *point;
    pilum_status all = PILUM_OK;
    for (uint32_t column = 0; column < n; column++) {
        double flux[2][PILUM_MAX_COMPONENTS], increment[2];
        for (int side = 0; side < 2; side++) {
            pilum_response trial;
            pilum_clear(point, &trial);
            moved.increment[column] = point->increment[column] + (side == 0 ? -step : step);
            increment[side] = moved.increment[column];
            pilum_status status = update(instance, &moved, PILUM_TANGENT_NONE, &trial);
            if (status != PILUM_OK && status != PILUM_OK_UNRELIABLE) {
                end->reason = trial.reason;
                end->step_factor = trial.step_factor;
                return status;
            }
            if (status == PILUM_OK_UNRELIABLE) {
                end->reason = trial.reason;
                all = status;
            }
            for (uint32_t row = 0; row < n; row++) {
                flux[side][row] = trial.flux[row];
            }
        }
        moved.increment[column] = point->increment[column];
        for (uint32_t row = 0; row < n; row++) {
            end->tangent[row * n + column] =
                (flux[1][row] - flux[0][row]) / (increment[1] - increment[0]);
        }
    }
    return all;
}

/* A gradient or flux: a tensor in Voigt order, or with `PILUM_VECTOR` normal first. */
#define PILUM_VARIABLE(name, sign, in, sentence, form, n, names)                                   \
    { sizeof(pilum_variable), 0, name, sign, in, sentence, form, n, names, 0.0 }
/* An internal variable that is one number, 0 at first. */
#define PILUM_STATE(name, sign, in, sentence)                                                      \
    PILUM_VARIABLE(name, sign, in, sentence, PILUM_SCALAR, 1, 0)
/* The same with another initial value. */
#define PILUM_STATE_FROM(name, sign, in, sentence, initial)                                        \
    { sizeof(pilum_variable), 0, name, sign, in, sentence, PILUM_SCALAR, 1, 0, initial }

#ifdef __GNUC__
#define PILUM_UNUSED __attribute__((unused))
#else
#define PILUM_UNUSED
#endif

PILUM_UNUSED static const char *const pilum_names_interface[] = {"n", "t", "s"};
PILUM_UNUSED static const char *const pilum_names_solid[] = {"11", "22", "33", "12", "13", "23"};

/* Gradient and flux of an interface in two dimensions. */
PILUM_UNUSED static const pilum_variable pilum_jump =
    PILUM_VARIABLE("jump", "[u]", "m", "Relative displacement across the interface, opening positive.",
                   PILUM_VECTOR, 2, pilum_names_interface);
PILUM_UNUSED static const pilum_variable pilum_traction =
    PILUM_VARIABLE("traction", "t", "kPa", "Traction on the interface, tension positive.",
                   PILUM_VECTOR, 2, pilum_names_interface);
/* The same in three dimensions. */
PILUM_UNUSED static const pilum_variable pilum_jump_3 =
    PILUM_VARIABLE("jump", "[u]", "m", "Relative displacement across the interface, opening positive.",
                   PILUM_VECTOR, 3, pilum_names_interface);
PILUM_UNUSED static const pilum_variable pilum_traction_3 =
    PILUM_VARIABLE("traction", "t", "kPa", "Traction on the interface, tension positive.",
                   PILUM_VECTOR, 3, pilum_names_interface);
/* Gradient and flux of a solid: in plane strain and axisymmetry, and in three dimensions. */
PILUM_UNUSED static const pilum_variable pilum_strain_4 =
    PILUM_VARIABLE("strain", "eps", "-", "Strain, engineering shear.", PILUM_SYMMETRIC_TENSOR, 4,
                   pilum_names_solid);
PILUM_UNUSED static const pilum_variable pilum_stress_4 =
    PILUM_VARIABLE("stress", "sigma", "kPa", "Stress, tension positive.", PILUM_SYMMETRIC_TENSOR, 4,
                   pilum_names_solid);
PILUM_UNUSED static const pilum_variable pilum_strain_6 =
    PILUM_VARIABLE("strain", "eps", "-", "Strain, engineering shear.", PILUM_SYMMETRIC_TENSOR, 6,
                   pilum_names_solid);
PILUM_UNUSED static const pilum_variable pilum_stress_6 =
    PILUM_VARIABLE("stress", "sigma", "kPa", "Stress, tension positive.", PILUM_SYMMETRIC_TENSOR, 6,
                   pilum_names_solid);

#ifdef __cplusplus
}
#endif

#endif /* PILUM_POINT_H */
