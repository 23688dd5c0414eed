
/* ---- FMI 2.0 ---- */

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
typedef struct {
    fmi2CallbackLogger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;
typedef struct {
    fmi2Boolean newDiscreteStatesNeeded;
    fmi2Boolean terminateSimulation;
    fmi2Boolean nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged;
    fmi2Boolean nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

#define IT(c) instance *const it = (instance *)(c)
#define STATUS(done) ((done) ? fmi2OK : fmi2Error)
#define STATUS_OF(kind) ((kind) == ERROR ? fmi2Error : (kind) == WARNING ? fmi2Warning : fmi2OK)

static void say(const instance *it, enum kind kind, const char *format, ...) {
    static const char *const categories[] = {"logAll", "logStatusWarning", "logStatusError"};
    char text[512];
    va_list arguments;
    fmi2CallbackLogger logger;
    if (it->log == NULL || (kind == INFORMATION && !it->shows_log)) {
        return;
    }
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    logger = (fmi2CallbackLogger)it->log;
    logger(it->environment, it->name, STATUS_OF(kind), categories[kind], "%s", text);
}

PUBLIC const char *fmi2GetTypesPlatform(void);
PUBLIC const char *fmi2GetTypesPlatform(void) {
    return "default";
}

PUBLIC const char *fmi2GetVersion(void);
PUBLIC const char *fmi2GetVersion(void) {
    return "2.0";
}

#define DECLARED(result, name, arguments) \
    PUBLIC result name arguments; \
    PUBLIC result name arguments

DECLARED(fmi2Component, fmi2Instantiate, (fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
    const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)) {
    instance *it = make(name);
    UNUSED(resources);
    UNUSED(visible);
    if (it == NULL) {
        return NULL;
    }
    it->shows_log = logging;
    it->is_exchange = type == fmi2ModelExchange;
    if (functions != NULL) {
        it->environment = functions->componentEnvironment;
        it->log = (void (*)(void))functions->logger;
    }
    if (guid == NULL || strcmp(guid, "@guid@") != 0) {
        say(it, ERROR, "the GUID is not that of this machine");
        discard(it);
        return NULL;
    }
    return it;
}

DECLARED(fmi2Status, fmi2SetupExperiment, (fmi2Component c, fmi2Boolean is_tolerance, fmi2Real tolerance, fmi2Real start,
    fmi2Boolean is_stop, fmi2Real stop)) {
    IT(c);
    return STATUS(initialise(it, start, is_tolerance, tolerance, is_stop ? stop : HUGE_VAL));
}

DECLARED(fmi2Status, fmi2EnterInitializationMode, (fmi2Component c)) {
    IT(c);
    it->now.phase = INITIALISING;
    return fmi2OK;
}

DECLARED(fmi2Status, fmi2GetReal, (fmi2Component c, const fmi2ValueReference references[], size_t number, fmi2Real values[])) {
    IT(c);
    size_t k;
    for (k = 0; k < number; ++k) {
        if (!get(it, references[k], values + k)) {
            return fmi2Error;
        }
    }
    return fmi2OK;
}

DECLARED(fmi2Status, fmi2SetReal, (fmi2Component c, const fmi2ValueReference references[], size_t number, const fmi2Real values[])) {
    IT(c);
    size_t k;
    for (k = 0; k < number; ++k) {
        if (!set(it, references[k], values[k])) {
            return fmi2Error;
        }
    }
    return fmi2OK;
}

/* There are no variables of other types. */
#define NONE_OF(type) \
    DECLARED(fmi2Status, fmi2Get##type, (fmi2Component c, const fmi2ValueReference references[], size_t number, \
        fmi2##type values[])) { \
        UNUSED(c); \
        UNUSED(references); \
        UNUSED(values); \
        return number == 0 ? fmi2OK : fmi2Error; \
    } \
    DECLARED(fmi2Status, fmi2Set##type, (fmi2Component c, const fmi2ValueReference references[], size_t number, \
        const fmi2##type values[])) { \
        UNUSED(c); \
        UNUSED(references); \
        UNUSED(values); \
        return number == 0 ? fmi2OK : fmi2Error; \
    }
NONE_OF(Integer)
NONE_OF(Boolean)
NONE_OF(String)

DECLARED(fmi2Status, fmi2GetFMUstate, (fmi2Component c, fmi2FMUstate *state)) {
    return STATUS(save((instance *)c, state));
}

DECLARED(fmi2Status, fmi2SetFMUstate, (fmi2Component c, fmi2FMUstate state)) {
    IT(c);
    if (state == NULL) {
        return fmi2Error;
    }
    memcpy(&it->now, state, sizeof it->now);
    return fmi2OK;
}

DECLARED(fmi2Status, fmi2FreeFMUstate, (fmi2Component c, fmi2FMUstate *state)) {
    UNUSED(c);
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

DECLARED(fmi2Status, fmi2SerializedFMUstateSize, (fmi2Component c, fmi2FMUstate state, size_t *size)) {
    UNUSED(c);
    UNUSED(state);
    *size = SAVED_SIZE;
    return fmi2OK;
}

DECLARED(fmi2Status, fmi2SerializeFMUstate, (fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)) {
    UNUSED(c);
    return STATUS(serialise(state, bytes, size));
}

DECLARED(fmi2Status, fmi2DeSerializeFMUstate, (fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)) {
    return STATUS(deserialise((instance *)c, bytes, size, state));
}

DECLARED(fmi2Status, fmi2GetDirectionalDerivative, (fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
    const fmi2ValueReference known[], size_t knowns, const fmi2Real seed[], fmi2Real sensitivity[])) {
    return STATUS(directional((instance *)c, unknown, unknowns, known, knowns, seed, sensitivity));
}

/* ---- co-simulation ---- */

DECLARED(fmi2Status, fmi2SetRealInputDerivatives, (fmi2Component c, const fmi2ValueReference references[], size_t number,
    const fmi2Integer orders[], const fmi2Real values[])) {
    UNUSED(c);
    UNUSED(references);
    UNUSED(orders);
    UNUSED(values);
    return number == 0 ? fmi2OK : fmi2Error;
}

DECLARED(fmi2Status, fmi2GetRealOutputDerivatives, (fmi2Component c, const fmi2ValueReference references[], size_t number,
    const fmi2Integer orders[], fmi2Real values[])) {
    UNUSED(c);
    UNUSED(references);
    UNUSED(orders);
    UNUSED(values);
    return number == 0 ? fmi2OK : fmi2Error;
}

DECLARED(fmi2Status, fmi2DoStep, (fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_set_state)) {
    IT(c);
    enum kind kind;
    UNUSED(no_set_state);
    kind = advance(it, time, step);
    return STATUS_OF(kind);
}

DECLARED(fmi2Status, fmi2CancelStep, (fmi2Component c)) {
    UNUSED(c);
    return fmi2Error;
}

DECLARED(fmi2Status, fmi2GetStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)) {
    UNUSED(c);
    UNUSED(kind);
    UNUSED(value);
    return fmi2Discard;
}

DECLARED(fmi2Status, fmi2GetRealStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)) {
    IT(c);
    if (kind != fmi2LastSuccessfulTime) {
        return fmi2Discard;
    }
    *value = it->now.machine.time;
    return fmi2OK;
}

DECLARED(fmi2Status, fmi2GetIntegerStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)) {
    UNUSED(c);
    UNUSED(kind);
    UNUSED(value);
    return fmi2Discard;
}

DECLARED(fmi2Status, fmi2GetBooleanStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)) {
    UNUSED(c);
    if (kind != fmi2Terminated) {
        return fmi2Discard;
    }
    *value = 0;
    return fmi2OK;
}

DECLARED(fmi2Status, fmi2GetStringStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2String *value)) {
    UNUSED(c);
    UNUSED(kind);
    UNUSED(value);
    return fmi2Discard;
}

/* ---- model exchange ---- */

DECLARED(fmi2Status, fmi2NewDiscreteStates, (fmi2Component c, fmi2EventInfo *info)) {
    IT(c);
    int is_moved = 0;
    memset(info, 0, sizeof *info);
    if (!settled(it, &is_moved)) {
        return fmi2Error;
    }
    info->valuesOfContinuousStatesChanged = is_moved;
    info->nextEventTimeDefined = it->now.next_look < HUGE_VAL;
    info->nextEventTime = info->nextEventTimeDefined ? it->now.next_look : 0.0;
    return fmi2OK;
}

DECLARED(fmi2Status, fmi2CompletedIntegratorStep, (fmi2Component c, fmi2Boolean no_set_state, fmi2Boolean *enter_event,
    fmi2Boolean *terminate)) {
    IT(c);
    UNUSED(no_set_state);
    *terminate = 0;
    *enter_event = 0;
    return STATUS(completed(it, enter_event));
}

DECLARED(fmi2Status, fmi2GetDerivatives, (fmi2Component c, fmi2Real rates[], size_t number)) {
    IT(c);
    if (number != @N@_STATES || !find_rates(it)) {
        return fmi2Error;
    }
    give_rates(&it->now, rates);
    return fmi2OK;
}
