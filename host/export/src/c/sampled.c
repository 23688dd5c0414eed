#if CLOCKS > 0
/* What is due at the time of m samples. */
static int is_due(const @n@_machine *m, int clock) {
    return m->time >= (m->next_sample[clock] - EARLY) * periods[clock];
}

/* Which multiple of its period a clock is at. */
static real count(const @n@_machine *m, int clock) {
    return F(floor)(m->time / periods[clock] + EARLY);
}

int @n@_sample(@n@_machine *m) {
    int clock, k, any = 0;
    /* Behind the instant: a function of time that jumps there has done so. */
    real behind = m->time;
    for (clock = 0; clock < CLOCKS; ++clock) {
        if (is_due(m, clock)) {
            const real instant = count(m, clock) * periods[clock];
            any = 1;
            behind = instant > behind ? instant : behind;
        }
    }
    if (!any) {
        return 0;
    }
    behind += BEHIND * F(fabs)(m->time);
#if SAMPLES_ARE_SOLVED
    run__motion(m, behind, m->state);
#endif
    run__samples(m, behind, m->state);
    for (clock = 0; clock < CLOCKS; ++clock) {
        if (is_due(m, clock)) {
            const real after = count(m, clock) + R(1.0), next = m->next_sample[clock] + R(1.0);
            /* Far from zero the quotient is not known to a whole number. */
            m->next_sample[clock] = after > next ? after : next;
            for (k = memory_from[clock]; k < memory_from[clock + 1]; ++k) {
                m->memory[k] = m->samples[k];
            }
        }
    }
    return 1;
}

void @n@_begin(@n@_machine *m) {
    int clock;
    memcpy(m->memory, memory_start, sizeof m->memory);
    for (clock = 0; clock < CLOCKS; ++clock) {
        m->next_sample[clock] = count(m, clock);
    }
    (void)@n@_sample(m);
}

@n@_real @n@_until_sample(const @n@_machine *m) {
    real least = m->next_sample[0] * periods[0] - m->time;
    int clock;
    for (clock = 1; clock < CLOCKS; ++clock) {
        const real until = m->next_sample[clock] * periods[clock] - m->time;
        if (until < least) {
            least = until;
        }
    }
    return least;
}
#endif
