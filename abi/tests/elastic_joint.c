/* An elastic interface: the traction changes by K times the change of the jump, with one
 * stiffness for each direction. A complete law library in C; compile it in this folder with
 *
 *     cc -std=c11 -O2 -shared -fPIC -fvisibility=hidden -I ../include \
 *         elastic_joint.c -o libelastic_joint.so -lm
 */
#include "pilum_law.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { N = 2 }; /* normal, tangential */

struct pilum_instance {
    double stiffness[N];
};

static const char *const names[N] = {"n", "t"};

static const pilum_variable jump = {
    .struct_size = sizeof(pilum_variable),
    .id = "jump",
    .symbol = "[u]",
    .unit = "m",
    .doc = "Relative displacement across the interface, opening positive.",
    .shape = PILUM_VECTOR,
    .n_components = N,
    .component_names = names,
};

static const pilum_variable traction = {
    .struct_size = sizeof(pilum_variable),
    .id = "traction",
    .symbol = "t",
    .unit = "kPa",
    .doc = "Traction on the interface, tension positive.",
    .shape = PILUM_VECTOR,
    .n_components = N,
    .component_names = names,
};

static const pilum_formulation formulation = {
    .struct_size = sizeof(pilum_formulation),
    .hypothesis = PILUM_H_INTERFACE_2D,
    .flags = PILUM_T_SYMMETRIC | PILUM_T_LINEAR,
    .n_gradients = 1,
    .n_fluxes = 1,
    .gradient = &jump,
    .flux = &traction,
};

/* Bounds and default are always given: left out, they would be zero. */
static const pilum_parameter parameters[N] = {
    {
        .struct_size = sizeof(pilum_parameter),
        .flags = PILUM_P_OPEN_LOWER,
        .id = "normal_stiffness",
        .symbol = "k_n",
        .unit = "kPa/m",
        .doc = "Stiffness against opening and closing.",
        .default_value = NAN,
        .lower = 0.0,
        .upper = INFINITY,
        .usual_lower = 1e3,
        .usual_upper = 1e9,
    },
    {
        .struct_size = sizeof(pilum_parameter),
        .flags = PILUM_P_OPEN_LOWER,
        .id = "shear_stiffness",
        .symbol = "k_s",
        .unit = "kPa/m",
        .doc = "Stiffness against sliding.",
        .default_value = NAN,
        .lower = 0.0,
        .upper = INFINITY,
        .usual_lower = 1e3,
        .usual_upper = 1e9,
    },
};

static pilum_status create(const pilum_law *law, const pilum_host *host, uint32_t number,
                           const double *parameter, uint32_t n_parameters, pilum_instance **out,
                           char *message, size_t capacity) {
    (void)law, (void)host;
    if (number != 0 || n_parameters != N || !parameter || !out) {
        return PILUM_E_ARGUMENT;
    }
    for (uint32_t i = 0; i < N; i++) {
        if (!(parameter[i] > 0.0 && isfinite(parameter[i]))) {
            if (message) {
                snprintf(message, capacity, "%s: must be positive", parameters[i].id);
            }
            return PILUM_E_PARAMETER;
        }
    }
    pilum_instance *instance = malloc(sizeof *instance);
    if (!instance) {
        return PILUM_E_INTERNAL;
    }
    for (uint32_t i = 0; i < N; i++) {
        instance->stiffness[i] = parameter[i];
    }
    *out = instance;
    return PILUM_OK;
}

static void destroy(pilum_instance *instance) { free(instance); }

static pilum_status integrate(const pilum_instance *instance, const pilum_batch *batch) {
    const uint32_t known = PILUM_REQ_FLUX | PILUM_REQ_TANGENT | PILUM_REQ_ELASTIC;
    if (!instance || !batch || !PILUM_HAS(batch, pilum_batch, rates)) {
        return PILUM_E_ARGUMENT;
    }
    if (batch->request & ~known) {
        return PILUM_E_UNSUPPORTED;
    }
    pilum_status worst = PILUM_OK;
    for (uint64_t i = 0; i < batch->n_points; i++) {
        pilum_status status = PILUM_OK;
        for (uint32_t c = 0; c < N; c++) {
            double increment = PILUM_AT(batch->gradient1, i, c) - PILUM_AT(batch->gradient0, i, c);
            double end = PILUM_AT(batch->flux0, i, c) + instance->stiffness[c] * increment;
            if (!isfinite(end)) {
                status = PILUM_E_NUMERIC;
            }
            PILUM_AT(batch->flux1, i, c) = end;
        }
        /* Both tangents are the elastic one; row by row. */
        if (batch->request & (PILUM_REQ_TANGENT | PILUM_REQ_ELASTIC)) {
            for (uint32_t row = 0; row < N; row++) {
                for (uint32_t column = 0; column < N; column++) {
                    PILUM_AT(batch->tangent, i, row * N + column) =
                        row == column ? instance->stiffness[row] : 0.0;
                }
            }
        }
        if (batch->status) {
            batch->status[i] = status;
        }
        if (status != PILUM_OK && worst == PILUM_OK) {
            worst = status;
            if (batch->message) {
                snprintf(batch->message, batch->message_capacity,
                         "point %" PRIu64 ": a value is not finite", batch->first_point + i);
            }
        }
    }
    return worst;
}

static const pilum_law law = {
    .struct_size = sizeof(pilum_law),
    .n_parameters = N,
    .n_formulations = 1,
    .id = "elastic_joint",
    .name = "elastic interface",
    .version = "1.0",
    .author = "The Pilum authors",
    .licence = "MIT OR Apache-2.0",
    .doc = "Traction proportional to the jump; the traction carried in is kept.",
    .references = "none",
    .parameter = parameters,
    .formulation = &formulation,
    .create = create,
    .integrate = integrate,
    .destroy = destroy,
};

static const pilum_law *const laws[] = {&law};

static const pilum_plugin plugin = {
    .struct_size = sizeof(pilum_plugin),
    .n_laws = 1,
    .law = laws,
};

const pilum_magic_block pilum_magic = PILUM_MAGIC_BLOCK("pilum-c 1.0");
PILUM_MANIFEST("pilum 1\nelastic_joint 1.0\n");

const pilum_plugin *pilum_entry(const pilum_host *host) {
    (void)host;
    return &plugin;
}
