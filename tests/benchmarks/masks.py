"""Print what a mask costs: time, postures asked, and how much dearer the path is than without it.

Usage: python tests/benchmarks/masks.py [vase] [fine]         (default: vase)

``vase`` is the printed case, 3 600 locations; ``fine`` its wall cut into 10 000. The masks: one that admits
everything, one that refuses scattered patches of (A, C) that wander along the path, a wall that stands across
the feed and tips to and fro along the path, and the scattered one with a rough map of its own. Every
one is a few lines of numpy, so that the time is the optimiser's: time of the processor, which other programs
on the machine disturb least.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scale import fine_vase

import fiveaxis as fx
from fiveaxis.model import Constraints, tool_axes
from fiveaxis.posture import Options, optimise_postures

VASE = Path(__file__).parents[3] / "shared" / "data" / "cases" / "vase_overhang.csv"
MACHINE = fx.load_machine("hayashi-640123")
# Locations over which masks change: of the printed case, in which one degree of C goes by with each.
WANDER, TIP = 40.0, 900.0
# Cosine between tool axis and wall from which the wall is hit, and how far it tips (rad).
WALL, TIPS = 0.1, 0.8

Mask = Callable[[np.ndarray, np.ndarray], np.ndarray]


def everything(path: fx.Toolpath) -> Mask:
    return lambda rows, rotary: np.ones(len(rows), dtype=bool)


def scattered(path: fx.Toolpath) -> Mask:
    slower = len(path) / 3600

    def mask(rows: np.ndarray, rotary: np.ndarray) -> np.ndarray:
        c, a = rotary.T
        along = rows / (WANDER * slower)
        return ~(np.sin(6.0 * c + along) * np.sin(9.0 * a + along / 2.25) > 0.5)

    return mask


def wall(path: fx.Toolpath) -> Mask:
    feed = np.gradient(path.contact, axis=0)
    feed /= np.linalg.norm(feed, axis=1, keepdims=True)
    tip = TIPS * np.sin(2.0 * np.pi * np.arange(len(path)) / (TIP * len(path) / 3600))[:, None]
    into = np.cos(tip) * feed + np.sin(tip) * np.array([0.0, 0.0, 1.0])
    return lambda rows, rotary: np.sum(tool_axes(MACHINE, rotary) * into[rows], axis=1) < WALL


class Mapped:
    """A mask with a rough map of its own: here the same answer, and its neighbours' too."""

    def __init__(self, path: fx.Toolpath) -> None:
        self.exact = scattered(path)

    def __call__(self, rows: np.ndarray, rotary: np.ndarray) -> np.ndarray:
        return self.exact(rows, rotary)

    def rough(self, rows: np.ndarray, rotary: np.ndarray) -> np.ndarray:
        return self.exact(rows, np.round(rotary / 0.03) * 0.03)


MASKS = {"everything": everything, "scattered": scattered, "wall": wall, "scattered, mapped": Mapped}


def run(what: str, path: fx.Toolpath) -> None:
    started = time.process_time()
    free = optimise_postures(path, MACHINE, Constraints.of_degrees(tilt=(15, 75)))
    print(f"{what}, {len(path):,} locations")
    print(
        f"{'without a mask':20} {time.process_time() - started:6.1f} s {free.energy.total:9.0f} J", flush=True
    )
    for name, make in MASKS.items():
        mask = make(path)
        started = time.process_time()
        found = optimise_postures(path, MACHINE, Constraints.of_degrees(tilt=(15, 75)), Options(mask=mask))
        seconds = time.process_time() - started
        rotary = found.motion.positions[:, MACHINE.rotary_columns]
        location = np.arange(len(rotary)) if found.motion.location is None else found.motion.location
        ends = (np.floor(location).astype(int), np.ceil(location).astype(int))
        refused = int((~mask(ends[0], rotary) | ~mask(ends[1], rotary)).sum())
        dearer = found.energy.total / free.energy.total - 1.0
        figures = f"{name:20} {seconds:6.1f} s {found.energy.total:9.0f} J {dearer:+7.2%}"
        print(f"{figures}  {found.stages[-1].status}, {refused} refused", flush=True)
        for baseline, saved in found.savings().items():
            print(f"{'':20} {saved:7.2%} below {baseline}; {found.compared[baseline].note}", flush=True)
        for baseline, reason in found.missing.items():
            print(f"{'':20} no {baseline}: {reason}", flush=True)


def main() -> None:
    cases = {
        "vase": lambda: fx.read_toolpath(VASE, tool=fx.Tool.ball(10)),
        "fine": lambda: fine_vase(10, 1_000),
    }
    # Compilers and caches.
    small = cases["vase"]().at(np.arange(450))
    optimise_postures(small, MACHINE, Constraints.of_degrees(tilt=(15, 75)), Options(mask=scattered(small)))
    for name in sys.argv[1:] or ["vase"]:
        run(name, cases[name]())


if __name__ == "__main__":
    main()
