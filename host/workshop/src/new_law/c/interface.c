/* my_law: an elastic interface with Coulomb friction and separation.
 *
 * (1) t_n = K_n ([u_n] + g),  t_t = t_t0 + K_t [u_t]      trial; g: gap at the start
 * (2) t_n > 0: the interface opens, t = 0, g = t_n / K_n
 * (3) |t_t| <= -t_n tan phi, otherwise it slides
 *
 * Tension and opening are positive. Where you write: `parameters`, `states`, `create`, `update`. */
#include "pilum_point.h"

#include <stdlib.h>

struct pilum_instance {
    double k_n, k_t, tan_phi;
};

/* In the order in which `create` receives them. */
static const pilum_parameter parameters[] = {
    {
        .struct_size = sizeof(pilum_parameter),
        .flags = PILUM_P_OPEN_LOWER,
        .id = "normal_stiffness",
        .symbol = "K_n",
        .unit = "kPa/m",
        .doc = "Stiffness against closing.",
        .default_value = NAN, /* none: has to be given */
        .lower = 0.0,
        .upper = INFINITY,
        .usual_lower = 1e3,
        .usual_upper = 1e12,
    },
    {
        .struct_size = sizeof(pilum_parameter),
        .flags = PILUM_P_OPEN_LOWER,
        .id = "shear_stiffness",
        .symbol = "K_t",
        .unit = "kPa/m",
        .doc = "Stiffness against sliding.",
        .default_value = NAN,
        .lower = 0.0,
        .upper = INFINITY,
        .usual_lower = 1e3,
        .usual_upper = 1e12,
    },
    {
        .struct_size = sizeof(pilum_parameter),
        .flags = PILUM_P_OPEN_UPPER,
        .id = "friction_angle",
        .symbol = "phi",
        .unit = "deg",
        .doc = "Friction angle.",
        .default_value = NAN,
        .lower = 0.0,
        .upper = 90.0,
        .usual_lower = 0.0,
        .usual_upper = 50.0,
    },
};
enum { N_PARAMETERS = sizeof parameters / sizeof *parameters };

enum { PLASTIC_SLIP, GAP, N_STATES };
static const pilum_variable states[N_STATES] = {
    [PLASTIC_SLIP] = PILUM_STATE("plastic_slip", "xi", "m", "Slip, accumulated over both directions."),
    [GAP] = PILUM_STATE("gap", "g", "m", "Opening; 0 in contact."),
};

static const pilum_formulation formulations[] = {
    {
        .struct_size = sizeof(pilum_formulation),
        .hypothesis = PILUM_H_INTERFACE_2D,
        .n_gradients = 1,
        .n_fluxes = 1,
        .n_states = N_STATES,
        .gradient = &pilum_jump,
        .flux = &pilum_traction,
        .state = states,
    },
};

static pilum_status create(const pilum_law *law, const pilum_host *host, uint32_t formulation,
                           const double *p, uint32_t n, pilum_instance **out, char *message,
                           size_t capacity) {
    (void)host;
    pilum_status status = pilum_check_parameters(law, formulation, p, n, out, message, capacity);
    if (status != PILUM_OK) {
        return status;
    }
    pilum_instance *joint = malloc(sizeof *joint);
    if (!joint) {
        return PILUM_E_INTERNAL;
    }
    joint->k_n = p[0];
    joint->k_t = p[1];
    joint->tan_phi = tan(p[2] * acos(-1.0) / 180.0);
    *out = joint;
    return PILUM_OK;
}

static void destroy(pilum_instance *joint) { free(joint); }

/* One point over one increment. No allocation, no output, nothing remembered between calls. */
static pilum_status update(const pilum_instance *joint, const pilum_point *point,
                           pilum_tangent tangent, pilum_response *end) {
    const double k_n = joint->k_n, k_t = joint->k_t, tan_phi = joint->tan_phi;
    /* (1) In contact the traction carries what is known of the past, open the gap does. */
    double normal = point->flux[0] + k_n * (point->state[GAP] + point->increment[0]);
    double shear = point->flux[1] + k_t * point->increment[1];
    int consistent = tangent == PILUM_TANGENT_CONSISTENT;
    end->tangent[0] = k_n;
    end->tangent[3] = k_t;
    end->state[PLASTIC_SLIP] = point->state[PLASTIC_SLIP];
    if (normal > 0.0) { /* (2) */
        end->state[GAP] = point->state[GAP] + point->increment[0] + point->flux[0] / k_n;
        if (consistent) {
            end->tangent[0] = end->tangent[3] = 0.0;
        }
        return PILUM_OK;
    }
    end->flux[0] = normal;
    end->flux[1] = shear;
    double excess = fabs(shear) + normal * tan_phi;
    if (excess > 0.0) { /* (3) */
        double sign = copysign(1.0, shear);
        end->flux[1] = -sign * normal * tan_phi;
        end->state[PLASTIC_SLIP] += excess / k_t;
        if (consistent) {
            end->tangent[2] = -sign * k_n * tan_phi;
            end->tangent[3] = 0.0;
        }
    }
    return PILUM_OK;
}

static pilum_status integrate(const pilum_instance *joint, const pilum_batch *batch) {
    return pilum_each_point(joint, batch, 2, N_STATES, update);
}

static const pilum_law law = {
    .struct_size = sizeof(pilum_law),
    .n_parameters = N_PARAMETERS,
    .n_formulations = 1,
    .id = "my_law",
    .name = "interface with Coulomb friction",
    .version = "0.1.0",
    .author = "unknown",
    .licence = "unknown",
    .doc = "Linear elasticity, Coulomb friction without dilatancy, separation.",
    .references = "none",
    .parameter = parameters,
    .formulation = formulations,
    .create = create,
    .integrate = integrate,
    .destroy = destroy,
};

/* The rest makes it a library: one law. */
static const pilum_law *const laws[] = {&law};
static const pilum_plugin plugin = {.struct_size = sizeof(pilum_plugin), .n_laws = 1, .law = laws};

const pilum_magic_block pilum_magic = PILUM_MAGIC_BLOCK("pilum-c 1.0");
PILUM_MANIFEST("pilum 1\nmy_law 0.1.0\n");

const pilum_plugin *pilum_entry(const pilum_host *host) {
    (void)host;
    return &plugin;
}
