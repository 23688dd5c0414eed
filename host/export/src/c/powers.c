/* Whole powers by squaring. */
static real whole_power(real x, int n) {
    unsigned m = n < 0 ? 0u - (unsigned)n : (unsigned)n;
    real power = R(1.0);
    for (;;) {
        if (m & 1u) {
            power *= x;
        }
        m >>= 1;
        if (m == 0u) {
            break;
        }
        x *= x;
    }
    return n < 0 ? R(1.0) / power : power;
}
