/* ---- derivatives along a direction ---- */

/* Clears the direction of derivatives. */
static void no_direction(instance *it) {
    memset(it->now.machine.seed, 0, sizeof it->now.machine.seed);
}

/* Adds a variable to the direction; 0 where nothing can be differentiated along it. */
static int direct(instance *it, unsigned reference, double seed) {
    double *const all = it->now.machine.seed;
    if (reference < FIRST_INPUT) {
        all[0] = seed;
        return 1;
    }
#if @N@_INPUTS > 0
    if (reference < FIRST_OUTPUT) {
        all[1 + @N@_STATES + reference - FIRST_INPUT] = seed;
        return 1;
    }
#endif
    if (reference >= FIRST_STATE && reference < FIRST_RATE) {
        all[1 + reference - FIRST_STATE] = seed;
        return 1;
    }
    say(it, ERROR, "nothing is differentiated along the variable with the value reference %u", reference);
    return 0;
}

/* Gives 0 where there are no rates. In model exchange nothing but the rates of Euler parameters depends on the length of these; their rates
   are in proportion to it. */
static int differentiate(instance *it) {
    double *outputs = NULL, *switches = NULL;
#if ROTATIONS > 0
    double along_length[ROTATIONS];
    int r, k;
    if (it->is_exchange) {
        if (!find_rates(it)) {
            return 0;
        }
        for (r = 0; r < ROTATIONS; ++r) {
            const double *const p = it->now.machine.state + euler[r];
            double *const seed = it->now.machine.seed + 1 + euler[r];
            along_length[r] = p[0] * seed[0] + p[1] * seed[1] + p[2] * seed[2] + p[3] * seed[3];
            for (k = 0; k < 4; ++k) {
                seed[k] = (seed[k] - along_length[r] * p[k]) / it->now.length[r];
            }
        }
    }
#endif
#if @N@_OUTPUTS > 0
    outputs = it->outputs_along;
#endif
#if @N@_SWITCHES > 0
    switches = it->switches_along;
#endif
    @n@_derivatives(&it->now.machine, it->rates_along, outputs, switches);
#if ROTATIONS > 0
    for (r = 0; r < ROTATIONS && it->is_exchange; ++r) {
        for (k = 0; k < 4; ++k) {
            double *const rate = it->rates_along + euler[r] + k;
            *rate = it->now.length[r] * *rate + along_length[r] * it->now.rates[euler[r] + k];
        }
    }
#endif
    return 1;
}

/* The derivative of a variable along the direction; 0 where there is none. */
static int along(const instance *it, unsigned reference, double *value) {
    int is_there = 0;
#if @N@_OUTPUTS > 0
    if (reference >= FIRST_OUTPUT && reference < FIRST_STATE) {
        *value = it->outputs_along[reference - FIRST_OUTPUT];
        is_there = 1;
    }
#endif
    if (reference >= FIRST_RATE && reference < FIRST_SWITCH) {
        *value = it->rates_along[reference - FIRST_RATE];
        is_there = 1;
    }
#if @N@_SWITCHES > 0
    if (reference >= FIRST_SWITCH && reference < FIRST_PARAMETER) {
        *value = it->switches_along[reference - FIRST_SWITCH];
        is_there = 1;
    }
#endif
    if (!is_there) {
        say(it, ERROR, "the variable with the value reference %u has no derivatives", reference);
    } else if (!(*value - *value == 0.0)) {
        say(it, ERROR, "at %g s: the derivative of the variable with the value reference %u is not a finite number", it->now.machine.time,
            reference);
        is_there = 0;
    }
    return is_there;
}

/* Derivatives of unknowns along a direction of knowns. */
static int directional(instance *it, const unsigned *unknowns, size_t number, const unsigned *knowns, size_t others, const double *seed,
    double *found) {
    size_t k;
    no_direction(it);
    for (k = 0; k < others; ++k) {
        if (!direct(it, knowns[k], seed[k])) {
            return 0;
        }
    }
    if (!differentiate(it)) {
        return 0;
    }
    for (k = 0; k < number; ++k) {
        if (!along(it, unknowns[k], found + k)) {
            return 0;
        }
    }
    return 1;
}

