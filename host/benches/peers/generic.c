/* What MFront's generic interface costs: one library's Mohr-Coulomb law, called in batches of 512
 * by the contract and point by point by that interface, on the same points.
 *
 *     generic LIBRARY                             prints: step, operator, ns per point of CPU time by
 *                                                 batch, by single native calls and by MFront's
 *                                                 interface, the least of the rounds
 *     generic LIBRARY call STEP OPERATOR ROUTE N  calls 1000 points N times: for valgrind
 *
 * Steps `elastic` and `restart` are those of ../scenario.rs, in axisymmetry. Operators: none,
 * consistent; routes: batch, single, mfront. Where a result differs by more than the rounding of
 * sqrt(2), the exit code is 1.
 */
#define _POSIX_C_SOURCE 200809L
#include "pilum_law.h"
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { N = 4, N_POINTS = 20000, N_COUNTED = 1000, ROUNDS = 25, BATCH = 512, S = 2 };
static const double PARAMETERS[] = {34e3, 0.3, 1.0, 36.5, 12.0};

struct state {
  const double *gradients;
  double *forces;
  const double *density, *properties;
  double *internal, *stored_energy, *dissipated_energy;
  const double *external;
};

/* The argument of a behaviour of MFront's generic interface. */
struct call {
  char *message;
  double time_increment;
  double *operator; /* first entry on input: 0 none, 4 consistent tangent */
  double *step_factor, *speed_of_sound;
  struct state start, end;
};

static int (*behaviour)(struct call *);
static const pilum_law *law;
static pilum_instance *instance;
static int n_points = N_POINTS;

/* By the contract, and in Kelvin-Mandel components. */
static double strain[N_POINTS * N], stress[N_POINTS * N], state[N_POINTS * S];
static double stress_end[N_POINTS * N], state_end[N_POINTS * S], tangent[N_POINTS * N * N];
static double zero[N_POINTS * N];
static double m_strain[N_POINTS * N], m_stress[N_POINTS * N];
static double m_stress_end[N_POINTS * N], m_state_end[N_POINTS * S], m_tangent[N_POINTS * N * N];

static void stop(const char *why) {
  fprintf(stderr, "generic: %s\n", why);
  exit(1);
}

static void native(int first, int size, int with_tangent) {
  static pilum_status status[BATCH];
  static double factor[BATCH];
  static char message[256];
  pilum_batch b = {.struct_size = sizeof b, .time_increment = 1, .n_points = (uint64_t)size,
                   .request = PILUM_REQ_FLUX | (with_tangent ? PILUM_REQ_TANGENT : 0),
                   .gradient0 = {zero + first * N, N, 1}, .gradient1 = {strain + first * N, N, 1},
                   .flux0 = {stress + first * N, N, 1}, .state0 = {state + first * S, S, 1},
                   .flux1 = {stress_end + first * N, N, 1}, .state1 = {state_end + first * S, S, 1},
                   .tangent = {tangent + first * N * N, N * N, 1}, .status = status,
                   .step_factor = factor, .message = message, .message_capacity = sizeof message};
  if (law->integrate(instance, &b) != PILUM_OK) stop(message);
}

static void generic(int i, int with_tangent) {
  static char message[512];
  double factor = 1, sound = 0, density = 0, energy[4] = {0}, external = 293.15, none[N * N] = {0};
  double *k = with_tangent ? m_tangent + i * N * N : none;
  k[0] = with_tangent ? 4 : 0;
  struct call c = {
      message, 1, k, &factor, &sound,
      {zero, m_stress + i * N, &density, PARAMETERS, state + i * S, energy, energy + 1, &external},
      {m_strain + i * N, m_stress_end + i * N, &density, PARAMETERS, m_state_end + i * S, energy + 2, energy + 3,
       &external}};
  if (behaviour(&c) != 1) stop(message);
}

static void step(const char *route, int with_tangent) {
  int size = strcmp(route, "batch") == 0 ? BATCH : 1;
  if (strcmp(route, "mfront") == 0)
    for (int i = 0; i < n_points; i++) generic(i, with_tangent);
  else
    for (int i = 0; i < n_points; i += size) native(i, n_points - i < size ? n_points - i : size, with_tangent);
}

static double unit(void) {
  static uint64_t seed = 88172645463325252u;
  seed ^= seed << 13;
  seed ^= seed >> 7;
  seed ^= seed << 17;
  return (double)(seed >> 11) / 9007199254740992.0;
}

/* Brings a point to the start of its step; draws again until the step is elastic, or plastic. */
static void draw(int i, int plastic) {
  double *e = strain + i * N, *s = stress + i * N, *v = state + i * S;
  for (;;) {
    double mean = 0, norm = 0;
    for (int c = 0; c < N; c++) s[c] = c < 3 ? -100 : 0, e[c] = 2e-4 * (unit() - 0.5);
    memset(v, 0, S * sizeof *v);
    if (plastic) {
      for (int c = 0; c < 3; c++) mean += e[c] / 3;
      for (int c = 0; c < N; c++) e[c] -= c < 3 ? 0.9 * mean : 0, norm += e[c] * e[c];
      for (int c = 0; c < N; c++) e[c] *= 5e-3 / sqrt(norm);
      native(i, 1, 0);
      memcpy(s, stress_end + i * N, N * sizeof *s);
      memcpy(v, state_end + i * S, S * sizeof *v);
      for (int c = 0; c < N; c++) e[c] *= 0.02;
    }
    native(i, 1, 0);
    if ((state_end[i * S] > v[0]) == plastic) break;
  }
  for (int c = 0; c < N; c++) {
    m_strain[i * N + c] = e[c] * (c < 3 ? 1 : sqrt(0.5));
    m_stress[i * N + c] = s[c] * (c < 3 ? 1 : sqrt(2));
  }
}

/* The same results, to the rounding of sqrt(2). */
static void compare(void) {
  step("batch", 1);
  step("mfront", 1);
  for (int i = 0; i < n_points * N; i++) {
    double root = i % N < 3 ? 1 : sqrt(2);
    if (!(fabs(m_stress_end[i] - root * stress_end[i]) < 1e-9)) stop("a stress differs");
    for (int j = 0; j < N; j++) {
      double k = root * tangent[i * N + j] * (j < 3 ? 1 : sqrt(2));
      if (!(fabs(m_tangent[i * N + j] - k) < 1e-7 * PARAMETERS[0])) stop("a tangent differs");
    }
  }
}

static void prepare(const char *which, int size) {
  n_points = size;
  for (int i = 0; i < size; i++) draw(i, strcmp(which, "elastic") != 0);
  compare();
}

static double seconds(void) {
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void build(const char *path) {
  void *library = dlopen(path, RTLD_NOW);
  if (!library) stop(dlerror());
  const pilum_plugin *(*entry)(const pilum_host *) = NULL;
  *(void **)&entry = dlsym(library, "pilum_entry");
  *(void **)&behaviour = dlsym(library, "MohrCoulomb_Axisymmetrical");
  if (!entry || !behaviour) stop("this is not the library of mohr_coulomb");
  law = entry(NULL)->law[0];
  double values[32];
  char message[256];
  uint32_t f = 0, n_given = sizeof PARAMETERS / sizeof *PARAMETERS;
  while (law->formulation[f].hypothesis != PILUM_H_AXISYMMETRIC) f++;
  for (uint32_t p = 0; p < law->n_parameters; p++)
    values[p] = p < n_given ? PARAMETERS[p] : law->parameter[p].default_value;
  if (law->create(law, NULL, f, values, law->n_parameters, &instance, message, sizeof message) != PILUM_OK)
    stop(message);
}

int main(int argc, char **argv) {
  if (argc != 2 && argc != 7) stop("name the library");
  build(argv[1]);
  if (argc == 7) {
    prepare(argv[3], N_COUNTED);
    for (int k = atoi(argv[6]); k > 0; k--) step(argv[5], strcmp(argv[4], "none") != 0);
    return 0;
  }
  static const char *const steps[] = {"elastic", "restart"}, *const routes[] = {"batch", "single", "mfront"};
  for (int s = 0; s < 2; s++) {
    prepare(steps[s], N_POINTS);
    for (int o = 0; o < 2; o++) {
      double least[3] = {1, 1, 1};
      /* Turns about: what else runs on the machine meets all of them. */
      for (int round = 0; round < ROUNDS; round++)
        for (int r = 0; r < 3; r++) {
          double start = seconds();
          step(routes[r], o);
          least[r] = fmin(least[r], seconds() - start);
        }
      printf("%s\t%s", steps[s], o ? "consistent" : "none");
      for (int r = 0; r < 3; r++) printf("\t%.1f", least[r] / N_POINTS * 1e9);
      printf("\n");
    }
  }
  return 0;
}
