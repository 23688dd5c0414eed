/* ---- one instance: a machine, and what its environment set ---- */

#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "@n@.h"

#if defined(_WIN32)
#define PUBLIC __declspec(dllexport)
#elif defined(__GNUC__)
#define PUBLIC __attribute__((visibility("default")))
#else
#define PUBLIC
#endif

#define UNUSED(name) (void)(name)

/* Value references: the time, inputs, outputs, states, their rates, event indicators, parameters. */
#define FIRST_INPUT 1u
#define FIRST_OUTPUT (FIRST_INPUT + @N@_INPUTS)
#define FIRST_STATE (FIRST_OUTPUT + @N@_OUTPUTS)
#define FIRST_RATE (FIRST_STATE + @N@_STATES)
#define FIRST_SWITCH (FIRST_RATE + @N@_STATES)
#define FIRST_PARAMETER (FIRST_SWITCH + @N@_SWITCHES)
#define LAST_REFERENCE (FIRST_PARAMETER + @N@_PARAMETERS)

/* Violation of the constraints, as a share of the scene's length, beyond which model exchange asks for an event that brings the
   state back to them. */
#define DRIFT 1e-9

/* What turns freely, and where its Euler parameters begin in the state. */
#define ROTATIONS @rotations@
#if ROTATIONS > 0
static const unsigned euler[ROTATIONS] = {@euler@};
#endif

enum phase { MADE, INITIALISING, STEPPING, EVENT, CONTINUOUS, ENDED };

/* What is kept of an instance, and saved and restored. */
typedef struct {
    @n@_machine machine;
    double rates[@N@_STATES]; /* of the state of the machine */
#if ROTATIONS > 0
    /* Somebody else's method does not keep Euler parameters at the length 1; the machine has them normalised, and the lengths are here. */
    double length[ROTATIONS];
#endif
    double completed; /* when a step of somebody else's method ended last, s */
    double next_look; /* when something samples, or counted angles may have turned far, s */
    double looked; /* when counted angles were looked at last at an event, s */
    double stop; /* no step may end behind it, s */
    int is_moved; /* whether states were set from outside */
    int are_outputs_due;
    int are_rates_due;
    enum phase phase;
} content;

typedef struct {
    content now;
    int is_exchange;
    int shows_log;
    /* Derivatives along the direction that was asked for last. */
    double rates_along[@N@_STATES];
#if @N@_OUTPUTS > 0
    double outputs_along[@N@_OUTPUTS];
#endif
#if @N@_SWITCHES > 0
    double switches_along[@N@_SWITCHES];
#endif
    char *name;
    void *environment;
    void (*log)(void);
} instance;

enum kind { INFORMATION, WARNING, ERROR };

static void say(const instance *it, enum kind kind, const char *format, ...);

/* The state has Euler parameters of the length 1. */
static void are_normal(content *now) {
#if ROTATIONS > 0
    int r;
    for (r = 0; r < ROTATIONS; ++r) {
        now->length[r] = 1.0;
    }
#else
    UNUSED(now);
#endif
}

/* By which factor a state, and its rate, are larger outside than in the machine. */
static double scale(const content *now, unsigned state) {
#if ROTATIONS > 0
    int r;
    for (r = 0; r < ROTATIONS; ++r) {
        if (state - euler[r] < 4u) {
            return now->length[r];
        }
    }
#else
    UNUSED(now);
    UNUSED(state);
#endif
    return 1.0;
}

static void give_states(const content *now, double *states) {
    unsigned k;
    for (k = 0; k < @N@_STATES; ++k) {
        states[k] = now->machine.state[k] * scale(now, k);
    }
}

/* The rates of Euler parameters are linear in these. */
static void give_rates(const content *now, double *rates) {
    unsigned k;
    for (k = 0; k < @N@_STATES; ++k) {
        rates[k] = now->rates[k] * scale(now, k);
    }
}

/* Takes a state of somebody else's method. */
static void take_states(content *now, const double *states) {
#if ROTATIONS > 0
    int r, k;
#endif
    memcpy(now->machine.state, states, sizeof now->machine.state);
    are_normal(now);
#if ROTATIONS > 0
    for (r = 0; r < ROTATIONS; ++r) {
        double *const p = now->machine.state + euler[r];
        const double length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
        if (length > 0.0 && length - length == 0.0) {
            now->length[r] = length;
            for (k = 0; k < 4; ++k) {
                p[k] /= length;
            }
        }
    }
#endif
}

static void begin(content *now) {
    memset(now, 0, sizeof *now);
    are_normal(now);
    @n@_start(&now->machine);
    now->stop = HUGE_VAL;
    now->are_outputs_due = 1;
    now->are_rates_due = 1;
    now->phase = MADE;
}

static void changed(content *now) {
    now->are_outputs_due = 1;
    now->are_rates_due = 1;
}

/* Rates of the states where the instance is. */
static int find_rates(instance *it) {
    content *now = &it->now;
    if (now->are_rates_due) {
        const int status = @n@_rates(&now->machine, now->machine.time, now->machine.state, now->rates);
        if (status != @N@_OK) {
            say(it, ERROR, "at %g s: %s", now->machine.time, @n@_message(status));
            return 0;
        }
        now->are_rates_due = 0;
    }
    return 1;
}

/* A variable; 0 where there is none or it has no value. */
static int get(instance *it, unsigned reference, double *value) {
    content *now = &it->now;
    if (reference < FIRST_INPUT) {
        *value = now->machine.time;
        return 1;
    }
#if @N@_INPUTS > 0
    if (reference < FIRST_OUTPUT) {
        *value = now->machine.input[reference - FIRST_INPUT];
        return 1;
    }
#endif
#if @N@_OUTPUTS > 0
    if (reference >= FIRST_OUTPUT && reference < FIRST_STATE) {
        if (now->are_outputs_due) {
            @n@_outputs(&now->machine);
            now->are_outputs_due = 0;
        }
        *value = now->machine.output[reference - FIRST_OUTPUT];
        return 1;
    }
#endif
    if (reference < FIRST_RATE) {
        *value = now->machine.state[reference - FIRST_STATE] * scale(now, reference - FIRST_STATE);
        return 1;
    }
    if (reference < FIRST_SWITCH) {
        if (!find_rates(it)) {
            return 0;
        }
        *value = now->rates[reference - FIRST_RATE] * scale(now, reference - FIRST_RATE);
        return 1;
    }
#if @N@_SWITCHES > 0
    if (reference < FIRST_PARAMETER) {
        @n@_real found[@N@_SWITCHES];
        @n@_switches(&now->machine, found);
        *value = found[reference - FIRST_SWITCH];
        return 1;
    }
#endif
#if @N@_PARAMETERS > 0
    if (reference >= FIRST_PARAMETER && reference < LAST_REFERENCE) {
        *value = now->machine.parameter[reference - FIRST_PARAMETER];
        return 1;
    }
#endif
    say(it, ERROR, "there is no variable with the value reference %u", reference);
    return 0;
}

#if @N@_PARAMETERS > 0
/* Whether a parameter can be set now: before the initialisation ends; later those that no joint follows, in co-simulation between steps,
   in model exchange at events. */
static int is_open(const content *now, unsigned parameter) {
    static const char is_tunable[@N@_PARAMETERS] = {@tunable@};
    return now->phase <= INITIALISING || (is_tunable[parameter] && (now->phase == STEPPING || now->phase == EVENT));
}
#endif

static int set(instance *it, unsigned reference, double value) {
    content *now = &it->now;
    if (!(value - value == 0.0)) {
        say(it, ERROR, "the variable with the value reference %u cannot be set to what is no finite number", reference);
        return 0;
    }
#if @N@_INPUTS > 0
    if (reference >= FIRST_INPUT && reference < FIRST_OUTPUT) {
        now->machine.input[reference - FIRST_INPUT] = value;
        changed(now);
        return 1;
    }
#endif
    if (reference >= FIRST_STATE && reference < FIRST_RATE && now->phase <= INITIALISING) {
        now->machine.state[reference - FIRST_STATE] = value;
        now->is_moved = 1;
        changed(now);
        return 1;
    }
#if @N@_PARAMETERS > 0
    if (reference >= FIRST_PARAMETER && reference < LAST_REFERENCE && is_open(now, reference - FIRST_PARAMETER)) {
        double *const parameter = now->machine.parameter + (reference - FIRST_PARAMETER);
        const double before = *parameter;
        int status;
        *parameter = value;
        status = @n@_follow_parameters(&now->machine);
        if (status != @N@_OK) {
            *parameter = before;
            say(it, ERROR, "the variable with the value reference %u cannot be %g: %s", reference, value, @n@_message(status));
            return 0;
        }
        now->is_moved = now->phase <= INITIALISING;
        changed(now);
        return 1;
    }
#endif
    say(it, ERROR, "the variable with the value reference %u cannot be set now", reference);
    return 0;
}

static void set_time(instance *it, double time) {
    it->now.machine.time = time;
    it->now.machine.lost_time = 0.0;
    changed(&it->now);
}

/* Brings the state to the constraints. */
static int project(instance *it) {
    @n@_machine *m = &it->now.machine;
    const int status = @n@_project(m, m->time, m->state);
    are_normal(&it->now);
    changed(&it->now);
    if (status != @N@_OK) {
        say(it, ERROR, "at %g s: %s", m->time, @n@_message(status));
        return 0;
    }
    return 1;
}

/* Begins the initialisation at a time. */
static int initialise(instance *it, double start, int is_tolerance, double tolerance, double stop) {
    if (!(start - start == 0.0)) {
        say(it, ERROR, "the time at the start is no finite number");
        return 0;
    }
    if (stop < start) {
        say(it, ERROR, "the simulation is to stop at %g s, before it starts at %g s", stop, start);
        return 0;
    }
#if @N@_IS_ADAPTIVE
    if (is_tolerance) {
        it->now.machine.tolerance = tolerance > 1e-13 ? (tolerance < 0.1 ? tolerance : 0.1) : 1e-13;
    }
#else
    UNUSED(is_tolerance);
    UNUSED(tolerance);
#endif
    it->now.stop = stop;
    set_time(it, start);
    return 1;
}

/* Ends the initialisation: a state or a time from outside is brought to the constraints; what samples does so for the first time. */
static int initialised(instance *it) {
    if ((it->now.is_moved || it->now.machine.time != @N@_START_TIME) && !project(it)) {
        return 0;
    }
    it->now.is_moved = 0;
    it->now.completed = it->now.machine.time;
    it->now.looked = it->now.machine.time;
#if @N@_CLOCKS > 0
    @n@_begin(&it->now.machine);
    it->now.machine.begun = 1;
    changed(&it->now);
#endif
    return 1;
}

/* The most steps of a communication step: more would take forever. */
#define MOST_STEPS 1e9

/* A communication step of the method's steps, none longer than it was exported with. Gives what it ended with. */
static enum kind advance(instance *it, double from, double duration) {
    @n@_machine *m = &it->now.machine;
    const double number = ceil(duration / @N@_STEP - 1e-6);
    const double until = m->time + duration;
    long steps = 1, k;
#if @N@_SWITCHES > 0
    const unsigned long passed = m->passed;
#endif
    if (it->now.phase != STEPPING) {
        say(it, ERROR, "a step before the initialisation or after the end");
        return ERROR;
    }
    /* What is not a number is not in the range either. */
    if (!(duration >= 0.0 && number <= MOST_STEPS)) {
        say(it, ERROR, "at %g s: a step of %g s cannot be made", m->time, duration);
        return ERROR;
    }
    if (!(fabs(from - m->time) <= 1e-6 * (duration + @N@_STEP) + 1e-9 * fabs(m->time))) {
        say(it, ERROR, "a step from %g s, where the machine is at %g s", from, m->time);
        return ERROR;
    }
    if (until - it->now.stop > 1e-6 * duration + 1e-9 * fabs(until)) {
        say(it, ERROR, "a step to %g s, behind the end at %g s", until, it->now.stop);
        return ERROR;
    }
    if (duration == 0.0) {
        return INFORMATION;
    }
    if (number > 1.0) {
        steps = (long)number;
    }
    for (k = 0; k < steps; ++k) {
        const int status = @n@_step(m, duration / (double)steps);
        if (status != @N@_OK) {
            changed(&it->now);
            say(it, ERROR, "at %g s: %s", m->time, @n@_message(status));
            return ERROR;
        }
    }
    changed(&it->now);
#if @N@_SWITCHES > 0
    if (m->passed > passed) {
        say(it, WARNING, "from %g s to %g s: more contacts or other switches fell in a step than are located; its error is larger. "
            "Export with a smaller --step", m->time - duration, m->time);
        return WARNING;
    }
#endif
    return INFORMATION;
}

/* Whether the equations can follow the state, once it is on the constraints. */
static int is_possible(instance *it) {
    const int status = @n@_watch(&it->now.machine);
    if (status != @N@_OK) {
        say(it, ERROR, "at %g s: %s", it->now.machine.time, @n@_message(status));
    }
    return status == @N@_OK;
}

/* After a step of somebody else's method: whether an event is needed, to bring the state to the constraints or to look at counted
   angles sooner. Gives 0 where count was lost, or rows contradict each other. */
static int completed(instance *it, int *is_event) {
    @n@_machine *m = &it->now.machine;
    const double rate = @n@_follow(m);
    const double step = m->time - it->now.completed;
    if (!(rate * step <= @N@_MOST_TURN)) {
        say(it, ERROR, "at %g s: %s", m->time, @n@_message(@N@_TURNS_TOO_FAR));
        return 0;
    }
    it->now.completed = m->time;
    if (@n@_violation(m) > DRIFT) {
        *is_event = 1;
        return 1;
    }
    *is_event = rate * (it->now.next_look - m->time) > 1.5;
    return is_possible(it);
}

/* At an event: brings the state to the constraints where it is off, lets sample what is due, and finds when the next event is: a
   sample, or a look at counted angles, at most 1 rad away. */
static int settled(instance *it, int *is_moved) {
    content *now = &it->now;
    const double rate = @n@_follow(&now->machine);
    now->completed = now->machine.time;
    now->next_look = rate > 0.0 ? now->machine.time + 1.0 / rate : HUGE_VAL;
#if @N@_COUNTED > 0
    {
        /* What stands still may be fast soon: the next look is no further away than twice the time since the last one. */
        const double since = now->machine.time - now->looked;
        const double most = now->machine.time + 2.0 * (since > @N@_STEP ? since : @N@_STEP);
        if (most < now->next_look) {
            now->next_look = most;
        }
        now->looked = now->machine.time;
    }
#endif
    *is_moved = @n@_violation(&now->machine) > DRIFT;
    if ((*is_moved && !project(it)) || !is_possible(it)) {
        return 0;
    }
#if @N@_CLOCKS > 0
    if (@n@_sample(&now->machine)) {
        changed(now);
    }
    {
        const double sample = now->machine.time + @n@_until_sample(&now->machine);
        if (sample < now->next_look) {
            now->next_look = sample;
        }
    }
#endif
    return 1;
}

static instance *make(const char *name) {
    instance *it = (instance *)calloc(1, sizeof *it);
    if (it == NULL) {
        return NULL;
    }
    if (name != NULL) {
        it->name = (char *)calloc(strlen(name) + 1, 1);
        if (it->name == NULL) {
            free(it);
            return NULL;
        }
        strcpy(it->name, name);
    }
    begin(&it->now);
    return it;
}

static void discard(instance *it) {
    if (it != NULL) {
        free(it->name);
        free(it);
    }
}
