/* What one update costs, by the language of the law: CPU time per point, in batches of 512, the least
 * of 20 rounds. Arguments: library, id, hypothesis (a PILUM_H_ number), then the parameters; then
 * `--`, the flux at the start, and the increment of the gradient. languages.sh calls it. */
#define _POSIX_C_SOURCE 200809L
#include "pilum_law.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { BATCH = 512, ROUNDS = 20, CALLS = 40, MOST = 64 };

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static int fail(const char *why) {
    fprintf(stderr, "%s\n", why);
    return 1;
}

/* Least time per point for a request, in nanoseconds; -1: the law does not answer it. */
static double least(const pilum_law *law, const pilum_instance *instance, pilum_batch *batch,
                    uint32_t request) {
    double best = -1.0;
    batch->request = request;
    if (law->integrate(instance, batch) != PILUM_OK) {
        return best;
    }
    for (int round = 0; round < ROUNDS; round++) {
        double start = now();
        for (int call = 0; call < CALLS; call++) {
            law->integrate(instance, batch);
        }
        double time = (now() - start) / ((double)CALLS * BATCH);
        best = best < 0.0 || time < best ? time : best;
    }
    return best;
}

int main(int n_arguments, char **arguments) {
    if (n_arguments < 4) {
        return fail("library, id, hypothesis, parameters, --, flux and increment");
    }
    void *library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        return fail(dlerror());
    }
    const pilum_plugin *(*entry)(const pilum_host *) = NULL;
    *(void **)&entry = dlsym(library, "pilum_entry");
    static const pilum_host host = {sizeof(pilum_host), PILUM_ABI_MAJOR, PILUM_ABI_MINOR,
                                    "languages", "1.0", NULL};
    const pilum_plugin *plugin = entry ? entry(&host) : NULL;
    const pilum_law *law = NULL;
    for (uint32_t i = 0; plugin && i < plugin->n_laws; i++) {
        law = strcmp(plugin->law[i]->id, arguments[2]) == 0 ? plugin->law[i] : law;
    }
    if (!law) {
        return fail("there is no such law");
    }
    uint32_t number = 0;
    while (number < law->n_formulations &&
           law->formulation[number].hypothesis != atoi(arguments[3])) {
        number++;
    }
    if (number == law->n_formulations) {
        return fail("the hypothesis is not offered");
    }
    const pilum_formulation *formulation = &law->formulation[number];
    const uint32_t n = formulation->flux->n_components, n_states = formulation->n_states;
    double parameters[MOST];
    int at = 4;
    uint32_t n_parameters = 0;
    for (; at < n_arguments && strcmp(arguments[at], "--") != 0 && n_parameters < MOST; at++) {
        parameters[n_parameters++] = strtod(arguments[at], NULL);
    }
    at++;
    if (at + 2 * (int)n > n_arguments || n_states > MOST) {
        return fail("flux and increment are missing");
    }
    static double flux[6], zero[6], increment[6], state[BATCH * MOST];
    static double flux1[BATCH * 6], state1[BATCH * MOST], tangent[BATCH * 36];
    static pilum_status status[BATCH];
    static double factor[BATCH];
    for (uint32_t c = 0; c < n; c++) {
        flux[c] = strtod(arguments[at + (int)c], NULL);
        increment[c] = strtod(arguments[at + (int)(n + c)], NULL);
    }
    char message[200] = "";
    pilum_instance *instance = NULL;
    if (law->create(law, &host, number, parameters, n_parameters, &instance, message,
                    sizeof message) != PILUM_OK) {
        return fail(message);
    }
    const ptrdiff_t rows = (ptrdiff_t)n, values = (ptrdiff_t)n_states;
    pilum_batch batch = {
        .struct_size = sizeof batch,
        .n_points = BATCH,
        .time_increment = 1.0,
        .flux0 = {flux, 0, 1},
        .state1 = {n_states ? state : NULL, values, 1},
        .status = status,
        .step_factor = factor,
        .message = message,
        .message_capacity = sizeof message,
    };
    for (uint32_t i = 0; i < BATCH * n_states; i++) {
        state[i] = formulation->state[i % n_states].initial_value;
    }
    if (law->init_state && law->init_state(instance, &batch) != PILUM_OK) {
        return fail(message);
    }
    batch.gradient0 = (pilum_view){zero, 0, 1};
    batch.gradient1 = (pilum_view){increment, 0, 1};
    batch.state0 = (pilum_view){n_states ? state : NULL, values, 1};
    batch.state1 = (pilum_view_mut){n_states ? state1 : NULL, values, 1};
    batch.flux1 = (pilum_view_mut){flux1, rows, 1};
    batch.tangent = (pilum_view_mut){tangent, rows * rows, 1};
    double plain = least(law, instance, &batch, PILUM_REQ_FLUX);
    if (plain < 0.0) {
        return fail(message);
    }
    double consistent = least(law, instance, &batch, PILUM_REQ_FLUX | PILUM_REQ_TANGENT);
    /* Rates by the first parameter. */
    double one[MOST] = {1.0};
    static double rate1[BATCH * 6], state_rate1[BATCH * MOST], nothing[MOST];
    pilum_rates rates = {
        .struct_size = sizeof rates,
        .parameter = one,
        .gradient0 = {nothing, 0, 1},
        .gradient1 = {nothing, 0, 1},
        .flux0 = {nothing, 0, 1},
        .state0 = {nothing, 0, 1},
        .flux1 = {rate1, rows, 1},
        .state1 = {n_states ? state_rate1 : NULL, values, 1},
    };
    batch.rates = &rates;
    double directional = least(law, instance, &batch, PILUM_REQ_FLUX | PILUM_REQ_RATES);
    printf("%-24s %8.0f %12.0f ", arguments[2], plain, consistent);
    if (directional < 0.0) {
        printf("%8s\n", "-");
    } else {
        printf("%8.0f\n", directional);
    }
    law->destroy(instance);
    return 0;
}
