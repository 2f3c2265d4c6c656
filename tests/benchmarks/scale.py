"""Print how the optimiser's time and memory grow with the number of locations.

Usage: python tests/benchmarks/scale.py [1 10 100]     (passes of 1 000 locations each; default: all)

The vase's wall, cut finer: passes and locations are splines through those of the printed case. "ms a
location" is time of the processor, which other programs on the machine disturb least. Peak memory is the
process's, so it never falls from one line to the next.
"""

import resource
import sys
import time
from pathlib import Path

import numpy as np
from scipy.interpolate import RectBivariateSpline

import fiveaxis as fx
from fiveaxis.posture import optimise
from fiveaxis.toolpath import Constraints

VASE = Path(__file__).parents[3] / "shared" / "data" / "cases" / "vase_overhang.csv"
PASSES, ROUND = 10, 360
LOCATIONS = 1_000
# Rows repeated on either side, so that the spline closes.
LAP = 6


def fine_vase(passes: int, around: int) -> fx.Toolpath:
    """Cut the vase's wall in so many passes of so many locations."""
    given = np.loadtxt(VASE, delimiter=",", skiprows=1)[:, :6].reshape(PASSES, ROUND, 6)
    closed = np.concatenate([given[:, -LAP:], given, given[:, :LAP]], axis=1)
    level = np.linspace(0, PASSES - 1, passes)
    turn = np.linspace(0, ROUND, around, endpoint=False)
    columns = [
        RectBivariateSpline(np.arange(PASSES), np.arange(-LAP, ROUND + LAP), closed[:, :, k])(level, turn)
        for k in range(6)
    ]
    rows = np.stack(columns, axis=-1).reshape(-1, 6)
    normal = rows[:, 3:] / np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
    return fx.Toolpath.from_contacts(rows[:, :3], normal, fx.Tool.ball(10))


def run(passes: int) -> None:
    toolpath, machine = fine_vase(passes, LOCATIONS), fx.load_machine("hayashi-640123")
    clock, processor = time.perf_counter(), time.process_time()
    solution = optimise(toolpath, machine, Constraints.of_degrees(tilt=(15, 75)))
    clock, processor = time.perf_counter() - clock, time.process_time() - processor
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(
        f"{len(toolpath):8,} locations {clock:8.1f} s {processor:8.1f} s of processor "
        f"{1e3 * processor / len(toolpath):6.2f} ms a location {memory:5.2f} GB "
        f"{solution.energy.total:10.0f} J, normal {solution.baselines['normal'].total:8.0f} J",
        flush=True,
    )


if __name__ == "__main__":
    # Compilers and caches.
    optimise(fine_vase(1, 400), fx.load_machine("hayashi-640123"), Constraints.of_degrees(tilt=(15, 75)))
    for count in map(int, sys.argv[1:] or ["1", "10", "100"]):
        run(count)
