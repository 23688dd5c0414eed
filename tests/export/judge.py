"""Judges FMUs by FMPy: judge.py FMU TABLE TOLERANCE EQUAL [PARAMETER VALUE ...]

The table has outputs, a row per step. Model exchange must give the same to TOLERANCE, co-simulation to EQUAL; directional and adjoint
derivatives those of differences to 1e-6. Prints what it looked at; anything wrong ends it.
"""

import csv
import ctypes
import sys

import numpy as np
from fmpy import extract, instantiate_fmu, read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

fmu, table, tolerance, equal = sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4])
given = dict(zip(sys.argv[5::2], map(float, sys.argv[6::2])))
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
    assert off <= equal, off

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

for name in given:
    # Beyond its range a parameter is refused.
    variable = next(v for v in description.modelVariables if v.name == name)
    try:
        simulate_fmu(fmu, start_time=start, stop_time=start + step, start_values={name: 1.1 * float(variable.max)})
    except Exception:
        print(f"{name}: refused beyond its range")
    else:
        sys.exit(f"{name} can be set beyond its range")


def derivatives(folder, version):
    """Directional derivatives of rates and outputs along states and inputs, and the adjoint ones, against differences of order 4."""
    instance = instantiate_fmu(folder, description, fmi_type="ModelExchange")
    if version == "2":
        instance.setupExperiment(startTime=start)
        instance.enterInitializationMode()
        instance.exitInitializationMode()
        instance.newDiscreteStates()
    else:
        instance.enterInitializationMode(startTime=start)
        instance.exitInitializationMode()
        instance.updateDiscreteStates()
    instance.enterContinuousTimeMode()
    rates = [unknown.variable for unknown in description.derivatives]
    states = [rate.derivative.valueReference for rate in rates]
    unknowns = [rate.valueReference for rate in rates] + [unknown.variable.valueReference for unknown in description.outputs]
    inputs = [v.valueReference for v in description.modelVariables if v.causality == "input"]
    knowns = states + inputs
    nominals = (ctypes.c_double * len(states))()
    instance.getNominalsOfContinuousStates(nominals, len(states))
    assert list(nominals) == [float(rate.derivative.nominal) for rate in rates], list(nominals)

    def get(references):
        return np.array(instance.getReal(references) if version == "2" else instance.getFloat64(references))

    def put(values):
        states_only = (ctypes.c_double * len(states))(*values[: len(states)])
        instance.setContinuousStates(states_only, len(states))
        if inputs:
            given = list(values[len(states) :])
            instance.setReal(inputs, given) if version == "2" else instance.setFloat64(inputs, given)

    def moved(direction, size):
        put(place + size * direction)
        return get(unknowns)

    # Away from the start, where much is zero.
    place = get(knowns) + 0.01 * np.cos(np.arange(len(knowns)))
    worst, h = 0.0, 1e-4
    rng = np.random.default_rng(1)
    jacobian = []
    for direction in list(np.eye(len(knowns))) + [rng.normal(size=len(knowns))]:
        a, b, c, d = (moved(direction, size) for size in (h, -h, 2 * h, -2 * h))
        differences = (8 * (a - b) - (c - d)) / (12 * h)
        here = moved(direction, 0.0)
        found = np.array(instance.getDirectionalDerivative(unknowns, knowns, list(direction)))
        jacobian.append(found)
        size = np.maximum(np.maximum(np.abs(found), np.abs(here)), 1e-3 * max(1.0, np.abs(found).max()))
        worst = max(worst, (np.abs(found - differences) / size).max())
    print(f"derivatives: {worst:.1e} from differences")
    assert worst < 1e-6, worst
    if version == "3":
        matrix, seed = np.array(jacobian[: len(knowns)]), rng.normal(size=len(unknowns))
        adjoint = np.array(instance.getAdjointDerivative(unknowns, knowns, list(seed), len(knowns)))
        # Where a mechanism is driven throughout, all of them are zero.
        off = np.abs(adjoint - matrix @ seed).max() / (np.abs(matrix).max() or 1.0)
        print(f"adjoint derivatives: {off:.1e}")
        assert off < 1e-12, off
    # Where something does not depend on something else, its derivative is zero.
    matrix = np.array(jacobian[: len(knowns)])
    for k, unknown in enumerate(description.derivatives + description.outputs):
        listed = {variable.valueReference for variable in unknown.dependencies}
        others = [j for j, known in enumerate(knowns) if known not in listed]
        assert not np.any(matrix[others, k]), unknown.variable.name
    instance.terminate()
    instance.freeInstance()


if description.modelExchange is not None:
    derivatives(extract(fmu), description.fmiVersion[0])

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
