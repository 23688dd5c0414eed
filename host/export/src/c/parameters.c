#if PARAMETERS > 0
int @n@_follow_parameters(@n@_machine *m) {
    const real *const p = m->parameter;
    real *const found = m->followed;
    real value;
    int i;
    for (i = 0; i < PARAMETERS; ++i) {
        if (!(parameter_range[i][0] <= p[i] && p[i] <= parameter_range[i][1])) {
            return @N@_OUT_OF_RANGE;
        }
    }
@followed@
    return @N@_OK;
}
#endif
