"""Feed energy of NC programs: a pocket in three strategies and two directions, block by block.

Edem & Balogun (2018) milled a pocket of 122 by 54 mm on a 3-axis mill whose x table rides on its y saddle. A
feed drive takes power in proportion to the weight it moves, P = W (a v + b), so a path along the heavier y
costs more, and every rapid return of a one-way strategy costs time and power for nothing. The strategies are
programs (`pocket/*.nc`; the zigzag one as printed, the others by its pattern), and each is charged block by
block with the machine file of the library.

What is fitted and what is predicted: b of x and y comes from one row of Table 1 each, a from the zag rows of
Table 2. Zigzag and contour, both directions, and all times are predictions. What the paper doesn't print is
taken so: the y direction is the pocket turned by a quarter, the contour a spiral along its walls, rapid 10
m/min in x and y as in z.

    python examples/papers/nc_programs.py [--figures FOLDER]

Source: Edem & Balogun, IJE Trans. B 31(5), 2018, doi 10.5829/ije.2018.31.05b.22.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from showing import BLUE, GREY, ORANGE, Misprint, Paper, Row, Table, show

import fiveaxis as fx
from fiveaxis.model import drive_power

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fiveaxis.lab import ProgramEnergy

PROGRAMS = Path(__file__).parent / "pocket"
STRATEGIES = ("zag", "zigzag", "contour")
FEED, PLUNGE = 500.0 / 60.0, 300.0 / 60.0  # mm/s
RAPID = 10_000.0 / 60.0  # mm/s
LENGTH, STEP = 114.0, 6.0  # mm, of a pass and from pass to pass; nine passes of the printed program
CLEAR, DEPTH = 5.0, -0.5  # mm
GRAVITY = 9.80665
# Table 1: energy (J, without base power) and time (s) of its blocks: engage, passes and steps, retract.
TABLE_1 = {
    "N01": (11.21, 0.10),
    **{f"N{n:02d}": (340.58, 0.72) if n % 2 else (5328.65, 13.74) for n in range(2, 19)},
    "N19": (31.87, 0.03),
    "N20": (318.73, 0.27),
}
TOTAL_1 = (51044.30, 129.82)
# Table 2: J in x and y direction, s of the cycle and of its G01 blocks.
TABLE_2 = {
    "zag": (54704.29, 70716.86, 138.13, 123.66),
    "zigzag": (51044.30, 60790.00, 129.82, 129.82),
    "contour": (52040.29, 57651.05, 127.56, 127.56),
}
# Y over X in per cent, as printed of the model and of the measurement.
Y_OVER_X = {"zag": (29.0, 15.0), "zigzag": (19.0, 14.0), "contour": (11.0, 15.0)}
# Eq. (5) of z, less the base power: W per (m/s), and W.
APPROACH, RETRACT = (6502.0, 75.12), (8540.0, 88.82)
RAMP = 0.06  # s, t_a: what a pass of Table 1 takes beyond its length over the feed
FEED_FORCE = 100.0  # N, to show what it does: the paper's isn't printed


@cache
def machine() -> fx.Machine:
    """Load the paper's machine."""
    return fx.load_machine("takisawa-mac-v3")


@cache
def spent(strategy: str, direction: str, force: float = 0.0) -> ProgramEnergy:
    """Charge a program along x or, turned by a quarter, along y, against a feed force in N."""
    process = {"spindle_rpm": 4000, "teeth": 4, "depth": -DEPTH, "width": STEP, "tangential": 1.0}
    text = (PROGRAMS / f"{strategy}.nc").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{strategy}-{direction}.nc"
        path.write_text(text if direction == "x" else text.translate(str.maketrans("XY", "YX")))
        return fx.program_energy(
            path, machine(), tool=fx.Tool.flat(8), process=process | {"feed_force": force}
        )


def block_sums(names: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Return energy (J) and time (s) of blocks of the zigzag program, by their numbers."""
    rows = {row["block"].split()[0]: row for row in spent("zigzag", "x").rows}
    return {name: (rows[name]["energy"], rows[name]["time"]) for name in names}


def z_power(coefficients: tuple[float, float], speed: float) -> float:
    """Compute the power of z by Eq. (5), W, at a speed in mm/s."""
    return coefficients[0] * speed / 1000.0 + coefficients[1]


def fit_coefficients(retract: tuple[float, float] = RETRACT) -> dict[str, tuple[float, float]]:
    """Work out a and b of x and y from Tables 1 and 2.

    Parameters
    ----------
    retract : Eq. (5) of z upwards
    """
    weights = np.array([GRAVITY * (machine().axis(c).moved_mass + machine().load.mass) for c in "XY"])
    at_feed = np.array([TABLE_1[n][0] / TABLE_1[n][1] for n in ("N02", "N03")])  # W, = W (a v + b)
    height = CLEAR - DEPTH
    z = z_power(APPROACH, PLUNGE) * (-DEPTH + 8 * height) / PLUNGE
    z += z_power(retract, RAPID) * (9 * height + 50.0 - CLEAR) / RAPID
    # What a zag row spends beyond its passes and z goes into eight rapid returns of one axis and eight rapid
    # steps of the other: two rows, two powers.
    rest = [TABLE_2["zag"][i] - 9 * at_feed[i] * LENGTH / FEED - z for i in range(2)]
    returns, steps = 8 * LENGTH / RAPID, 8 * STEP / RAPID  # s
    at_rapid = np.linalg.solve([[returns, steps], [steps, returns]], rest)
    a = 1000.0 * (at_rapid - at_feed) / (RAPID - FEED) / weights
    b = at_feed / weights - a * FEED / 1000.0
    return {letter: (float(a[i]), float(b[i])) for i, letter in enumerate("XY")}


def ramp_time(distance: float) -> float:
    """Compute the time of a move of x with ramps of `RAMP` at F500, s, by the time law (Eqs. 2 and 3)."""
    axes = tuple(replace(axis, max_acceleration=FEED / RAMP) for axis in machine().axes)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "move.nc"
        path.write_text(f"G21 G90\nG00 X0 Y0 Z0\nG01 X{distance:g} F500\nM30\n", encoding="utf-8")
        law = fx.program_energy(path, replace(machine(), axes=axes), corners="exact-stop")
    return float(law.rows[-1]["time"])


def y_over_x(strategy: str) -> float:
    """Compute by how much y costs more than x, %."""
    x, y = (spent(strategy, direction).energy.total for direction in "xy")
    return 100.0 * (y / x - 1.0)


def tables() -> tuple[Table, ...]:
    """Compute every table."""
    blocks, total = block_sums(TABLE_1), spent("zigzag", "x").energy
    energies, times = (
        tuple(Row(n, blocks[n][i], printed[i]) for n, printed in TABLE_1.items()) for i in (0, 1)
    )
    ends = {"x direction": 0, "y direction": 1}
    predicted = [
        Row(f"{name}, {where}", spent(name, where[0]).energy.total, TABLE_2[name][column])
        for name in STRATEGIES
        for where, column in ends.items()
    ]
    cycle, cuts = [], []
    for name in STRATEGIES:
        energy = spent(name, "x").energy
        cycle.append(Row(name, energy.time, TABLE_2[name][2]))
        cuts.append(Row(name, energy.by_kind["cut"].time, TABLE_2[name][3]))
    shares, means = [], {}
    for name in STRATEGIES:
        x, y = (spent(name, d).energy for d in "xy")
        means[name] = (x.total + y.total, x.time)
        shares.append(Row(name, y_over_x(name), Y_OVER_X[name][0]))
    printed = {name: (x + y, s) for name, (x, y, s, _) in TABLE_2.items()}
    against = [
        Row(
            f"{name}, {what}",
            100.0 * (means[name][i] / means["contour"][i] - 1.0),
            100.0 * (printed[name][i] / printed["contour"][i] - 1.0),
        )
        for name in ("zag", "zigzag")
        for i, what in enumerate(("energy", "time"))
    ]
    fitted, other = fit_coefficients(), fit_coefficients(APPROACH)
    coefficients = [
        Row(f"{letter}, {name}", fitted[letter][i], other[letter][i])
        for letter in "XY"
        for i, name in enumerate("ab")
    ]
    pushed = [
        Row(
            name,
            spent(name, "x", FEED_FORCE).energy.total - spent(name, "x").energy.total,
            FEED_FORCE * cut_length(name) / 1000.0,
        )
        for name in STRATEGIES
    ]
    return (
        Table("Table 1: energy by block", "J", energies),
        Table("Table 1: time by block", "s", times),
        Table(
            "Table 1: total",
            "J and s",
            (Row("energy", total.total, TOTAL_1[0]), Row("time", total.time, TOTAL_1[1])),
            5e-3,
        ),
        Table("Table 2: energy (zag is fitted)", "J", tuple(predicted), 0.02, 0),
        Table("Table 2: cycle time", "s", tuple(cycle), 6e-3),
        Table("Table 2: time of G01 blocks", "s", tuple(cuts)),
        Table("y over x", "%", tuple(shares), None, 1),
        Table("Mean of both directions against the contour", "%", tuple(against), None, 1),
        Table(
            "Coefficients (W per N and m/s; W per N): z's retracts by Eq. (5), or by its approach, as N19",
            "a, b",
            tuple(coefficients),
            None,
            4,
            "approach",
        ),
        Table(
            f"Eqs. (1) and (5): what a feed force of {FEED_FORCE:g} N adds in the cuts",
            "J",
            tuple(pushed),
            1e-9,
            1,
            "F_f · length",
        ),
    )


def cut_length(strategy: str) -> float:
    """Measure the path of a program's G01 blocks, mm."""
    motion = spent(strategy, "x").motion
    return float(np.linalg.norm(motion.moves[:, :3], axis=1)[motion.cutting].sum())


def misprints() -> tuple[Misprint, ...]:
    """List what contradicts itself, the physics or another table."""
    lift = {name: TABLE_1[name][0] for name in ("N19", "N20")}
    blocks = block_sums(lift)
    short = 0.3  # mm
    own = ramp_time(short)
    as_printed = float(np.sqrt(2.0 * RAMP * short / FEED))
    rows = [
        Misprint(
            f"Table 1, {name}",
            f"{printed:.2f} J",
            f"{blocks[name][0]:.1f} J",
            f"By Eq. (5) a retract is 8540 v + 88.82 W above base. Printed is the approach: (6502 · 0.17 + "
            f"75.12) · {seconds:g} = {z_power(APPROACH, 170.0) * seconds:.2f} J.",
        )
        for (name, printed), seconds in zip(lift.items(), (0.027, 0.27), strict=True)
    ]
    base = machine().base_power * TABLE_1["N02"][1]
    return (
        Misprint(
            "Eq. (3), time of a move too short to reach the feed",
            f"√(2 t_a D/v_f) = {as_printed:.3f} s for {short:g} mm at F500 with t_a = {RAMP:g} s",
            f"{own:.3f} s",
            "Half the way is accelerated and half braked, each at v_f/t_a, so it takes 2√(t_a D/v_f).",
        ),
        *rows,
        Misprint(
            "Table 1, whether base power is in",
            "with P0, says the text",
            f"{TABLE_1['N02'][0]:.0f} J in N02, whose base power alone is {base:.0f} J",
            "The energies are without it.",
        ),
        Misprint(
            "Table 2, G01 time of zag",
            f"{TABLE_2['zag'][3]:.2f} s = 9 · {TABLE_1['N02'][1]:.2f} s",
            f"{spent('zag', 'x').energy.by_kind['cut'].time:.2f} s",
            "These are the passes without the plunges at F300; zigzag's is its whole cycle with rapids.",
        ),
        Misprint("Table 1, N16", "Y43", "Y32", "The step of 6 mm, and the next block's Y26."),
    )


def bars(axes: object, values: dict[str, tuple[list[float], str]]) -> None:
    """Draw groups of bars: a group for each strategy, a colour for each kind."""
    places, width = np.arange(len(STRATEGIES)), 0.8 / len(values)
    for k, (name, (heights, colour)) in enumerate(values.items()):
        found = axes.bar(
            places + width * (k - 0.5 * (len(values) - 1)),
            heights,
            width,
            color=colour,
            label=name,
            edgecolor="white",
        )
        axes.bar_label(
            found, [f"{v:.1f}" if v < 1000.0 else f"{v / 1000.0:.1f}" for v in heights], fontsize=7
        )
    axes.set(xticks=places, xticklabels=STRATEGIES)


def draw_energies() -> Figure:
    """Draw the energies of Table 2 by strategy and direction."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 2.8))
    axes = figure.subplots()
    ours = {d: [spent(name, d).energy.total for name in STRATEGIES] for d in "xy"}
    printed = [[TABLE_2[name][i] for name in STRATEGIES] for i in (0, 1)]
    bars(
        axes,
        {
            "x, ours": (ours["x"], BLUE),
            "x, printed": (printed[0], "#a5bbdb"),
            "y, ours": (ours["y"], ORANGE),
            "y, printed": (printed[1], "#f2bf91"),
        },
    )
    axes.set(ylabel="feed drives (J)", ylim=(0.0, 90_000.0))
    axes.legend(frameon=False, ncols=4, fontsize=8)
    axes.set_title("labels in kJ", fontsize=8, loc="right")
    return figure


def draw_directions() -> Figure:
    """Draw y over x: ours, printed and measured."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.0, 2.6))
    axes = figure.subplots()
    columns = [[Y_OVER_X[name][i] for name in STRATEGIES] for i in (0, 1)]
    bars(
        axes,
        {
            "ours": ([y_over_x(name) for name in STRATEGIES], BLUE),
            "printed": (columns[0], ORANGE),
            "measured": (columns[1], GREY),
        },
    )
    axes.set(ylabel="y over x (%)", ylim=(0.0, 36.0))
    axes.legend(frameon=False, ncols=3)
    return figure


def draw_drives() -> Figure:
    """Draw the drives' power over speed, Eqs. (1) and (5)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.8, 2.8))
    axes = figure.subplots()
    speed = np.linspace(1.0, RAPID, 200)
    for letter, sign, label in (("X", 1, "x"), ("Y", 1, "y"), ("Z", 1, "z up"), ("Z", -1, "z down")):
        axis = machine().axis(letter)
        weight = 0.0 if axis.moved_mass is None else GRAVITY * (axis.moved_mass + machine().load.mass)
        axes.plot(speed * 0.06, drive_power(axis.drive, sign * speed, weight=weight), label=label)
    axes.set(xlabel="speed (m/min)", ylabel="power above base (W)")
    axes.legend(frameon=False)
    return figure


def paper() -> Paper:
    """Compute all that is shown of the paper."""
    return Paper(
        "Feed energy of NC programs: Edem & Balogun, IJE Trans. B 31(5), 2018",
        tables(),
        misprints(),
        (
            "a and b of x and y aren't printed: they are fitted (b to a row of Table 1 each, a to zag).",
            f"The {RAMP:g} s that a pass of Table 1 takes beyond its length over the feed; a step has none.",
            "With the retracts as N19 and N20 are printed, a comes out higher (last but one table). That "
            "changes rapid moves of x and y alone: a v + b at F500 is a row of Table 1.",
            f"N01: {TABLE_1['N01'][0]:g} J, where Eq. (5) gives {z_power(APPROACH, PLUNGE) / 10.0:.2f} J.",
            "The feed force isn't printed; if there was one, what is fitted contains it.",
            "Measured energies: of them only the ratio of y to x is at hand.",
        ),
        {
            "pocket-energies": draw_energies,
            "pocket-directions": draw_directions,
            "pocket-drives": draw_drives,
        },
    )


if __name__ == "__main__":
    show(paper)
