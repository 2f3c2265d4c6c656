"""Drilling power: reproduce the tables of a paper from its own measurements, and show what doesn't reproduce.

A drilling machine takes an idle power that is a quadratic of the spindle speed, the power of the cut, and a
loss in its drive that grows with the cut: P_total = P_idle(n) + P_c + C0 P_c. Wang et al. (2019) measured
sixteen states of a machine YH850Z in the alloy GH4169 (Experiment I), fitted the model, and validated it at
one removal rate and four speeds (Experiment II). Three benchmark models take the total as a straight function
of the removal rate (P1), of removal rate and speed (P2), or of the cutting power (P3).

    python examples/papers/drilling.py [--figures FOLDER]

Source: Wang, Zhang, Chen, Zhang, Wu, Appl. Sci. 2019, 9(22), 4801, doi 10.3390/app9224801.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from showing import BLUE, GREEN, GREY, ORANGE, Misprint, Paper, Row, Table, show

from fiveaxis.base import Array
from fiveaxis.lab import CuttingCoefficients, Drill
from fiveaxis.lab.cutting.drilling import auxiliary_power, idle_power, mean_drilling_power

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REV_MIN = 2.0 * np.pi / 60.0  # rad/s
# Idle power as printed: constant W, per rev/min, per (rev/min)².
IDLE = np.array([1221.0, 0.0524, 0.0003]) / REV_MIN ** np.arange(3)
C0 = 0.1336  # W/W, as printed
DIAMETER = 10.0  # mm
LIPS = CuttingCoefficients(4196.8, 202.6, thrust=5395.7, thrust_edge=339.2)  # as printed

# Experiment I: four speeds (rev/min) by four feeds (mm/rev), measured, idle and cutting power in W.
SPEEDS = np.array([400.0, 550.0, 700.0, 850.0])
FEEDS = np.array([0.08, 0.11, 0.14, 0.17])
MEASURED = np.array(
    [
        [1625.0, 1679.0, 1744.6, 1781.4],
        [1750.0, 1837.4, 1937.0, 2001.8],
        [1906.1, 1988.8, 2117.4, 2217.9],
        [2067.9, 2217.5, 2354.8, 2474.4],
    ]
)
IDLING = np.array([1290.0, 1340.6, 1404.7, 1482.3])
CUTTING = np.array(
    [
        [262.4, 313.4, 364.4, 415.6],
        [360.9, 430.9, 501.1, 571.5],
        [459.3, 548.4, 637.8, 727.4],
        [557.7, 665.9, 774.4, 883.2],
    ]
)
# Experiment II: the same speeds at 100 mm³/s, f 76.4 mm/min.
MEASURED_2 = np.array([1851.0, 1925.7, 2010.6, 2105.2])
CUTTING_2 = np.array([472.1, 507.9, 543.9, 580.2])
PRINTED_2 = np.array([1826.1, 1917.3, 2022.4, 2141.1])
FEED_2 = 76.4 / 60.0  # mm/s
# Coefficients of the benchmark models as printed; MRR in mm³/s, n in rev/min.
PRINTED_MODELS = {
    "P1 = C0 MRR + C1": (5.749, 1393.6),
    "P2 = k0 MRR + k1 n + k2": (5.801, 0.334, 1170.5),
    "P3 = C0 P_c + C1": (1.4036, 1237.9),
}


def removal_rate(feed: Array) -> Array:
    """Compute the material removal rate π d² f/4, mm³/s, at feeds in mm/s."""
    return np.pi / 4.0 * DIAMETER**2 * feed


def total_power(spindle: Array, cutting: Array, share: float = C0) -> Array:
    """Compute the proposed model, W, at speeds in rev/min and cutting powers in W."""
    return idle_power(spindle * REV_MIN, IDLE) + cutting + auxiliary_power(cutting, share)


def designs(spindle: Array, cutting: Array, feed: Array) -> dict[str, Array]:
    """Return what each benchmark model is linear in, by model, (n, coefficients)."""
    one, rate = np.ones_like(cutting), removal_rate(feed)
    columns = ([rate, one], [rate, spindle, one], [cutting, one])
    return {name: np.stack(c, axis=1) for name, c in zip(PRINTED_MODELS, columns, strict=True)}


def mean_error(model: Array, measured: Array) -> float:
    """Average the relative error, %."""
    return float(100.0 * np.mean(np.abs(model / measured - 1.0)))


def flat() -> tuple[Array, Array, Array, Array]:
    """Return speed (rev/min), cutting power (W), feed (mm/s), measured power (W) of Experiment I, (16,)."""
    spindle = np.repeat(SPEEDS, len(FEEDS))
    return spindle, CUTTING.ravel(), spindle * np.tile(FEEDS, len(SPEEDS)) / 60.0, MEASURED.ravel()


def fits() -> dict[str, Array]:
    """Fit the benchmark models to Experiment I by least squares."""
    *given, measured = flat()
    return {name: np.linalg.lstsq(m, measured, rcond=None)[0] for name, m in designs(*given).items()}


def fitted_share() -> float:
    """Fit C0 of P_aux = C0 P_c by least squares."""
    auxiliary = MEASURED - IDLING[:, None] - CUTTING
    return float(np.sum(auxiliary * CUTTING) / np.sum(CUTTING**2))


def predictions(coefficients: dict[str, Array], *given: Array) -> dict[str, Array]:
    """Compute what the benchmark models say, W."""
    return {name: m @ np.asarray(coefficients[name]) for name, m in designs(*given).items()}


def nearest_drill() -> tuple[float, Drill]:
    """Find the web and point angle with which the printed coefficients come nearest to the printed powers.

    Returns
    -------
    The largest relative error at the corners of Experiment I, and the drill
    """
    corners = [0, 3]

    def error(drill: Drill) -> float:
        shares = [
            mean_drilling_power(drill, LIPS, SPEEDS[i] * FEEDS[corners] / 60.0, SPEEDS[i] * REV_MIN)
            / CUTTING[i, corners]
            for i in corners
        ]
        return float(np.abs(np.array(shares) - 1.0).max())

    webs, halves = np.linspace(0.0, 9.5, 39), np.radians(np.linspace(20.0, 90.0, 36))
    drills = (Drill(DIAMETER, float(web), float(half)) for web in webs for half in halves)
    return min(((error(drill), drill) for drill in drills), key=lambda found: found[0])


def tables() -> tuple[Table, ...]:
    """Compute every table."""
    spindle, cutting, feed, measured = flat()
    states = [f"n {n:.0f}, c {c:.2f}" for n in SPEEDS for c in FEEDS]
    model = total_power(spindle, cutting)
    line = spindle * REV_MIN * (40.633 * np.tile(FEEDS, 4) + 3.0132)
    best, shares = fits(), {"C0 of P_aux = C0 P_c": (fitted_share(), C0)}
    for name, printed in PRINTED_MODELS.items():
        shares |= {f"{name} [{i}]": (float(best[name][i]), p) for i, p in enumerate(printed)}
    printed = {name: np.array(p) for name, p in PRINTED_MODELS.items()}
    errors = [Row("proposed", mean_error(model, measured), 1.13)]
    claimed: dict[str, float] = {"P3 = C0 P_c + C1": 2.09}
    for name, said in predictions(printed, spindle, cutting, feed).items():
        errors.append(Row(f"{name}, printed coefficients", mean_error(said, measured), claimed.get(name)))
    for name, said in predictions(best, spindle, cutting, feed).items():
        errors.append(Row(f"{name}, least squares", mean_error(said, measured)))
    second = np.full(4, FEED_2)
    model_2 = total_power(SPEEDS, CUTTING_2)
    errors_2 = [Row("proposed", mean_error(model_2, MEASURED_2), 1.02)]
    for name, said in predictions(printed, SPEEDS, CUTTING_2, second).items():
        errors_2.append(Row(f"{name}, printed coefficients", mean_error(said, MEASURED_2)))
    off, drill = nearest_drill()
    lips = [mean_drilling_power(drill, LIPS, n * FEEDS / 60.0, n * REV_MIN) for n in SPEEDS]

    def beside(ours: Array, others: Array, names: list[str] = states) -> tuple[Row, ...]:
        return tuple(Row(n, float(a), float(b)) for n, a, b in zip(names, ours, others, strict=True))

    speeds = [f"n {n:.0f}" for n in SPEEDS]
    width = f"web {drill.web:g} mm, point {2.0 * np.degrees(drill.half_point):.0f} deg"
    return (
        Table("Idle power", "W", beside(idle_power(SPEEDS * REV_MIN, IDLE), IDLING, speeds), 1e-4, 1),
        Table("Experiment I: cutting power as ω (40.633 c + 3.0132)", "W", beside(line, cutting), 6e-4, 1),
        Table("Experiment I: total power, model", "W", beside(model, measured), None, 1, "measured"),
        *(
            Table(
                f"Experiment I: total power, {name}, printed coefficients",
                "W",
                beside(said, measured),
                None,
                1,
                "measured",
            )
            for name, said in predictions(printed, spindle, cutting, feed).items()
        ),
        Table("Experiment I: mean error", "%", tuple(errors)),
        Table(
            "Coefficients by least squares of Experiment I",
            "as printed",
            tuple(Row(name, *pair) for name, pair in shares.items()),
            None,
            4,
        ),
        Table(
            "Experiment II: total power, model and its printed values",
            "W",
            beside(model_2, PRINTED_2, speeds),
            1e-3,
            1,
        ),
        Table(
            "Experiment II: total power, model", "W", beside(model_2, MEASURED_2, speeds), None, 1, "measured"
        ),
        Table("Experiment II: mean error", "%", tuple(errors_2)),
        Table(
            f"Cutting power of the printed coefficients, nearest drill ({width}; {100.0 * off:.1f} % at most "
            "at the corners)",
            "W",
            beside(np.ravel(lips), cutting),
            None,
            1,
        ),
    )


def misprints() -> tuple[Misprint, ...]:
    """List what contradicts itself."""
    *given, measured = flat()
    printed = {name: np.array(p) for name, p in PRINTED_MODELS.items()}
    said = predictions(printed, *given)
    third = said["P3 = C0 P_c + C1"]
    squares = {
        name: float(np.sum((m @ k - measured) ** 2))
        for name, m, k in (
            ("ours", designs(*given)["P2 = k0 MRR + k1 n + k2"], fits()["P2 = k0 MRR + k1 n + k2"]),
            ("printed", designs(*given)["P2 = k0 MRR + k1 n + k2"], printed["P2 = k0 MRR + k1 n + k2"]),
        )
    }
    k = fits()["P2 = k0 MRR + k1 n + k2"]
    return (
        Misprint(
            "Table 5, P3, row 4 (n 400, c 0.17)",
            "1860.1 W (1821.4 W by Table 4)",
            f"{third[3]:.1f} W",
            "Table 4's model at the printed cutting power gives the second number.",
        ),
        Misprint(
            "Table 5, mean error of P3",
            "2.09 %",
            f"{mean_error(third, measured):.2f} %",
            "By its own formula P3 is better than the proposed model "
            f"({mean_error(total_power(given[0], given[1]), measured):.2f} %).",
        ),
        Misprint(
            "P2",
            "5.801, 0.334, 1170.5",
            ", ".join(f"{v:.4g}" if v < 1e3 else f"{v:.1f}" for v in k),
            f"As printed it isn't the least-squares fit: it leaves {squares['printed']:.0f} W² where that "
            f"leaves {squares['ours']:.0f} W².",
        ),
        Misprint(
            "C0 of the auxiliary power",
            "0.1336",
            f"{fitted_share():.4f}",
            "By least squares through zero of the printed powers.",
        ),
        Misprint(
            "Experiment II, predictions",
            "1.0 to 1.2 W more in every row",
            "the printed formula",
            "The mean error is the same to two digits.",
        ),
    )


def draw_idle() -> Figure:
    """Draw the idle power over the spindle speed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.2, 2.6))
    axes = figure.subplots()
    speeds = np.linspace(0.0, 900.0, 91)
    axes.plot(speeds, idle_power(speeds * REV_MIN, IDLE), color=BLUE, label="0.0003 n² + 0.0524 n + 1221")
    axes.plot(SPEEDS, IDLING, "o", color=ORANGE, label="printed")
    axes.set(xlabel="spindle speed n (rev/min)", ylabel="idle power (W)")
    axes.legend(frameon=False)
    return figure


def draw_auxiliary() -> Figure:
    """Draw the auxiliary power over the cutting power, with the linear fits and the quadratic one."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.2, 2.6))
    axes = figure.subplots()
    cutting, auxiliary = CUTTING.ravel(), (MEASURED - IDLING[:, None] - CUTTING).ravel()
    design = np.stack([cutting, cutting**2], axis=1)
    linear, quadratic = np.linalg.lstsq(design, auxiliary, rcond=None)[0]
    along = np.linspace(0.0, 900.0, 91)
    axes.plot(cutting, auxiliary, "o", color=GREY, label="measured − idle − cutting")
    axes.plot(along, auxiliary_power(along, C0), color=ORANGE, label=f"{C0} P_c (printed)")
    axes.plot(along, auxiliary_power(along, fitted_share()), color=BLUE, label=f"{fitted_share():.4f} P_c")
    axes.plot(
        along,
        auxiliary_power(along, linear, quadratic),
        ":",
        color=GREEN,
        label=f"{linear:.4f} P_c {quadratic:+.2e} P_c²",
    )
    axes.set(xlabel="cutting power P_c (W)", ylabel="auxiliary power (W)")
    axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def draw_models() -> Figure:
    """Draw the errors of the four models, by printed coefficients, over the states of Experiment I."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 2.8))
    axes = figure.subplots()
    spindle, cutting, feed, measured = flat()
    printed = {name: np.array(p) for name, p in PRINTED_MODELS.items()}
    models = {"proposed": total_power(spindle, cutting)} | predictions(printed, spindle, cutting, feed)
    for (name, said), mark in zip(models.items(), "os^v", strict=True):
        axes.plot(np.arange(1, 17), 100.0 * (said / measured - 1.0), mark + "-", ms=4, lw=0.8, label=name)
    axes.axhline(0.0, color=GREY, lw=0.8)
    axes.set(xlabel="state of Experiment I", ylabel="model over measured (%)", xticks=range(1, 17))
    axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize=8)
    return figure


def draw_validation() -> Figure:
    """Draw Experiment II: measured power beside the model's and the printed prediction."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.6, 2.6))
    axes = figure.subplots()
    bars = {
        "measured": (MEASURED_2, GREY),
        "ours": (total_power(SPEEDS, CUTTING_2), BLUE),
        "printed": (PRINTED_2, ORANGE),
    }
    for k, (name, (watts, colour)) in enumerate(bars.items()):
        axes.bar(np.arange(4) + 0.27 * (k - 1), watts, 0.25, color=colour, label=name)
    axes.set(xticks=range(4), xticklabels=[f"{n:.0f}" for n in SPEEDS], ylim=(1500.0, 2250.0))
    axes.set(xlabel="spindle speed (rev/min), 100 mm³/s", ylabel="total power (W)")
    axes.legend(frameon=False)
    return figure


def paper() -> Paper:
    """Compute all that is shown of the paper."""
    return Paper(
        "Drilling power: Wang, Zhang, Chen, Zhang, Wu, Appl. Sci. 2019, 9(22), 4801",
        tables(),
        misprints(),
        (
            "The cutting powers from the lips (Eqs. 3-10): the drill's point isn't printed in full, and with "
            "no web and point angle do the printed coefficients give the printed powers. The nearest drill "
            "is in the last table; its web would be more than half the drill.",
            "The benchmark models row by row: of their printed predictions only the one above is at hand. "
            "What their printed coefficients give stands in the tables.",
            "The measurements and the cutting powers of Experiment II: they are taken from the tables.",
        ),
        {
            "drilling-idle": draw_idle,
            "drilling-auxiliary": draw_auxiliary,
            "drilling-models": draw_models,
            "drilling-validation": draw_validation,
        },
    )


if __name__ == "__main__":
    show(paper)
