/* An FMU by hand, as small as the tests need it, for FMI 2.0 and (with -DTHREE) FMI 3.0.

   mode 0: a PI controller that computes once per communication step, I += ki T (set_point - measured), u = kp e + I.
   mode 1: a mass of ki kg on a spring of kp N/m, whose other end `measured` is; u is the force of the spring on that end. */

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum { SET_POINT, MEASURED, U, KP, KI, FAULT, MODE, LABEL, STEPS };
enum { OK, WARNING, DISCARD, ERROR, FATAL };

typedef struct {
    double value[5];
    double integral, x, v;
    int fault, mode, steps, ends, kind;
    char label[32];
} model;

typedef struct {
    model now;
    void *environment;
    void (*log)(void);
} instance;

static int step(model *m, double t, double h) {
    double error = m->value[SET_POINT] - m->value[MEASURED];
    int k, n = 64;
    m->steps += 1;
    if (m->fault != 0 && t > 0.0995) {
        switch (m->fault) {
        case 5:
            m->ends = 1;
            return DISCARD;
        case 6:
            m->value[U] = NAN;
            return OK;
        case 7:
            *(volatile int *)8 = 1;
            return OK;
        default:
            return m->fault;
        }
    }
    if (m->mode == 0) {
        m->integral = m->integral + error * (m->value[KI] * h);
        m->value[U] = error * m->value[KP] + m->integral;
        return OK;
    }
    for (k = 0; k < n; ++k) {
        double d = h / n, w = m->value[KP] / m->value[KI], a = m->value[MEASURED];
        double x = m->x, v = m->v;
        double k1x = v, k1v = w * (a - x);
        double k2x = v + d / 2 * k1v, k2v = w * (a - (x + d / 2 * k1x));
        double k3x = v + d / 2 * k2v, k3v = w * (a - (x + d / 2 * k2x));
        double k4x = v + d * k3v, k4v = w * (a - (x + d * k3x));
        m->x = x + d / 6 * (k1x + 2 * k2x + 2 * k3x + k4x);
        m->v = v + d / 6 * (k1v + 2 * k2v + 2 * k3v + k4v);
    }
    m->value[U] = m->value[KP] * (m->x - m->value[MEASURED]);
    return OK;
}

static int set(model *m, unsigned reference, double value) {
    if (reference <= KI) {
        m->value[reference] = value;
    } else if (reference == FAULT) {
        m->fault = (int)value;
    } else if (reference == MODE) {
        m->mode = (int)value;
    } else {
        return ERROR;
    }
    return OK;
}

static instance *make(void) {
    instance *made = calloc(1, sizeof *made);
    made->now.value[KP] = 1.0;
    made->now.x = 0.0;
    return made;
}

#ifdef THREE
#define NAME(name) fmi3##name
typedef void (*logger)(void *, int, const char *, const char *);
#else
#define NAME(name) fmi2##name
typedef void (*logger)(void *, const char *, int, const char *, const char *, ...);
#endif

static int say(instance *it, int status, const char *text) {
    if (status == OK || it->log == NULL) {
        return status;
    }
#ifdef THREE
    ((logger)it->log)(it->environment, status, "logStatusError", text);
#else
    ((logger)it->log)(it->environment, "it", status, "logStatusError", text);
#endif
    return status;
}

#ifdef THREE
int fmi3SetFloat64(void *c, const unsigned *r, size_t n, const double *v, size_t m) {
    (void)n; (void)m;
    return set(&((instance *)c)->now, *r, *v);
}
int fmi3GetFloat64(void *c, const unsigned *r, size_t n, double *v, size_t m) {
    (void)n; (void)m;
    *v = ((instance *)c)->now.value[*r];
    return OK;
}
int fmi3SetInt32(void *c, const unsigned *r, size_t n, const int *v, size_t m) {
    (void)n; (void)m;
    return set(&((instance *)c)->now, *r, *v);
}
int fmi3GetInt32(void *c, const unsigned *r, size_t n, int *v, size_t m) {
    (void)r; (void)n; (void)m;
    *v = ((instance *)c)->now.steps;
    return OK;
}
int fmi3SetString(void *c, const unsigned *r, size_t n, const char *const *v, size_t m) {
    (void)r; (void)n; (void)m;
    strncpy(((instance *)c)->now.label, *v, 31);
    return OK;
}
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
    bool events, bool early, const unsigned *required, size_t n, void *environment, logger log, void *update) {
    instance *made;
    (void)name; (void)resources; (void)visible; (void)logging; (void)events; (void)early; (void)required; (void)n; (void)update;
    if (strcmp(token, "{the-token}") != 0) {
        return NULL;
    }
    made = make();
    made->environment = environment;
    made->log = (void (*)(void))log;
    return made;
}
int fmi3EnterInitializationMode(void *c, bool t, double tol, double start, bool stops, double stop) {
    (void)c; (void)t; (void)tol; (void)start; (void)stops; (void)stop;
    return OK;
}
int fmi3DoStep(void *c, double t, double h, bool never, bool *event, bool *ends, bool *early, double *last) {
    instance *it = c;
    int status = step(&it->now, t, h);
    (void)never;
    *event = *early = false;
    *last = t + h;
    *ends = it->now.ends;
    return say(it, it->now.ends ? OK : status, "the step cannot be made");
}
#else
int fmi2SetReal(void *c, const unsigned *r, size_t n, const double *v) {
    (void)n;
    return set(&((instance *)c)->now, *r, *v);
}
int fmi2GetReal(void *c, const unsigned *r, size_t n, double *v) {
    (void)n;
    *v = ((instance *)c)->now.value[*r];
    return OK;
}
int fmi2SetInteger(void *c, const unsigned *r, size_t n, const int *v) {
    (void)n;
    return set(&((instance *)c)->now, *r, *v);
}
int fmi2GetInteger(void *c, const unsigned *r, size_t n, int *v) {
    (void)r; (void)n;
    *v = ((instance *)c)->now.steps;
    return OK;
}
int fmi2SetBoolean(void *c, const unsigned *r, size_t n, const int *v) {
    (void)c; (void)r; (void)n; (void)v;
    return ERROR;
}
int fmi2GetBoolean(void *c, const unsigned *r, size_t n, int *v) {
    (void)c; (void)r; (void)n; (void)v;
    return ERROR;
}
int fmi2SetString(void *c, const unsigned *r, size_t n, const char *const *v) {
    (void)r; (void)n;
    strncpy(((instance *)c)->now.label, *v, 31);
    return OK;
}
typedef struct {
    void (*logger)(void);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void);
    void *environment;
} callbacks;
void *fmi2Instantiate(const char *name, int type, const char *token, const char *resources, const callbacks *f, int visible, int log) {
    instance *made;
    (void)name; (void)resources; (void)visible; (void)log;
    if (type != 1 || strcmp(token, "{the-token}") != 0) {
        return NULL;
    }
    made = make();
    made->environment = f->environment;
    made->log = f->logger;
    return made;
}
int fmi2SetupExperiment(void *c, int t, double tol, double start, int stops, double stop) {
    (void)c; (void)t; (void)tol; (void)start; (void)stops; (void)stop;
    return OK;
}
int fmi2EnterInitializationMode(void *c) {
    (void)c;
    return OK;
}
int fmi2DoStep(void *c, double t, double h, int never) {
    instance *it = c;
    (void)never;
    return say(it, step(&it->now, t, h), "the step cannot be made");
}
int fmi2GetBooleanStatus(void *c, int kind, int *value) {
    *value = kind == 3 && ((instance *)c)->now.ends;
    return OK;
}
#endif

int NAME(ExitInitializationMode)(void *c) {
    (void)c;
    return OK;
}
int NAME(Terminate)(void *c) {
    (void)c;
    return OK;
}
void NAME(FreeInstance)(void *c) {
    free(c);
}
#ifdef THREE
#define STATE(name) fmi3##name##FMUState
#define SERIALIZED_SIZE fmi3SerializedFMUStateSize
#define SERIALIZE fmi3SerializeFMUState
#define DESERIALIZE fmi3DeserializeFMUState
#else
#define STATE(name) fmi2##name##FMUstate
#define SERIALIZED_SIZE fmi2SerializedFMUstateSize
#define SERIALIZE fmi2SerializeFMUstate
#define DESERIALIZE fmi2DeSerializeFMUstate
#endif
int STATE(Get)(void *c, void **state) {
    *state = malloc(sizeof(model));
    memcpy(*state, &((instance *)c)->now, sizeof(model));
    return OK;
}
int STATE(Set)(void *c, void *state) {
    memcpy(&((instance *)c)->now, state, sizeof(model));
    return OK;
}
int STATE(Free)(void *c, void **state) {
    (void)c;
    free(*state);
    *state = NULL;
    return OK;
}
int SERIALIZED_SIZE(void *c, void *state, size_t *size) {
    (void)c; (void)state;
    *size = sizeof(model);
    return OK;
}
int SERIALIZE(void *c, void *state, unsigned char *bytes, size_t size) {
    (void)c;
    memcpy(bytes, state, size);
    return OK;
}
int DESERIALIZE(void *c, const unsigned char *bytes, size_t size, void **state) {
    (void)c;
    *state = malloc(size);
    memcpy(*state, bytes, size);
    return OK;
}
