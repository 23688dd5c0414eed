/*
 * odyn_element.h: joints, forces and control elements of O-DYN in C (C99; usable from C++11).
 *
 * A library describes its elements in constant structs and exports them with ODYN_PLUGIN. An element either records its
 * equations once, per instance, or is called with numbers at run time (ODYN_OPAQUE). The guide is docs/c-plugins.md.
 *
 * Rules of the boundary
 *  - Everything reachable from the exported odyn_plugin is constant and lives as long as the library, which is never
 *    unloaded. Texts are UTF-8 and end with a zero.
 *  - What the host passes to a function (parameters, recorder, error, arrays) is valid until that function returns.
 *    Nothing is freed by the other side: an instance is what `create` gave and only `destroy` frees it.
 *  - Functions return ODYN_OK, or another code after having written a message into `error`. They must not throw, longjmp
 *    or end the process.
 *  - An instance is used by one thread at a time. `create` and `record` of different instances may run at once, so a
 *    library has no unprotected global state. A recorder is used on the thread that it was passed on.
 *  - `evaluate` must not change memory: it is also called for steps that are rejected later. Memory changes in `accept`.
 *  - Units are SI and rad, vectors are in the right-handed ground frame, rotation matrices map marker components to ground
 *    components. A wrench is what acts on the body. Joint axes are z axes.
 *  - Structs grow at their end; each says its size as its writer knew it, and what it does not have is zero. Array elements
 *    (odyn_named, odyn_signal, odyn_parameter, odyn_text, odyn_value) never change.
 */
#ifndef ODYN_ELEMENT_H
#define ODYN_ELEMENT_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of the C table; a manifest says "abi=c1". */
#define ODYN_C_ABI 1
/* Number of the conventions: axes, units, order of Euler parameters, signs. */
#define ODYN_CONVENTIONS 1
/* Version of the contract that this header belongs to. */
#define ODYN_INTERFACE "1.2.0"

/* What functions return. */
enum {
    ODYN_OK = 0,
    /* The element failed. */
    ODYN_FAULT = 1,
    /* `create` refuses a parameter; odyn_error.parameter names it, or is empty where it is not a single one. */
    ODYN_REFUSED = 2,
    /* An optional parameter was not given. */
    ODYN_ABSENT = 3
};

/* odyn_element.kind */
enum { ODYN_JOINT = 0, ODYN_FORCE = 1, ODYN_CONTROL = 2 };

/* odyn_element.flags */
enum {
    /* Called at run time with numbers instead of recorded. */
    ODYN_OPAQUE = 1,
    /* An opaque joint that computes the derivatives itself; without it the host takes differences. */
    ODYN_GIVES_DERIVATIVES = 2,
    /* A joint that gives the pose of frame 1 in frame 0 from `mobility` joint coordinates. */
    ODYN_HAS_MOBILITY = 4,
    /* On top of that pose frame 1 turns freely in all directions. */
    ODYN_TURNS_FREELY = 8,
    /* An opaque force that gives its potential energy, its dissipated power. */
    ODYN_GIVES_POTENTIAL = 16,
    ODYN_GIVES_DISSIPATION = 32
};

/* odyn_parameter.kind */
enum {
    ODYN_NUMBER = 0,
    ODYN_INTEGER = 1,
    ODYN_BOOLEAN = 2,
    ODYN_TEXT = 3,
    /* Three numbers. */
    ODYN_VECTOR = 4,
    /* Any number of numbers. */
    ODYN_LIST = 5,
    /* Pairs of argument and value. */
    ODYN_CURVE = 6,
    /* A function of one variable that the scene gives: number, expression, points. */
    ODYN_FUNCTION = 7,
    /* A function of two variables that the scene gives on a grid. Contract 1.2. */
    ODYN_SURFACE = 8
};

/* Operations on values, for odyn_recorder.operation; the inline functions below use them. */
enum {
    ODYN_OP_ADD = 2,
    ODYN_OP_SUB = 3,
    ODYN_OP_MUL = 4,
    ODYN_OP_DIV = 5,
    ODYN_OP_NEG = 6,
    ODYN_OP_SQRT = 7,
    ODYN_OP_SIN = 8,
    ODYN_OP_COS = 9,
    ODYN_OP_ATAN2 = 10,
    ODYN_OP_EXP = 11,
    ODYN_OP_LN = 12,
    ODYN_OP_TANH = 13,
    ODYN_OP_SELECT = 16
};

/* What the host provides, for odyn_recorder.input; the index is given behind each. */
enum {
    ODYN_IN_TIME = 0,             /* 0 */
    ODYN_IN_POSITION = 1,         /* 3 frame + component, m */
    ODYN_IN_ROTATION = 2,         /* 9 frame + 3 row + column */
    ODYN_IN_VELOCITY = 3,         /* 3 frame + component, m/s */
    ODYN_IN_ANGULAR_VELOCITY = 4, /* 3 frame + component, rad/s */
    ODYN_IN_ANGLE_REFERENCE = 5,  /* angle; changes only between steps */
    ODYN_IN_STATE = 6,            /* continuous state */
    ODYN_IN_MEMORY = 7,           /* discrete state; changes only between steps */
    ODYN_IN_SIGNAL = 8,           /* signal taken */
    ODYN_IN_COORDINATE = 9,       /* joint coordinate of the mobility */
    ODYN_IN_REACTION_FORCE = 10,  /* 3 joint + component, N */
    ODYN_IN_REACTION_TORQUE = 11, /* 3 joint + component, N m */
    ODYN_IN_UNKNOWN = 12          /* internal unknown; contract 1.2 */
};

/* What a value means to the host, for odyn_recorder.result; the index is given behind each. */
enum {
    ODYN_OUT_ROW = 0,           /* row of a joint: zero when it holds */
    ODYN_OUT_FORCE = 1,         /* 3 frame + component, N, at the frame's origin; contributions add up */
    ODYN_OUT_TORQUE = 2,        /* 3 frame + component, N m; contributions add up */
    ODYN_OUT_ANGLE = 3,         /* multi-turn angle */
    ODYN_OUT_COORDINATE = 4,    /* channel of a joint */
    ODYN_OUT_RATE = 5,          /* rate of a continuous state */
    ODYN_OUT_MEMORY = 6,        /* discrete state after the step is accepted; kept where it is not given */
    ODYN_OUT_CHANNEL = 8,       /* channel of a force, output of a control element, value of a joint */
    ODYN_OUT_POTENTIAL = 9,     /* 0; potential energy, J */
    ODYN_OUT_DISSIPATION = 10,  /* 0; dissipated power, W, not negative */
    ODYN_OUT_POSE_POSITION = 11, /* component of the position of frame 1 in frame 0 */
    ODYN_OUT_POSE_ROTATION = 12, /* 3 row + column of the rotation frame 1 -> frame 0 */
    /* Row on velocities of a joint, numbered with the others: zero when it holds, linear in the velocities. Contract 1.2. */
    ODYN_OUT_VELOCITY_ROW = 13,
    ODYN_OUT_SAMPLE_PERIOD = 14, /* 0; s, a constant: memory changes at its whole multiples only. Contract 1.2. */
    /* The row is unilateral: never negative, it only pushes; a constant, the coefficient of restitution. Contract 1.2. */
    ODYN_OUT_UNILATERAL = 15,
    ODYN_OUT_CONDITION = 17,   /* condition on the internal unknowns: zero; as many as unknowns. Contract 1.2. */
    ODYN_OUT_CHECK = 25,       /* margin of a check, positive while all is well. Contract 1.2. */
    ODYN_OUT_STICKS_WITH = 16, /* The row holds only while that unilateral row is closed; a constant, its number. Contract 1.2. */
    /* The row on velocities holds up to this limit, N or N m, and slides beyond; of one that sticks with a unilateral row a share
       of that row's reaction. Contract 1.2. */
    ODYN_OUT_LIMIT = 30,
    ODYN_OUT_SLIDES_WITH = 31, /* The row and that one have one limit, a circle; a constant, its number. Contract 1.2. */
    /* 0; kinetic energy of mass that a force brings, J: sums of products of two velocities each, of frames and flexible
       coordinates; frames' positions and rotations and flexible coordinates may go in. Its inertia acts by itself. Not with
       ODYN_OPAQUE. Contract 1.2. */
    ODYN_OUT_KINETIC = 40,
    /* Generalised force on flexible coordinate k. With n of them the states begin with n coordinates and n rates of these, and
       the element gives the rates of further states only. Contract 1.2. */
    ODYN_OUT_FLEXIBLE_FORCE = 41
};

/* Continuation of a table outside its points, plus what it is between them (hosts of contract 1.0 know splines only). */
enum { ODYN_CLAMPED = 0, ODYN_PERIODIC = 1 };
enum { ODYN_SPLINE = 0, ODYN_MONOTONE = 16, ODYN_LINEAR = 32, ODYN_STEPS = 48 };

/* `wanted` of `evaluate`: a sum. */
enum { ODYN_WANT_JACOBIAN = 1, ODYN_WANT_SECOND = 2 };

/* A number in a recording. Only the recorder that gave it knows it; one that is zero or from another recording is refused. */
typedef struct odyn_value {
    uint32_t tape;
    uint32_t node;
} odyn_value;

/* A name with an SI unit and a sentence; unit and doc may be null. */
typedef struct odyn_named {
    const char *name;
    const char *unit;
    const char *doc;
} odyn_named;

/* A signal that is taken. `value`: a number as text where a scene connects nothing; null: it must be connected. */
typedef struct odyn_signal {
    const char *name;
    const char *unit;
    const char *doc;
    const char *value;
} odyn_signal;

/* A parameter. All but `name` may be zero. */
typedef struct odyn_parameter {
    const char *name;
    uint32_t kind;
    /* 1: may be left out although there is no default. */
    uint32_t optional;
    /* SI unit; of a curve or function "rad/s -> N m". */
    const char *unit;
    const char *doc;
    /* Default, as it would be written in a scene without units: "0.5", "[0, 0, 1]", "true", "'text'". Null: none. */
    const char *value;
    /* "> 0", ">= 0 and < 1"; null: any number. */
    const char *range;
    /* Texts that are allowed, "slow|fast"; null: any. */
    const char *choices;
    /* Name of a function's variable in expressions; null: x. */
    const char *variable;
} odyn_parameter;

/* A name and a text about it. */
typedef struct odyn_text {
    const char *name;
    const char *text;
} odyn_text;

/* Where a function says what went wrong. The host allocates it, empty. */
typedef struct odyn_error {
    uint32_t size;
    uint32_t reserved;
    char parameter[64];
    char message[1024];
} odyn_error;

/* The parameters of an instance: complete, checked, in SI units. Use the functions odyn_get_... below. */
typedef struct odyn_parameters {
    uint32_t size;
    uint32_t reserved;
    void *context;
    int32_t (*number)(void *context, const char *name, double *value);
    /* Also booleans, as 0 and 1. */
    int32_t (*integer)(void *context, const char *name, int64_t *value);
    int32_t (*text)(void *context, const char *name, const char **value);
    /* Vectors, lists, and curves as argument, value, argument, value, ... */
    int32_t (*numbers)(void *context, const char *name, const double **values, size_t *count);
} odyn_parameters;

/* Takes down the equations of an instance. Use the inline functions below. */
typedef struct odyn_recorder {
    uint32_t size;
    uint32_t reserved;
    void *context;
    odyn_value (*constant)(void *context, double value);
    odyn_value (*input)(void *context, uint32_t input, uint32_t index);
    /* Operands that the operation does not have are ignored. */
    odyn_value (*operation)(void *context, uint32_t code, odyn_value a, odyn_value b, odyn_value x, odyn_value y);
    odyn_value (*power)(void *context, odyn_value a, int32_t n);
    odyn_value (*real_power)(void *context, odyn_value a, double exponent);
    /* The curve through `count` points (argument, value, ...) at `a`; `outside`: ODYN_CLAMPED or ODYN_PERIODIC, plus one of
     * ODYN_SPLINE, ODYN_MONOTONE, ODYN_LINEAR, ODYN_STEPS. */
    odyn_value (*table)(void *context, odyn_value a, const double *points, size_t count, uint32_t outside);
    /* The parameter of kind ODYN_FUNCTION at `x`. */
    odyn_value (*function)(void *context, const char *parameter, odyn_value x);
    void (*result)(void *context, uint32_t role, uint32_t index, odyn_value value);

    /* Contract 1.2: hosts before it have a smaller `size`, and no such function. */
    /* The parameter of kind ODYN_SURFACE at `x` and `y`. */
    odyn_value (*surface)(void *context, const char *parameter, odyn_value x, odyn_value y);
    /* The derivative at `x` of the parameter of kind ODYN_FUNCTION. */
    odyn_value (*slope)(void *context, const char *parameter, odyn_value x);
} odyn_recorder;

/* An element class. Lists are pointer and count; what is zero or null is not there. */
typedef struct odyn_element {
    uint32_t size; /* sizeof(odyn_element) */
    uint32_t kind;
    const char *name;    /* word used in scenes: a-z, 0-9 and -, beginning with a letter */
    const char *summary; /* one sentence */
    const char *doc;     /* manual page, Markdown; may be null */
    uint32_t flags;
    uint32_t angles;   /* angles followed over many turns */
    uint32_t mobility; /* joint coordinates, with ODYN_HAS_MOBILITY */
    uint32_t memory;   /* discrete states */
    const odyn_named *frames; /* in the order of `bodies` in a scene */
    size_t frame_count;
    const char *const *rows; /* names of a joint's rows */
    size_t row_count;
    const odyn_named *channels; /* joint coordinates to report, channels of a force, outputs of a control element */
    size_t channel_count;
    const odyn_named *states; /* continuous states */
    size_t state_count;
    const odyn_signal *inputs; /* signals taken */
    size_t input_count;
    const odyn_named *joints; /* joints whose reactions are taken */
    size_t joint_count;
    const odyn_parameter *parameters;
    size_t parameter_count;
    /* Over which lengths (m) and times (s) the rows of an opaque joint bend, for the host's differences. 0: the largest
     * distance of its frames (1 m where they coincide); 1 s. */
    double difference_length;
    double difference_time;

    /* [create] Builds an instance. Null: instances are null pointers. */
    int32_t (*create)(const odyn_parameters *parameters, void **instance, odyn_error *error);
    /* Frees an instance. May be null. */
    void (*destroy)(void *instance);
    /* [create] Whether an instance of a joint has the row; null: all. */
    int32_t (*uses_row)(const void *instance, uint32_t row);
    /* [create] Writes the states and the memory at the start; they are zero before. Null: they stay zero. */
    void (*start)(const void *instance, double *states, double *memory);
    /* [record] Takes down the equations, once per instance. Needed unless ODYN_OPAQUE. */
    int32_t (*record)(const void *instance, const odyn_recorder *recorder, odyn_error *error);
    /* [hot] Numbers in, numbers out, where the functions odyn_at_... say. Needed with ODYN_OPAQUE. Results that are not
     * written are NaN, which ends a run. */
    int32_t (*evaluate)(const void *instance, const double *inputs, uint32_t wanted, double *results, odyn_error *error);
    /* [between steps] The step that ended here was accepted. May be null. */
    int32_t (*accept)(void *instance, const double *inputs, odyn_error *error);
    /* [between steps] Writes the private memory if it fits into `capacity` bytes, and gives its size. May be null. */
    size_t (*save)(const void *instance, unsigned char *bytes, size_t capacity);
    /* [between steps] Restores it. May be null, with `save`. */
    int32_t (*load)(void *instance, const unsigned char *bytes, size_t count, odyn_error *error);

    /* Contract 1.2. */
    size_t velocity_row_count; /* so many of the rows, the last ones, are on velocities; not with ODYN_OPAQUE */
    /* Values of parameters for `odyn plugin check`, as they would be written in a scene without units. */
    const odyn_text *examples;
    size_t example_count;
    /* Checks of the test kit that do not apply to it ("third-law"), and why. */
    const odyn_text *exempt;
    size_t exempt_count;
    /* Internal unknowns, found from as many conditions at every instant; at most eight; not with ODYN_OPAQUE. */
    const odyn_named *unknowns;
    size_t unknown_count;
    /* [create] Writes where the search for them begins; they are zero before. Null: at zero. */
    void (*guess)(const void *instance, double *unknowns);
    /* What each further frame is, for an element that takes any number of them after `frames`; null: it does not. */
    const odyn_named *more_frames;
    /* Largest number of frames in all, with `more_frames`. */
    uint32_t most_frames;
    uint32_t reserved;
    /* [create] Gives an instance the number of all its frames, after `create`. May refuse a number (the parameter `bodies`).
     * May be null. */
    int32_t (*with_frames)(void *instance, uint32_t count, odyn_error *error);
    /* Conditions under which a force or control element may be used: name, unit of the margin, and what is wrong where it is
     * negative ("is loaded beyond its rating"); not with ODYN_OPAQUE. */
    const odyn_named *checks;
    size_t check_count;
    /* Rows of recommended parameters that a scene picks with `use`, CSV; null: none. */
    const char *catalog;
    /* What reports say of an instance, Markdown; null: nothing. */
    const char *report;
    /* Values that a joint reports besides its channels, which are its coordinates; not with ODYN_OPAQUE. */
    const odyn_named *values;
    size_t value_count;
} odyn_element;

/* What a library exports; made by ODYN_PLUGIN. */
typedef struct odyn_plugin {
    uint32_t size;
    uint32_t abi;
    uint32_t conventions;
    uint32_t reserved;
    const odyn_element *const *elements;
    size_t element_count;
    const char *manifest; /* so that linkers which drop what nobody refers to keep it */
} odyn_plugin;

/* Number of entries of an array. */
#define ODYN_COUNT(array) (sizeof(array) / sizeof((array)[0]))

/* ---- The manifest: what the host reads from the file before it runs anything of it ---- */

#if defined(_MSC_VER)
#pragma section(".odyn", read)
#define ODYN_SECTION __declspec(allocate(".odyn"))
#define ODYN_PUBLIC __declspec(dllexport)
#elif defined(__APPLE__)
#define ODYN_SECTION __attribute__((used, section("__DATA,__odyn")))
#define ODYN_PUBLIC __attribute__((visibility("default")))
#elif defined(_WIN32)
#define ODYN_SECTION __attribute__((used, section(".odyn")))
#define ODYN_PUBLIC __declspec(dllexport)
#else
#define ODYN_SECTION __attribute__((used, section(".odyn")))
#define ODYN_PUBLIC __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
#define ODYN_EXTERN_C extern "C"
#else
#define ODYN_EXTERN_C
#endif

#if defined(__OPTIMIZE__) || defined(NDEBUG)
#define ODYN_PROFILE "release"
#else
#define ODYN_PROFILE "debug"
#endif
#ifdef __SSE4_2__
#define ODYN_SSE "sse4.2 "
#else
#define ODYN_SSE ""
#endif
#ifdef __AVX__
#define ODYN_AVX "avx "
#else
#define ODYN_AVX ""
#endif
#ifdef __AVX2__
#define ODYN_AVX2 "avx2 "
#else
#define ODYN_AVX2 ""
#endif
#ifdef __FMA__
#define ODYN_FMA "fma "
#else
#define ODYN_FMA ""
#endif
#ifdef __AVX512F__
#define ODYN_AVX512 "avx512f "
#else
#define ODYN_AVX512 ""
#endif
#ifdef __ARM_NEON
#define ODYN_NEON "neon "
#else
#define ODYN_NEON ""
#endif

/* The elements as the manifest lists them, for ODYN_PLUGIN: ODYN_LISTS_JOINT("rod") ODYN_LISTS_FORCE("lag"). */
#define ODYN_LISTS_JOINT(name) "element=joint " name "\n"
#define ODYN_LISTS_FORCE(name) "element=force " name "\n"
#define ODYN_LISTS_CONTROL(name) "element=control " name "\n"

#define ODYN_TEXT_OF_(word) #word
#define ODYN_TEXT_OF(word) ODYN_TEXT_OF_(word)

/*
 * Exports a library; once, outside of functions:
 *
 *   ODYN_PLUGIN(bars, "bars", "0.1.0", "Bars and ropes", ODYN_LISTS_JOINT("rod"), &rod)
 *
 * A word of its own for the symbol, then package (a-z, 0-9, - and _), version and a sentence, the list for the manifest, and
 * the addresses of the elements, as many as the list has.
 */
#define ODYN_PLUGIN(word, package, version, about, list, ...)                                                          \
    ODYN_SECTION static const char odyn_manifest_##word[] =                                                            \
        "ODYN-MANIFEST 1\nabi=c" ODYN_TEXT_OF(ODYN_C_ABI) "\nconventions=" ODYN_TEXT_OF(ODYN_CONVENTIONS)              \
        "\ninterface=" ODYN_INTERFACE "\npackage=" package "\nversion=" version "\nabout=" about                       \
        "\nentry=odyn_plugin_c" ODYN_TEXT_OF(ODYN_C_ABI) "_" #word "\nprofile=" ODYN_PROFILE                           \
        "\nfeatures=" ODYN_SSE ODYN_AVX ODYN_AVX2 ODYN_FMA ODYN_AVX512 ODYN_NEON "\n" list "end\n";                    \
    static const odyn_element *const odyn_elements_##word[] = {__VA_ARGS__};                                           \
    static const odyn_plugin odyn_root_##word = {                                                                      \
        sizeof(odyn_plugin),  ODYN_C_ABI,                       ODYN_CONVENTIONS,    0,                                \
        odyn_elements_##word, ODYN_COUNT(odyn_elements_##word), odyn_manifest_##word};                                 \
    ODYN_ENTRY(word)

/* The symbol that the manifest names. Its name ends with the version of the table. */
#define ODYN_ENTRY(word)                                                                                               \
    ODYN_EXTERN_C ODYN_PUBLIC const odyn_plugin *odyn_plugin_c1_##word(void);                                          \
    ODYN_EXTERN_C ODYN_PUBLIC const odyn_plugin *odyn_plugin_c1_##word(void) { return &odyn_root_##word; }

/* ---- Errors and parameters ---- */

/* Writes a message and gives ODYN_FAULT: return odyn_fail(error, "why"); */
static inline int32_t odyn_fail(odyn_error *error, const char *message) {
    snprintf(error->message, sizeof error->message, "%s", message);
    return ODYN_FAULT;
}
/* Refuses a parameter: return odyn_refuse(error, "length", "no rod is that long"); */
static inline int32_t odyn_refuse(odyn_error *error, const char *parameter, const char *message) {
    snprintf(error->parameter, sizeof error->parameter, "%s", parameter);
    snprintf(error->message, sizeof error->message, "%s", message);
    return ODYN_REFUSED;
}

/* A number (also a whole number); where there is none, `otherwise`. Asking for what is not declared fails the instance. */
static inline double odyn_get_number(const odyn_parameters *p, const char *name, double otherwise) {
    double value = otherwise;
    return p->number(p->context, name, &value) == ODYN_OK ? value : otherwise;
}
/* A whole number, or true and false as 1 and 0. */
static inline int64_t odyn_get_integer(const odyn_parameters *p, const char *name, int64_t otherwise) {
    int64_t value = otherwise;
    return p->integer(p->context, name, &value) == ODYN_OK ? value : otherwise;
}
/* A text, to be copied if it is needed after `create`; null where there is none. */
static inline const char *odyn_get_text(const odyn_parameters *p, const char *name) {
    const char *value = NULL;
    return p->text(p->context, name, &value) == ODYN_OK ? value : NULL;
}
/* A vector, list or curve, to be copied if it is needed after `create`; gives how many numbers it has. */
static inline size_t odyn_get_numbers(const odyn_parameters *p, const char *name, const double **values) {
    size_t count = 0;
    *values = NULL;
    return p->numbers(p->context, name, values, &count) == ODYN_OK ? count : 0;
}

/* ---- Numbers in a recording ---- */

typedef const odyn_recorder *odyn_tape;

static inline odyn_value odyn_constant(odyn_tape o, double value) { return o->constant(o->context, value); }
static inline odyn_value odyn_input(odyn_tape o, uint32_t input, uint32_t index) {
    return o->input(o->context, input, index);
}
static inline odyn_value odyn_unary(odyn_tape o, uint32_t code, odyn_value a) {
    return o->operation(o->context, code, a, a, a, a);
}
static inline odyn_value odyn_binary(odyn_tape o, uint32_t code, odyn_value a, odyn_value b) {
    return o->operation(o->context, code, a, b, a, a);
}
static inline odyn_value odyn_add(odyn_tape o, odyn_value a, odyn_value b) { return odyn_binary(o, ODYN_OP_ADD, a, b); }
static inline odyn_value odyn_sub(odyn_tape o, odyn_value a, odyn_value b) { return odyn_binary(o, ODYN_OP_SUB, a, b); }
static inline odyn_value odyn_mul(odyn_tape o, odyn_value a, odyn_value b) { return odyn_binary(o, ODYN_OP_MUL, a, b); }
static inline odyn_value odyn_div(odyn_tape o, odyn_value a, odyn_value b) { return odyn_binary(o, ODYN_OP_DIV, a, b); }
static inline odyn_value odyn_neg(odyn_tape o, odyn_value a) { return odyn_unary(o, ODYN_OP_NEG, a); }
static inline odyn_value odyn_sqrt(odyn_tape o, odyn_value a) { return odyn_unary(o, ODYN_OP_SQRT, a); }
static inline odyn_value odyn_sin(odyn_tape o, odyn_value a) { return odyn_unary(o, ODYN_OP_SIN, a); }
static inline odyn_value odyn_cos(odyn_tape o, odyn_value a) { return odyn_unary(o, ODYN_OP_COS, a); }
/* Angle of the point (x, y). */
static inline odyn_value odyn_atan2(odyn_tape o, odyn_value y, odyn_value x) {
    return odyn_binary(o, ODYN_OP_ATAN2, y, x);
}
static inline odyn_value odyn_exp(odyn_tape o, odyn_value a) { return odyn_unary(o, ODYN_OP_EXP, a); }
static inline odyn_value odyn_ln(odyn_tape o, odyn_value a) { return odyn_unary(o, ODYN_OP_LN, a); }
static inline odyn_value odyn_tanh(odyn_tape o, odyn_value a) { return odyn_unary(o, ODYN_OP_TANH, a); }
static inline odyn_value odyn_powi(odyn_tape o, odyn_value a, int32_t n) { return o->power(o->context, a, n); }
static inline odyn_value odyn_powf(odyn_tape o, odyn_value a, double exponent) {
    return o->real_power(o->context, a, exponent);
}
/* x where a < b, otherwise y. The only way to switch: values can't be looked at. */
static inline odyn_value odyn_select(odyn_tape o, odyn_value a, odyn_value b, odyn_value x, odyn_value y) {
    return o->operation(o->context, ODYN_OP_SELECT, a, b, x, y);
}
static inline odyn_value odyn_min(odyn_tape o, odyn_value a, odyn_value b) { return odyn_select(o, a, b, a, b); }
static inline odyn_value odyn_max(odyn_tape o, odyn_value a, odyn_value b) { return odyn_select(o, a, b, b, a); }
static inline odyn_value odyn_abs(odyn_tape o, odyn_value a) {
    return odyn_select(o, a, odyn_constant(o, 0.0), odyn_neg(o, a), a);
}
/* Value times number, value plus number. */
static inline odyn_value odyn_scale(odyn_tape o, odyn_value a, double by) { return odyn_mul(o, a, odyn_constant(o, by)); }
static inline odyn_value odyn_shift(odyn_tape o, odyn_value a, double by) { return odyn_add(o, a, odyn_constant(o, by)); }

/* ---- What the host provides ---- */

static inline odyn_value odyn_time(odyn_tape o) { return odyn_input(o, ODYN_IN_TIME, 0); }
static inline odyn_value odyn_state(odyn_tape o, uint32_t k) { return odyn_input(o, ODYN_IN_STATE, k); }
static inline odyn_value odyn_memory(odyn_tape o, uint32_t k) { return odyn_input(o, ODYN_IN_MEMORY, k); }
static inline odyn_value odyn_signal_taken(odyn_tape o, uint32_t k) { return odyn_input(o, ODYN_IN_SIGNAL, k); }
/* Internal unknown. */
static inline odyn_value odyn_unknown(odyn_tape o, uint32_t k) { return odyn_input(o, ODYN_IN_UNKNOWN, k); }
/* Joint coordinate of the mobility. */
static inline odyn_value odyn_coordinate(odyn_tape o, uint32_t k) { return odyn_input(o, ODYN_IN_COORDINATE, k); }

/* ---- Vectors ---- */

typedef struct odyn_vector {
    odyn_value x, y, z;
} odyn_vector;

static inline odyn_vector odyn_vector_of(odyn_value x, odyn_value y, odyn_value z) {
    odyn_vector v;
    v.x = x;
    v.y = y;
    v.z = z;
    return v;
}
static inline odyn_vector odyn_input_vector(odyn_tape o, uint32_t input, uint32_t of) {
    odyn_vector v;
    v.x = odyn_input(o, input, 3 * of);
    v.y = odyn_input(o, input, 3 * of + 1);
    v.z = odyn_input(o, input, 3 * of + 2);
    return v;
}
static inline odyn_vector odyn_position(odyn_tape o, uint32_t frame) {
    return odyn_input_vector(o, ODYN_IN_POSITION, frame);
}
static inline odyn_vector odyn_velocity(odyn_tape o, uint32_t frame) {
    return odyn_input_vector(o, ODYN_IN_VELOCITY, frame);
}
static inline odyn_vector odyn_angular_velocity(odyn_tape o, uint32_t frame) {
    return odyn_input_vector(o, ODYN_IN_ANGULAR_VELOCITY, frame);
}
static inline odyn_vector odyn_reaction_force(odyn_tape o, uint32_t joint) {
    return odyn_input_vector(o, ODYN_IN_REACTION_FORCE, joint);
}
static inline odyn_vector odyn_reaction_torque(odyn_tape o, uint32_t joint) {
    return odyn_input_vector(o, ODYN_IN_REACTION_TORQUE, joint);
}
/* Axis 0, 1, 2 (x, y, z) of a frame: a unit vector in the ground frame. */
static inline odyn_vector odyn_axis(odyn_tape o, uint32_t frame, uint32_t axis) {
    odyn_vector v;
    v.x = odyn_input(o, ODYN_IN_ROTATION, 9 * frame + axis);
    v.y = odyn_input(o, ODYN_IN_ROTATION, 9 * frame + 3 + axis);
    v.z = odyn_input(o, ODYN_IN_ROTATION, 9 * frame + 6 + axis);
    return v;
}
static inline odyn_vector odyn_vec_add(odyn_tape o, odyn_vector a, odyn_vector b) {
    return odyn_vector_of(odyn_add(o, a.x, b.x), odyn_add(o, a.y, b.y), odyn_add(o, a.z, b.z));
}
static inline odyn_vector odyn_vec_sub(odyn_tape o, odyn_vector a, odyn_vector b) {
    return odyn_vector_of(odyn_sub(o, a.x, b.x), odyn_sub(o, a.y, b.y), odyn_sub(o, a.z, b.z));
}
static inline odyn_vector odyn_vec_neg(odyn_tape o, odyn_vector a) {
    return odyn_vector_of(odyn_neg(o, a.x), odyn_neg(o, a.y), odyn_neg(o, a.z));
}
static inline odyn_vector odyn_vec_scale(odyn_tape o, odyn_vector a, odyn_value by) {
    return odyn_vector_of(odyn_mul(o, a.x, by), odyn_mul(o, a.y, by), odyn_mul(o, a.z, by));
}
static inline odyn_value odyn_dot(odyn_tape o, odyn_vector a, odyn_vector b) {
    return odyn_add(o, odyn_add(o, odyn_mul(o, a.x, b.x), odyn_mul(o, a.y, b.y)), odyn_mul(o, a.z, b.z));
}
static inline odyn_vector odyn_cross(odyn_tape o, odyn_vector a, odyn_vector b) {
    return odyn_vector_of(odyn_sub(o, odyn_mul(o, a.y, b.z), odyn_mul(o, a.z, b.y)),
                          odyn_sub(o, odyn_mul(o, a.z, b.x), odyn_mul(o, a.x, b.z)),
                          odyn_sub(o, odyn_mul(o, a.x, b.y), odyn_mul(o, a.y, b.x)));
}
/* Length; its derivative at zero length is undefined. */
static inline odyn_value odyn_length(odyn_tape o, odyn_vector a) { return odyn_sqrt(o, odyn_dot(o, a, a)); }
/* Components in the axes of a frame -> components in the ground frame. */
static inline odyn_vector odyn_rotate(odyn_tape o, uint32_t frame, odyn_vector local) {
    odyn_vector x = odyn_vec_scale(o, odyn_axis(o, frame, 0), local.x);
    odyn_vector y = odyn_vec_scale(o, odyn_axis(o, frame, 1), local.y);
    odyn_vector z = odyn_vec_scale(o, odyn_axis(o, frame, 2), local.z);
    return odyn_vec_add(o, odyn_vec_add(o, x, y), z);
}
/* Components in the ground frame -> components in the axes of a frame. */
static inline odyn_vector odyn_rotate_back(odyn_tape o, uint32_t frame, odyn_vector v) {
    return odyn_vector_of(odyn_dot(o, odyn_axis(o, frame, 0), v), odyn_dot(o, odyn_axis(o, frame, 1), v),
                          odyn_dot(o, odyn_axis(o, frame, 2), v));
}

/* ---- Results ---- */

static inline void odyn_result(odyn_tape o, uint32_t role, uint32_t index, odyn_value value) {
    o->result(o->context, role, index, value);
}
static inline void odyn_row(odyn_tape o, uint32_t row, odyn_value value) { odyn_result(o, ODYN_OUT_ROW, row, value); }
/* A row on velocities: rolling without slip, a blade. */
static inline void odyn_velocity_row(odyn_tape o, uint32_t row, odyn_value value) {
    odyn_result(o, ODYN_OUT_VELOCITY_ROW, row, value);
}
/* A row that only pushes: a contact, a stop, a freewheel. */
static inline void odyn_unilateral(odyn_tape o, uint32_t row, double restitution) {
    odyn_result(o, ODYN_OUT_UNILATERAL, row, odyn_constant(o, restitution));
}
/* A row that holds only while the unilateral row `with` is closed. */
static inline void odyn_sticks_with(odyn_tape o, uint32_t row, uint32_t with) {
    odyn_result(o, ODYN_OUT_STICKS_WITH, row, odyn_constant(o, (double)with));
}
/* A row on velocities that holds up to a limit, and slides beyond: dry friction, a brake, a clutch. */
static inline void odyn_limit(odyn_tape o, uint32_t row, odyn_value limit) {
    odyn_result(o, ODYN_OUT_LIMIT, row, limit);
}
/* A row with a limit, and the row `with` that shares it: friction in a plane. */
static inline void odyn_slides_with(odyn_tape o, uint32_t row, uint32_t with) {
    odyn_result(o, ODYN_OUT_SLIDES_WITH, row, odyn_constant(o, (double)with));
}
/* The element samples: its memory changes at the start and at whole multiples of the period only. */
static inline void odyn_sample_period(odyn_tape o, double period) {
    odyn_result(o, ODYN_OUT_SAMPLE_PERIOD, 0, odyn_constant(o, period));
}
static inline void odyn_report_coordinate(odyn_tape o, uint32_t k, odyn_value value) {
    odyn_result(o, ODYN_OUT_COORDINATE, k, value);
}
/* Condition on the internal unknowns: zero. */
static inline void odyn_condition(odyn_tape o, uint32_t k, odyn_value value) {
    odyn_result(o, ODYN_OUT_CONDITION, k, value);
}
/* Margin of a check, positive while all is well. */
static inline void odyn_check(odyn_tape o, uint32_t k, odyn_value margin) { odyn_result(o, ODYN_OUT_CHECK, k, margin); }
static inline void odyn_channel(odyn_tape o, uint32_t k, odyn_value value) { odyn_result(o, ODYN_OUT_CHANNEL, k, value); }
static inline void odyn_rate(odyn_tape o, uint32_t k, odyn_value value) { odyn_result(o, ODYN_OUT_RATE, k, value); }
static inline void odyn_next_memory(odyn_tape o, uint32_t k, odyn_value value) {
    odyn_result(o, ODYN_OUT_MEMORY, k, value);
}
static inline void odyn_potential(odyn_tape o, odyn_value value) { odyn_result(o, ODYN_OUT_POTENTIAL, 0, value); }
static inline void odyn_dissipation(odyn_tape o, odyn_value value) { odyn_result(o, ODYN_OUT_DISSIPATION, 0, value); }
/* Kinetic energy of mass that the element brings. */
static inline void odyn_kinetic(odyn_tape o, odyn_value value) { odyn_result(o, ODYN_OUT_KINETIC, 0, value); }
/* Force on flexible coordinate k: state k, whose rate is state n + k of n of them. */
static inline void odyn_flexible_force(odyn_tape o, uint32_t k, odyn_value force) {
    odyn_result(o, ODYN_OUT_FLEXIBLE_FORCE, k, force);
}
static inline void odyn_result_vector(odyn_tape o, uint32_t role, uint32_t of, odyn_vector v) {
    odyn_result(o, role, 3 * of, v.x);
    odyn_result(o, role, 3 * of + 1, v.y);
    odyn_result(o, role, 3 * of + 2, v.z);
}
/* A force on the body of a frame, at the frame's origin; a torque on it. */
static inline void odyn_force(odyn_tape o, uint32_t frame, odyn_vector force) {
    odyn_result_vector(o, ODYN_OUT_FORCE, frame, force);
}
static inline void odyn_torque(odyn_tape o, uint32_t frame, odyn_vector torque) {
    odyn_result_vector(o, ODYN_OUT_TORQUE, frame, torque);
}
/* `force` at the origin of frame j, and its opposite on the body of frame i along the same line. Of a force between the two
 * origins (springs, dampers) the moment on i is zero, which the host cannot see: two calls of `odyn_force` cost a part of it. */
static inline void odyn_force_pair(odyn_tape o, uint32_t i, uint32_t j, odyn_vector force) {
    odyn_vector lever = odyn_vec_sub(o, odyn_position(o, j), odyn_position(o, i));
    odyn_vector back = odyn_vec_neg(o, force);
    odyn_force(o, j, force);
    odyn_force(o, i, back);
    odyn_torque(o, i, odyn_cross(o, lever, back));
}
/* `torque` on the body of frame j, its opposite on that of frame i. */
static inline void odyn_torque_pair(odyn_tape o, uint32_t i, uint32_t j, odyn_vector torque) {
    odyn_torque(o, j, torque);
    odyn_torque(o, i, odyn_vec_neg(o, torque));
}
/* Angle number k from its sine and cosine, followed over many turns. */
static inline odyn_value odyn_angle(odyn_tape o, uint32_t k, odyn_value sine, odyn_value cosine) {
    odyn_value reference = odyn_input(o, ODYN_IN_ANGLE_REFERENCE, k);
    odyn_value sr = odyn_sin(o, reference), cr = odyn_cos(o, reference);
    odyn_value ahead = odyn_atan2(o, odyn_sub(o, odyn_mul(o, sine, cr), odyn_mul(o, cosine, sr)),
                                  odyn_add(o, odyn_mul(o, cosine, cr), odyn_mul(o, sine, sr)));
    odyn_value angle = odyn_add(o, reference, ahead);
    odyn_result(o, ODYN_OUT_ANGLE, k, angle);
    return angle;
}
/* Angle number k by which frame j is turned against frame i about their common z axis. */
static inline odyn_value odyn_angle_about_z(odyn_tape o, uint32_t k, uint32_t i, uint32_t j) {
    odyn_vector x = odyn_axis(o, j, 0);
    return odyn_angle(o, k, odyn_dot(o, x, odyn_axis(o, i, 1)), odyn_dot(o, x, odyn_axis(o, i, 0)));
}
/* Three rows from `row` on: the origins coincide, in the axes of frame i. */
static inline void odyn_rows_coincident(odyn_tape o, uint32_t row, uint32_t i, uint32_t j) {
    odyn_vector d = odyn_rotate_back(o, i, odyn_vec_sub(o, odyn_position(o, j), odyn_position(o, i)));
    odyn_row(o, row, d.x);
    odyn_row(o, row + 1, d.y);
    odyn_row(o, row + 2, d.z);
}
/* Two rows from `row` on: the z axes are parallel. */
static inline void odyn_rows_parallel_z(odyn_tape o, uint32_t row, uint32_t i, uint32_t j) {
    odyn_vector z = odyn_axis(o, j, 2);
    odyn_row(o, row, odyn_dot(o, odyn_axis(o, i, 0), z));
    odyn_row(o, row + 1, odyn_dot(o, odyn_axis(o, i, 1), z));
}

/* ---- Where the numbers of an opaque element are ----
 *
 * Inputs: time; angle references; states; memory; signals; per joint reaction force (3) and torque (3); per frame position
 * (3), rotation (9, row after row), velocity (3), angular velocity (3).
 *
 * Results of a joint, with n = rows used + channels: values (n); with ODYN_GIVES_DERIVATIVES also, as far as `wanted` says,
 * derivatives (n times 6 per frame: shift of the origin in ground directions, rotation about the frame's own axes),
 * derivative by time (n), second derivative along the motion without accelerations (n); then the angles.
 * Results of a force or control element: forces (3 per frame), torques (3 per frame), rates, next memory, channels,
 * potential, dissipation, angles. The loads of a control element are zeros already.
 */

static inline size_t odyn_at_reference(const odyn_element *e, size_t k) {
    (void)e;
    return 1 + k;
}
static inline size_t odyn_at_state(const odyn_element *e, size_t k) { return 1 + e->angles + k; }
static inline size_t odyn_at_memory(const odyn_element *e, size_t k) { return 1 + e->angles + e->state_count + k; }
static inline size_t odyn_at_signal(const odyn_element *e, size_t k) { return odyn_at_memory(e, e->memory) + k; }
static inline size_t odyn_at_reaction(const odyn_element *e, size_t joint) {
    return odyn_at_signal(e, e->input_count) + 6 * joint;
}
/* Where a frame begins: its position; its rotation is 3, its velocity 12, its angular velocity 15 further. */
static inline size_t odyn_at_frame(const odyn_element *e, size_t frame) {
    return odyn_at_reaction(e, e->joint_count) + 18 * frame;
}
/* Results of a joint with n values. */
static inline size_t odyn_at_derivative(const odyn_element *e, size_t n, size_t value, size_t frame) {
    return n + value * 6 * e->frame_count + 6 * frame;
}
static inline size_t odyn_at_time_derivative(const odyn_element *e, size_t n, size_t value) {
    return n * (1 + 6 * e->frame_count) + value;
}
static inline size_t odyn_at_second(const odyn_element *e, size_t n, size_t value) {
    return n * (2 + 6 * e->frame_count) + value;
}
static inline size_t odyn_at_joint_angle(const odyn_element *e, size_t n, size_t k) {
    return n * (3 + 6 * e->frame_count) + k;
}
/* Results of a force or control element. */
static inline size_t odyn_at_force(const odyn_element *e, size_t frame) {
    (void)e;
    return 3 * frame;
}
static inline size_t odyn_at_torque(const odyn_element *e, size_t frame) { return 3 * e->frame_count + 3 * frame; }
static inline size_t odyn_at_rate(const odyn_element *e, size_t k) { return 6 * e->frame_count + k; }
static inline size_t odyn_at_next_memory(const odyn_element *e, size_t k) { return odyn_at_rate(e, e->state_count) + k; }
static inline size_t odyn_at_channel(const odyn_element *e, size_t k) { return odyn_at_next_memory(e, e->memory) + k; }
static inline size_t odyn_at_potential(const odyn_element *e) { return odyn_at_channel(e, e->channel_count); }
static inline size_t odyn_at_dissipation(const odyn_element *e) { return odyn_at_potential(e) + 1; }
static inline size_t odyn_at_angle(const odyn_element *e, size_t k) { return odyn_at_potential(e) + 2 + k; }

#ifdef __cplusplus
}
#endif

#endif
