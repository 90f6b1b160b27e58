/* The contract between the Pilum host and constitutive laws. abi/README.md is the normative text;
 * abi/tests/elastic_joint.c is a complete law.
 *
 * Generated from abi/src/raw.rs. Do not edit: the host refuses libraries whose layout differs.
 *
 * Every struct but the two views starts with `struct_size`, the size its writer knows. Structs
 * only ever grow at the end. A reader tests PILUM_HAS before it touches a field that is not in
 * version 1.0, and walks an array of structs with the stride of its first element's `struct_size`.
 *
 * Strings are UTF-8, NUL-terminated, static and never null unless a field says so.
 *
 * Prefixes: PILUM_H_ hypotheses, PILUM_P_ flags of parameters, PILUM_V_ flags of variables,
 * PILUM_T_ flags of formulations, PILUM_REQ_ requests, PILUM_E_ errors. */
#ifndef PILUM_LAW_H
#define PILUM_LAW_H

#include <stddef.h>
#include <stdint.h>

#if UINTPTR_MAX != UINT64_MAX
#error "the contract is for 64-bit systems"
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* A law with its parameters fixed; opaque, owned by the library, immutable after `create`. */
typedef struct pilum_instance pilum_instance;

/* `pilum_magic_block.magic`: the letters `PILM`. A byte-swapped value means the other endianness. */
#define PILUM_MAGIC UINT32_C(0x50494C4D)
/* Major version of the contract. Different majors never work together. */
#define PILUM_ABI_MAJOR 1
/* Minor version of the contract. Minors only append; any two of one major work together. */
#define PILUM_ABI_MINOR 0

/* Outcome of a call, one of the `PILUM_OK` ... `PILUM_E_INTERNAL` values. */
typedef int32_t pilum_status;

/* Outputs are valid. */
#define PILUM_OK 0
/* Outputs are valid but inaccurate; the host should take smaller steps. */
#define PILUM_OK_UNRELIABLE 1
/* No outputs; the host should repeat with a smaller step, see `pilum_batch.step_factor`. */
#define PILUM_CUT_STEP 2
/* The host broke the contract. */
#define PILUM_E_ARGUMENT (-1)
/* A parameter is refused. */
#define PILUM_E_PARAMETER (-2)
/* The law does not offer what was requested. */
#define PILUM_E_UNSUPPORTED (-3)
/* The state or the gradient is outside the law's domain; a smaller step does not help. */
#define PILUM_E_DOMAIN (-4)
/* The local computation broke down; a smaller step does not help. */
#define PILUM_E_NUMERIC (-5)
/* A defect of the law (a caught panic or exception). The instance is unusable from now on. */
#define PILUM_E_INTERNAL (-6)

/* Kinematic hypothesis, one of the `PILUM_H_*` values. */
typedef int32_t pilum_hypothesis;

/* Plane strain: components 11 22 33 12, 33 out of plane, strain 33 given as zero. */
#define PILUM_H_PLANE_STRAIN 1
/* Axisymmetry: components 11 (radial) 22 (axial) 33 (hoop) 12. */
#define PILUM_H_AXISYMMETRIC 2
/* Three dimensions: components 11 22 33 12 13 23. */
#define PILUM_H_3D 3
/* Interface in two dimensions, plane or axisymmetric: components normal, tangential. */
#define PILUM_H_INTERFACE_2D 10
/* Interface in three dimensions: components normal, tangential 1, tangential 2. */
#define PILUM_H_INTERFACE_3D 11

/* Shape of a variable, one of the `PILUM_SCALAR` ... values. */
typedef int32_t pilum_shape;

/* One number. */
#define PILUM_SCALAR 0
/* Components in the frame of the interface: normal first. */
#define PILUM_VECTOR 1
/* Symmetric tensor in Voigt order 11 22 33 12 [13 23]; strains carry gamma = 2 epsilon. */
#define PILUM_SYMMETRIC_TENSOR 2

/* Handshake block, the data symbol `pilum_magic`. Its shape never changes. */
typedef struct pilum_magic_block {
    /* Size of this struct, 64. */
    uint32_t struct_size;
    /* `PILUM_MAGIC`. */
    uint32_t magic;
    /* `PILUM_ABI_MAJOR` the library was built against. */
    uint16_t abi_major;
    /* `PILUM_ABI_MINOR` the library was built against. */
    uint16_t abi_minor;
    /* Size of a pointer, 8. */
    uint8_t pointer_bytes;
    /* Size of a real number, 8. */
    uint8_t real_bytes;
    /* Zero. */
    uint8_t reserved[2];
    /* `PILUM_LAYOUT_HASH` of the header the library was built with: the offsets and sizes of all
     * public fields. A difference within one version means a compiler flag or an edited header. */
    uint64_t layout_hash;
    /* What the library was built with, such as `pilum-rs 0.1.0`; NUL-padded. */
    char sdk[40];
} pilum_magic_block;

/* A material parameter: declared once; input checks, documentation and messages derive from it. */
typedef struct pilum_parameter {
    /* Size of this struct. */
    uint32_t struct_size;
    /* `PILUM_P_*` flags. */
    uint32_t flags;
    /* Identifier `[a-z][a-z0-9_]*`, public interface, never changes. */
    const char *id;
    /* Symbol in the literature. */
    const char *symbol;
    /* Unit; `-` where absent, `deg` for angles. */
    const char *unit;
    /* One sentence. */
    const char *doc;
    /* Default value; NaN: none. */
    double default_value;
    /* Smallest admissible value; may be -infinity. */
    double lower;
    /* Largest admissible value; may be +infinity. */
    double upper;
    /* Start of the usual range; outside it the host only warns. */
    double usual_lower;
    /* End of the usual range. */
    double usual_upper;
    /* Null, or a null-terminated list of labels; the value is then the index of the label. */
    const char *const *choices;
} pilum_parameter;

/* The lower bound itself is not admissible. */
#define PILUM_P_OPEN_LOWER (1u << 0)
/* The upper bound itself is not admissible. */
#define PILUM_P_OPEN_UPPER (1u << 1)
/* May be left out: the law then receives NaN and does what `doc` says. */
#define PILUM_P_OPTIONAL (1u << 2)

/* A gradient, a flux or an internal variable. */
typedef struct pilum_variable {
    /* Size of this struct. */
    uint32_t struct_size;
    /* `PILUM_V_*` flags. */
    uint32_t flags;
    /* Identifier `[a-z][a-z0-9_]*`: `strain`, `jump`, `plastic_slip`. */
    const char *id;
    /* Symbol in the literature. */
    const char *symbol;
    /* Unit. */
    const char *unit;
    /* One sentence. */
    const char *doc;
    /* Shape. */
    pilum_shape shape;
    /* Number of components. */
    uint32_t n_components;
    /* `n_components` names, or null for a scalar. */
    const char *const *component_names;
    /* Initial value where the law has no `init_state`. */
    double initial_value;
} pilum_variable;

/* A result to look at; it carries no history. */
#define PILUM_V_OUTPUT_ONLY (1u << 0)

/* What a law offers under one hypothesis. `gradient[i]` is work-conjugate to `flux[i]`. */
typedef struct pilum_formulation {
    /* Size of this struct. */
    uint32_t struct_size;
    /* Hypothesis. */
    pilum_hypothesis hypothesis;
    /* `PILUM_T_*` flags. */
    uint32_t flags;
    /* Number of gradients. */
    uint32_t n_gradients;
    /* Number of fluxes, equal to the number of gradients. */
    uint32_t n_fluxes;
    /* Number of internal variables. */
    uint32_t n_states;
    /* Gradients. */
    const struct pilum_variable *gradient;
    /* Fluxes. */
    const struct pilum_variable *flux;
    /* Internal variables; may be null if absent. */
    const struct pilum_variable *state;
} pilum_formulation;

/* The tangent is symmetric in every state. */
#define PILUM_T_SYMMETRIC (1u << 0)
/* The response is linear: one constant tangent, no internal variables. */
#define PILUM_T_LINEAR (1u << 1)
/* Components are in axes of the material (1 along the layer, 2 normal to it, 3 out of plane), so
 * the law only makes sense in an element that has such axes. */
#define PILUM_T_LOCAL_AXES (1u << 2)
/* Offers rates, `PILUM_REQ_RATES`. */
#define PILUM_T_RATES (1u << 3)
/* Its consistent tangent is close to the derivative of the update, but not equal to it. */
#define PILUM_T_TANGENT_APPROXIMATE (1u << 4)
/* Offers the elastic operator only; asked for the consistent tangent, it answers
 * `PILUM_E_UNSUPPORTED`. */
#define PILUM_T_NO_TANGENT (1u << 5)

/* Read access to values of many points: component `c` of point `i` is
 * `p[i * point + c * component]`. A `point` stride of 0 gives all points the same values. */
typedef struct pilum_view {
    /* First value; null if there are no components. */
    const double *p;
    /* Stride from point to point, in doubles. */
    ptrdiff_t point;
    /* Stride from component to component, in doubles. */
    ptrdiff_t component;
} pilum_view;

/* Write access to values of many points; entries never overlap each other nor any input. */
typedef struct pilum_view_mut {
    /* First value; null if there are no components or nothing is requested. */
    double *p;
    /* Stride from point to point, in doubles. */
    ptrdiff_t point;
    /* Stride from component to component, in doubles. */
    ptrdiff_t component;
} pilum_view_mut;

/* Rates of what an update depends on, and of what it gives: the derivative of the update in one
 * direction. */
typedef struct pilum_rates {
    /* Size of this struct. */
    uint32_t struct_size;
    /* Zero. */
    uint32_t reserved;
    /* Rates of the parameters, one for each in declared order, the same for all points; null: all
     * zero. */
    const double *parameter;
    /* Rates of the gradients at the start of the increment. */
    struct pilum_view gradient0;
    /* Rates of the gradients at the end of the increment. */
    struct pilum_view gradient1;
    /* Rates of the fluxes at the start. */
    struct pilum_view flux0;
    /* Rates of the internal variables at the start. */
    struct pilum_view state0;
    /* Rates of the fluxes at the end (written). */
    struct pilum_view_mut flux1;
    /* Rates of the internal variables at the end (written). */
    struct pilum_view_mut state1;
} pilum_rates;

/* One call: a batch of integration points over one increment. All pointers are valid until the
 * call returns, and none may be kept. */
typedef struct pilum_batch {
    /* Size of this struct. */
    uint32_t struct_size;
    /* `PILUM_REQ_*` flags. */
    uint32_t request;
    /* Number of points. */
    uint64_t n_points;
    /* Number of the first point in the host's numbering; for messages only. */
    uint64_t first_point;
    /* Time at the start of the increment. */
    double time;
    /* Length of the increment in time. */
    double time_increment;
    /* Gradients at the start of the increment. */
    struct pilum_view gradient0;
    /* Gradients at the end of the increment. */
    struct pilum_view gradient1;
    /* Fluxes at the start. */
    struct pilum_view flux0;
    /* Internal variables at the start. */
    struct pilum_view state0;
    /* Fluxes at the end (written). */
    struct pilum_view_mut flux1;
    /* Internal variables at the end (written). */
    struct pilum_view_mut state1;
    /* d flux1/d gradient1, row-major over all components (written if requested). */
    struct pilum_view_mut tangent;
    /* `n_points` outcomes (written), or null. */
    pilum_status *status;
    /* `n_points` factors (written where the outcome is `PILUM_CUT_STEP`), or null: the fraction
     * of the increment, in (0, 1), that the law believes it can follow; NaN: the host decides. */
    double *step_factor;
    /* Buffer for one message, NUL-terminated on return; may be null. */
    char *message;
    /* Size of the buffer in bytes. */
    size_t message_capacity;
    /* Time at the start of the increment, counted from the start of the phase or segment that it
     * belongs to. */
    double step_time;
    /* Rates; null unless `PILUM_REQ_RATES` is set. */
    const struct pilum_rates *rates;
} pilum_batch;

/* Compute fluxes and internal variables at the end of the increment. */
#define PILUM_REQ_FLUX (1u << 0)
/* Compute the tangent consistent with the update. */
#define PILUM_REQ_TANGENT (1u << 1)
/* Compute the elastic operator instead of the consistent tangent. */
#define PILUM_REQ_ELASTIC (1u << 2)
/* Compute rates too, see `pilum_batch.rates`. */
#define PILUM_REQ_RATES (1u << 3)

/* What the host tells a library. */
typedef struct pilum_host {
    /* Size of this struct. */
    uint32_t struct_size;
    /* `PILUM_ABI_MAJOR` of the host. */
    uint16_t abi_major;
    /* `PILUM_ABI_MINOR` of the host. */
    uint16_t abi_minor;
    /* Name of the program. */
    const char *name;
    /* Version of the program. */
    const char *version;
    /* Looks up an optional service by id (`pilum.<name>/<revision>`); null: unknown. May be null. */
    const void *(*get_extension)(const char *id);
} pilum_host;

/* A constitutive law: description and functions. */
typedef struct pilum_law {
    /* Size of this struct. */
    uint32_t struct_size;
    /* Zero. */
    uint32_t flags;
    /* Number of parameters. */
    uint32_t n_parameters;
    /* Number of formulations. */
    uint32_t n_formulations;
    /* Identifier `[a-z][a-z0-9_]*`, public interface, never changes. */
    const char *id;
    /* Name in words. */
    const char *name;
    /* Version of the law. */
    const char *version;
    /* Authors. */
    const char *author;
    /* Licence, as an SPDX expression. */
    const char *licence;
    /* A sentence or two. */
    const char *doc;
    /* Sources. */
    const char *references;
    /* Parameters; may be null if absent. */
    const struct pilum_parameter *parameter;
    /* Formulations. */
    const struct pilum_formulation *formulation;
    /* Fixes the parameters (`n_parameters` values in declared order) under formulation number
     * `formulation`, checks them, and is the only function that may allocate. On failure it
     * writes a message and leaves `out` alone; a message about one parameter starts with its id
     * and a colon. [one thread at a time] */
    pilum_status (*create)(const struct pilum_law *law,
                           const struct pilum_host *host,
                           uint32_t formulation,
                           const double *parameter,
                           uint32_t n_parameters,
                           pilum_instance **out,
                           char *message,
                           size_t message_capacity);
    /* Writes `state1` for points that carry `flux0`; null: every variable starts from its
     * `initial_value`. [any thread, concurrent, no allocation] */
    pilum_status (*init_state)(const pilum_instance *instance, const struct pilum_batch *batch);
    /* Carries every point of the batch over the increment. A pure function of its arguments: the
     * same inputs give the same bits, in any order, split and thread. A failing point does not
     * stop the others; the result is the most severe outcome. [any thread, concurrent, no
     * allocation, lock or output] */
    pilum_status (*integrate)(const pilum_instance *instance, const struct pilum_batch *batch);
    /* Frees the instance. [one thread at a time] */
    void (*destroy)(pilum_instance *instance);
} pilum_law;

/* What a library holds. */
typedef struct pilum_plugin {
    /* Size of this struct. */
    uint32_t struct_size;
    /* Number of laws. */
    uint32_t n_laws;
    /* `n_laws` pointers to laws. */
    const struct pilum_law *const *law;
    /* Looks up an optional service by id; null: unknown. May be null. */
    const void *(*get_extension)(const char *id);
} pilum_plugin;

/* Offsets and sizes of all public fields, for the handshake. */
#define PILUM_LAYOUT_HASH UINT64_C(0xb8583da8c195e927)

/* Before a definition: makes the symbol visible outside the library. */
#if defined(_WIN32)
#define PILUM_EXPORT __declspec(dllexport)
#else
#define PILUM_EXPORT __attribute__((visibility("default")))
#endif

/* The two symbols of a library. `pilum_entry` is idempotent, may be called from any thread, and
 * returns the same static description every time; null refuses the host. */
extern PILUM_EXPORT const pilum_magic_block pilum_magic;
PILUM_EXPORT const pilum_plugin *pilum_entry(const pilum_host *host);

/* Initialiser of `pilum_magic`; `sdk` is a string literal of at most 39 bytes:
 *     PILUM_EXPORT const pilum_magic_block pilum_magic = PILUM_MAGIC_BLOCK("my-sdk 1.0"); */
#define PILUM_MAGIC_BLOCK(sdk)                                                                     \
    {                                                                                              \
        sizeof(pilum_magic_block), PILUM_MAGIC, PILUM_ABI_MAJOR, PILUM_ABI_MINOR, sizeof(void *),  \
            sizeof(double), {0, 0}, PILUM_LAYOUT_HASH, sdk                                         \
    }

/* Whether the writer of `*ptr` knew `field`. */
#define PILUM_HAS(ptr, type, field)                                                                \
    ((ptr)->struct_size >= offsetof(type, field) + sizeof(((type *)0)->field))

/* Component `c` of point `i` in a view, to read or to assign. */
#define PILUM_AT(view, i, c)                                                                       \
    ((view).p[(ptrdiff_t)(i) * (view).point + (ptrdiff_t)(c) * (view).component])

/* Says which laws the library holds, readable without running it; once per library, at file
 * scope. One line `<id> <version>` for each law follows the first line:
 *     PILUM_MANIFEST("pilum 1\nmy_law 1.0\n"); */
#if defined(_MSC_VER) && !defined(__clang__)
#pragma section(".pilum", read)
#define PILUM_MANIFEST(text)                                                                       \
    extern const char pilum_manifest[];                                                            \
    __declspec(allocate(".pilum")) const char pilum_manifest[] = text
#else
#if defined(__APPLE__)
#define PILUM_MANIFEST_ATTRIBUTES used, section("__DATA,__pilum")
#elif defined(__ELF__) && defined(__has_attribute)
#if __has_attribute(retain)
#define PILUM_MANIFEST_ATTRIBUTES used, retain, section(".pilum")
#endif
#endif
#ifndef PILUM_MANIFEST_ATTRIBUTES
#define PILUM_MANIFEST_ATTRIBUTES used, section(".pilum")
#endif
#define PILUM_MANIFEST(text)                                                                       \
    static const char pilum_manifest[] __attribute__((PILUM_MANIFEST_ATTRIBUTES)) = text
#endif

/* Compiler flags that change the structs are found here; an edited header by the host. */
#ifdef __cplusplus
#define PILUM_SIZE(type, bytes) static_assert(sizeof(type) == (bytes), "size of " #type)
#else
#define PILUM_SIZE(type, bytes) _Static_assert(sizeof(type) == (bytes), "size of " #type)
#endif
PILUM_SIZE(pilum_magic_block, 64);
PILUM_SIZE(pilum_parameter, 88);
PILUM_SIZE(pilum_variable, 64);
PILUM_SIZE(pilum_formulation, 48);
PILUM_SIZE(pilum_view, 24);
PILUM_SIZE(pilum_view_mut, 24);
PILUM_SIZE(pilum_batch, 256);
PILUM_SIZE(pilum_rates, 160);
PILUM_SIZE(pilum_host, 32);
PILUM_SIZE(pilum_law, 120);
PILUM_SIZE(pilum_plugin, 24);
#undef PILUM_SIZE

#ifdef __cplusplus
}
#endif

#endif /* PILUM_LAW_H */
