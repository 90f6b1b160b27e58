/* Cost of one integration point of MFront's elastic and Mohr-Coulomb laws, in nanoseconds of CPU
 * time, on the steps of ../scenario.rs: same soil, same random numbers, same kinds of start.
 *
 *     mfront LIBRARY [NAME...]      prints: name, operator, ns per point (median, least)
 *
 * LIBRARY is the one that the Python wheel of OpenGeoSys brings. Its laws speak MFront's "generic"
 * interface; the two structs below restate that interface. Shear components carry a factor of
 * sqrt(2). Tension positive, kPa. Mohr-Coulomb is the rounded surface of Abbo & Sloan there, with
 * the rounding from a Lode angle of 29 degrees on and a hyperbola of 0.1 kPa at the apex.
 */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { N_POINTS = 20000, RUNS = 15, MOST = 6 };
static const double LEAST_RUN = 0.02; /* s */
static const double YOUNG = 34e3, POISSON = 0.3;

struct state {
  const double *gradients;
  double *forces;
  const double *density;
  const double *properties;
  double *internal;
  double *stored_energy;
  double *dissipated_energy;
  const double *external;
};

struct call {
  char *message;
  double time_increment;
  double *operator; /* first entry on input: 0 none, 4 consistent tangent */
  double *step_factor;
  double *speed_of_sound;
  struct state start, end;
};

typedef int law(struct call *);

struct point {
  double stress[MOST], internal[MOST + 1], strain[MOST];
  double stress_end[MOST], internal_end[MOST + 1], operator[MOST * MOST];
};

static uint64_t seed;
static double unit(void) {
  seed ^= seed << 13;
  seed ^= seed >> 7;
  seed ^= seed << 17;
  return (double)(seed >> 11) / 9007199254740992.0;
}

/* One step. The strain of the interface is that of the increment: the law keeps the elastic strain
 * itself. Returns whether it succeeded. */
static int integrate(law *f, int n, struct point *p, double operator) {
  static const double properties[] = {34e3, 0.3, 1.0, 36.5, 12.0, 29.0, 0.1};
  static const double zero[MOST], external[] = {293.15};
  static char message[512];
  double factor = 1, sound = 0, density = 0, energy[4] = {0};
  memcpy(p->stress_end, p->stress, sizeof p->stress);
  memcpy(p->internal_end, p->internal, sizeof p->internal);
  p->operator[0] = operator;
  struct call c = {
      message, 1, p->operator, &factor, &sound,
      {zero, p->stress, &density, properties, p->internal, energy, energy + 1, external},
      {p->strain, p->stress_end, &density, properties, p->internal_end, energy + 2, energy + 3, external}};
  (void)n;
  return f(&c) == 1;
}

/* At rest under 100 kPa from all sides. */
static void rest(int n, struct point *p) {
  memset(p, 0, sizeof *p);
  for (int i = 0; i < 3; i++) {
    p->stress[i] = -100;
    p->internal[i] = -100 * (1 - 2 * POISSON) / YOUNG;
  }
  (void)n;
}

static void direction(int n, const char *step, double *e) {
  double mean = 0, norm = 0;
  for (int i = 0; i < n; i++) e[i] = unit() - 0.5;
  if (strcmp(step, "edge") == 0) {
    const double compression[] = {0.35, -1, 0.35};
    for (int i = 0; i < n; i++) e[i] = 1e-6 * e[i] + (i < 3 ? compression[i] : 0);
  } else {
    for (int i = 0; i < 3; i++) mean += e[i] / 3;
    for (int i = 0; i < 3; i++) e[i] -= 0.9 * mean;
  }
  for (int i = 0; i < n; i++) norm += e[i] * e[i];
  for (int i = 0; i < n; i++) e[i] /= sqrt(norm);
}

/* Brings a point to the start of its step; draws again until the step is plastic. */
static void draw(law *f, int n, const char *step, struct point *p) {
  double e[MOST];
  if (strcmp(step, "elastic") == 0) {
    rest(n, p);
    for (int i = 0; i < n; i++) p->strain[i] = 2e-4 * (unit() - 0.5);
    return;
  }
  do {
    rest(n, p);
    direction(n, step, e);
    double large = strcmp(step, "edge") == 0 ? 1.5e-2 : 5e-3;
    if (strcmp(step, "large") == 0) large *= 0.5 + unit();
    for (int i = 0; i < n; i++) p->strain[i] = large * e[i];
    if (strcmp(step, "large") != 0) {
      if (!integrate(f, n, p, 0)) continue;
      memcpy(p->stress, p->stress_end, sizeof p->stress);
      memcpy(p->internal, p->internal_end, sizeof p->internal);
      for (int i = 0; i < n; i++) p->strain[i] = 1e-4 * e[i];
    }
  } while (!integrate(f, n, p, 4) || !(p->internal_end[n] > p->internal[n]));
}

static double seconds(void) {
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static int measure(void *library, const char *name) {
  static struct point points[N_POINTS];
  const char *slash = strchr(name, '/');
  const char *step = slash ? slash + 1 : "elastic";
  int spatial = strstr(name, "_3d") != NULL, n = spatial ? 6 : 4;
  char symbol[64];
  snprintf(symbol, sizeof symbol, "%s_%s", slash ? "MohrCoulombAbboSloan" : "StandardElasticityBrick",
           spatial ? "Tridimensional" : "Axisymmetrical");
  union { void *object; law *function; } found = {dlsym(library, symbol)};
  if (!found.object) {
    fprintf(stderr, "mfront: no law %s in the library\n", symbol);
    return 1;
  }
  seed = 88172645463325252u;
  for (int i = 0; i < N_POINTS; i++) draw(found.function, n, step, &points[i]);
  for (int o = 0; o < 2; o++) {
    double runs[RUNS], once = 0;
    int times = 1, failed = 0;
    for (int r = -2; r < RUNS; r++) {
      double start = seconds();
      for (int k = 0; k < times; k++)
        for (int i = 0; i < N_POINTS; i++)
          failed += !integrate(found.function, n, &points[i], o ? 4 : 0);
      double each = (seconds() - start) / times / N_POINTS;
      if (r < 0) once = each * N_POINTS, times = r < -1 ? 1 : 1 + (int)(LEAST_RUN / once);
      else runs[r] = each * 1e9;
    }
    if (failed) {
      fprintf(stderr, "mfront: %s: %d calls failed\n", name, failed);
      return 1;
    }
    qsort(runs, RUNS, sizeof *runs, ascending);
    printf("%s\t%s\t%.2f\t%.2f\n", name, o ? "consistent" : "none", runs[RUNS / 2], runs[0]);
  }
  return 0;
}

int main(int argc, char **argv) {
  void *library = argc > 1 ? dlopen(argv[1], RTLD_NOW) : NULL;
  if (!library) {
    fprintf(stderr, "mfront: %s\n", argc > 1 ? dlerror() : "name the library");
    return 2;
  }
  int failed = 0;
  for (int i = 2; i < argc; i++) failed |= measure(library, argv[i]);
  return failed;
}
