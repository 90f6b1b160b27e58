/* The law of models/coulomb_joint in C; its LAW.md has the equations. */
#include "pilum_point.h"

#include <stdlib.h>

/* Strength of a joint: c, R_t, tan phi, tan psi. */
typedef struct strength {
    double cohesion, tensile, tan_phi, tan_psi;
} strength;

struct pilum_instance {
    double k_n, k_t;
    strength intact, broken;
};

#define PARAMETER(its_flags, its_id, its_symbol, its_unit, its_doc, otherwise, most, usually, until) \
    {                                                                                                \
        .struct_size = sizeof(pilum_parameter), .flags = its_flags, .id = its_id,                    \
        .symbol = its_symbol, .unit = its_unit, .doc = its_doc, .default_value = otherwise,          \
        .lower = 0.0, .upper = most, .usual_lower = usually, .usual_upper = until                    \
    }
static const pilum_parameter parameters[] = {
    PARAMETER(PILUM_P_OPEN_LOWER, "normal_stiffness", "K_n", "kPa/m", "Normal stiffness.", NAN,
              INFINITY, 1e3, 1e12),
    PARAMETER(PILUM_P_OPEN_LOWER, "shear_stiffness", "K_t", "kPa/m", "Shear stiffness.", NAN,
              INFINITY, 1e3, 1e12),
    PARAMETER(0, "cohesion", "c", "kPa", "Cohesion, until the joint has opened.", NAN, INFINITY,
              0.0, 1e3),
    PARAMETER(PILUM_P_OPEN_UPPER, "friction_angle", "phi", "deg", "Friction angle.", NAN, 90.0, 0.0,
              50.0),
    PARAMETER(PILUM_P_OPEN_UPPER, "dilatancy_angle", "psi", "deg", "Dilatancy angle.", NAN, 90.0,
              0.0, 30.0),
    PARAMETER(0, "tensile_strength", "R_t", "kPa", "Tensile strength, until the joint has opened.",
              0.0, INFINITY, 0.0, 1e3),
};

enum { PLASTIC_SLIP, PLASTIC_OPENING, GAP, BROKEN, N_STATES };
static const pilum_variable states[N_STATES] = {
    [PLASTIC_SLIP] =
        PILUM_STATE("plastic_slip", "xi", "m", "Plastic slip, accumulated over both directions."),
    [PLASTIC_OPENING] =
        PILUM_STATE("plastic_opening", "[u_n^p]", "m", "Plastic opening by dilatancy."),
    [GAP] = PILUM_STATE("gap", "g", "m",
                        "Opening beyond the position of contact without stress; 0 in contact."),
    [BROKEN] = PILUM_STATE("broken", "b", "-",
                           "1 once the joint has opened, which breaks its bond; 0 before."),
};

static const pilum_formulation formulation = {
    .struct_size = sizeof(pilum_formulation),
    .hypothesis = PILUM_H_INTERFACE_2D,
    .n_gradients = 1,
    .n_fluxes = 1,
    .n_states = N_STATES,
    .gradient = &pilum_jump,
    .flux = &pilum_traction,
    .state = states,
};

static pilum_status create(const pilum_law *law, const pilum_host *host, uint32_t number,
                           const double *p, uint32_t n, pilum_instance **out, char *message,
                           size_t capacity) {
    (void)host;
    pilum_status status = pilum_check_parameters(law, number, p, n, out, message, capacity);
    if (status != PILUM_OK) {
        return status;
    }
    const double degree = acos(-1.0) / 180.0;
    strength intact = {p[2], p[5], tan(p[3] * degree), tan(p[4] * degree)};
    if (p[4] > p[3]) {
        pilum_say(message, capacity, "dilatancy_angle: %g deg is above friction_angle = %g deg",
                  p[4], p[3]);
        return PILUM_E_PARAMETER;
    }
    if (intact.tensile * intact.tan_phi > intact.cohesion * (1.0 + 1e-12)) {
        pilum_say(message, capacity,
                  "tensile_strength: %g kPa is above cohesion / tan(friction_angle) = %g kPa", p[5],
                  intact.cohesion / intact.tan_phi);
        return PILUM_E_PARAMETER;
    }
    pilum_instance *joint = malloc(sizeof *joint);
    if (!joint) {
        return PILUM_E_INTERNAL;
    }
    *joint = (pilum_instance){
        .k_n = p[0],
        .k_t = p[1],
        .intact = intact,
        .broken = {0.0, 0.0, intact.tan_phi, intact.tan_psi},
    };
    *out = joint;
    return PILUM_OK;
}

static void destroy(pilum_instance *joint) { free(joint); }

/* Slip from the start of the increment to the moment when t_n reaches the tensile strength, Eq. (6):
 * rates are constant before and after yielding. */
static double slip_before_opening(const pilum_instance *joint, const strength *s,
                                  const double traction[2], double opening, double slip) {
    double normal = traction[0], shear = traction[1];
    double normal_rate = joint->k_n * opening, shear_rate = joint->k_t * slip;
    double opens_elastically =
        normal < s->tensile && normal_rate > 0.0 ? (s->tensile - normal) / normal_rate : 0.0;
    double yields = INFINITY, growth = 0.0;
    for (int side = 0; side < 2; side++) {
        double sign = side == 0 ? 1.0 : -1.0;
        double start = sign * shear + normal * s->tan_phi - s->cohesion;
        double rate = sign * shear_rate + normal_rate * s->tan_phi;
        double at = start >= 0.0 ? 0.0 : -start / rate;
        if (rate > 0.0 && at < yields) {
            yields = at;
            growth = rate;
        }
    }
    if (opens_elastically <= yields) {
        return 0.0;
    }
    double slip_rate = growth / (joint->k_t + joint->k_n * s->tan_phi * s->tan_psi);
    double opening_rate = normal_rate - joint->k_n * s->tan_psi * slip_rate;
    double left = s->tensile - normal - yields * normal_rate;
    return opening_rate > 0.0 && left > 0.0 ? slip_rate * left / opening_rate : 0.0;
}

/* The joint is open at the end: no traction, no stiffness. */
static void open(double gap, pilum_response *end) {
    end->state[GAP] = gap;
    end->state[BROKEN] = 1.0;
}

static void carry(const pilum_instance *joint, const pilum_point *point, pilum_response *end) {
    const double k_n = joint->k_n, k_t = joint->k_t;
    double opening = point->increment[0], slip = point->increment[1];
    double traction[2] = {point->flux[0], point->flux[1]};
    /* d slip / d jump: slip before the contact re-forms does not act. */
    double by_normal = 0.0, by_tangential = 1.0;
    const strength *s = point->state[BROKEN] > 0.5 ? &joint->broken : &joint->intact;
    double gap = point->state[GAP];
    for (uint32_t i = 0; i < N_STATES; i++) {
        end->state[i] = point->state[i];
    }
    if (gap > 0.0) {
        if (gap + opening >= 0.0) {
            open(gap + opening, end);
            return;
        }
        /* Contact re-forms on the way; the path within the increment is straight. */
        double fraction = 1.0 + gap / opening;
        by_normal = -slip * gap / (opening * opening);
        by_tangential = fraction;
        traction[0] = traction[1] = 0.0;
        opening += gap;
        slip *= fraction;
        s = &joint->broken;
    }
    /* Eq. (1). */
    double normal = traction[0] + k_n * opening;
    double shear = traction[1] + k_t * slip;
    double a = k_n, b = 0.0, c = 0.0, d = k_t;
    /* Eq. (2). */
    double excess = fabs(shear) + normal * s->tan_phi - s->cohesion;
    double round_off = 4.0 * 2.220446049250313e-16 * (s->cohesion + fabs(normal * s->tan_phi));
    if (excess > round_off || normal > s->tensile) {
        /* Eq. (4), (3). */
        double resistance = k_t + k_n * s->tan_phi * s->tan_psi;
        double d_lambda = fmax(excess, 0.0) / resistance;
        normal -= k_n * s->tan_psi * d_lambda;
        int opens = normal > s->tensile || s->cohesion - normal * s->tan_phi < 0.0;
        if (opens) {
            d_lambda = slip_before_opening(joint, s, traction, opening, slip);
        }
        end->state[PLASTIC_SLIP] += d_lambda;
        end->state[PLASTIC_OPENING] += s->tan_psi * d_lambda;
        if (opens) {
            open(fmax(traction[0] / k_n + opening - s->tan_psi * d_lambda, 0.0), end);
            return;
        }
        double sign = copysign(1.0, shear);
        shear = sign * (s->cohesion - normal * s->tan_phi);
        /* Eq. (5). */
        a = k_n * k_t / resistance;
        b = -sign * a * s->tan_psi;
        c = -sign * a * s->tan_phi;
        d = a * s->tan_phi * s->tan_psi;
    }
    end->state[GAP] = 0.0;
    end->flux[0] = normal;
    end->flux[1] = shear;
    end->tangent[0] = a + b * by_normal;
    end->tangent[1] = b * by_tangential;
    end->tangent[2] = c + d * by_normal;
    end->tangent[3] = d * by_tangential;
}

static pilum_status update(const pilum_instance *joint, const pilum_point *point,
                           pilum_tangent tangent, pilum_response *end) {
    carry(joint, point, end);
    if (tangent == PILUM_TANGENT_ELASTIC) {
        end->tangent[0] = joint->k_n;
        end->tangent[3] = joint->k_t;
        end->tangent[1] = end->tangent[2] = 0.0;
    }
    return PILUM_OK;
}

static pilum_status integrate(const pilum_instance *joint, const pilum_batch *batch) {
    return pilum_each_point(joint, batch, 2, N_STATES, update);
}

static const pilum_law law = {
    .struct_size = sizeof(pilum_law),
    .n_parameters = sizeof parameters / sizeof *parameters,
    .n_formulations = 1,
    .id = "coulomb_joint_c",
    .name = "Coulomb joint in C",
    .version = "0.1.0",
    .author = "The Pilum authors",
    .licence = "MIT OR Apache-2.0",
    .doc = "Linear elasticity, Coulomb friction with constant dilatancy, brittle tensile strength "
           "and separation.",
    .references = "De Gennaro & Frank, Table IV (2)",
    .parameter = parameters,
    .formulation = &formulation,
    .create = create,
    .integrate = integrate,
    .destroy = destroy,
};

static const pilum_law *const laws[] = {&law};
static const pilum_plugin plugin = {.struct_size = sizeof(pilum_plugin), .n_laws = 1, .law = laws};

const pilum_magic_block pilum_magic = PILUM_MAGIC_BLOCK("pilum-c 1.0");
PILUM_MANIFEST("pilum 1\ncoulomb_joint_c 0.1.0\n");

const pilum_plugin *pilum_entry(const pilum_host *host) {
    (void)host;
    return &plugin;
}
