"""Reproduce the tables of a drilling-energy paper from its own measurements, and show what doesn't reproduce.

A drilling machine takes an idle power that is a quadratic of the spindle speed, the power of the cut, and a
loss in its drive that grows with the cut: P_total = P_idle(n) + P_c + C0 P_c. Wang et al. (2019) measured
sixteen states of a machine YH850Z in the alloy GH4169 (Experiment I), fitted the model, and validated it at
one removal rate and four speeds (Experiment II). Three rivals take the total as a straight function of
removal rate (Model-1), of removal rate and speed (Model-2), or of the cutting power (Model-3).

Source: Wang, Zhang, Chen, Zhang, Wu, Appl. Sci. 2019, 9(22), 4801, doi 10.3390/app9224801.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.energy import drilling_power, drilling_removal_rate

RAD_PER_S = 2.0 * np.pi / 60.0  # of 1 rev/min
# Idle power as printed: constant W, per rev/min, per (rev/min)².
IDLE = np.array([1221.0, 0.0524, 0.0003]) / RAD_PER_S ** np.arange(3)
C0 = 0.1336  # W/W, as printed
DIAMETER = 10.0  # mm

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
# Experiment II: the same speeds at 100 mm³/s.
MEASURED_2 = np.array([1851.0, 1925.7, 2010.6, 2105.2])
CUTTING_2 = np.array([472.1, 507.9, 543.9, 580.2])
PRINTED_2 = np.array([1826.1, 1917.3, 2022.4, 2141.1])


def main() -> None:
    """Print the tables, then the fits beside the printed ones."""
    print_predictions()
    speeds = np.repeat(SPEEDS, len(FEEDS))
    rates = drilling_removal_rate(DIAMETER, speeds * np.tile(FEEDS, len(SPEEDS)) / 60.0)
    cutting, measured = CUTTING.ravel(), MEASURED.ravel()
    auxiliary = (MEASURED - IDLING[:, None] - CUTTING).ravel()
    one = np.ones_like(rates)
    print(
        "\nLeast squares of Experiment I   ours | printed                  sum of squares, W²: ours | printed"
    )
    print_fit("C0       P_aux = C0 P_c", [cutting], auxiliary, [C0])
    print_fit("Model-1  C0 MRR + C1", [rates, one], measured, [5.749, 1393.6])
    # k1 per rev/min, as the paper prints it.
    print_fit("Model-2  k0 MRR + k1 n + k2", [rates, speeds, one], measured, [5.801, 0.334, 1170.5])
    print_fit("Model-3  C0 P_c + C1", [cutting, one], measured, [1.4036, 1237.9])
    print(
        "\nC0 and Model-2 as printed aren't the least-squares fits of the table; Models 1 and 3 agree.\n"
        "Not reproduced: the cutting powers themselves, here taken from the table. The drill's point\n"
        "isn't printed in full; with the printed coefficients the best web and point angle stay 3 %\n"
        "off, and that web would be more than half the drill."
    )


def print_predictions() -> None:
    """Print the measured total power of both experiments beside the model's."""
    model = drilling_power(SPEEDS[:, None] * RAD_PER_S, CUTTING, IDLE, (C0, 0.0))
    print("Experiment I   n rev/min  c mm/rev  measured W  model W  error %")
    for (i, k), predicted in np.ndenumerate(model):
        measured = MEASURED[i, k]
        error = 100.0 * (predicted / measured - 1.0)
        print(f"{SPEEDS[i]:24.0f}{FEEDS[k]:10.2f}{measured:12.1f}{predicted:9.1f}{error:9.2f}")
    print(f"mean error {mean_error(model, MEASURED):.2f} % (printed 1.13 %)\n")
    model = drilling_power(SPEEDS * RAD_PER_S, CUTTING_2, IDLE, (C0, 0.0))
    print("Experiment II  n rev/min  measured W  model W  printed W  error %")
    for n, measured, predicted, printed in zip(SPEEDS, MEASURED_2, model, PRINTED_2, strict=True):
        error = 100.0 * (predicted / measured - 1.0)
        print(f"{n:24.0f}{measured:12.1f}{predicted:9.1f}{printed:11.1f}{error:9.2f}")
    print(f"mean error {mean_error(model, MEASURED_2):.2f} % (printed 1.02 %)")


def mean_error(model: np.ndarray, measured: np.ndarray) -> float:
    """Average the relative error, %."""
    return float(100.0 * np.mean(np.abs(model / measured - 1.0)))


def print_fit(name: str, columns: list[np.ndarray], target: np.ndarray, printed: list[float]) -> None:
    """Fit a model by least squares; print its coefficients and sum of squares beside the printed ones."""
    design = np.stack(columns, axis=1)
    shown = [np.linalg.lstsq(design, target, rcond=None)[0], np.array(printed)]
    squares = [f"{np.sum((design @ k - target) ** 2):7.0f}" for k in shown]
    figures = " | ".join(", ".join(f"{v:.4g}" if abs(v) < 1e3 else f"{v:.1f}" for v in k) for k in shown)
    print(f"{name:28s} {figures:48s} {' | '.join(squares)}")


if __name__ == "__main__":
    main()
