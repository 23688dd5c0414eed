"""Judges FMUs by FMPy: judge.py FMU TABLE TOLERANCE [INPUT VALUE]

The table has the outputs that the interpreter computes, a row per step; co-simulation must give the same digits, model exchange the
same to TOLERANCE. Prints what it looked at; anything wrong ends it.
"""

import csv
import sys

import numpy as np
from fmpy import extract, instantiate_fmu, read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

fmu, table, tolerance = sys.argv[1], sys.argv[2], float(sys.argv[3])
given = dict(zip(sys.argv[4::2], map(float, sys.argv[5::2])))
with open(table, newline="") as file:
    rows = list(csv.reader(file))
names, values = rows[0][1:], np.array(rows[1:], dtype=float)
times, values = values[:, 0], values[:, 1:]

problems = validate_fmu(fmu)
assert not problems, problems
print("validated")

description = read_model_description(fmu)
step = times[1] - times[0]
start, stop = times[0], times[-1]


def scaled(found):
    size = np.maximum(np.abs(values).max(axis=0), 1e-3)
    return (np.abs(found - values) / size).max()


def columns(result):
    return np.column_stack([result[name] for name in names])


if description.coSimulation is not None:
    result = simulate_fmu(
        fmu, fmi_type="CoSimulation", start_time=start, stop_time=stop, output_interval=step, output=names, start_values=given
    )
    found = columns(result)
    assert found.shape == values.shape, (found.shape, values.shape)
    off = scaled(found)
    print(f"co-simulation: {off:.1e}")
    assert off <= 1e-11, off

if description.modelExchange is not None:
    result = simulate_fmu(
        fmu,
        fmi_type="ModelExchange",
        start_time=start,
        stop_time=stop,
        output_interval=step,
        output=names,
        start_values=given,
        relative_tolerance=1e-9,
        record_events=False,
    )
    off = scaled(columns(result))
    print(f"model exchange: {off:.1e}")
    assert off <= tolerance, off

if description.coSimulation is not None:
    folder = extract(fmu)
    outputs = [v.valueReference for v in description.modelVariables if v.causality == "output"]
    version = description.fmiVersion[0]

    def made(name):
        instance = instantiate_fmu(folder, description, fmi_type="CoSimulation")
        if version == "2":
            instance.setupExperiment(startTime=start)
            instance.enterInitializationMode()
        else:
            instance.enterInitializationMode(startTime=start)
        instance.exitInitializationMode()
        return instance

    def get(instance):
        return list(instance.getReal(outputs) if version == "2" else instance.getFloat64(outputs))

    def advance(instance, first, count):
        for k in range(first, first + count):
            instance.doStep(currentCommunicationPoint=times[k], communicationStepSize=step)
        return get(instance)

    def close(instance):
        instance.terminate()
        instance.freeInstance()

    alone = made("alone")
    halfway, whole = advance(alone, 0, 8), advance(alone, 8, 8)
    close(alone)
    # Two at once, one of them slower.
    a, b = made("a"), made("b")
    advance(a, 0, 4)
    advance(b, 0, 8)
    advance(a, 4, 4)
    assert get(a) == halfway and get(b) == halfway
    # Saved half way, run on, restored and run on again.
    if version == "2":
        state = a.getFMUstate()
        data = a.serializeFMUstate(state)
        assert advance(a, 8, 8) == whole
        a.setFMUstate(state)
        assert get(a) == halfway
        assert advance(a, 8, 8) == whole
        a.freeFMUstate(state)
        other = b.deSerializeFMUstate(data)
        advance(b, 8, 3)
        b.setFMUstate(other)
        assert advance(b, 8, 8) == whole
        b.freeFMUstate(other)
    else:
        state = a.getFMUState()
        data = a.serializeFMUState(state)
        assert advance(a, 8, 8) == whole
        a.setFMUState(state)
        assert get(a) == halfway
        assert advance(a, 8, 8) == whole
        a.freeFMUState(state)
        other = b.deserializeFMUState(data)
        advance(b, 8, 3)
        b.setFMUState(other)
        assert advance(b, 8, 8) == whole
        b.freeFMUState(other)
    close(a)
    close(b)
    print("two instances, saved and restored")
