/* One step of the method, brought to the constraints. */
static int advance(@n@_machine *m, real t, const real *y, real h, real *next) {
    int s, i, j, status;
#if SWITCHES > 0
    memcpy(m->last, m->first, sizeof m->last);
#endif
    for (s = 0; s < STAGES; ++s) {
        for (i = 0; i < @N@_STATES; ++i) {
            real sum = R(0.0);
            for (j = 0; j < s; ++j) {
                sum += method_a[s][j] * m->slopes[j][i];
            }
            m->stage[i] = y[i] + h * sum;
        }
        status = @n@_rates(m, t + method_c[s] * h, m->stage, m->slopes[s]);
        if (status != @N@_OK) {
            return status;
        }
#if SWITCHES > 0
        reach(m, t + method_c[s] * h, m->stage);
#endif
    }
    for (i = 0; i < @N@_STATES; ++i) {
        real sum = R(0.0);
        for (j = 0; j < STAGES; ++j) {
            sum += method_b[j] * m->slopes[j][i];
        }
        next[i] = y[i] + h * sum;
    }
    return @n@_project(m, t + h, next);
}
