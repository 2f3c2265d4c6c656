"""Milling power from forces: instantaneous power, its mean over a turn, and why the moment's share is 50 %.

Olteanu, Bîșu and Tănase milled 42CrMo4 with a one-toothed face mill of 63 mm and 45 degrees, measured the
wrench (force and moment) on the workpiece with two dynamometers, carried it from the dynamometer's origin O
to the cutter's centre S and to the tooth D, and multiplied it by velocities. Their force records aren't
printed. Here the forces are those of a mechanistic model with assumed coefficients, so that the record is
consistent: the forces act at the tooth, and O, S and D are points of one frame. Everything that the equations
determine is computed on it.

    python examples/papers/milling.py [--figures FOLDER]

Source: Olteanu, Bîșu, Tănase, "Determination of power consumption in milling", UPB Sci. Bull.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from showing import BLUE, GREEN, GREY, ORANGE, Misprint, Paper, Row, Table, show
from wrench import (
    absolute_sum_power,
    cutter_positions,
    net_power,
    revolution_average,
    rotation_angles,
    tooth_positions,
    tooth_velocities,
    transport_moment,
    wrench_power,
)

from fiveaxis.base import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Printed: the cutter and its cut.
DIAMETER, KAPPA = 63.0, np.radians(45.0)  # mm, angle between edge and feed plane
SPEED = 120.0 * 1000.0 / 60.0  # mm/s, v_c = 120 m/min
ADVANCE, DEPTH = 0.1, 2.0  # mm/rev of one tooth, mm
PRINTED = {"Kistler": (840.0, 1220.0), "QZZ2": (870.0, 1260.0)}  # W at the centre and at the tooth
# Assumed: 42CrMo4's coefficients (N/mm²), a full slot, and where the dynamometer's origin lies.
TANGENTIAL, NORMAL = 1900.0, 700.0
ORIGIN = np.array([-40.0, 25.0, -30.0])  # mm, O
EXPONENT = 0.25  # of Kienzle's k_c = k_c1.1 h^(-m_c)
EFFICIENCY = 0.8

RADIUS = DIAMETER / 2.0
SPIN = -SPEED / RADIUS  # rad/s, clockwise seen from above
FEED = ADVANCE * SPEED / (np.pi * DIAMETER)  # mm/s
TURN = 2.0 * np.pi / abs(SPIN)  # s
TURNING = np.array([0.0, 0.0, SPIN])


class Record(NamedTuple):
    """One turn, (n,) samples: N, N·mm, mm and mm/s; forces on the workpiece.

    The workpiece pushes back on the tool, so the cut takes `wrench_power` of these from the machine.
    """

    time: Array
    angle: Array
    force: Array
    centre: Array
    tooth: Array
    velocity: Array  # of the tooth
    moment: dict[str, Array]  # by point: O, S, D


@cache
def record(samples: int = 3600) -> Record:
    """Compute one turn of the face mill in a full slot.

    The tooth at angle θ from +x is in the material while it moves against the feed's half: from +y through +x
    to −y for a clockwise spindle. Its chip is ``h = f cosθ sinκ`` thick and ``b = a_p/sinκ`` wide. The force
    on the workpiece is ``K_t b h`` along the tooth's motion, and ``K_n b h`` away from the edge, of which
    sinκ acts outwards and cosκ downwards.
    """
    time = np.linspace(0.0, TURN, samples + 1)
    angle = rotation_angles(SPIN, time, start=np.pi)
    centre = cutter_positions(np.zeros(3), FEED, time)
    tooth = tooth_positions(centre, angle, RADIUS)
    outward = (tooth - centre) / RADIUS
    along = np.sign(SPIN) * np.stack([-outward[:, 1], outward[:, 0], np.zeros_like(angle)], axis=-1)
    section = DEPTH * ADVANCE * np.maximum(np.cos(angle), 0.0)  # b h, mm²
    edge = np.sin(KAPPA) * outward - np.cos(KAPPA) * np.array([0.0, 0.0, 1.0])
    force = section[:, None] * (TANGENTIAL * along + NORMAL * edge)
    # The dynamometer gives the moment at O; it is carried on from there as in the paper.
    measured = transport_moment(force, np.zeros_like(force), tooth, np.broadcast_to(ORIGIN, tooth.shape))
    at_centre = transport_moment(force, measured, ORIGIN, centre)
    at_tooth = transport_moment(force, at_centre, centre, tooth)
    velocity = tooth_velocities(angle, SPIN, RADIUS, FEED)
    return Record(time, angle, force, centre, tooth, velocity, {"O": measured, "S": at_centre, "D": at_tooth})


def centre_velocity() -> Array:
    """Return the velocity of S, (3,) mm/s."""
    return np.array([FEED, 0.0, 0.0])


def powers() -> dict[str, Array]:
    """Compute the power over a turn by each reading, (n,) W."""
    one = record()
    return {
        "R·v + M·ω at S": wrench_power(one.force, one.moment["S"], centre_velocity(), TURNING),
        "R·v + M·ω at D": wrench_power(one.force, one.moment["D"], one.velocity, TURNING),
        "Eq. (17) at S, with the velocity of S": absolute_sum_power(
            one.force, one.moment["S"], centre_velocity(), TURNING
        ),
        "Eq. (17) at D, with the velocity of D": absolute_sum_power(
            one.force, one.moment["D"], one.velocity, TURNING
        ),
        "Eq. (17) as printed: moment at S, velocity of D": absolute_sum_power(
            one.force, one.moment["S"], one.velocity, TURNING
        ),
    }


def mean(power: Array) -> float:
    """Average over the turn (Eq. 18), W."""
    return revolution_average(power, record().time, SPIN)


def moment_share(at: str, velocity: Array) -> float:
    """Compute the share of the moment in the mean of Eq. (17), %, with the moment at S or D."""
    one = record()
    turning = np.abs(one.moment[at][:, 2] * SPIN) / 1e3
    return 100.0 * mean(turning) / mean(absolute_sum_power(one.force, one.moment[at], velocity, TURNING))


def formulas() -> dict[str, float]:
    """Compute the usual formulas of the mean power, W."""
    handbook = float(net_power(DEPTH, DIAMETER, FEED, TANGENTIAL))
    # Mean chip of a full slot, and k_c that is TANGENTIAL at it: a maker's k_c1.1 is that of 1 mm.
    chip = ADVANCE * np.sin(KAPPA) * 2.0 / np.pi
    thick = TANGENTIAL * chip**EXPONENT
    return {
        "Eq. (1): a_p a_e v_f k_c": handbook,
        "with k_c of the mean chip, k_c1.1 h^-0.25": float(
            net_power(DEPTH, DIAMETER, FEED, thick * chip**-EXPONENT)
        ),
        "with k_c1.1 in place of k_c": float(net_power(DEPTH, DIAMETER, FEED, thick)),
        f"at the motor, efficiency {EFFICIENCY:g}": handbook / EFFICIENCY,
    }


def tables() -> tuple[Table, ...]:
    """Compute every table."""
    one, found = record(), powers()
    exact = TANGENTIAL * DEPTH * DIAMETER * FEED / 1e3
    pushing = mean(one.force[:, 0] * FEED / 1e3)
    means = [Row(name, mean(power), exact + pushing_share()) for name, power in found.items()]
    moments = [
        Row("S, arm SO (Eqs. 11-12)", *moment_at("S", one.centre)),
        Row("D, arm DS (Eq. 13)", *moment_at("D", one.tooth)),
    ]
    shares = [
        Row("moment at S, velocity of S", moment_share("S", centre_velocity()), 100.0),
        Row("moment at D, velocity of D", moment_share("D", one.velocity), 0.0),
        Row("moment at S, velocity of D (Eq. 17 as printed)", moment_share("S", one.velocity)),
    ]
    return (
        Table(
            "Mean power of a turn (Eq. 18) by the readings of the power",
            "W",
            tuple(means[:2]),
            1e-3,
            1,
            "K_t MRR + feed",
        ),
        Table("Mean of the absolute sum (Eq. 17)", "W", tuple(means[2:]), None, 1, "K_t MRR + feed"),
        Table("Share of the moment in Eq. (17)", "%", tuple(shares), None, 1, "consistent"),
        Table("Largest moment about z after the transport", "N·m", tuple(moments), 1e-9, 2, "direct"),
        Table(
            "Formulas of the mean power",
            "W",
            tuple(Row(n, w, exact) for n, w in formulas().items()),
            None,
            1,
            "K_t MRR",
        ),
        Table(
            "Share of the feed in the power",
            "W",
            (Row("F_x v_f", pushing, pushing_share()),),
            1e-3,
            3,
            "by hand",
        ),
    )


def pushing_share() -> float:
    """Compute the mean of F_x v_f by hand, W: over half a turn ``K_t b h sinθ`` has no mean, K_n does."""
    return NORMAL * np.sin(KAPPA) * DEPTH * ADVANCE / 4.0 * FEED / 1e3


def moment_at(point: str, places: Array) -> tuple[float, float]:
    """Return the largest transported moment about z, and that of the tooth's force about the point, N·m."""
    one = record()
    direct = np.cross(one.tooth - places, one.force)[:, 2]
    at = int(np.argmax(np.abs(direct)))
    return float(one.moment[point][at, 2]) / 1e3, float(direct[at]) / 1e3


def misprints() -> tuple[Misprint, ...]:
    """List what contradicts the physics."""
    one, found = record(), powers()
    wrong = one.moment["S"] + np.cross(ORIGIN - one.tooth, one.force)
    at = int(np.argmax(np.linalg.norm(wrong, axis=1)))
    printed = found["Eq. (17) as printed: moment at S, velocity of D"]
    fast = absolute_sum_power(
        one.force, one.moment["S"], tooth_velocities(one.angle, SPIN, RADIUS, FEED) * 60.0, TURNING
    )
    return (
        Misprint(
            "Eq. (17), moment at S with the velocity of the tooth D",
            f"{mean(printed):.0f} W on this record",
            f"{mean(found['R·v + M·ω at S']):.0f} W",
            "The tangential force's power stands in both terms. With moment and velocity of one point the "
            "moment has all of it at S and none at D; as printed about half (the paper finds 45 to 60 %).",
        ),
        Misprint(
            "Eq. (13), arm of the moment from S to D",
            f"DO: a moment of {np.linalg.norm(wrong[at]) / 1e3:.1f} N·m on this record",
            f"DS: {np.linalg.norm(one.moment['D'][at]) / 1e3:.1f} N·m",
            "Eq. (12) has already carried it from O to S. A point force at the tooth has no moment there.",
        ),
        Misprint(
            "Eq. (17), unit of v_c",
            f"m/min: {mean(fast) / 1e3:.1f} kW on this record",
            f"m/s: {mean(printed) / 1e3:.2f} kW",
            "Force in N times m/min isn't W: 120 m/min are 2 m/s.",
        ),
    )


def draw_turn() -> Figure:
    """Draw the power over a turn (the paper's Fig. 3)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 2.8))
    axes = figure.subplots()
    # From the tooth's entry: the angle that it has turned.
    turned = np.degrees(np.abs(record().angle - np.pi))
    styles = {
        "R·v + M·ω at S": (BLUE, "-"),
        "R·v + M·ω at D": (GREEN, ":"),
        "Eq. (17) as printed: moment at S, velocity of D": (ORANGE, "-"),
    }
    for name, (colour, line) in styles.items():
        axes.plot(turned, powers()[name], line, color=colour, label=name, lw=2.5 if line == ":" else 1.5)
    axes.set(xlabel="turn of the spindle (deg)", ylabel="P_c (W)", xticks=range(0, 361, 45), xlim=(0, 360))
    axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=8)
    return figure


def draw_means() -> Figure:
    """Draw the means over a turn (the paper's Fig. 4)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 2.2))
    axes = figure.subplots()
    means = {name: mean(power) for name, power in reversed(powers().items())}
    colours = [ORANGE, GREY, GREY, BLUE, BLUE]
    found = axes.barh(list(means), list(means.values()), color=colours)
    axes.bar_label(found, [f"{watts:.0f} W" for watts in means.values()], padding=2)
    axes.set(xlabel="mean power of a turn (W)", xlim=(0.0, 1.15 * max(means.values())))
    return figure


def draw_formulas() -> Figure:
    """Draw the usual formulas side by side (as the paper's Fig. 5 does those of makers)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 1.9))
    axes = figure.subplots()
    bars = {"record, R·v + M·ω": mean(powers()["R·v + M·ω at S"])} | formulas()
    names = list(bars)[::-1]
    found = axes.barh(names, [bars[name] for name in names], color=[GREY] * 4 + [BLUE])
    axes.bar_label(found, [f"{bars[name]:.0f} W" for name in names], padding=2)
    axes.set(xlabel="mean power (W)", xlim=(0.0, 1.15 * max(bars.values())))
    return figure


def paper() -> Paper:
    """Compute all that is shown of the paper."""
    printed = "; ".join(f"{name} {a / 1e3:g} and {b / 1e3:g} kW" for name, (a, b) in PRINTED.items())
    return Paper(
        "Milling power: Olteanu, Bîșu, Tănase, UPB Sci. Bull.",
        tables(),
        misprints(),
        (
            f"The measured powers at centre and tooth ({printed}): the force records aren't printed.",
            "The makers' figures: which formula takes which coefficient isn't known here; the usual forms "
            "stand side by side with assumed ones.",
        ),
        {"milling-turn": draw_turn, "milling-means": draw_means, "milling-formulas": draw_formulas},
    )


if __name__ == "__main__":
    show(paper)
