
/* ---- what versions 2 and 3 share but for the names ---- */

DECLARED(void, @fmi@FreeInstance, (void *c)) {
    discard((instance *)c);
}

DECLARED(@fmi@Status, @fmi@SetDebugLogging, (void *c, @fmi@Boolean on, size_t number, const @fmi@String categories[])) {
    IT(c);
    UNUSED(number);
    UNUSED(categories);
    it->shows_log = on;
    return @fmi@OK;
}

DECLARED(@fmi@Status, @fmi@ExitInitializationMode, (void *c)) {
    IT(c);
    it->now.phase = it->is_exchange ? EVENT : STEPPING;
    return STATUS(initialised(it));
}

DECLARED(@fmi@Status, @fmi@Terminate, (void *c)) {
    IT(c);
    it->now.phase = ENDED;
    return @fmi@OK;
}

DECLARED(@fmi@Status, @fmi@Reset, (void *c)) {
    IT(c);
    begin(&it->now);
    return @fmi@OK;
}

DECLARED(@fmi@Status, @fmi@EnterEventMode, (void *c)) {
    IT(c);
    it->now.phase = EVENT;
    return @fmi@OK;
}

DECLARED(@fmi@Status, @fmi@EnterContinuousTimeMode, (void *c)) {
    IT(c);
    it->now.phase = CONTINUOUS;
    return @fmi@OK;
}

DECLARED(@fmi@Status, @fmi@SetTime, (void *c, double time)) {
    set_time((instance *)c, time);
    return @fmi@OK;
}

DECLARED(@fmi@Status, @fmi@SetContinuousStates, (void *c, const double states[], size_t number)) {
    IT(c);
    if (number != @N@_STATES) {
        return @fmi@Error;
    }
    take_states(&it->now, states);
    changed(&it->now);
    return @fmi@OK;
}

DECLARED(@fmi@Status, @fmi@GetContinuousStates, (void *c, double states[], size_t number)) {
    IT(c);
    if (number != @N@_STATES) {
        return @fmi@Error;
    }
    give_states(&it->now, states);
    return @fmi@OK;
}

DECLARED(@fmi@Status, @fmi@GetEventIndicators, (void *c, double indicators[], size_t number)) {
    IT(c);
    if (number != @N@_SWITCHES) {
        return @fmi@Error;
    }
    @n@_switches(&it->now.machine, indicators);
    return @fmi@OK;
}

DECLARED(@fmi@Status, @fmi@GetNominalsOfContinuousStates, (void *c, double nominals[], size_t number)) {
    static const double sizes[@N@_STATES] = {@nominals@};
    UNUSED(c);
    if (number != @N@_STATES) {
        return @fmi@Error;
    }
    memcpy(nominals, sizes, sizeof sizes);
    return @fmi@OK;
}
