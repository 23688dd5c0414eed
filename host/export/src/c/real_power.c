/* Real powers. The exponent is volatile so that no compiler takes pow(x, 2.0) for x * x, whose last digit may be another. */
static real real_power(real x, volatile real exponent) {
    return F(pow)(x, exponent);
}
