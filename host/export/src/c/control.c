#if ADAPTIVE
#define AGAIN (-1)

/* Takes the sizes of an accepted state. */
static void measure(@n@_machine *m) {
    int i;
    for (i = 0; i < @N@_STATES; ++i) {
        const int number = size_of[i];
        if (number >= SIZES_FIXED && F(fabs)(m->state[i]) > m->sizes[number]) {
            m->sizes[number] = F(fabs)(m->state[i]);
        }
    }
}

/* Size of a step where so much time is left: none longer than the longest, none that turns a counted angle by more than 1 rad, and no
   tiny one at the end. */
static real next_size(@n@_machine *m, real left) {
    real h = m->step_size;
#if REFERENCES > 0
    real rate;
#endif
    if (!(h > R(0.0) && h <= @N@_STEP)) {
        h = @N@_STEP;
    }
#if REFERENCES > 0
    rate = @n@_follow(m);
    if (rate * h > R(1.0)) {
        h = R(1.0) / rate;
    }
#endif
    if (left <= h) {
        return left;
    }
    return left < R(2.0) * h ? R(0.5) * left : h;
}

/* Judges a step by the difference from the embedded solution; AGAIN: a shorter one is to be tried. */
static int judged(@n@_machine *m, int status, real h) {
    real share = R(0.0), factor = R(0.25);
    int i, s;
    if (status == @N@_OK) {
        status = @n@_rates(m, m->time + h, m->next, m->stage);
    }
    if (status == @N@_OK) {
        real eighth;
        for (i = 0; i < @N@_STATES; ++i) {
            const int number = size_of[i];
            real sum = R(0.0), size, part;
            if (number < 0) {
                continue;
            }
            for (s = 0; s < STAGES; ++s) {
                sum += method_error[s] * m->slopes[s][i];
            }
            sum += method_error[STAGES] * m->stage[i];
            size = m->sizes[number];
            if (number >= SIZES_FIXED) {
                size = F(fabs)(m->state[i]) > size ? F(fabs)(m->state[i]) : size;
                size = F(fabs)(m->next[i]) > size ? F(fabs)(m->next[i]) : size;
            }
            part = F(fabs)(h * sum) / (m->tolerance * size);
            if (!(part <= share)) {
                share = part;
            }
        }
        /* share^(-3/16), by roots that are exact everywhere */
        eighth = F(sqrt)(F(sqrt)(F(sqrt)(share)));
        factor = R(0.9) / (eighth * F(sqrt)(eighth));
        if (!(factor >= R(0.2))) {
            factor = R(0.2);
        }
        if (factor > R(5.0)) {
            factor = R(5.0);
        }
        if (share <= R(1.0)) {
            const real next = h * factor;
            /* A step that was cut does not shorten those that follow. */
            if (next > m->step_size || !(h < m->step_size)) {
                m->step_size = next;
            }
            return @N@_OK;
        }
    }
    ++m->rejected;
    m->step_size = h * factor;
    if (!(m->step_size > LEAST * @N@_STEP)) {
        return status == @N@_OK ? @N@_STEP_TOO_SMALL : status;
    }
    return AGAIN;
}
#endif
