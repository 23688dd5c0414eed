/* Sine and cosine of one angle, in numbers of 24 bits; angles beyond 12000 rad have none (not a number, so that a step reports
   @N@_NOT_FINITE). */
static void turn(real angle, real *sine, real *cosine) {
    const real to_whole = 12582912.0f; /* 1.5 * 2^23 */
    const real whole = angle * 0.63661977f + to_whole;
    const real turns = whole - to_whole;
    const real x = ((angle - turns * 1.5703125f) - turns * 4.83751297e-4f) - turns * 7.54978995e-8f;
    const real square = x * x;
    real s, c, swapped;
    uint32_t quarter;
    s = x + x * square * (-0.16666667f + square * (0.0083333333f + square * (-1.984127e-4f + square * 2.755732e-6f)));
    c = (1.0f - 0.5f * square)
        + square * square * (0.041666667f + square * (-0.0013888889f + square * (2.4801587e-5f - square * 2.755732e-7f)));
    memcpy(&quarter, &whole, sizeof quarter);
    if (quarter & 1u) {
        swapped = s;
        s = c;
        c = swapped;
    }
    if (quarter & 2u) {
        s = -s;
    }
    if ((quarter + 1u) & 2u) {
        c = -c;
    }
    if (!(fabsf(angle) < 12000.0f)) {
        s = c = NAN;
    }
    *sine = s;
    *cosine = c;
}
