"""Reproduce an energy paper on pocket milling: three strategies, two directions, one machine.

Edem & Balogun (2018) milled a pocket of 122 by 54 mm on a 3-axis mill whose x table rides on its y saddle. A
feed drive takes power in proportion to the weight it moves, P = W (a v + b), so a path along the heavier y
costs more, and every rapid return of a one-way strategy costs time and power for nothing. Each strategy is
written here as an NC program, read back, and charged block by block with the machine file of the library.

What is fitted and what is predicted: b of x and y comes from one row of Table 1 each, a from the zag rows of
Table 2. Zigzag and contour, both directions, and all times are predictions. What the paper doesn't print is
taken so: the y direction is the pocket turned by a quarter, the contour a spiral along its walls, rapid 10
m/min in x and y as in z. What doesn't reproduce: Eq. (5) gives more for the two retract rows of z than Table
1 prints (printed below); the 0.06 s that the paper adds to a pass for acceleration are left out, as it adds
none to a step.

Source: Edem & Balogun, IJE Trans. B 31(5), 2018, doi 10.5829/ije.2018.31.05b.22.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import fiveaxis as fx

FEED = 500.0 / 60.0  # mm/s
RAPID = 10_000.0 / 60.0  # mm/s
LENGTH, WIDTH, STEP = 114.0, 48.0, 6.0  # mm, of the tool centre's path; nine passes of the printed program
FIT = 46.0  # mm, what a tool of 8 mm has in a pocket of 54 mm: the contour's first loop, at the walls
CLEAR, DEPTH = 5.0, -0.5  # mm
GRAVITY = 9.80665
# Table 1: energy and time of a pass and of a step. Table 2: J in x and y direction, s.
PASS, STEP_ROW = (5328.65, 13.74), (340.58, 0.72)
TABLE_2 = {
    "zag": (54704.29, 70716.86, 138.13),
    "zigzag": (51044.30, 60790.00, 129.82),
    "contour": (52040.29, 57651.05, 127.56),
}


def zigzag() -> list[str]:
    """Lay passes there and back with steps at feed: the printed program."""
    lines, x = [f"G01 Z{DEPTH:g} F300"], 0.0
    for i in range(9):
        if i:
            lines.append(f"G01 Y{WIDTH - STEP * i:g}")
        x = LENGTH - x
        lines.append(f"G01 X{x:g} F500")
    return [*lines, f"G00 Z{CLEAR:g}", "G00 Z50"]


def zag() -> list[str]:
    """Lay passes one way; back in rapid above the part, down again at F300."""
    lines = [f"G01 Z{DEPTH:g} F300"]
    for i in range(9):
        if i:
            lines += [f"G00 Z{CLEAR:g}", "G00 X0", f"G00 Y{WIDTH - STEP * i:g}", f"G01 Z{DEPTH:g} F300"]
        lines.append(f"G01 X{LENGTH:g} F500")
    return [*lines, f"G00 Z{CLEAR:g}", "G00 Z50"]


def contour() -> list[str]:
    """Lay a rectangular spiral from the pocket's walls inwards."""
    lines = [f"G01 Z{DEPTH:g} F300"]
    inset = 0.0
    while True:
        lines.append(f"G01 X{LENGTH - inset:g} F500")
        if FIT - 2.0 * inset < STEP:
            return [*lines, f"G00 Z{CLEAR:g}", "G00 Z50"]
        lines += [f"G01 Y{inset:g}", f"G01 X{inset:g}", f"G01 Y{FIT - inset - STEP:g}"]
        inset += STEP


STRATEGIES = {"zag": zag, "zigzag": zigzag, "contour": contour}


def program(strategy: str, direction: str) -> str:
    """Write a strategy along x or, turned by a quarter, along y."""
    lines = STRATEGIES[strategy]()
    start = f"G00 X0 Y{FIT if strategy == 'contour' else WIDTH:g} Z0"
    text = "\n".join(["G21 G90", start, *lines, "M30", ""])
    return text if direction == "x" else text.translate(str.maketrans("XY", "YX"))


def spent(machine: fx.Machine, strategy: str, direction: str) -> fx.Energy:
    """Charge one program."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pocket.nc"
        path.write_text(program(strategy, direction))
        return fx.program_energy(path, machine).energy


def fit_coefficients(machine: fx.Machine) -> dict[str, tuple[float, float]]:
    """Work out a and b of x and y from Tables 1 and 2."""
    weights = np.array([GRAVITY * (machine.axis(c).moved_mass + machine.load.mass) for c in "XY"])
    at_feed = np.array([joules / seconds for joules, seconds in (PASS, STEP_ROW)])  # W, = W (a v + b)
    plunge, lift = 75.12 + 6502.0 * 0.005, 88.82 + 8540.0 * RAPID / 1000.0  # W of z, Eq. (5)
    height = CLEAR - DEPTH
    z = plunge * (-DEPTH + 8 * height) / 5.0 + lift * (9 * height + 50.0 - CLEAR) / RAPID
    # What a zag row spends beyond its passes and z goes into eight rapid returns of one axis and eight rapid
    # steps of the other: two rows, two powers.
    rest = [TABLE_2["zag"][i] - 9 * at_feed[i] * LENGTH / FEED - z for i in range(2)]
    returns, steps = 8 * LENGTH / RAPID, 8 * STEP / RAPID  # s
    at_rapid = np.linalg.solve([[returns, steps], [steps, returns]], rest)
    a = 1000.0 * (at_rapid - at_feed) / (RAPID - FEED) / weights
    b = at_feed / weights - a * FEED / 1000.0
    return {letter: (float(a[i]), float(b[i])) for i, letter in enumerate("XY")}


def main() -> None:
    """Print the coefficients, then the paper's Table 2 beside ours."""
    machine = fx.load_machine("takisawa-mac-v3")
    for letter, (a, b) in fit_coefficients(machine).items():
        print(f"{letter}: a = {a:.4f} W/(N m/s), b = {b:.5f} W/N")
    print(f"{'strategy':10}{'x J':>10}{'paper':>10}{'y J':>10}{'paper':>10}{'s':>9}{'paper':>9}")
    means = {}
    for name, (x_paper, y_paper, s_paper) in TABLE_2.items():
        x, y = (spent(machine, name, direction) for direction in "xy")
        means[name] = (x.total + y.total, x.time, x_paper + y_paper, s_paper)
        row = (x.total, x_paper, y.total, y_paper)
        print(f"{name:10}" + "".join(f"{v:10.0f}" for v in row) + f"{x.time:9.2f}{s_paper:9.2f}")
    lift = spent(machine, "zigzag", "x").by_axis["Z"] - (75.12 + 6502.0 * 0.005) * 0.1
    print(f"z, rows N19 and N20: {lift:.0f} J by Eq. (5), {31.87 + 318.73:.0f} J in Table 1")
    print("mean of both directions against the contour: energy, paper's, time, paper's")
    for name in ("zag", "zigzag"):
        shares = (100.0 * (a / b - 1.0) for a, b in zip(means[name], means["contour"], strict=True))
        energy, time, energy_paper, time_paper = shares
        print(f"{name:10}{energy:+8.1f} %{energy_paper:+8.1f} %{time:+8.1f} %{time_paper:+8.1f} %")


if __name__ == "__main__":
    main()
