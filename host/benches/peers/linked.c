/* What the shared library costs: the same law, linked into this program and opened as a plugin, on
 * the same batches. The calls are counted against malloc, too: there must be none.
 *
 *     linked LIBRARY [ROUNDS]      prints: batch, ns per point linked, opened, median of the ratios
 *
 * Linked with the static library of a law of solids (Mohr-Coulomb); LIBRARY is its shared one.
 */
#define _GNU_SOURCE
#include "pilum_law.h"
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { N = 4, N_POINTS = 4096, MOST_ROUNDS = 999 };

extern const pilum_plugin *pilum_entry(const pilum_host *host);
typedef const pilum_plugin *entry(const pilum_host *host);

/* Every allocation of the process, whoever asks for it. */
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t n, size_t size);
extern void *__libc_realloc(void *p, size_t size);
static long allocations;
void *malloc(size_t size) { return allocations++, __libc_malloc(size); }
void *calloc(size_t n, size_t size) { return allocations++, __libc_calloc(n, size); }
void *realloc(void *p, size_t size) { return allocations++, __libc_realloc(p, size); }

static double strain0[N_POINTS * N], strain1[N_POINTS * N], stress0[N_POINTS * N], state0[N_POINTS * 2];
static double stress1[N_POINTS * N], state1[N_POINTS * 2], tangent[N_POINTS * N * N], factor[N_POINTS];
static pilum_status status[N_POINTS];
static char message[256];

struct instance {
  const pilum_law *law;
  pilum_instance *made;
};

static struct instance build(entry *enter) {
  static const double given[] = {34e3, 0.3, 1.0, 36.5, 12.0};
  struct instance i = {enter(NULL)->law[0], NULL};
  double values[32];
  for (uint32_t p = 0; p < i.law->n_parameters; p++)
    values[p] = p < sizeof given / sizeof *given ? given[p] : i.law->parameter[p].default_value;
  uint32_t f = 0;
  while (i.law->formulation[f].hypothesis != PILUM_H_AXISYMMETRIC) f++;
  if (i.law->create(i.law, NULL, f, values, i.law->n_parameters, &i.made, message, sizeof message) != PILUM_OK) {
    fprintf(stderr, "linked: %s\n", message);
    exit(1);
  }
  return i;
}

/* All points, in batches of this size. */
static void integrate(struct instance i, int size) {
  pilum_batch b = {.struct_size = sizeof b, .request = PILUM_REQ_FLUX | PILUM_REQ_TANGENT, .time_increment = 1,
                   .message = message, .message_capacity = sizeof message};
  for (int first = 0; first < N_POINTS; first += size) {
    b.n_points = (uint64_t)(N_POINTS - first < size ? N_POINTS - first : size);
    b.gradient0 = (pilum_view){strain0 + first * N, N, 1};
    b.gradient1 = (pilum_view){strain1 + first * N, N, 1};
    b.flux0 = (pilum_view){stress0 + first * N, N, 1};
    b.state0 = (pilum_view){state0 + first * 2, 2, 1};
    b.flux1 = (pilum_view_mut){stress1 + first * N, N, 1};
    b.state1 = (pilum_view_mut){state1 + first * 2, 2, 1};
    b.tangent = (pilum_view_mut){tangent + first * N * N, N * N, 1};
    b.status = status + first;
    b.step_factor = factor + first;
    if (i.law->integrate(i.made, &b) != PILUM_OK) {
      fprintf(stderr, "linked: %s\n", message);
      exit(1);
    }
  }
}

/* ns of CPU time per point, over some 5 ms. */
static double cost(struct instance i, int size) {
  struct timespec a, b;
  int times = 10;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
  for (int k = 0; k < times; k++) integrate(i, size);
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
  return ((double)(b.tv_sec - a.tv_sec) * 1e9 + (double)(b.tv_nsec - a.tv_nsec)) / times / N_POINTS;
}

static int ascending(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

int main(int argc, char **argv) {
  void *library = argc > 1 ? dlopen(argv[1], RTLD_NOW | RTLD_LOCAL) : NULL;
  union { void *object; entry *function; } opened = {library ? dlsym(library, "pilum_entry") : NULL};
  if (!opened.object) {
    fprintf(stderr, "linked: %s\n", argc > 1 ? dlerror() : "name the library");
    return 2;
  }
  int rounds = argc > 2 ? atoi(argv[2]) : 101;
  if (rounds > MOST_ROUNDS) rounds = MOST_ROUNDS;
  struct instance ours = build(pilum_entry), theirs = build(opened.function);
  if (ours.law->integrate == theirs.law->integrate) {
    fprintf(stderr, "linked: both calls reach the same code\n");
    return 1;
  }
  srand(1);
  for (int i = 0; i < N_POINTS * N; i++) {
    stress0[i] = i % N < 3 ? -100 : 0;
    strain1[i] = 4e-3 * (rand() / (double)RAND_MAX - 0.5);
  }
  const int sizes[] = {1, 8, 64, 512};
  for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
    double a[MOST_ROUNDS], b[MOST_ROUNDS], ratio[MOST_ROUNDS];
    cost(ours, sizes[s]), cost(theirs, sizes[s]);
    long before = allocations;
    for (int r = 0; r < rounds; r++) {
      /* Turns about, so that neither is always the second. */
      if (r % 2) a[r] = cost(ours, sizes[s]), b[r] = cost(theirs, sizes[s]);
      else b[r] = cost(theirs, sizes[s]), a[r] = cost(ours, sizes[s]);
      ratio[r] = b[r] / a[r];
    }
    if (allocations != before) {
      fprintf(stderr, "linked: %ld allocations in the calls\n", allocations - before);
      return 1;
    }
    qsort(a, rounds, sizeof *a, ascending);
    qsort(b, rounds, sizeof *b, ascending);
    qsort(ratio, rounds, sizeof *ratio, ascending);
    printf("%d\t%.2f\t%.2f\t%.4f\n", sizes[s], a[rounds / 2], b[rounds / 2], ratio[rounds / 2]);
  }
  return 0;
}
