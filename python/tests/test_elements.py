"""Elements written in Python: traced, used, saved, and refused with what to write."""

from __future__ import annotations

import copy
import math
import pickle
import random
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy
import odyn
import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "python" / "examples"))

SCENE = """
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.01
[[body]]
name = "a"
mass = 1.0
inertia = [0.1, 0.1, 0.1]
position = [0.4, 0, 0]
[[body]]
name = "b"
mass = 0.5
inertia = [0.05, 0.05, 0.05]
position = [0.4, 0.3, 0]
[[joint]]
name = "first"
type = "distance-rod"
bodies = ["ground", "a"]
params.length = "40 cm"
[[joint]]
name = "second"
type = "distance-rod"
bodies = ["a", "b"]
params.length = "30 cm"
[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["ground", "b"]
params = { stiffness = "120 N/m", damping = "0.7 N s/m", free_length = "0.2 m", force_of_elongation = "900 x^3" }
[[output]]
name = "x"
quantity = "position"
of = "a"
component = "x"
[[output]]
name = "pull"
quantity = "reaction_force"
of = "second"
on = "b"
component = "x"
"""

OWN = SCENE.replace("distance-rod", "rod").replace("translational-spring-damper", "spring-damper")
WITHOUT = OWN.replace('libraries = ["joints", "forces"]', "libraries = []")


def same(one: odyn.Run, other: odyn.Run) -> None:
    assert list(one) == list(other)
    assert one.t.tobytes() == other.t.tobytes()
    for name in one:
        assert one[name].tobytes() == other[name].tobytes(), name
    assert len(one.t) > 50


def test_a_joint_and_a_force_equal_those_in_rust_bit_for_bit():
    import elements

    rust = odyn.load(text=SCENE)
    own = odyn.load(text=WITHOUT, elements=[elements.Rod, elements.SpringDamper])
    for options in [{}, {"method": "radau5"}, {"formulation": "cartesian"}]:
        same(own.run(**options), rust.run(**options))
    plans = [re.search(r"written, (.*)", str(model.plan())).group(1) for model in (own, rust)]
    assert plans[0] == plans[1] and "distinct" in plans[0]


def test_the_file_that_is_kept_is_what_its_source_writes(tmp_path):
    import elements

    file = odyn.save(tmp_path / "mechanics.odyn-element", elements.ALL, about="elements written in Python")
    assert file.read_bytes() == (ROOT / "python" / "examples" / file.name).read_bytes()


def test_a_saved_element_serves_other_scenes_and_the_program(tmp_path, program):
    import elements

    assert elements.Rod.save(tmp_path / "rod.odyn-element", version="1.2.0", about="a rod").is_file()
    assert elements.SpringDamper.save(tmp_path).name == "spring-damper.odyn-element"
    listed = WITHOUT.replace("libraries = []", 'libraries = ["rod", "spring-damper"]\npath = ["."]')
    scene = tmp_path / "scene.toml"
    scene.write_text(listed)
    same(odyn.load(scene).run(), odyn.load(text=SCENE).run())
    done = program("run", scene, "-o", tmp_path / "out", "-q")
    assert done.returncode == 0, done.stderr
    assert "rod" in (tmp_path / "out" / "summary.json").read_text()
    done = program("plugin", "check", tmp_path / "rod.odyn-element")
    assert done.returncode == 0 and "0 FAILED" in done.stdout and "length: number [m], required, > 0" in done.stdout
    done = program("elements", "describe", "rod", "--plugin", tmp_path / "rod.odyn-element")
    assert done.returncode == 0 and "Distance of the two points." in done.stdout
    with pytest.raises(ValueError, match=r"ends with `\.odyn-element`"):
        elements.Rod.save(tmp_path / "rod.txt")
    with pytest.raises(ValueError, match="three numbers"):
        elements.Rod.save(tmp_path, version="new")
    with pytest.raises(TypeError, match="is no element"):
        odyn.load(text=WITHOUT, elements=[int])


def test_a_model_goes_to_other_processes_with_its_elements(tmp_path):
    import elements

    model = odyn.load(text=WITHOUT, elements=[elements.Rod, elements.SpringDamper]).set({"first.params.length": "40 cm"})
    again = pickle.loads(pickle.dumps(model))
    same(again.run(), model.run())
    same(copy.copy(model).run(), model.run())


def test_a_study_has_its_elements_where_workers_see_them(tmp_path):
    import elements

    scene = tmp_path / "scene.toml"
    scene.write_text(WITHOUT)
    model = odyn.load(scene, elements=[elements.Rod, elements.SpringDamper])
    points = {"spring.params.stiffness": ["100 N/m", "140 N/m"]}
    study = odyn.study(model, points, output=tmp_path / "study", jobs=1)
    assert study["status"] == ["completed"] * 2
    assert sorted(one.name for one in (tmp_path / "study" / "elements").iterdir()) == [
        "rod.odyn-element",
        "spring-damper.odyn-element",
    ]
    again = odyn.study(model, points, output=tmp_path / "study", jobs=1, resume=True)
    assert again.rows == study.rows


def test_parameters_are_checked_as_those_of_libraries():
    import elements

    model = odyn.load(text=WITHOUT, elements=[elements.Rod, elements.SpringDamper])
    for value, part in [("0 m", "> 0"), ("3 kg", "m")]:
        with pytest.raises(odyn.Error) as caught:
            model.set({"first.params.length": value}).run()
        assert part in str(caught.value)
    assert elements.Rod.parameters["length"]["unit"] == "m"
    assert repr(elements.Rod) == "<odyn joint 'rod': length>"


def test_every_function_gives_what_that_of_python_gives(tmp_path, program):
    """Values in a run; derivatives by the test kit, which holds those of the recording to differences of values."""

    @odyn.force(frames=["i", "j"])
    class Everything:
        """All operations at once."""

        a = odyn.param("1", default=1.3)
        n = odyn.param("1", default=2.5)
        v = odyn.vector_param("m", default=[0.1, 0.2, 0.3])

        @odyn.channel()
        def value(self, at: odyn.Motion) -> odyn.Number:
            """everything"""
            d = at[1].position - at[0].position - self.v
            x = odyn.tanh(odyn.dot(d, odyn.cross(at[0].x, at[1].y)))
            y = odyn.clip(odyn.length(d), 0.1, 2.0) + 1.1
            s = odyn.sin(x) * odyn.cos(y) + odyn.tan(x / 2) - odyn.atan2(x, y) + odyn.hypot(x, y)
            s += odyn.asin(x / 2) + odyn.acos(x / 2) + odyn.atan(x) + odyn.exp(-x) * odyn.log(y) + odyn.sqrt(y)
            s += y**3 + y**self.n + y**-2 + 2**x + abs(x - 0.2) + odyn.maximum(x, y) - odyn.minimum(x, 0.1)
            s += odyn.where((x > 0) & ~(y >= 1.5) | (x < -0.5), x, y) + odyn.where(self.a > 1, x * self.a, y)
            return s + odyn.table(x, [[-1, 0], [0, 1], [1, 0.5]], interpolation="spline") + at.time

        def wrench(self, at: odyn.Motion, out: odyn.Loads) -> None:
            out.force_pair_at(0, 1, at[0].point([0.1, 0, 0]), at[0].direction([0, 1, 0]) * self.value(at))

    done = program("plugin", "check", Everything.save(tmp_path), "--except", "frame-invariance")
    assert done.returncode == 0 and "jacobian          ok" in done.stdout, done.stdout
    values = []
    for x in (0.3, -0.7):
        text = f"""
[simulation]
t_end = 0.001
output_step = 0.001
[[body]]
name = "b"
mass = 1
inertia = [1, 1, 1]
position = [{x}, 0.4, 0.5]
[[force]]
name = "f"
type = "everything"
bodies = ["ground", "b"]
[[output]]
name = "v"
quantity = "value"
of = "f"
channel = "value"
"""
        values.append(odyn.load(text=text, elements=[Everything]).run()["v"][0])

    def by_hand(px: float) -> float:
        d = numpy.array([px, 0.4, 0.5]) - [0.1, 0.2, 0.3]
        x = math.tanh(d @ numpy.cross([1, 0, 0], [0, 1, 0]))
        y = min(max(float(numpy.linalg.norm(d)), 0.1), 2.0) + 1.1
        s = math.sin(x) * math.cos(y) + math.tan(x / 2) - math.atan2(x, y) + math.hypot(x, y)
        s += math.asin(x / 2) + math.acos(x / 2) + math.atan(x) + math.exp(-x) * math.log(y) + math.sqrt(y)
        s += y**3 + y**2.5 + y**-2 + 2**x + abs(x - 0.2) + max(x, y) - min(x, 0.1)
        s += (x if (x > 0 and y < 1.5) or x < -0.5 else y) + x * 1.3
        points = [(-1, 0), (0, 1), (1, 0.5)]
        scipy = pytest.importorskip("scipy.interpolate")
        return s + float(scipy.CubicSpline(*zip(*points, strict=True), bc_type="natural")(x))

    assert values == pytest.approx([by_hand(0.3), by_hand(-0.7)], rel=1e-14)


def refused(build: Callable[[], Any]) -> odyn.TraceError:
    with pytest.raises(odyn.TraceError) as caught:
        build()
    assert caught.value.place is not None and Path(caught.value.place.file) == Path(__file__)
    assert caught.value.message and str(caught.value).startswith(f"error[{caught.value.code}]")
    return caught.value


def of_residual(residual: Callable[[Any, Any], Any]) -> Callable[[], Any]:
    def build() -> Any:
        members = {"length": odyn.param("m", above=0), "residual": residual}
        return odyn.joint(frames=["i", "j"])(type("Bad", (), members))

    return build


def branch(self, at):
    x = at[1].position.x
    return [x if x > 0 else -x]


def in_one_line(test: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    return lambda self, at: [test(at[1].position.x, self.length)]


@pytest.mark.parametrize(
    ("function", "remedy"),
    [
        (lambda x, p: 1.0 if x else 2.0, "odyn.where(x > 0, a, b)"),
        (lambda x, p: 1.0 if x < p < 2 else 2.0, "odyn.where(x > 0, a, b)"),
        (lambda x, p: x if p > 1 else 2.0, "odyn.where(x > 0, a, b)"),
        (lambda x, p: max(x, 0.0), "odyn.maximum"),
        (lambda x, p: math.sin(x), "odyn.sin(x)"),
        (lambda x, p: float(x), "odyn.sqrt(x)"),
        (lambda x, p: x if x == 0 else p, "odyn.where"),
        (lambda x, p: x if x in (1, 2) else p, "odyn.where"),
        (lambda x, p: sum(x for _ in range(p)), "when the element is defined"),
        (lambda x, p: int(p) * x, "number of teeth"),
        (lambda x, p: round(x), "steps are tables"),
        (lambda x, p: x % 1, "periodic=True"),
        (lambda x, p: numpy.floor(x), "the functions of odyn"),
        (lambda x, p: numpy.array([x, p]).astype(float)[0], "odyn.sin(x)"),
        (lambda x, p: not x, "odyn.where(x > 0, a, b)"),
    ],
)
def test_a_traced_value_used_as_a_number_is_refused_with_what_to_write(function, remedy):
    error = refused(of_residual(in_one_line(function)))
    assert error.code == "ODY0831"
    assert remedy in error.remedy


def test_a_branch_is_refused_where_it_is_written():
    error = refused(of_residual(branch))
    assert error.code == "ODY0831" and "odyn.where(x > 0, a, b)" in error.remedy
    lines = Path(__file__).read_text(encoding="utf-8").splitlines()
    assert "if x > 0 else -x" in lines[error.place.line - 1]
    assert isinstance(error, odyn.Error) and isinstance(error, TypeError)


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda x, p: 2**x**x, "an exponent depends on parameters only"),
        (lambda x, p: (-2) ** x, "must be a positive number"),
        (lambda x, p: float("nan") * x, "nan is no number"),
        (lambda x, p: x + "1", "is no number that equations can use"),
        (lambda x, p: (x > 0) + 1, "unsupported operand"),
        (lambda x, p: odyn.where(x, 1, 2), "takes a condition"),
        (lambda x, p: odyn.Vec(x, p, 0), "where one number is needed"),
        (lambda x, p: odyn.length([x, p]), "is no vector of three numbers"),
    ],
)
def test_what_cannot_be_recorded_is_refused(function, message):
    build = of_residual(in_one_line(function))
    if message == "unsupported operand":
        with pytest.raises(TypeError, match=message):
            build()
        return
    error = refused(build)
    assert error.code == "ODY0832" and message in error.message


def test_what_does_not_fit_a_declaration_is_refused():
    def start_that_moves() -> Any:
        @odyn.force(frames=["i", "j"])
        class Late:
            x = odyn.state("m", start=lambda self: self.x + 1)

            def rates(self, at: odyn.Motion) -> list[odyn.Number]:
                return [-self.x]

            def wrench(self, at: odyn.Motion, out: odyn.Loads) -> None:
                out.force("k", [self.x, 0, 0])

        return Late

    assert "there is no frame 'k'" in refused(start_that_moves).message

    def rates_missing() -> Any:
        @odyn.force(frames=["i"])
        class Late:
            x = odyn.state("m")

            def wrench(self, at: odyn.Motion, out: odyn.Loads) -> None:
                pass

        return Late

    assert "`Late.rates` is missing" in refused(rates_missing).message

    def no_rows() -> Any:
        @odyn.joint()
        class Nothing:
            pass

        return Nothing

    assert "gives no rows" in refused(no_rows).message

    def bad_name() -> Any:
        @odyn.joint(name="My Rod")
        class Rod:
            def residual(self, at: odyn.Motion) -> list[odyn.Number]:
                return [at[0].position.x]

        return Rod

    assert "cannot be the name" in refused(bad_name).message


    def bad_parameter() -> Any:
        members = {"_length": odyn.param("m"), "residual": lambda self, at: [at[0].position.x - self._length]}
        return odyn.joint()(type("Hidden", (), members))

    assert "`Hidden._length` is no name for scenes" in refused(bad_parameter).message


def test_values_of_another_recording_are_refused():
    kept: list[odyn.Number] = []

    def build() -> Any:
        @odyn.joint()
        class First:
            def residual(self, at: odyn.Motion) -> list[odyn.Number]:
                kept.append(at[0].position.x)
                return [kept[0] + at[1].position.x]

        @odyn.joint()
        class Second:
            def residual(self, at: odyn.Motion) -> list[odyn.Number]:
                return [kept[0] + at[1].position.x]

    assert "of another element" in refused(build).message


def test_numbers_of_numpy_and_of_python_are_constants():
    @odyn.joint(frames=["i", "j"])
    class Mixed:
        length = odyn.param("m", above=0)

        def residual(self, at: odyn.Motion) -> list[odyn.Number]:
            d = at[1].position - numpy.array([0.0, 0.0, 0.0])
            return [numpy.float64(2.0) * numpy.sin(d.x) + numpy.float32(0.5) * self.length + sum([d.y, d.z]) + odyn.sin(0.5)]

    text = Mixed.text
    assert "mul 2.0 v" in text and "mul 0.5 v" in text and f" {math.sin(0.5)!r}" in text
    assert "v0 = param length" in text


def test_random_expressions_give_what_python_gives():
    """Equations drawn at random, as channels of a force: the value of a run is what floats give, to the last bit but for powers."""
    draw = random.Random(5)

    def expression(depth: int) -> str:
        if depth == 0:
            return draw.choice(["x", "y", "p", f"{draw.uniform(-2, 2):.3f}"])
        a, b = expression(depth - 1), expression(depth - 1)
        return draw.choice([f"({a} + {b})", f"({a} - {b})", f"({a} * {b})", f"f.sin({a})", f"f.cos({a})", f"f.atan2({a}, {b})"])

    texts = [expression(5) for _ in range(20)]
    members: dict[str, Any] = {"p": odyn.param("1"), "wrench": lambda self, at, out: None}
    for k, text in enumerate(texts):
        code = compile(text, "expression", "eval")

        def channel(self: Any, at: odyn.Motion, code: Any = code) -> Any:
            return eval(code, {"f": odyn, "x": at[0].position.x, "y": at[0].position.y, "p": self.p})

        members[f"c{k}"] = odyn.channel()(channel)
    drawn = odyn.force(frames=["i"], name="drawn")(type("Drawn", (), members))
    outputs = "".join(
        f'[[output]]\nname = "c{k}"\nquantity = "value"\nof = "f"\nchannel = "c{k}"\n' for k in range(len(texts))
    )
    scene = f"""
[simulation]
t_end = 0.001
output_step = 0.001
[[body]]
name = "b"
mass = 1
inertia = [1, 1, 1]
position = [0.3125, -0.75, 0]
[[force]]
name = "f"
type = "drawn"
bodies = ["b"]
params.p = 1.7
{outputs}"""
    run = odyn.load(text=scene, elements=[drawn]).run()
    for k, text in enumerate(texts):
        expected = eval(text, {"f": math, "x": 0.3125, "y": -0.75, "p": 1.7})
        assert run[f"c{k}"][0] == pytest.approx(expected, rel=1e-13, abs=1e-15), text


ALONE = """
[simulation]
gravity = [0, 0, 0]
t_end = 1
output_step = 0.01
method = "dop853"
tolerance = 1e-11
[[body]]
name = "a"
mass = 1.0
inertia = [0.1, 0.1, 0.1]
position = [0, 0, 0]
[[force]]
name = "one"
type = "TYPE"
bodies = [BODIES]
params = { PARAMS }
"""


def alone(word: str, bodies: str, params: str, elements: list[Any], more: str = "") -> odyn.Model:
    text = ALONE.replace("TYPE", word).replace("BODIES", bodies).replace("PARAMS", params)
    return odyn.load(text=text + more, elements=elements)


def test_a_mass_that_slides_along_a_frame_has_its_frequency(tmp_path, program):
    @odyn.force(frames=["i"])
    class Absorber(odyn.Recorded):
        """A mass on a spring along the z axis of a frame."""

        mass = odyn.param("kg", above=0)
        stiffness = odyn.param("N/m", min=0)
        first = odyn.param("m")
        q = odyn.flexible("m", start=lambda self: self.first, doc="where it is")
        work = odyn.state("J")

        def wrench(self, at, out):
            pass

        def kinetic(self, at):
            v = at[0].velocity + at[0].z * self.q.rate
            return v.dot(v) * (0.5 * self.mass)

        def flexible_forces(self, at):
            return [-self.stiffness * self.q]

        def potential(self, at):
            return 0.5 * self.stiffness * self.q * self.q

        def rates(self, at):
            return {"work": -self.stiffness * self.q * self.q.rate}

        @odyn.channel("m")
        def where(self, at):
            return self.q

        @odyn.channel("J")
        def done(self, at):
            return self.work

    mass, stiffness, first = 0.5, 200.0, 0.1
    outputs = "".join(
        f'[[output]]\nname = "{one}"\nquantity = "value"\nof = "one"\nchannel = "{one}"\n' for one in ("where", "done")
    )
    params = f"mass = {mass}, stiffness = {stiffness}, first = {first}"
    run = alone("absorber", '"a"', params, [Absorber], outputs).run().raise_if_not_ok()
    # With the free body it swings at the frequency of the reduced mass.
    expected = first * numpy.cos(math.sqrt(stiffness * (1 / mass + 1 / 1.0)) * run.t)
    assert abs(run["where"] - expected).max() < 1e-9
    assert abs(run["done"] - stiffness / 2 * (first**2 - expected**2)).max() < 1e-9
    assert run.audit["energy_error_relative"] < 1e-9
    done = program("plugin", "check", Absorber.save(tmp_path))
    assert done.returncode == 0, done.stdout + done.stderr
    with pytest.raises(odyn.TraceError, match="no `kinetic`"):

        @odyn.force(frames=["i"])
        class Massless:
            q = odyn.flexible("m")

            def wrench(self, at, out):
                pass

            def flexible_forces(self, at):
                return [0]

    with pytest.raises(odyn.TraceError, match=r"Rigid\.q"):

        @odyn.joint(frames=["i", "j"])
        class Rigid:
            q = odyn.flexible("m")

            def residual(self, at):
                return [at[1].position.x]


def test_words_choose_equations_and_rows_of_a_catalogue_parameters(tmp_path, program):
    def spring(name: str, law: Callable[[Any, Any], Any], words: bool) -> Any:
        class Spring:
            """A spring with one of three laws."""

            stiffness = odyn.param("N/m", min=0, example=100)
            if words:
                law = odyn.choice_param(["linear", "cubic", "tanh"], default="linear", doc="of its force")

            def wrench(self, at, out):
                d = at[0].position
                out.force(0, -self.stiffness * law(self, odyn.length(d)) * d)

        table = "# invented\nname,stiffness [N/mm]\nsoft,0.1\nhard,2.5\n" if words else ""
        return odyn.force(frames=["i"], name=name, catalog=table)(Spring)

    laws = {"linear": lambda self, x: 1.0, "cubic": lambda self, x: x * x, "tanh": lambda self, x: odyn.tanh(x) / x}
    chosen = spring(
        "spring",
        lambda self, x: odyn.where(self.law == "cubic", x * x, odyn.where(self.law != "tanh", 1.0, odyn.tanh(x) / x)),
        True,
    )
    output = '[[output]]\nname = "x"\nquantity = "position"\nof = "a"\ncomponent = "x"\n'
    own = [spring(f"spring-{word}", law, False) for word, law in laws.items()]

    def moved(word: str, params: str, elements: list[Any]) -> Any:
        run = alone(word, '"a"', params, elements, output).set({"a.position": [0.3, 0.1, 0]}).run()
        return run["x"]

    for word in laws:
        one = moved("spring", f'stiffness = 80, law = "{word}"', [chosen])
        # The equations of a run are those of the choice, not more.
        assert one.tobytes() == moved(f"spring-{word}", "stiffness = 80", own).tobytes()
        assert one[0] == 0.3 and abs(one[-1] - 0.3) > 1e-3
    assert moved("spring", "stiffness = 80", [chosen]).tobytes() == moved("spring-linear", "stiffness = 80", own).tobytes()
    assert moved("spring", 'use = "hard"', [chosen]).tobytes() == moved("spring-linear", 'stiffness = "2.5 N/mm"', own).tobytes()
    with pytest.raises(odyn.Error, match="quartic"):
        moved("spring", 'stiffness = 80, law = "quartic"', [chosen])
    with pytest.raises(odyn.Error, match="ODY0330"):
        moved("spring", 'use = "harder"', [chosen])
    file = chosen.save(tmp_path)
    shown = program("elements", "describe", "spring", "--plugin", file)
    assert "tanh" in shown.stdout and "hard" in shown.stdout, shown.stdout + shown.stderr
    done = program("plugin", "check", file)
    assert done.returncode == 0, done.stdout + done.stderr
    with pytest.raises(odyn.TraceError, match="is never 'quartic'"):
        spring("bad", lambda self, x: odyn.where(self.law == "quartic", 1.0, 0.0), True)
    with pytest.raises(odyn.TraceError, match="has no number yet"):
        spring("bad", lambda self, x: 1.0 if self.law == "cubic" else 0.0, True)
    with pytest.raises(odyn.TraceError, match="two or more different words"):
        odyn.choice_param(["one", "one"])
    with pytest.raises(odyn.TraceError, match="none of the choices"):
        odyn.choice_param(["one", "two"], default="three")


TYPED = '''
import odyn

@odyn.joint(frames=["i", "j"])
class Rod(odyn.Recorded):
    """Two points keep their distance."""

    length = odyn.param("m", above=0)
    law = odyn.choice_param(["stiff", "soft"])

    def residual(self, at: odyn.Motion) -> dict[str, odyn.Number]:
        d = at[1].position - at[0].position
        return {"distance": odyn.length(d) - odyn.where(self.law == "soft", 2.0, 1.0) * self.length}

path: str = str(Rod.save("rod.odyn-element", version="1.0.0"))
names: list[str] = [Rod.name, *Rod.parameters]
model: odyn.Model = odyn.load("scene.toml", elements=[Rod])
'''


def test_elements_are_typed(tmp_path):
    mypy = pytest.importorskip("mypy.api")
    file = tmp_path / "typed.py"
    file.write_text(TYPED + "Rod.saved()\n")
    text, errors, code = mypy.run(["--strict", "--no-incremental", "--follow-imports=silent", str(file)])
    assert code == 1 and text.count("error:") == 1 and 'no attribute "saved"' in text, text + errors
