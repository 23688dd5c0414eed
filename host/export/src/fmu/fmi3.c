
/* ---- FMI 3.0 ---- */

#include <stdbool.h>

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef double fmi3Float64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef int fmi3DependencyKind;
typedef int fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3Callback)(void);

#define IT(c) instance *const it = (instance *)(c)
#define STATUS(done) ((done) ? fmi3OK : fmi3Error)
#define STATUS_OF(kind) ((kind) == ERROR ? fmi3Error : (kind) == WARNING ? fmi3Warning : fmi3OK)
#define DECLARED(result, name, arguments) \
    PUBLIC result name arguments; \
    PUBLIC result name arguments
#define REFERENCES const fmi3ValueReference references[], size_t number

static void say(const instance *it, enum kind kind, const char *format, ...) {
    static const char *const categories[] = {"logAll", "logStatusWarning", "logStatusError"};
    char text[512];
    va_list arguments;
    fmi3LogMessageCallback logger;
    if (it->log == NULL || (kind == INFORMATION && !it->shows_log)) {
        return;
    }
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    logger = (fmi3LogMessageCallback)it->log;
    logger(it->environment, STATUS_OF(kind), categories[kind], text);
}

DECLARED(const char *, fmi3GetVersion, (void)) {
    return "3.0";
}

static instance *instantiate(fmi3String name, fmi3String token, fmi3Boolean logging, void *environment,
    fmi3LogMessageCallback log, int is_exchange) {
    instance *it = make(name);
    if (it == NULL) {
        return NULL;
    }
    it->shows_log = logging;
    it->is_exchange = is_exchange;
    it->environment = environment;
    it->log = (void (*)(void))log;
    if (token == NULL || strcmp(token, "@guid@") != 0) {
        say(it, ERROR, "the instantiation token is not that of this machine");
        discard(it);
        return NULL;
    }
    return it;
}

DECLARED(fmi3Instance, fmi3InstantiateModelExchange, (fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)) {
    UNUSED(resources);
    UNUSED(visible);
    return instantiate(name, token, logging, environment, log, 1);
}

DECLARED(fmi3Instance, fmi3InstantiateCoSimulation, (fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[],
    size_t number, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3Callback update)) {
    UNUSED(resources);
    UNUSED(visible);
    UNUSED(events);
    UNUSED(early);
    UNUSED(required);
    UNUSED(number);
    UNUSED(update);
    return instantiate(name, token, logging, environment, log, 0);
}

DECLARED(fmi3Instance, fmi3InstantiateScheduledExecution, (fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3Callback clock, fmi3Callback lock, fmi3Callback unlock)) {
    UNUSED(name);
    UNUSED(token);
    UNUSED(resources);
    UNUSED(visible);
    UNUSED(logging);
    UNUSED(environment);
    UNUSED(log);
    UNUSED(clock);
    UNUSED(lock);
    UNUSED(unlock);
    return NULL;
}

DECLARED(fmi3Status, fmi3EnterInitializationMode, (fmi3Instance c, fmi3Boolean is_tolerance, fmi3Float64 tolerance,
    fmi3Float64 start, fmi3Boolean is_stop, fmi3Float64 stop)) {
    IT(c);
    it->now.phase = INITIALISING;
    return STATUS(initialise(it, start, is_tolerance, tolerance, is_stop ? stop : HUGE_VAL));
}

DECLARED(fmi3Status, fmi3GetFloat64, (fmi3Instance c, REFERENCES, fmi3Float64 values[], size_t size)) {
    IT(c);
    size_t k;
    if (size != number) {
        return fmi3Error;
    }
    for (k = 0; k < number; ++k) {
        if (!get(it, references[k], values + k)) {
            return fmi3Error;
        }
    }
    return fmi3OK;
}

DECLARED(fmi3Status, fmi3SetFloat64, (fmi3Instance c, REFERENCES, const fmi3Float64 values[], size_t size)) {
    IT(c);
    size_t k;
    if (size != number) {
        return fmi3Error;
    }
    for (k = 0; k < number; ++k) {
        if (!set(it, references[k], values[k])) {
            return fmi3Error;
        }
    }
    return fmi3OK;
}

/* There are no variables of other types. */
#define NONE_OF(name, type) \
    DECLARED(fmi3Status, fmi3Get##name, (fmi3Instance c, REFERENCES, type values[], size_t size)) { \
        UNUSED(c); \
        UNUSED(references); \
        UNUSED(values); \
        UNUSED(size); \
        return number == 0 ? fmi3OK : fmi3Error; \
    } \
    DECLARED(fmi3Status, fmi3Set##name, (fmi3Instance c, REFERENCES, type const values[], size_t size)) { \
        UNUSED(c); \
        UNUSED(references); \
        UNUSED(values); \
        UNUSED(size); \
        return number == 0 ? fmi3OK : fmi3Error; \
    }
NONE_OF(Float32, float)
NONE_OF(Int8, int8_t)
NONE_OF(UInt8, uint8_t)
NONE_OF(Int16, int16_t)
NONE_OF(UInt16, uint16_t)
NONE_OF(Int32, int32_t)
NONE_OF(UInt32, uint32_t)
NONE_OF(Int64, int64_t)
NONE_OF(UInt64, uint64_t)
NONE_OF(Boolean, bool)
NONE_OF(String, const char *)

/* What nobody may call, since there is nothing that it could be called for. */
#define NOT_THERE(name, arguments) \
    DECLARED(fmi3Status, fmi3##name, arguments) { \
        IT(c); \
        say(it, ERROR, "fmi3" #name " is not provided"); \
        return fmi3Error; \
    }

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
NOT_THERE(GetBinary, (fmi3Instance c, REFERENCES, size_t sizes[], fmi3Binary values[], size_t size))
NOT_THERE(SetBinary, (fmi3Instance c, REFERENCES, const size_t sizes[], const fmi3Binary values[], size_t size))
NOT_THERE(GetClock, (fmi3Instance c, REFERENCES, fmi3Clock values[]))
NOT_THERE(SetClock, (fmi3Instance c, REFERENCES, const fmi3Clock values[]))
NOT_THERE(GetNumberOfVariableDependencies, (fmi3Instance c, fmi3ValueReference reference, size_t *number))
NOT_THERE(GetVariableDependencies, (fmi3Instance c, fmi3ValueReference dependent, size_t elements[],
    fmi3ValueReference independents[], size_t others[], fmi3DependencyKind kinds[], size_t number))
NOT_THERE(EnterConfigurationMode, (fmi3Instance c))
NOT_THERE(ExitConfigurationMode, (fmi3Instance c))
NOT_THERE(GetIntervalDecimal, (fmi3Instance c, REFERENCES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]))
NOT_THERE(GetIntervalFraction, (fmi3Instance c, REFERENCES, uint64_t counters[], uint64_t resolutions[],
    fmi3IntervalQualifier qualifiers[]))
NOT_THERE(GetShiftDecimal, (fmi3Instance c, REFERENCES, fmi3Float64 shifts[]))
NOT_THERE(GetShiftFraction, (fmi3Instance c, REFERENCES, uint64_t counters[], uint64_t resolutions[]))
NOT_THERE(SetIntervalDecimal, (fmi3Instance c, REFERENCES, const fmi3Float64 intervals[]))
NOT_THERE(SetIntervalFraction, (fmi3Instance c, REFERENCES, const uint64_t counters[], const uint64_t resolutions[]))
NOT_THERE(SetShiftDecimal, (fmi3Instance c, REFERENCES, const fmi3Float64 shifts[]))
NOT_THERE(SetShiftFraction, (fmi3Instance c, REFERENCES, const uint64_t counters[], const uint64_t resolutions[]))
NOT_THERE(GetOutputDerivatives, (fmi3Instance c, REFERENCES, const int32_t orders[], fmi3Float64 values[], size_t size))
NOT_THERE(ActivateModelPartition, (fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time))

DECLARED(fmi3Status, fmi3GetDirectionalDerivative, (fmi3Instance c, const fmi3ValueReference unknowns[], size_t number,
    const fmi3ValueReference knowns[], size_t others, const fmi3Float64 seed[], size_t seeds, fmi3Float64 found[], size_t size)) {
    if (seeds != others || size != number) {
        return fmi3Error;
    }
    return STATUS(directional((instance *)c, unknowns, number, knowns, others, seed, found));
}

/* Column by column. */
DECLARED(fmi3Status, fmi3GetAdjointDerivative, (fmi3Instance c, const fmi3ValueReference unknowns[], size_t number,
    const fmi3ValueReference knowns[], size_t others, const fmi3Float64 seed[], size_t seeds, fmi3Float64 found[], size_t size)) {
    IT(c);
    size_t k, j;
    if (seeds != number || size != others) {
        return fmi3Error;
    }
    for (k = 0; k < others; ++k) {
        found[k] = 0.0;
        no_direction(it);
        if (!direct(it, knowns[k], 1.0)) {
            return fmi3Error;
        }
        if (!differentiate(it)) {
            return fmi3Error;
        }
        for (j = 0; j < number; ++j) {
            double value;
            if (!along(it, unknowns[j], &value)) {
                return fmi3Error;
            }
            found[k] += seed[j] * value;
        }
    }
    return fmi3OK;
}

DECLARED(fmi3Status, fmi3GetFMUState, (fmi3Instance c, fmi3FMUState *state)) {
    return STATUS(save((instance *)c, state));
}

DECLARED(fmi3Status, fmi3SetFMUState, (fmi3Instance c, fmi3FMUState state)) {
    IT(c);
    if (state == NULL) {
        return fmi3Error;
    }
    memcpy(&it->now, state, sizeof it->now);
    return fmi3OK;
}

DECLARED(fmi3Status, fmi3FreeFMUState, (fmi3Instance c, fmi3FMUState *state)) {
    UNUSED(c);
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi3OK;
}

DECLARED(fmi3Status, fmi3SerializedFMUStateSize, (fmi3Instance c, fmi3FMUState state, size_t *size)) {
    UNUSED(c);
    UNUSED(state);
    *size = SAVED_SIZE;
    return fmi3OK;
}

DECLARED(fmi3Status, fmi3SerializeFMUState, (fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)) {
    UNUSED(c);
    return STATUS(serialise(state, bytes, size));
}

DECLARED(fmi3Status, fmi3DeserializeFMUState, (fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)) {
    return STATUS(deserialise((instance *)c, bytes, size, state));
}

/* ---- co-simulation ---- */

DECLARED(fmi3Status, fmi3EnterStepMode, (fmi3Instance c)) {
    IT(c);
    it->now.phase = STEPPING;
    return fmi3OK;
}

DECLARED(fmi3Status, fmi3DoStep, (fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_set_state,
    fmi3Boolean *events, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached)) {
    IT(c);
    enum kind kind;
    UNUSED(no_set_state);
    *events = false;
    *terminate = false;
    *early = false;
    kind = advance(it, time, step);
    *reached = it->now.machine.time;
    return STATUS_OF(kind);
}

/* ---- model exchange ---- */

DECLARED(fmi3Status, fmi3EvaluateDiscreteStates, (fmi3Instance c)) {
    UNUSED(c);
    return fmi3OK;
}

DECLARED(fmi3Status, fmi3UpdateDiscreteStates, (fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
    fmi3Boolean *nominals, fmi3Boolean *values, fmi3Boolean *is_next, fmi3Float64 *next)) {
    IT(c);
    int is_moved = 0;
    *again = false;
    *terminate = false;
    *nominals = false;
    *values = false;
    *is_next = false;
    *next = 0.0;
    if (!settled(it, &is_moved)) {
        return fmi3Error;
    }
    *values = is_moved != 0;
    *is_next = it->now.next_look < HUGE_VAL;
    *next = *is_next ? it->now.next_look : 0.0;
    return fmi3OK;
}

DECLARED(fmi3Status, fmi3CompletedIntegratorStep, (fmi3Instance c, fmi3Boolean no_set_state, fmi3Boolean *enter_event,
    fmi3Boolean *terminate)) {
    IT(c);
    int is_event = 0;
    UNUSED(no_set_state);
    *terminate = false;
    if (!completed(it, &is_event)) {
        return fmi3Error;
    }
    *enter_event = is_event != 0;
    return fmi3OK;
}

DECLARED(fmi3Status, fmi3GetContinuousStateDerivatives, (fmi3Instance c, fmi3Float64 rates[], size_t number)) {
    IT(c);
    if (number != @N@_STATES || !find_rates(it)) {
        return fmi3Error;
    }
    give_rates(&it->now, rates);
    return fmi3OK;
}

DECLARED(fmi3Status, fmi3GetNumberOfEventIndicators, (fmi3Instance c, size_t *number)) {
    UNUSED(c);
    *number = @N@_SWITCHES;
    return fmi3OK;
}

DECLARED(fmi3Status, fmi3GetNumberOfContinuousStates, (fmi3Instance c, size_t *number)) {
    UNUSED(c);
    *number = @N@_STATES;
    return fmi3OK;
}
