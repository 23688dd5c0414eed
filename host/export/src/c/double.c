/* Sine and cosine of one angle. One polynomial for all machines, so that the digits do not depend on a library; angles beyond
   1.6e6 rad have none (not a number, so that a step reports @N@_NOT_FINITE). */
static void turn(real angle, real *sine, real *cosine) {
    const real to_whole = 6755399441055744.0; /* 1.5 * 2^52 */
    const real whole = angle * 0.6366197723675814 + to_whole;
    const real turns = whole - to_whole;
    real a, b, rounded, taken, lost, lost_again;
    real excess, x, rest, square, cube, bend, half, most, s, c, swapped;
    uint64_t quarter;
    a = angle - turns * 1.5707963267341256;
    b = turns * 6.077100506303966e-11;
    rounded = a - b;
    taken = a - rounded;
    lost = (b - taken) + ((rounded + taken) - a);
    a = rounded;
    b = turns * 2.0222662487111665e-21;
    rounded = a - b;
    taken = a - rounded;
    lost_again = (b - taken) + ((rounded + taken) - a);
    excess = lost + lost_again + turns * 8.4784276603689e-32;
    x = rounded - excess;
    rest = (rounded - x) - excess;
    square = x * x;
    cube = square * x;
    bend = 0.008333333333330943
        + square * (-0.0001984126983674956
        + square * (2.755731609787775e-6
        + square * (-2.5051130870968297e-8
        + square * 1.591805913698281e-10)));
    s = x - ((square * (0.5 * rest - cube * bend) - rest) - cube * -0.16666666666666666);
    bend = 0.041666666666666664
        + square * (-0.0013888888888887393
        + square * (2.4801587298760048e-5
        + square * (-2.755731726880539e-7
        + square * (2.0876145659059344e-9
        + square * -1.1382588535352522e-11))));
    half = 0.5 * square;
    most = 1.0 - half;
    c = most + (((1.0 - most) - half) + (square * square * bend - x * rest));
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
