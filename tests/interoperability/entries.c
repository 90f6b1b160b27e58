/* Calls every entry of a law library with the same points, as the programs that each entry is for would, and
 * compares with the native one: UMAT and CALCULIX bit for bit, an MFront behaviour, whose components carry √2, to
 * 1e-13 of the largest value, of internal variables also of the gradient's increment, and bit for bit from a
 * gradient of zero, where what the behaviour makes of its components is what the native call is given.
 *
 *     entries LIBRARY LAW BEHAVIOUR FLUX STEP PARAMETER...
 *
 * FLUX: normal flux at the start; STEP: size of a gradient increment. Parameters that are left out, or `-`, take their
 * defaults. A behaviour in axes of a layer is called with an angle of 0.
 * Prints what was compared; the exit code is the number of what differs. */
#include "../../abi/include/pilum_law.h"
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 64, POINTS = 200, STEPS = 20 };

typedef void umat(double *, double *, double *, double *, double *, double *, double *, double *, double *, double *,
                  const double *, const double *, const double *, const double *, const double *, const double *,
                  const double *, const double *, const char *, const int *, const int *, const int *, const int *,
                  const double *, const int *, const double *, const double *, double *, const double *,
                  const double *, const double *, const int *, const int *, const int *, const int *, const int *,
                  const int *, size_t);
typedef void calculix(const char *, const int *, const int *, const int *, const double *, const double *,
                      const double *, const double *, const double *, const double *, const double *, const double *,
                      const int *, const double *, const double *, const double *, const double *, const int *,
                      const int *, const int *, const int *, const double *, double *, double *, double *,
                      const int *, const double *, const double *, double *, const int *, int);
struct state {
    double *gradients, *forces, *density, *properties, *internal, *stored, *dissipated, *external;
};
struct data {
    char *message;
    double dt, *k, *rdt, *sound;
    struct state s0, s1;
};
typedef int behaviour(struct data *);

static void *library;
static const pilum_law *law;
static double parameter[MOST], property[MOST];
static int n_given, n_properties, n_wrong;
static uint64_t seed = 1;

static double uniform(void) { /* in [-1, 1) */
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(int64_t)(seed >> 11) / 4503599627370496.0 - 1.0;
}

static void wrong(const char *what, double here, double there) {
    if (n_wrong++ < 10) printf("wrong: %s: %.17g, native %.17g\n", what, here, there);
}

static void bits(const char *what, const double *here, const double *native, int n) {
    for (int i = 0; i < n; i++)
        if (memcmp(here + i, native + i, sizeof *here) && !(here[i] == 0 && native[i] == 0))
            wrong(what, here[i], native[i]);
}

static void close(const char *what, const double *here, const double *native, int n, double size) {
    for (int i = 0; i < n; i++) size = fmax(size, fabs(native[i]));
    for (int i = 0; i < n; i++)
        if (!(fabs(here[i] - native[i]) <= 1e-13 * size)) wrong(what, here[i], native[i]);
}

/* A point of one formulation, before and after a native call. */
struct point {
    int n, n_state;
    double gradient0[6], gradient1[6], flux0[6], flux1[6], state0[MOST], state1[MOST], tangent[36];
    pilum_status status;
};

static pilum_status native(const pilum_instance *instance, struct point *p, int initial) {
    char message[256] = "";
    pilum_batch b = {.struct_size = sizeof b, .n_points = 1};
    b.time_increment = 1;
    b.flux0 = (pilum_view){p->flux0, p->n, 1};
    b.state1 = (pilum_view_mut){initial ? p->state0 : p->state1, p->n_state, 1};
    b.message = message;
    b.message_capacity = sizeof message;
    b.status = &p->status;
    if (!initial) {
        b.request = PILUM_REQ_FLUX | PILUM_REQ_TANGENT;
        b.gradient0 = (pilum_view){p->gradient0, p->n, 1};
        b.gradient1 = (pilum_view){p->gradient1, p->n, 1};
        b.state0 = (pilum_view){p->state0, p->n_state, 1};
        b.flux1 = (pilum_view_mut){p->flux1, p->n, 1};
        b.tangent = (pilum_view_mut){p->tangent, p->n * p->n, 1};
    }
    return (initial ? law->init_state : law->integrate)(instance, &b);
}

/* Every second call passes null for whatever is optional. */
static void by_umat(const char *name, const struct point *p, int bare) {
    umat *call = (umat *)dlsym(library, name);
    if (!call) {
        wrong(name, 0, 1);
        return;
    }
    double stress[6], state[MOST], tangent[36], increment[6], rest[36] = {0}, time[2] = {0}, dt = 1, pnewdt = 1;
    int ndi = 3, nshr = p->n - 3, one[4] = {1};
    memcpy(stress, p->flux0, sizeof stress);
    memcpy(state, p->state0, sizeof state);
    for (int i = 0; i < p->n; i++) increment[i] = p->gradient1[i] - p->gradient0[i];
    if (bare)
        call(stress, state, tangent, 0, 0, 0, 0, 0, 0, 0, p->gradient0, increment, 0, 0, 0, 0, 0, 0, 0, 0, 0, &p->n,
             0, parameter, &n_given, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    else
        call(stress, state, tangent, rest, rest, rest, rest, rest, rest, rest, p->gradient0, increment, time, &dt,
             rest, rest, rest, rest, "LAW", &ndi, &nshr, &p->n, &p->n_state, parameter, &n_given, rest, rest,
             &pnewdt, rest, rest, rest, one, one, one, one, one, one, 80);
    if (p->status != PILUM_OK) {
        if (!isnan(stress[0])) wrong("UMAT has a stress where the law has none", stress[0], NAN);
        if (!bare && !(pnewdt > 0 && pnewdt < 1)) wrong("PNEWDT", pnewdt, 0.25);
        bits("STATEV after a failure", state, p->state0, p->n_state);
        return;
    }
    if (pnewdt != 1) wrong("PNEWDT", pnewdt, 1);
    bits("STRESS", stress, p->flux1, p->n);
    bits("STATEV", state, p->state1, p->n_state);
    for (int i = 0; i < p->n; i++)
        for (int j = 0; j < p->n; j++) bits("DDSDDE", tangent + j * p->n + i, p->tangent + i * p->n + j, 1);
}

/* Point 2 of element 3, with 4 points an element. */
static void by_calculix(const struct point *p) {
    calculix *call = (calculix *)dlsym(library, "CALCULIX");
    static double begin[3 * 4 * MOST], end[3 * 4 * MOST];
    int element = 3, at = 2, points[3] = {4}, kode = -100 - n_given, command = 1, zero[2] = {0}, n_state = p->n_state;
    int place = n_state * (at - 1 + 4 * (element - 1));
    double strain0[6], strain1[6], stress[6], stiffness[21], rest[9] = {0}, dt = 1, pnewdt = -1;
    if (!call) {
        wrong("CALCULIX", 0, 1);
        return;
    }
    for (int i = 0; i < 6; i++) {
        strain0[i] = p->gradient0[i] / (i < 3 ? 1 : 2);
        strain1[i] = p->gradient1[i] / (i < 3 ? 1 : 2);
        stress[i] = p->flux0[i];
    }
    memcpy(begin + place, p->state0, n_state * sizeof *begin);
    call("@LAW", &element, &at, &kode, parameter, strain1, strain0, rest, rest, rest, rest, rest, zero, rest, &dt,
         &dt, rest, &command, zero, points, &n_state, begin, end, stress, stiffness, zero, rest, rest, &pnewdt, zero,
         80);
    if (p->status != PILUM_OK) {
        if (!isnan(stress[0]) || !(pnewdt > 0 && pnewdt < 1)) wrong("CALCULIX after a failure", stress[0], NAN);
        return;
    }
    if (pnewdt != -1) wrong("pnewdt", pnewdt, -1);
    bits("stre", stress, p->flux1, 6);
    bits("xstate", end + place, p->state1, n_state);
    for (int j = 0, k = 0; j < 6; j++)
        for (int i = 0; i <= j; i++, k++) {
            double mean = 0.5 * (p->tangent[6 * i + j] + p->tangent[6 * j + i]);
            bits("stiff", stiffness + k, &mean, 1);
        }
}

/* What goes in and out of a behaviour. */
struct carried {
    double g0[6], g1[6], f0[6], f1[6], k[36], s1[MOST], rdt;
    char message[512];
};

/* From its components to ours. */
static double scale(const struct point *p, int i) { return p->n > 2 && i >= 3 ? 0.70710678118654752440 : 1; }

static int behave(const char *name, const char *hypothesis, const struct point *p, struct carried *m) {
    char symbol[128];
    snprintf(symbol, sizeof symbol, "%s_%s", name, hypothesis);
    behaviour *call = (behaviour *)dlsym(library, symbol);
    if (!call) {
        wrong(symbol, 0, 1);
        return -2;
    }
    double scalar = 0;
    memcpy(m->f1, m->f0, sizeof m->f1);
    memcpy(m->s1, p->state0, sizeof m->s1);
    m->k[0] = 4, m->rdt = 1, *m->message = 0;
    struct state begin = {m->g0, m->f0, &scalar, 0, (double *)p->state0, &scalar, &scalar, 0};
    struct state end = {m->g1, m->f1, &scalar, property, m->s1, &scalar, &scalar, 0};
    struct data data = {m->message, 1, m->k, &m->rdt, &scalar, begin, end};
    int result = call(&data);
    if (p->status != PILUM_OK) {
        if (result != -1 || !(m->rdt < 1) || !*m->message) wrong("a failed behaviour", result, -1);
    } else if (result != 1 || m->rdt != 1) {
        printf("%s\n", m->message);
        wrong("result of a behaviour", result, 1);
    }
    return p->status == PILUM_OK ? result : -1;
}

static void by_behaviour(const char *name, const char *hypothesis, const struct point *p) {
    struct carried m = {.rdt = 1};
    for (int i = 0; i < p->n; i++) {
        m.g0[i] = p->gradient0[i] * scale(p, i);
        m.g1[i] = p->gradient1[i] * scale(p, i);
        m.f0[i] = p->flux0[i] / scale(p, i);
    }
    if (behave(name, hypothesis, p, &m) != 1) return;
    for (int i = 0; i < p->n; i++) m.f1[i] *= scale(p, i);
    for (int i = 0; i < p->n * p->n; i++) m.k[i] *= scale(p, i / p->n) * scale(p, i % p->n);
    close("forces", m.f1, p->flux1, p->n, 0);
    /* Plastic strains are what the increment leaves of itself, and have its rounding. */
    double increment = 0;
    for (int i = 0; i < p->n; i++) increment = fmax(increment, fabs(p->gradient1[i] - p->gradient0[i]));
    close("internal state variables", m.s1, p->state1, p->n_state, increment);
    close("K", m.k, p->tangent, p->n * p->n, 0);
}

/* The same increment from a gradient of zero: the native call gets the very numbers that the law gets. */
static void exactly(const char *name, const char *hypothesis, const struct point *p, const pilum_instance *instance) {
    struct carried m = {.rdt = 1};
    struct point q = *p;
    double f1[6], k[36];
    for (int i = 0; i < p->n; i++) {
        m.g1[i] = p->gradient1[i] - p->gradient0[i];
        m.f0[i] = p->flux0[i];
        q.gradient0[i] = 0;
        q.gradient1[i] = m.g1[i] / scale(p, i);
        q.flux0[i] = m.f0[i] * scale(p, i);
    }
    native(instance, &q, 0);
    if (behave(name, hypothesis, &q, &m) != 1) return;
    for (int i = 0; i < p->n; i++) f1[i] = q.flux1[i] / scale(p, i);
    for (int i = 0; i < p->n * p->n; i++) k[i] = q.tangent[i] / (scale(p, i / p->n) * scale(p, i % p->n));
    bits("forces, to the bit", m.f1, f1, p->n);
    bits("internal state variables, to the bit", m.s1, q.state1, p->n_state);
    bits("K, to the bit", m.k, k, p->n * p->n);
}

int main(int argc, char **argv) {
    if (argc < 6) return 99;
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        printf("%s\n", dlerror());
        return 99;
    }
    const pilum_plugin *(*entry)(const pilum_host *) = (const pilum_plugin *(*)(const pilum_host *))dlsym(library, "pilum_entry");
    const pilum_host host = {.struct_size = sizeof host, .abi_major = 1, .name = "entries", .version = ""};
    const char *name = argv[3];
    double start = atof(argv[4]), step = atof(argv[5]);
    const pilum_plugin *plugin = entry(&host);
    for (uint32_t i = 0; i < plugin->n_laws; i++)
        if (!strcmp(plugin->law[i]->id, argv[2])) law = plugin->law[i];
    if (!law) return 99;
    n_given = argc - 6;
    for (uint32_t i = 0; i < law->n_parameters; i++) {
        const pilum_parameter *declared = law->parameter + i;
        int given = (int)i < n_given && strcmp(argv[6 + i], "-");
        parameter[i] = given ? atof(argv[6 + i]) : declared->default_value;
        if (isnan(declared->default_value) && !(declared->flags & PILUM_P_OPTIONAL))
            property[n_properties++] = parameter[i];
    }
    int n_calls = 0, n_failed = 0;
    for (uint32_t f = 0; f < law->n_formulations; f++) {
        const pilum_formulation *formulation = law->formulation + f;
        int kind = formulation->hypothesis;
        /* Entries of other programs are for interfaces in the plane. */
        if (kind == PILUM_H_INTERFACE_3D) continue;
        pilum_instance *instance = 0;
        char message[256] = "";
        if (law->create(law, &host, f, parameter, law->n_parameters, &instance, message, sizeof message)) {
            printf("%s\n", message);
            return 99;
        }
        for (int i = 0; i < POINTS; i++) {
            struct point p = {.n = formulation->flux->n_components, .n_state = formulation->n_states};
            int solid = p.n > 2;
            for (int c = 0; c < (solid ? 3 : 1); c++) p.flux0[c] = start;
            if (law->init_state) native(instance, &p, 1);
            for (int s = 0; s < STEPS; s++, n_calls++) {
                /* Now and then more than the law can follow. */
                double size = s % 19 == 18 ? 1e305 : step;
                for (int c = 0; c < p.n; c++) p.gradient1[c] = p.gradient0[c] + size * uniform();
                if (kind == PILUM_H_PLANE_STRAIN) p.gradient1[2] = 0;
                native(instance, &p, 0);
                if (solid) {
                    const char *names[] = {"umat_", "umat", "UMAT"};
                    by_umat(names[s % 3], &p, s % 2);
                }
                if (kind == PILUM_H_3D) by_calculix(&p);
                int turns = kind == PILUM_H_AXISYMMETRIC || s % 2;
                const char *plane = turns ? "Axisymmetrical" : "PlaneStrain";
                const char *hypothesis = kind == PILUM_H_3D ? "Tridimensional" : plane;
                by_behaviour(name, hypothesis, &p);
                exactly(name, hypothesis, &p, instance);
                if (p.status == PILUM_OK) {
                    memcpy(p.gradient0, p.gradient1, sizeof p.gradient0);
                    memcpy(p.flux0, p.flux1, sizeof p.flux0);
                    memcpy(p.state0, p.state1, sizeof p.state0);
                } else
                    n_failed++;
            }
        }
        law->destroy(instance);
    }
    printf("%d calls, %d of them failed for good or by a cut, %d differences\n", n_calls, n_failed, n_wrong);
    if (!n_failed) wrong("no call failed", 0, 1);
    return n_wrong > 98 ? 98 : n_wrong;
}
