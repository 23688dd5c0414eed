/* Derivative of some order of a table of cubic pieces. */
static real look_up(const real *breaks, const real (*pieces)[4], int number, int periodic, real x, int order) {
    const real first = breaks[0];
    const real last = breaks[number];
    int low = 0, high = number + 1;
    const real *c;
    real s;
    if (periodic) {
        const real period = last - first;
        x = x - F(floor)((x - first) / period) * period;
    } else if (x < first || x > last) {
        if (order > 0) {
            return R(0.0);
        }
        x = x < first ? first : last;
    }
    /* The number of break points that are not above x. */
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (breaks[middle] <= x) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low = (low < 1 ? 1 : low > number ? number : low) - 1;
    s = x - breaks[low];
    c = pieces[low];
    switch (order) {
    case 0: return c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    case 1: return c[1] + s * (R(2.0) * c[2] + s * (R(3.0) * c[3]));
    case 2: return R(2.0) * c[2] + s * (R(6.0) * c[3]);
    case 3: return R(6.0) * c[3];
    default: return R(0.0);
    }
}
