/* Sine and cosine of one angle. One polynomial for all machines, so that the digits do not depend on a library; angles beyond
   1.6e6 rad have none (not a number, so that a step reports @N@_NOT_FINITE). */
static void turn(real angle, real *sine, real *cosine) {
    const real to_whole = 6755399441055744.0; /* 1.5 * 2^52 */
    const real whole = angle * 0.6366197723675814 + to_whole;
    const real turns = whole - to_whole;
    real a, b, coarse, x, taken, lost, lost_again;
    real excess, square, cube, fourth, bend, half, most, s, c, swapped;
    uint64_t quarter;
    a = angle - turns * 1.5707963267341256;
    b = turns * 6.077100506303966e-11;
    coarse = a - b;
    taken = a - coarse;
    lost = (b - taken) + ((coarse + taken) - a);
    b = turns * 2.0222662487111665e-21;
    x = coarse - b;
    taken = coarse - x;
    lost_again = (b - taken) + ((x + taken) - coarse);
    excess = (lost + turns * 8.4784276603689e-32) + lost_again;
    square = x * x;
    cube = square * x;
    fourth = square * square;
    half = 0.5 * square;
    most = 1.0 - half;
    bend = (0.008333333333330943 + square * -0.0001984126983674956)
        + fourth * ((2.755731609787775e-6 + square * -2.5051130870968297e-8) + fourth * 1.591805913698281e-10);
    s = x - (excess * most - (cube * -0.16666666666666666 + (cube * square) * bend));
    bend = ((0.041666666666666664 + square * -0.0013888888888887393)
        + fourth * (2.4801587298760048e-5 + square * -2.755731726880539e-7))
        + (fourth * fourth) * (2.0876145659059344e-9 + square * -1.1382588535352522e-11);
    c = most + (((1.0 - most) - half) + (fourth * bend + x * excess));
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
    if (!(fabs(angle) < 1.6e6)) {
        s = c = NAN;
    }
    *sine = s;
    *cosine = c;
}
