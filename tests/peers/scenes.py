#!/usr/bin/env python3
"""Writes the benchmark scenes that are too long to write by hand, into scenes/benchmarks:

    python3 tests/peers/scenes.py                 A02_N40.toml, chain_N10.toml, chain_N100.toml
    python3 tests/peers/scenes.py chain 1000      chain_N1000.toml
    python3 tests/peers/scenes.py four-bars 80    A02_N80.toml (which has no reference)
"""

import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[2] / "scenes" / "benchmarks"
WRITTEN = "# Written by tests/peers/scenes.py."


def body(name, position, lines):
    return f'\n[[body]]\nname = "{name}"\n{lines}\nposition = {position}\n'


def revolute(name, first, second, point):
    return (
        f'\n[[joint]]\nname = "{name}"\ntype = "revolute"\nbodies = ["{first}", "{second}"]\n'
        f"point = {point}\naxis = [0, 0, 1]\n"
    )


def output(name, of, quantity, component, point):
    return (
        f'\n[[output]]\nname = "{name}"\nquantity = "{quantity}"\nof = "{of}"\n'
        f'point = {point}\ncomponent = "{component}"\n'
    )


def check(name, kind, reference, tolerance, more=""):
    return (
        f'\n[[check]]\nname = "{name}"\nkind = "{kind}"\nvalue = "{name}"\n'
        f"reference = {reference}\ntolerance = {tolerance}\n{more}"
    )


def csv_column(table, column):
    return f'{{ csv = "../reference/{table}.csv", column = "{column}" }}'


def four_bars(n, t_end, reference):
    """Problem A02: n four-bars side by side, all rods 1 m and 1 kg."""
    text = f"""# N-four-bar mechanism with N = {n}: problem A02 of the IFToMM multibody benchmark library (University of A Coruna).
# {n + 1} vertical links on ground pivots 1 m apart and {n} couplers between their upper ends, all uniform rods of 1 m and 1 kg.
# Links upright at the start; the upper ends move at 1 m/s in x. Spatial revolute joints along z: {15 * n + 5} rows of rank
# {12 * n + 5}, and at every passage of the horizontal {n} fewer.
{f"# Reference: scenes/reference/{reference}.csv (exact, by elliptic functions)." if reference else "# No reference."}
{WRITTEN} Bodies are those of A02_N2.toml.

title = "A02 N-four-bar mechanism, N = {n}"

[plugins]
libraries = ["joints"]

[parameters]
rod.axial = "1e-3 kg m^2"
rod.transverse = "1 kg * (1 m)^2 / 12"

[simulation]
gravity = [0, -9.81, 0]
t_end = {t_end}
tolerance = 1e-12
output_step = 0.05
"""
    inertia = 'mass = 1\ninertia = ["rod.axial", "rod.transverse", "rod.transverse"]'
    for k in range(n + 1):
        lines = inertia + "\norientation = { x = [0, 1, 0], y = [-1, 0, 0] }"
        lines += "\nvelocity = [0.5, 0, 0]\nangular_velocity = [0, 0, -1]"
        text += body(f"link{k}", [k, 0.5, 0], lines)
    for k in range(1, n + 1):
        text += body(f"coupler{k}", [k - 0.5, 1, 0], inertia + "\nvelocity = [1, 0, 0]\nangular_velocity = [0, 0, 0]")
    for k in range(n + 1):
        text += revolute(f"A{k}", "ground", f"link{k}", [k, 0, 0])
    for k in range(n + 1):
        if k > 0:
            text += revolute(f"B{k}_left", f"coupler{k}", f"link{k}", [k, 1, 0])
        if k < n:
            text += revolute(f"B{k}_right", f"link{k}", f"coupler{k + 1}", [k, 1, 0])
    for name, component in (("B0x", "x"), ("B0y", "y")):
        text += output(name, "link0", "position", component, "[0.5, 0, 0]")
        if reference:
            text += check(name, "position", csv_column(reference, name), "1e-9")
    return text


def chain(n, t_end, reference):
    """n equal rods, together 1 m and 1 kg, on a pivot, released horizontally."""
    lines = [
        f"# Chain of {n} equal uniform rods, together 1 m and 1 kg, on a pivot, released at rest along +x.",
    ]
    if reference:
        lines.append(f"# Reference: scenes/reference/{reference}.csv (tests/peers/chain_reference.py).")
    else:
        lines.append("# Its tip falls freely, y = -g t^2 / 2, until it is told of the pivot.")
    text = "\n".join(lines) + f"""
{WRITTEN} Body frames: origin at the centre of mass, x along the rod. The moment of inertia about
# the rod's own axis is 0 in the problem; here it is a hundredth of the other, which has no influence.

title = "Chain of {n}"

[plugins]
libraries = ["joints"]

[parameters]
rod.length = "1 m / {n}"
rod.mass = "1 kg / {n}"
rod.transverse = "rod.mass * rod.length^2 / 12"
rod.axial = "rod.transverse / 100"

[simulation]
gravity = [0, -9.81, 0]
t_end = {t_end}
output_step = 0.01
"""
    for k in range(n):
        lines = 'mass = "rod.mass"\ninertia = ["rod.axial", "rod.transverse", "rod.transverse"]'
        lines += "\nvelocity = [0, 0, 0]\nangular_velocity = [0, 0, 0]"
        text += body(f"rod{k + 1}", f'["{k + 0.5} * rod.length", 0, 0]', lines)
    text += revolute("joint1", "ground", "rod1", [0, 0, 0])
    for k in range(1, n):
        text += revolute(f"joint{k + 1}", f"rod{k}", f"rod{k + 1}", f'["{k} * rod.length", 0, 0]')
    for name, component in (("tip_x", "x"), ("tip_y", "y")):
        text += output(name, f"rod{n}", "position", component, '["rod.length / 2", 0, 0]')
    if reference:
        for name in ("tip_x", "tip_y"):
            text += check(name, "position", csv_column(reference, name), "2e-12")
    else:
        text += check("tip_y", "position", '"-9.81 / 2 * t^2"', "1e-13", "")
    return text


def write(name, text):
    (FOLDER / f"{name}.toml").write_text(text)
    print(f"scenes/benchmarks/{name}.toml")


def main(arguments):
    if not arguments:
        write("A02_N40", four_bars(40, 20, "A02_N40"))
        write("chain_N10", chain(10, 1, "chain_N10"))
        write("chain_N100", chain(100, 0.2, None))
    elif arguments[0] == "chain" and len(arguments) == 2:
        n = int(arguments[1])
        write(f"chain_N{n}", chain(n, 0.2, None))
    elif arguments[0] == "four-bars" and len(arguments) == 2:
        n = int(arguments[1])
        write(f"A02_N{n}", four_bars(n, 10, None))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main(sys.argv[1:])
