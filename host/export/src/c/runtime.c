/* ---- what steps the equations ---- */

/* Rates of the four Euler parameters p of what turns with angular velocity w in its own axes. */
#if ROTATIONS > 0
static void turning(const real *p, const real *w, real *rate) {
    const real e0 = p[0], e1 = p[1], e2 = p[2], e3 = p[3];
    const real x = w[0], y = w[1], z = w[2];
    rate[0] = R(0.5) * (-e1 * x - e2 * y - e3 * z);
    rate[1] = R(0.5) * (e0 * x - e3 * y + e2 * z);
    rate[2] = R(0.5) * (e3 * x + e0 * y - e1 * z);
    rate[3] = R(0.5) * (-e2 * x + e1 * y + e0 * z);
}

static void normalise(real *p) {
    const real length = F(sqrt)(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
    p[0] /= length;
    p[1] /= length;
    p[2] /= length;
    p[3] /= length;
}
#endif

#if REFERENCES > 0
/* The fastest of the counted angles where they were found last, rad/s. */
static real fastest(const @n@_machine *m) {
    real most = R(0.0);
    int i;
    for (i = REFERENCES; i < 2 * REFERENCES; ++i) {
        if (!(F(fabs)(m->angles[i]) <= most)) {
            most = F(fabs)(m->angles[i]);
        }
    }
    return most;
}
#endif

int @n@_rates(@n@_machine *m, @n@_real t, const @n@_real *y, @n@_real *rates) {
    int i;
    run__motion(m, t, y);
    for (i = PIVOTS_FROM; i < PIVOTS_TO; ++i) {
        if (!(m->motion[i] > R(0.0))) {
            return m->motion[i] - m->motion[i] == R(0.0) ? @N@_SINGULAR : @N@_NOT_FINITE;
        }
    }
@rates@
    for (i = 0; i < @N@_STATES - MOTION_STATES; ++i) {
        rates[MOTION_STATES + i] = m->motion[RATES_FROM + i];
    }
    for (i = 0; i < @N@_STATES; ++i) {
        if (!(rates[i] - rates[i] == R(0.0))) {
            return @N@_NOT_FINITE;
        }
    }
    return @N@_OK;
}

#if ROWS > 0
/* Moves positions along the correction that was found; gives its size, m. */
static real move_along(const @n@_machine *m, real *y) {
    const real *d = m->correction;
    real size = R(0.0);
    real step;
#if ROTATIONS > 0
    real rate[4];
    int k;
#endif
@move@
    return size;
}
#endif

int @n@_project(@n@_machine *m, @n@_real t, @n@_real *y) {
#if ROWS > 0
    real size = R(0.0);
    int i;
#endif
@normalise@
#if ROWS > 0
    for (i = 0; i < CORRECTIONS; ++i) {
        run__position(m, t, y);
        size = move_along(m, y);
    }
    size = size / LENGTH;
    if (!(size * size <= OFF_CONSTRAINTS)) {
        return @N@_OFF_CONSTRAINTS;
    }
    run__velocity(m, t, y);
    for (i = 0; i < ROWS; ++i) {
        const real *pivots = m->correction + COLUMNS + COLUMNS;
        if (!(pivots[i] >= LEAST_KEPT * pivots[ROWS + i] && pivots[ROWS + ROWS + i] >= least_independence[i])) {
            return @N@_SINGULAR;
        }
    }
@change@
#else
    (void)m;
    (void)t;
    (void)y;
#endif
    return @N@_OK;
}

@parameters@

@tangents@

@sampled@

#if SWITCHES > 0
/* Takes the functions of a state y for which the motion was found last where they are furthest on the other side. */
static void reach(@n@_machine *m, real t, const real *y) {
    int k;
    run__switches(m, t, y);
    for (k = 0; k < SWITCHES; ++k) {
        if (m->first[k] < R(0.0) ? !(m->switches[k] <= m->last[k]) : m->switches[k] < m->last[k]) {
            m->last[k] = m->switches[k];
        }
    }
}

static void look_at_switches(@n@_machine *m, real t, const real *y, real *found) {
#if SWITCHES_ARE_SOLVED
    run__motion(m, t, y);
#endif
    run__switches(m, t, y);
    memcpy(found, m->switches, sizeof m->switches);
}
#endif

@advance@

int @n@_watch(@n@_machine *m) {
#if OTHERS > 0
    int i;
    run__watched(m, m->time, m->state);
    for (i = 0; i < ROWS_LEFT_OUT; ++i) {
        if (!(F(fabs)(m->watched[i]) <= most_off[i])) {
            return @N@_CONTRADICTION;
        }
    }
#if THIN > 0
    if (m->watched[ROWS_LEFT_OUT] > m->largest_kinetic) {
        m->largest_kinetic = m->watched[ROWS_LEFT_OUT];
    }
    for (i = 0; i < THIN; ++i) {
        const real about = m->watched[ROWS_LEFT_OUT + 1 + i];
        if (!(R(0.5) * thin[i][0] * about * about <= thin[i][1] * m->largest_kinetic)) {
            return @N@_TURNS_THIN_AXIS;
        }
    }
#endif
#else
    (void)m;
#endif
    return @N@_OK;
}

@n@_real @n@_follow(@n@_machine *m) {
#if REFERENCES > 0
    int i;
    run__angles(m, m->time, m->state);
    for (i = 0; i < REFERENCES; ++i) {
        if (F(fabs)(m->angles[i] - m->reference[i]) > R(1.0)) {
            m->reference[i] = m->angles[i];
        }
    }
    return fastest(m);
#else
    (void)m;
    return R(0.0);
#endif
}

@n@_real @n@_violation(@n@_machine *m) {
    real worst = R(0.0);
#if ROWS > 0
    int i;
    run__position(m, m->time, m->state);
    for (i = 0; i < ROWS; ++i) {
        const real violation = F(fabs)(m->correction[COLUMNS + i]) / row_sizes[i];
        if (!(violation <= worst)) {
            worst = violation;
        }
    }
    worst /= LENGTH;
#else
    (void)m;
#endif
    return worst;
}

/* Takes a state as the one that was reached. */
static int accept(@n@_machine *m, real h, const real *next) {
    const real whole = h + m->lost_time;
    const real sum = m->time + whole;
    m->lost_time = whole - (sum - m->time);
    m->time = sum;
    memcpy(m->state, next, sizeof m->state);
    if (!(@n@_follow(m) * h <= @N@_MOST_TURN)) {
        return @N@_TURNS_TOO_FAR;
    }
    return @n@_watch(m);
}

@control@

#if SWITCHES > 0
/* Whether something switched in the step that was made last, at its end or in a stage. */
static int has_switched(@n@_machine *m, real t, const real *y) {
    int k, any = 0;
#if SWITCHES_ARE_SOLVED
    run__motion(m, t, y);
#endif
    reach(m, t, y);
    for (k = 0; k < SWITCHES; ++k) {
        any |= (m->first[k] < R(0.0)) != (m->last[k] < R(0.0));
    }
    return any;
}

/* The longest step known to lie before a switch, and its end in m->next; what is left of the shortest that is known not to. What lies
   behind a switch may be far from what the equations before it give, so that places are extrapolated from before it as soon as two are
   known there; until then by false position with weights (the Illinois algorithm). */
static int locate(@n@_machine *m, real whole, real *before, real *across) {
    real a = R(0.0), b = whole, earlier = R(0.0), weight = R(1.0);
    int trial, k, status, known = 1;
    memcpy(m->low, m->first, sizeof m->low);
    memcpy(m->high, m->last, sizeof m->high);
    for (trial = 0; trial < TRIALS; ++trial) {
        real share = R(2.0), x;
        for (k = 0; k < SWITCHES; ++k) {
            if ((m->first[k] < R(0.0)) != (m->high[k] < R(0.0))) {
                const real u = known > 1 ? m->low[k] * (a - earlier) : weight * m->low[k];
                const real v = known > 1 ? (m->lower[k] - m->low[k]) * (b - a) : weight * m->low[k] - m->high[k];
                const real root = u / v;
                if (root > R(0.0) && root < share) {
                    share = root;
                }
            }
        }
        /* Functions that jump, or are zero on one side, tell no place. */
        if (share > R(1.001)) {
            share = R(0.5);
        }
        if (share < R(1e-3)) {
            share = R(1e-3);
        }
        if (share > R(0.999)) {
            share = R(0.999);
        }
        x = a + (b - a) * share;
        status = advance(m, m->time, m->state, x, m->trial);
        if (status != @N@_OK) {
            return status;
        }
        if (has_switched(m, m->time + x, m->trial)) {
            b = x;
            memcpy(m->high, m->last, sizeof m->high);
            weight *= R(0.5);
        } else {
            earlier = a;
            a = x;
            memcpy(m->lower, m->low, sizeof m->lower);
            memcpy(m->low, m->last, sizeof m->low);
            memcpy(m->next, m->trial, sizeof m->next);
            ++known;
        }
    }
    *before = a;
    *across = b - a;
    return @N@_OK;
}
#endif

void @n@_switches(@n@_machine *m, @n@_real *found) {
#if SWITCHES > 0
    look_at_switches(m, m->time, m->state, found);
#else
    (void)m;
    (void)found;
#endif
}

/* Time in which nothing samples. */
static int stretch(@n@_machine *m, real h) {
    real left = h;
#if SWITCHES > 0
    int splits = 0;
#endif
#if ADAPTIVE
    long trials = 0;
#endif
    for (;;) {
        real taken = left;
        int status;
#if ADAPTIVE
        taken = next_size(m, left);
        if (++trials > MOST_TRIALS) {
            return @N@_STEP_TOO_SMALL;
        }
#endif
#if IMPLICIT
        linearise(m);
#endif
#if SWITCHES > 0
        look_at_switches(m, m->time, m->state, m->first);
#endif
        status = advance(m, m->time, m->state, taken, m->next);
#if ADAPTIVE
        status = judged(m, status, taken);
        if (status == AGAIN) {
            continue;
        }
#endif
        if (status != @N@_OK) {
            return status;
        }
#if SWITCHES > 0
        if (has_switched(m, m->time + taken, m->next)) {
            if (splits < LOCATED) {
                real before, across;
                status = locate(m, taken, &before, &across);
                if (status == @N@_OK && before > R(0.0)) {
                    status = accept(m, before, m->next);
                    left -= before;
                }
                if (status != @N@_OK) {
                    return status;
                }
                /* From there over the switch, by so little that it does not matter which of the stages lie behind it. */
                across = R(2.0) * across + WIDTH * taken;
                taken = across < left ? across : left;
#if IMPLICIT
                linearise(m);
#endif
                look_at_switches(m, m->time, m->state, m->first);
                status = advance(m, m->time, m->state, taken, m->next);
                if (status != @N@_OK) {
                    return status;
                }
                ++splits;
                ++m->located;
            } else {
                ++m->passed;
            }
        }
#if ADAPTIVE
        else {
            splits = 0;
        }
#endif
#endif
        status = accept(m, taken, m->next);
        if (status != @N@_OK) {
            return status;
        }
#if ADAPTIVE
        measure(m);
#endif
        if (taken >= left) {
            return @N@_OK;
        }
        left -= taken;
    }
}

int @n@_step(@n@_machine *m, @n@_real h) {
#if CLOCKS > 0
    real left = h;
    if (!m->begun) {
        /* Inputs, state and parameters may have been set since. */
        @n@_begin(m);
        m->begun = 1;
    }
    for (;;) {
        real part;
        int status;
        (void)@n@_sample(m);
        part = @n@_until_sample(m);
        if (!(part < left * (R(1.0) - EARLY))) {
            return stretch(m, left);
        }
        status = stretch(m, part);
        if (status != @N@_OK) {
            return status;
        }
        left -= part;
    }
#else
    return stretch(m, h);
#endif
}

void @n@_outputs(@n@_machine *m) {
#if OUTPUTS > 0
#if OUTPUTS_ARE_SOLVED
    run__motion(m, m->time, m->state);
#endif
    run__outputs(m, m->time, m->state);
@outputs@
#else
    (void)m;
#endif
}

void @n@_start(@n@_machine *m) {
    static const real start[@N@_STATES] = {
@start@
    };
    memset(m, 0, sizeof *m);
    m->time = @t_start@;
    memcpy(m->state, start, sizeof m->state);
@start_inputs@
#if PARAMETERS > 0
    (void)@n@_follow_parameters(m);
#endif
#if ADAPTIVE
    m->tolerance = TOLERANCE;
    memcpy(m->sizes, sizes_least, sizeof m->sizes);
    measure(m);
#endif
#if CLOCKS > 0
    @n@_begin(m);
#endif
    @n@_outputs(m);
}

const char *@n@_message(int status) {
    switch (status) {
    case @N@_OK: return "done";
    case @N@_SINGULAR: return "the constraints are close to a singular position, or a mass matrix is not positive definite";
    case @N@_NOT_FINITE: return "a rate is not a finite number";
    case @N@_OFF_CONSTRAINTS: return "the corrections of a step do not bring it to the constraints: the step is too long";
    case @N@_CONTRADICTION: return "constraints that followed from others at the start contradict them";
    case @N@_TURNS_THIN_AXIS: return "something turns a body about an axis about which it has no moment of inertia";
    case @N@_TURNS_TOO_FAR: return "an angle that is counted over full turns may have turned by half a turn in a step: the step is too long";
    case @N@_OUT_OF_RANGE: return "a parameter is outside of the range in which what follows it is known";
    case @N@_STEP_TOO_SMALL: return "the tolerance cannot be met by steps of a reasonable size";
    default: return "unknown status";
    }
}
