"""Form shaping and the power surface: the paper that fiveaxis began with.

Hayashi et al. (2018) measured the power of every axis of a 5-axis mill, wrote its kinematics as a product of
one-axis motions (the form-shaping code 640123), and drew what a posture costs as a surface over both rotary
angles. Following its valleys, an overhung part took 69 % less energy in the feed drives than a commercial CAM
system's path. The part isn't printed; a stand-in shows the same: contour lines on the underside of a dome,
with the tool along the normal (as little tilted as allowed) before, and optimised after.

    python examples/papers/form_shaping.py [--figures FOLDER]

Source: Hayashi, Okami, Morimoto, Takasugi, "Study on Tool Path Generation Method for Reducing Energy
Consumption of 5-axis NC Machine Tools", euspen 2018.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from showing import BLUE, GREY, ORANGE, SURFACE, Misprint, Paper, Row, Table, show

import fiveaxis as fx
from fiveaxis.base import Array, every_pair
from fiveaxis.model import drive_power, linear_positions, tool_poses, travel_costs
from fiveaxis.show.report.plots import Drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Measured power, W, while the value grows and falls; of A and C per deg/min.
POWERS = {
    "X": (34.55, 33.87),
    "Y": (65.57, 68.07),
    "Z": (612.1, 427.8),
    "A": (8.483e-2, 5.736e-2),
    "C": (3.093e-2, 3.231e-2),
}
FEEDS = (250.0, 500.0, 750.0, 1000.0)  # mm/min, deg/min
FEED = 1000.0  # mm/min
TIP = (30.0, 10.0, 20.0)  # mm, where the surfaces are drawn; the paper's place isn't known here
SAVED = 69.0  # %, of the paper's case study
# The stand-in: three turns on the underside of a dome.
RADIUS, CENTRE, TURNS, POINTS = 30.0, (40.0, 0.0, 30.0), 3, 180
TILT = (15.0, 75.0)  # deg


@cache
def machine() -> fx.Machine:
    """Load the measured machine."""
    return fx.load_machine("hayashi-640123")


def by_hand(x: float, y: float, z: float, a: float, c: float) -> Array:
    """Multiply the one-axis motions out: ``A6(θ) A4(φ) A1(x) A2(y) A3(z)`` (Eqs. 2 and 3).

    Returns
    -------
    (4, 4), mm: tool origin in the last column, tool axis in the third
    """

    def motion(rotation: list[list[float]], shift: tuple[float, float, float]) -> Array:
        return np.vstack([np.column_stack([rotation, shift]), [0.0, 0.0, 0.0, 1.0]])

    (sa, ca), (sc, cc), none = (np.sin(a), np.cos(a)), (np.sin(c), np.cos(c)), (0.0, 0.0, 0.0)
    about_z = motion([[cc, -sc, 0.0], [sc, cc, 0.0], [0.0, 0.0, 1.0]], none)
    about_x = motion([[1.0, 0.0, 0.0], [0.0, ca, -sa], [0.0, sa, ca]], none)
    return about_z @ about_x @ motion(np.eye(3).tolist(), (x, y, z))


def displacement(tip: Array, a: Array, c: Array) -> Array:
    """Solve for the linear axes by the paper's Eq. (5), (..., 3) mm: S_L."""
    rx, ry, rz = tip
    x = rx * np.cos(c) + ry * np.sin(c)
    across = -rx * np.sin(c) + ry * np.cos(c)
    return np.stack([x, across * np.cos(a) + rz * np.sin(a), -across * np.sin(a) + rz * np.cos(a)], axis=-1)


def random_positions(n: int) -> Array:
    """Draw axis values, (n, 5) mm and rad, in the machine's order."""
    scale = [100.0, 100.0, 100.0, 1.5, 3.0]
    return np.random.default_rng(0).uniform(-1.0, 1.0, (n, 5)) * scale


def grid(step: float) -> tuple[Array, Array]:
    """Return the grid of C and A, rad, by a step in deg."""
    return np.radians(np.arange(-180.0, 180.1, step)), np.radians(np.arange(-120.0, 30.1, step))


def surfaces(step: float) -> dict[str, Array]:
    """Compute S_WL, S_WR and S_W by hand over the grid (Eqs. 5-8), (g, h) J."""
    first, second = grid(step)
    c, a = np.meshgrid(first, second, indexing="ij")
    moves = displacement(np.array(TIP), a, c)

    def priced(values: Array, letter: str) -> Array:
        plus, minus = (60.0 * p / FEED for p in POWERS[letter])
        if letter in "AC":
            plus, minus = (60.0 * np.degrees(p) for p in POWERS[letter])
        return plus * np.maximum(values, 0.0) + minus * np.maximum(-values, 0.0)

    linear = sum((priced(moves[..., k], letter) for k, letter in enumerate("XYZ")), np.zeros_like(a))
    rotary = priced(a, "A") + priced(c, "C")
    return {"S_WL": linear, "S_WR": rotary, "S_W": linear + rotary}


@cache
def solved() -> fx.Solution:
    """Optimise the stand-in: contour lines below the equator of a dome, as one spiral."""
    around = np.linspace(0.0, 2.0 * np.pi * TURNS, POINTS)
    down = np.radians(np.linspace(20.0, 32.0, POINTS))
    level = np.stack([np.cos(down) * np.cos(around), np.cos(down) * np.sin(around), -np.sin(down)], axis=-1)
    path = fx.Toolpath.from_contacts(
        RADIUS * level + CENTRE, level, fx.Tool.ball(8), feed_mm_min=FEED, name="dome"
    )
    return fx.optimise(path, machine(), tilt=TILT, effort="quick")


def mean_powers() -> dict[str, dict[str, float]]:
    """Compute the mean power by axis, W: of the path before (along the normal), and after."""
    energies = {"before": solved().compared["normal"].energy, "after": solved().energy}
    return {
        name: {letter: joules / energy.time for letter, joules in energy.by_axis.items()}
        for name, energy in energies.items()
    }


def tables() -> tuple[Table, ...]:
    """Compute every table."""
    powers, travel = [], []
    for letter, sides in POWERS.items():
        drive = machine().axis(letter).drive
        for sign, power in zip("+-", sides, strict=True):
            for feed in FEEDS if letter in "AC" else FEEDS[-1:]:
                turning = letter in "AC"
                speed = np.radians(feed / 60.0) if turning else feed / 60.0
                ours = float(drive_power(drive, np.array([float(f"{sign}1") * speed]))[0])
                name = f"P{sign} of {letter} at {feed:.0f} {'deg' if turning else 'mm'}/min"
                powers.append(Row(name, ours, power * feed if turning else power))
        unit = np.radians(1.0) if letter in "AC" else 1.0
        for feed in (500.0, FEED):
            costs = [side[0] * unit for side in travel_costs(machine(), np.array([feed / 60.0]))]
            for sign, power, side in zip("+-", sides, costs, strict=True):
                hand = 60.0 * power if letter in "AC" else 60.0 * power / feed
                name = f"W{sign} of {letter} at F{feed:.0f} (J/{'deg' if letter in 'AC' else 'mm'})"
                travel.append(Row(name, float(side[machine().column(letter)]), hand))
    positions = random_positions(200)
    tip, axis = tool_poses(machine(), positions)
    chain = np.array([by_hand(*row) for row in positions])
    solved_again = linear_positions(machine(), tip, positions[:, [4, 3]])[:, :3]
    eq5 = np.array([displacement(r, row[3], row[4]) for r, row in zip(tip, positions, strict=True)])
    known = fx.power_surface(machine(), TIP, FEED, grid(3.0))
    parts = {"S_WL": known.linear, "S_WR": known.rotary, "S_W": known.total}
    ends = [
        Row(f"{end} of {name}", float(getattr(parts[name], end)()), float(getattr(by, end)()))
        for name, by in surfaces(3.0).items()
        for end in ("min", "max")
    ]
    largest = (
        ("Eq. (3), tool origin: tool_poses (mm)", tip - chain[:, :3, 3]),
        ("Eq. (2), tool axis: tool_poses", axis - chain[:, :3, 2]),
        ("Eq. (5), linear axes: linear_positions (mm)", solved_again - eq5),
        ("Eq. (5) inverts Eq. (3) (mm)", eq5 - positions[:, :3]),
    )
    largest += tuple(
        (f"Eqs. (6)-(8), {name}: power_surface (J)", parts[name] - by) for name, by in surfaces(3.0).items()
    )
    exact = tuple(Row(name, 1e12 * float(np.abs(off).max()), 0.0) for name, off in largest)
    first, second = grid(30.0)
    coarse = every_pair(first[::3], second[[0, 2, 4, 5]])
    places = linear_positions(machine(), np.array(TIP), coarse)[..., :3]
    columns = [
        Row(
            f"{letter} at C {np.degrees(c):.0f}, A {np.degrees(a):.0f}",
            float(places[i, j, k]),
            float(displacement(np.array(TIP), a, c)[k]),
        )
        for i, row in enumerate(coarse)
        for j, (c, a) in enumerate(row)
        for k, letter in enumerate("XYZ")
    ]
    means = mean_powers()
    axes = [Row(f"{c}, {when}", watts[c]) for c in machine().letters for when, watts in means.items()]
    totals = [Row("saved in the feed drives", 100.0 * solved().savings()["normal"], SAVED)]
    return (
        Table("Axis power (machine hayashi-640123)", "W", tuple(powers), 1e-9),
        Table("Eq. (1): energy per travel, W = 60 P/v", "J/mm, J/deg", tuple(travel), 1e-9, 3, "by hand"),
        Table(
            "Equations: largest difference of fiveaxis from the formulas",
            "1e-12 of the unit",
            exact,
            5.0,
            2,
            "formulas",
        ),
        Table(
            f"S_L (Fig. 2): displacements of the linear axes, tip at {TIP} mm",
            "mm",
            tuple(columns),
            1e-9,
            3,
            "Eq. (5)",
        ),
        Table(
            f"S_WL, S_WR and S_W (Fig. 3) at this tip, F{FEED:.0f}", "J", tuple(ends), 1e-9, 1, "Eqs. (6)-(8)"
        ),
        Table("Mean power by axis (Fig. 5) of the stand-in", "W", tuple(axes), None, 1),
        Table("Case study: another part than the paper's", "%", tuple(totals), None, 1),
    )


def misprints() -> tuple[Misprint, ...]:
    """List Eq. (4), whose inverse is right."""
    x, y, z, a, c = 10.0, 20.0, 30.0, np.radians(-30.0), np.radians(50.0)
    tip = tool_poses(machine(), np.array([[x, y, z, a, c]]))[0][0]
    row = x * np.sin(c) + y * np.cos(a) * np.cos(c)
    term = z * np.sin(a) * np.cos(c)
    return (
        Misprint(
            "Eq. (4), second row",
            f"+ z sinφ cosθ: r_y = {row + term:.3f} mm at X10 Y20 Z30 A-30 C50",
            f"− z sinφ cosθ: {row - term:.3f} mm",
            f"The product of Eq. (2) has the minus, {by_hand(x, y, z, a, c)[1, 3]:.3f} mm (tool_poses: "
            f"{tip[1]:.3f}), and only with it is Eq. (5) the inverse.",
        ),
    )


def surface_axes(figure: Figure, place: int, values: Array, label: str, step: float) -> object:
    """Draw one surface over C and A, deg."""
    axes = figure.add_subplot(1, 3, place, projection="3d")
    c, a = np.meshgrid(*(np.degrees(g) for g in grid(step)), indexing="ij")
    axes.plot_surface(c, a, values, **SURFACE)
    axes.set(xlabel="C (deg)", ylabel="A (deg)", xticks=(-180, 0, 180), yticks=(-120, -60, 0))
    axes.set_title(label, fontsize=10)
    axes.view_init(28.0, -60.0)
    return axes


def draw_displacements() -> Figure:
    """Draw S_L: the displacement of each linear axis over C and A (Fig. 2)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.0))
    places = linear_positions(machine(), np.array(TIP), every_pair(*grid(6.0)))
    for k, letter in enumerate("XYZ"):
        surface_axes(figure, k + 1, places[..., k], f"{letter} (mm)", 6.0)
    figure.subplots_adjust(wspace=0.15, left=0.0, right=0.97)
    return figure


def draw_surfaces() -> Figure:
    """Draw S_WL, S_WR and S_W with valley and cheapest posture (Fig. 3); posture bounded by the tilt."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.2))
    found = fx.tip_surface(machine(), TIP, FEED, normal=(0, 0, 1), tilt=TILT, step_deg=3.0)
    first, second = (np.degrees(g) for g in (found.power.first, found.power.second))
    allowed = np.where(found.admissible, found.power.total, np.nan)
    rows = np.flatnonzero(np.isfinite(allowed).any(axis=1))
    floor = np.nanargmin(allowed[rows], axis=1)
    best = np.unravel_index(np.nanargmin(allowed), allowed.shape)
    parts = {"S_WL": found.power.linear, "S_WR": found.power.rotary, "S_W": found.power.total}
    for k, (name, values) in enumerate(parts.items()):
        axes = figure.add_subplot(1, 3, k + 1, projection="3d", computed_zorder=False)
        c, a = np.meshgrid(first, second, indexing="ij")
        axes.plot_surface(c, a, values, zorder=1, **SURFACE)
        axes.plot(
            first[rows],
            second[floor],
            values[rows, floor],
            ".",
            ms=2.5,
            color=ORANGE,
            zorder=2,
            label="valley of S_W",
        )
        axes.plot(
            [first[best[0]]],
            [second[best[1]]],
            [values[best]],
            "o",
            color="red",
            mec="white",
            ms=7,
            zorder=3,
            label="cheapest posture",
        )
        axes.set(xlabel="C (deg)", ylabel="A (deg)", xticks=(-180, 0, 180), yticks=(-120, -60, 0))
        axes.set_title(f"{name} (J)", fontsize=10)
        axes.view_init(35.0, -60.0)
    figure.axes[0].legend(
        loc="lower left", bbox_to_anchor=(0.0, -0.32), frameon=False, fontsize=8, ncols=2, markerscale=1.5
    )
    figure.subplots_adjust(wspace=0.15, left=0.0, right=0.97)
    return figure


def draw_maps() -> Drawn:
    """Draw the same as heat maps."""
    return fx.tip_surface(machine(), TIP, FEED, normal=(0, 0, 1), tilt=TILT, step_deg=5.0)


def draw_valley() -> Drawn:
    """Draw the valley along the stand-in's path, and what the moves cost."""
    return fx.path_valley(solved())


def draw_mean_powers() -> Figure:
    """Draw the mean power by axis before and after (Fig. 5)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.0, 2.6))
    axes = figure.subplots()
    places = np.arange(5)
    for k, ((name, watts), colour) in enumerate(zip(mean_powers().items(), (GREY, BLUE), strict=True)):
        found = axes.bar(places + 0.4 * k - 0.2, list(watts.values()), 0.38, color=colour, label=name)
        axes.bar_label(found, [f"{w:.0f}" for w in watts.values()], fontsize=8)
    axes.set(xticks=places, xticklabels=list(mean_powers()["before"]), ylabel="mean power (W)")
    axes.legend(frameon=False)
    return figure


def paper() -> Paper:
    """Compute all that is shown of the paper."""
    figures: dict[str, Callable[[], Figure | Drawn]] = {
        "displacement-surface": draw_displacements,
        "power-surface": draw_surfaces,
        "power-maps": draw_maps,
        "valley": draw_valley,
        "mean-power": draw_mean_powers,
    }
    return Paper(
        "Form shaping and the power surface: Hayashi et al., euspen 2018",
        tables(),
        misprints(),
        (
            f"The {SAVED:g} % of the case study: part, CAM settings, tilt limits and feed aren't printed.",
            "The numbers of Figs. 2, 3 and 5: surfaces are of a tip of our own, bars of the stand-in.",
        ),
        {f"form-shaping-{name}": draw for name, draw in figures.items()},
    )


if __name__ == "__main__":
    show(paper)
