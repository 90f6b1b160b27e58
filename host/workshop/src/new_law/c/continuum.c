/* my_law: linear elasticity and von Mises plasticity without hardening, for soft clay.
 *
 * (1) sigma* = sigma_0 + D d_eps                          elastic trial
 * (2) q = sqrt(3/2 s:s) <= Y                              s: deviator of sigma
 * (3) sigma = p 1 + Y/q* s*,  d_eps_p = (q* - Y)/(3 G)    radial return
 *
 * Components 11 22 33 12 [13 23], tension positive, shear strains gamma = 2 eps.
 * Where you write: `parameters`, `states`, `create`, `update`. */
#include "pilum_point.h"

#include <stdlib.h>

struct pilum_instance {
    /* Bulk and shear modulus, yield stress, kPa. */
    double k, g, yield;
    uint32_t n;
};

/* In the order in which `create` receives them. */
static const pilum_parameter parameters[] = {
    {
        .struct_size = sizeof(pilum_parameter),
        .flags = PILUM_P_OPEN_LOWER,
        .id = "young_modulus",
        .symbol = "E",
        .unit = "kPa",
        .doc = "Young's modulus.",
        .default_value = NAN, /* none: has to be given */
        .lower = 0.0,
        .upper = INFINITY,
        .usual_lower = 1e2,
        .usual_upper = 1e9,
    },
    {
        .struct_size = sizeof(pilum_parameter),
        .flags = PILUM_P_OPEN_LOWER | PILUM_P_OPEN_UPPER,
        .id = "poisson_ratio",
        .symbol = "nu",
        .unit = "-",
        .doc = "Poisson's ratio.",
        .default_value = NAN,
        .lower = -1.0,
        .upper = 0.5,
        .usual_lower = 0.0,
        .usual_upper = 0.495,
    },
    {
        .struct_size = sizeof(pilum_parameter),
        .flags = PILUM_P_OPEN_LOWER,
        .id = "yield_stress",
        .symbol = "Y",
        .unit = "kPa",
        .doc = "Strength in uniaxial compression, twice the undrained shear strength.",
        .default_value = NAN,
        .lower = 0.0,
        .upper = INFINITY,
        .usual_lower = 1.0,
        .usual_upper = 1e6,
    },
};
enum { N_PARAMETERS = sizeof parameters / sizeof *parameters };

enum { PLASTIC_STRAIN, N_STATES };
static const pilum_variable states[N_STATES] = {
    [PLASTIC_STRAIN] = PILUM_STATE("plastic_strain", "eps_p", "-", "Equivalent plastic strain."),
};

#define FORMULATION(its_hypothesis, its_strain, its_stress)                                        \
    {                                                                                              \
        .struct_size = sizeof(pilum_formulation), .hypothesis = its_hypothesis,                    \
        .flags = PILUM_T_SYMMETRIC, .n_gradients = 1, .n_fluxes = 1, .n_states = N_STATES,         \
        .gradient = &its_strain, .flux = &its_stress, .state = states                              \
    }
static const pilum_formulation formulations[] = {
    FORMULATION(PILUM_H_PLANE_STRAIN, pilum_strain_4, pilum_stress_4),
    FORMULATION(PILUM_H_AXISYMMETRIC, pilum_strain_4, pilum_stress_4),
    FORMULATION(PILUM_H_3D, pilum_strain_6, pilum_stress_6),
};
enum { N_FORMULATIONS = sizeof formulations / sizeof *formulations };

static pilum_status create(const pilum_law *law, const pilum_host *host, uint32_t formulation,
                           const double *p, uint32_t n, pilum_instance **out, char *message,
                           size_t capacity) {
    (void)host;
    pilum_status status = pilum_check_parameters(law, formulation, p, n, out, message, capacity);
    if (status != PILUM_OK) {
        return status;
    }
    pilum_instance *solid = malloc(sizeof *solid);
    if (!solid) {
        return PILUM_E_INTERNAL;
    }
    solid->k = p[0] / (3.0 * (1.0 - 2.0 * p[1]));
    solid->g = p[0] / (2.0 * (1.0 + p[1]));
    solid->yield = p[2];
    solid->n = formulations[formulation].flux->n_components;
    *out = solid;
    return PILUM_OK;
}

static void destroy(pilum_instance *solid) { free(solid); }

/* One point over one increment. No allocation, no output, nothing remembered between calls. */
static pilum_status update(const pilum_instance *solid, const pilum_point *point,
                           pilum_tangent tangent, pilum_response *end) {
    const double k = solid->k, g = solid->g;
    const double *d_eps = point->increment;
    /* (1) */
    double bulk = (k - 2.0 * g / 3.0) * (d_eps[0] + d_eps[1] + d_eps[2]);
    for (uint32_t i = 0; i < point->n; i++) {
        end->flux[i] = point->flux[i] + (i < 3 ? bulk + 2.0 * g * d_eps[i] : g * d_eps[i]);
    }
    double mean = (end->flux[0] + end->flux[1] + end->flux[2]) / 3.0;
    double s[PILUM_MAX_COMPONENTS];
    double square = 0.0;
    for (uint32_t i = 0; i < point->n; i++) {
        s[i] = i < 3 ? end->flux[i] - mean : end->flux[i];
        square += i < 3 ? s[i] * s[i] : 2.0 * s[i] * s[i];
    }
    double q = sqrt(1.5 * square);
    end->state[PLASTIC_STRAIN] = point->state[PLASTIC_STRAIN];
    /* (2), (3); what was returned before is within round-off. */
    int yields = q > solid->yield * (1.0 + 1e-14);
    double scale = yields ? solid->yield / q : 1.0;
    if (yields) {
        end->state[PLASTIC_STRAIN] += (q - solid->yield) / (3.0 * g);
        for (uint32_t i = 0; i < point->n; i++) {
            end->flux[i] = scale * s[i] + (i < 3 ? mean : 0.0);
        }
    }
    if (tangent == PILUM_TANGENT_NONE) {
        return PILUM_OK;
    }
    int plastic = yields && tangent == PILUM_TANGENT_CONSISTENT;
    double shear = plastic ? scale * g : g;
    for (uint32_t i = 0; i < point->n; i++) {
        for (uint32_t j = 0; j < point->n; j++) {
            double d = i < 3 && j < 3 ? k - 2.0 * shear / 3.0 : 0.0;
            if (i == j) {
                d += i < 3 ? 2.0 * shear : shear;
            }
            if (plastic) {
                d -= 3.0 * shear * s[i] * s[j] / (q * q);
            }
            end->tangent[i * point->n + j] = d;
        }
    }
    return PILUM_OK;
}

static pilum_status integrate(const pilum_instance *solid, const pilum_batch *batch) {
    return pilum_each_point(solid, batch, solid ? solid->n : 0, N_STATES, update);
}

static const pilum_law law = {
    .struct_size = sizeof(pilum_law),
    .n_parameters = N_PARAMETERS,
    .n_formulations = N_FORMULATIONS,
    .id = "my_law",
    .name = "von Mises plasticity",
    .version = "0.1.0",
    .author = "unknown",
    .licence = "unknown",
    .doc = "Linear elasticity and von Mises plasticity without hardening.",
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
