#if TANGENTS
/* Derivatives of the rates at a state y, along the direction in m->seed. */
static void rate_tangents(@n@_machine *m, real t, const real *y, real *found) {
    const real *const dy = m->seed + 1;
    int i;
#if ROTATIONS > 0
    real moved[4];
#endif
    (void)dy;
    run__tangent(m, t, y);
@rate_tangents@
    for (i = 0; i < @N@_STATES - MOTION_STATES; ++i) {
        found[MOTION_STATES + i] = m->tangent[RATES_FROM + i];
    }
}
#endif

#if DERIVATIVES
void @n@_derivatives(@n@_machine *m, @n@_real *rates, @n@_real *outputs, @n@_real *switches) {
#if @N@_OUTPUTS > 0
    int i;
#endif
#if OUTPUTS_ARE_SOLVED || SWITCHES_ARE_SOLVED
    run__motion(m, m->time, m->state);
#endif
    rate_tangents(m, m->time, m->state, rates);
#if @N@_OUTPUTS > 0
    if (outputs != NULL) {
        run__output_tangent(m, m->time, m->state);
        for (i = 0; i < @N@_OUTPUTS; ++i) {
            outputs[i] = m->output_tangent[i];
        }
@output_tangents@
    }
#else
    (void)outputs;
#endif
#if SWITCHES > 0
    if (switches != NULL) {
        run__switch_tangent(m, m->time, m->state);
        memcpy(switches, m->switch_tangent, sizeof m->switch_tangent);
    }
#else
    (void)switches;
#endif
}
#endif
