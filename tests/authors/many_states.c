/* A law with 400 values of internal variables, more than the helper has room for if it is not told. */
#include "pilum_point.h"

#include <stdlib.h>

enum { N_STATES = 400 };

struct pilum_instance {
    double stiffness;
};

#define HALF(name) PILUM_VARIABLE(name, "s", "-", "Movements, one after the other.", PILUM_VECTOR, 200, 0)
static const pilum_variable states[] = {HALF("first"), HALF("second")};

static const pilum_formulation formulation = {
    .struct_size = sizeof(pilum_formulation),
    .hypothesis = PILUM_H_INTERFACE_2D,
    .n_gradients = 1,
    .n_fluxes = 1,
    .n_states = 2,
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
    *out = malloc(sizeof **out);
    if (!*out) {
        return PILUM_E_INTERNAL;
    }
    (*out)->stiffness = 1e5;
    return PILUM_OK;
}

static void destroy(pilum_instance *instance) { free(instance); }

static pilum_status initial(const pilum_instance *instance, const double *flux, double *state,
                            const char **reason) {
    (void)instance, (void)reason;
    state[N_STATES - 1] = -flux[0];
    return PILUM_OK;
}

static pilum_status update(const pilum_instance *instance, const pilum_point *point,
                           pilum_tangent tangent, pilum_response *end) {
    (void)tangent;
    for (uint32_t i = 0; i < 2; i++) {
        end->flux[i] = point->flux[i] + instance->stiffness * point->increment[i];
        end->tangent[3 * i] = instance->stiffness;
    }
    for (uint32_t i = 0; i < point->n_states; i++) {
        end->state[i] = point->state[i];
    }
    end->state[0] += point->increment[1];
    return PILUM_OK;
}

static pilum_status init_state(const pilum_instance *instance, const pilum_batch *batch) {
    return pilum_each_start(instance, batch, 2, N_STATES, initial);
}

static pilum_status integrate(const pilum_instance *instance, const pilum_batch *batch) {
    return pilum_each_point(instance, batch, 2, N_STATES, update);
}

static const pilum_law law = {
    .struct_size = sizeof(pilum_law),
    .n_formulations = 1,
    .id = "many_states",
    .name = "many internal variables",
    .version = "1.0",
    .author = "The Pilum authors",
    .licence = "MIT OR Apache-2.0",
    .doc = "Elastic interface.",
    .references = "none",
    .formulation = &formulation,
    .create = create,
    .init_state = init_state,
    .integrate = integrate,
    .destroy = destroy,
};

static const pilum_law *const laws[] = {&law};
static const pilum_plugin plugin = {.struct_size = sizeof(pilum_plugin), .n_laws = 1, .law = laws};

const pilum_magic_block pilum_magic = PILUM_MAGIC_BLOCK("pilum-c 1.1");
PILUM_MANIFEST("pilum 1\nmany_states 1.0\n");

const pilum_plugin *pilum_entry(const pilum_host *host) {
    (void)host;
    return &plugin;
}
