"""Does to an FMU what importing tools do, and what they should not: fuzz.py FMU SEED ROUNDS

Co-simulation: whatever is done, nothing crashes; errors come with a message; two instances that are treated alike give the same bytes,
whatever others do; saved states lead to the same bytes; a reset instance is a new one. Prints what was done.
"""

import math
import random
import shutil
import sys

from fmpy import extract, instantiate_fmu, read_model_description

fmu, seed, rounds = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
rng = random.Random(seed)
description = read_model_description(fmu)
two = description.fmiVersion[0] == "2"
folder = extract(fmu)
variables = description.modelVariables
inputs = [v for v in variables if v.causality == "input"]
outputs = [v.valueReference for v in variables if v.causality == "output"]
parameters = [v for v in variables if v.causality == "parameter"]
states = [v for v in variables if v.name.startswith("machine.state")]
step = float(description.defaultExperiment.stepSize)
counts = {}


class Machine:
    """An instance with the state that it should be in."""

    def __init__(self):
        self.fmu = instantiate_fmu(folder, description, fmi_type="CoSimulation")
        self.time = 0.0

    def begin(self, start=0.0, stop=None, settings=()):
        self.time = start
        if two:
            self.fmu.setupExperiment(startTime=start, stopTime=stop, tolerance=None)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=start, stopTime=stop)
        for reference, value in settings:
            self.put(reference, value)
        self.fmu.exitInitializationMode()

    def put(self, reference, value):
        (self.fmu.setReal if two else self.fmu.setFloat64)([reference], [value])

    def get(self, references=None):
        references = outputs if references is None else references
        return list((self.fmu.getReal if two else self.fmu.getFloat64)(references))

    def advance(self, h, time=None):
        self.fmu.doStep(currentCommunicationPoint=self.time if time is None else time, communicationStepSize=h)
        self.time += h

    def save(self):
        return self.fmu.getFMUstate() if two else self.fmu.getFMUState()

    def restore(self, state):
        self.fmu.setFMUstate(state) if two else self.fmu.setFMUState(state)

    def forget(self, state):
        self.fmu.freeFMUstate(state) if two else self.fmu.freeFMUState(state)

    def serialise(self, state):
        return self.fmu.serializeFMUstate(state) if two else self.fmu.serializeFMUState(state)

    def deserialise(self, data):
        return self.fmu.deSerializeFMUstate(data) if two else self.fmu.deserializeFMUState(data)

    def end(self):
        self.fmu.terminate()
        self.fmu.freeInstance()


def refused(what, call):
    """It must be refused, and say so."""
    counts[what] = counts.get(what, 0) + 1
    try:
        call()
    except Exception:
        return
    sys.exit(f"{what}: not refused")


def history(machine, plan):
    """What a machine gives along a plan of inputs and steps."""
    found = [machine.get()]
    for action, first, second in plan:
        if action == "input":
            machine.put(first, second)
        else:
            try:
                machine.advance(first)
            except Exception:
                found.append("failed")
                return found
        found.append(machine.get())
    assert all(value == "failed" or all(map(math.isfinite, value)) for value in found)
    return found


def some_plan(length):
    plan = []
    for _ in range(length):
        if inputs and rng.random() < 0.3:
            variable = rng.choice(inputs)
            start = float(variable.start or 0.0)
            plan.append(("input", variable.valueReference, start + rng.uniform(-1, 1) * max(1.0, abs(start))))
        else:
            # Also none, and such as are no multiple of anything.
            plan.append(("step", step * rng.choice([0.0, 1.0, 1.0, 2.0, 3.7, rng.random(), 1e-9]), None))
    return plan


for _ in range(rounds):
    settings = []
    for parameter in parameters:
        low, high = float(parameter.min), float(parameter.max)
        if rng.random() < 0.5:
            settings.append((parameter.valueReference, rng.uniform(low, high)))
    plan = some_plan(12)
    alone = Machine()
    alone.begin(settings=settings)
    expected = history(alone, plan)
    failed = expected[-1] == "failed"
    counts["failed plans"] = counts.get("failed plans", 0) + failed

    # A second one, step by step beside one that does something else.
    a, b = Machine(), Machine()
    a.begin(settings=settings)
    b.begin()
    found, other = [a.get()], some_plan(len(plan))
    for (action, first, second), (does, what, value) in zip(plan, other):
        try:
            a.put(first, second) if action == "input" else a.advance(first)
        except Exception:
            found.append("failed")
            break
        found.append(a.get())
        try:
            b.put(what, value) if does == "input" else b.advance(what)
        except Exception:
            pass
    assert found == expected, "two instances are not independent"
    counts["interleaved"] = counts.get("interleaved", 0) + 1

    # Reset, it is a new one.
    a.fmu.reset()
    a.begin(settings=settings)
    assert history(a, plan) == expected, "a reset instance is not a new one"
    counts["reset"] = counts.get("reset", 0) + 1

    # Saved between any two actions, also before the first.
    at = rng.randrange(len(plan))
    c = Machine()
    c.begin(settings=settings)
    before = history(c, plan[:at])
    if before[-1] != "failed":
        state, time = c.save(), c.time
        data = c.serialise(state)
        rest = history(c, plan[at:])
        c.restore(state)
        c.time = time
        assert history(c, plan[at:]) == rest, "a restored state goes another way"
        d = Machine()
        d.begin()
        copy = d.deserialise(data)
        d.restore(copy)
        d.time = time
        assert history(d, plan[at:]) == rest, "a state of another instance goes another way"
        refused("damaged states", lambda: d.deserialise(b"x" + bytes(data)[1:]))
        c.forget(state)
        d.forget(copy)
        d.end()
        counts["saved"] = counts.get("saved", 0) + 1
    c.end()
    b.end()
    alone.end()

    # What must be refused leaves everything as it was.
    if not failed:
        e = Machine()
        e.begin(stop=100 * step, settings=settings)
        found = [e.get()]
        for action, first, second in plan:
            for value in (math.nan, math.inf):
                if inputs:
                    refused("inputs that are no numbers", lambda: e.put(rng.choice(inputs).valueReference, value))
            refused("negative steps", lambda: e.advance(-step, e.time))
            refused("steps that are no numbers", lambda: e.advance(rng.choice([math.nan, math.inf, 1e300]), e.time))
            refused("steps from another time", lambda: e.advance(step, e.time + 10 * step))
            refused("steps behind the end", lambda: e.advance(200 * step, e.time))
            refused("outputs", lambda: e.put(rng.choice(outputs), 0.0))
            refused("states while it runs", lambda: e.put(rng.choice(states).valueReference, 0.0))
            refused("unknown variables", lambda: e.get([4_000_000_000]))
            e.put(first, second) if action == "input" else e.advance(first)
            found.append(e.get())
        assert found == expected, "what was refused left traces"
        for parameter in parameters:
            value = 0.5 * (float(parameter.min) + float(parameter.max))
            if parameter.variability == "tunable":
                e.put(parameter.valueReference, value)
                assert e.get([parameter.valueReference]) == [value]
                counts["tuned"] = counts.get("tuned", 0) + 1
            else:
                refused("fixed parameters while it runs", lambda: e.put(parameter.valueReference, value))
            refused("parameters beyond their range", lambda: e.put(parameter.valueReference, 1.01 * float(parameter.max) + 1.0))
        e.fmu.terminate()
        refused("steps after the end", lambda: e.advance(step, e.time))
        e.fmu.freeInstance()
    f = Machine()
    refused("steps before the beginning", lambda: f.advance(step, 0.0))
    f.fmu.freeInstance()
    a.end()

shutil.rmtree(folder, ignore_errors=True)
print(", ".join(f"{what} {count}" for what, count in counts.items()))
