#!/usr/bin/env python3
"""Writes scenes/reference/chain_N10.csv: the chain of scenes/benchmarks/chain_N10.toml, computed independently of O-DYN.

With the angles a_i of the rods above the horizontal, masses m and lengths l = 1/N, the kinetic energy is
T = 1/2 sum_ij M_ij cos(a_i - a_j) a_i' a_j', where M_ij = m l^2 (N - max(i, j) - 1/2) for i /= j (numbered from 0), M_ii = m l^2
(N - i - 1 + 1/3), and V = sum_i m g l (N - i - 1/2) sin a_i. Lagrange's equations:

    sum_j M_ij (cos(a_i - a_j) a_j'' + sin(a_i - a_j) a_j'^2) + m g l (N - i - 1/2) cos a_i = 0

integrated by extrapolation of the modified midpoint rule (Gragg-Bulirsch-Stoer; Hairer, Norsett, Wanner, Solving ODEs I, II.9).
Two runs with different steps and orders tell the digits that are certain.
"""

from math import cos, sin
from pathlib import Path

N = 10
T_END = 1
SAMPLES = 100


def derivative(y):
    n = len(y) // 2
    a, w = y[:n], y[n:]
    m = length = 1 / n
    s, c = [sin(x) for x in a], [cos(x) for x in a]
    rows = []
    for i in range(n):
        row = []
        right = -m * 9.81 * length * (n - i - 0.5) * c[i]
        for j in range(n):
            inertia = n - i - 1 + 1 / 3 if i == j else n - max(i, j) - 0.5
            inertia *= m * length**2
            row.append(inertia * (c[i] * c[j] + s[i] * s[j]))
            right -= inertia * (s[i] * c[j] - c[i] * s[j]) * w[j] ** 2
        rows.append(row + [right])
    # Gauss without pivoting: the matrix is positive definite.
    for k in range(n):
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            for j in range(k, n + 1):
                rows[i][j] -= factor * rows[k][j]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - sum(rows[i][j] * x[j] for j in range(i + 1, n))) / rows[i][i]
    return w + x


def midpoint(y, start, step, count):
    h = step / count
    before, now = y, [u + h * v for u, v in zip(y, start)]
    for _ in range(count - 1):
        d = derivative(now)
        before, now = now, [u + 2 * h * v for u, v in zip(before, d)]
    return now


def extrapolated(y, step, order):
    start = derivative(y)
    counts = [2 * k for k in range(1, order // 2 + 1)]
    table = []
    for k, count in enumerate(counts):
        table.append(midpoint(y, start, step, count))
        for j in range(k - 1, -1, -1):
            weight = (count / counts[j]) ** 2 - 1
            table[j] = [u + (u - v) / weight for u, v in zip(table[j + 1], table[j])]
    return table[0]


def run(steps, order):
    y = [0.0] * (2 * N)
    rows = []
    for sample in range(SAMPLES + 1):
        if sample > 0:
            for _ in range(steps):
                y = extrapolated(y, T_END / (SAMPLES * steps), order)
        a, w = y[:N], y[N:]
        x, up = sum(cos(v) for v in a) / N, sum(sin(v) for v in a) / N
        vx, vy = -sum(sin(v) * u for v, u in zip(a, w)) / N, sum(cos(v) * u for v, u in zip(a, w)) / N
        rows.append([x, up, vx, vy])
    return rows


def main():
    first, second = run(8, 12), run(12, 10)
    apart = max(abs(u - v) for a, b in zip(first, second) for u, v in zip(a, b))
    path = Path(__file__).resolve().parents[2] / "scenes" / "reference" / f"chain_N{N}.csv"
    with path.open("w") as file:
        file.write(f"# Chain of {N} uniform rods, together 1 m and 1 kg, released at rest along +x, g=9.81 in -y. Written by\n")
        file.write(f"# tests/peers/chain_reference.py; two runs (orders 12/10, different steps) differ by {apart:.1e}.\n")
        file.write("t,tip_x,tip_y,tip_vx,tip_vy\n")
        for k, row in enumerate(first):
            file.write(",".join([repr(k * T_END / SAMPLES)] + [repr(v) for v in row]) + "\n")
    print(path.name, f"runs differ by {apart:.1e}")


if __name__ == "__main__":
    main()
