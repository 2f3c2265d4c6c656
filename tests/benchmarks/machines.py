"""Run reasonable finishing jobs on machines as the library has them, and print how many end in a program.

Usage: python tests/benchmarks/machines.py [MACHINE…] [--shapes SHAPE…] [--effort quick]

Eleven finishing paths of some 900 locations (ball 8, 10 to 60 deg from the normal) on seven machines, with
nothing stated but machine, tool and tilt: no work offset, no powers, and a tool length (120 mm) only where
the head swivels. A job ends in a verified program, or with the first line that it says instead.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import fiveaxis as fx
from fiveaxis.base.errors import FiveAxisError
from fiveaxis.job import make_job, run_job
from fiveaxis.nc import write_toolpath

MACHINES = (
    "hayashi-640123",
    "linuxcnc-xyzac-trt",
    "dmu50ev",
    "umc-750",
    "linuxcnc-bridgemill",
    "dmu80p-duoblock",
    "variaxis-630",
)
ROWS, POINTS = 30, 31
STEP = 1e-5

# Points of a surface, mm, over its two parameters in 0…1; the normal points to the side of the cross product.
Surface = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]


def wall(lean: float) -> Surface:
    """An S-shaped wall that leans outwards by an angle in deg, from the vertical."""

    def surface(u, v):
        x, height = 60.0 * (u - 0.5), 25.0 * v
        return x, 8.0 * np.sin(2.0 * np.pi * u) - height * np.tan(np.radians(lean)), 10.0 + height

    return surface


def sphere(low: float, high: float, side: float) -> Surface:
    """A zone of a sphere of 25 mm between two polar angles, deg, seen from outside (1) or inside (-1)."""

    def surface(u, v):
        polar, turn = np.radians(low + (high - low) * v), side * 1.5 * np.pi * u
        ring = 25.0 * np.sin(polar)
        return ring * np.cos(turn), ring * np.sin(turn), 30.0 - 25.0 * np.cos(np.pi - polar)

    return surface


def graph(height: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Surface:
    """A height over a square of 50 mm."""

    def surface(u, v):
        x, y = 50.0 * (u - 0.5), 50.0 * (v - 0.5)
        return x, y, 20.0 + height(x / 25.0, y / 25.0)

    return surface


def torus(u, v):
    """The upper half of a ring."""
    turn, polar = 1.9 * np.pi * u, np.pi * (0.15 + 0.7 * v)
    ring = 25.0 + 8.0 * np.cos(polar)
    return ring * np.cos(turn), ring * np.sin(turn), 15.0 + 8.0 * np.sin(polar)


def cone(u, v):
    """A cone that widens upwards: an overhang."""
    turn, height = 1.9 * np.pi * u, 20.0 * v
    ring = 15.0 + 0.5 * height
    return ring * np.cos(turn), ring * np.sin(turn), 10.0 + height


def blade(u, v):
    """A ruled blade that twists by 35 deg."""
    twist, along = np.radians(35.0) * v, 50.0 * (u - 0.5)
    return along * np.cos(twist), along * np.sin(twist), 10.0 + 30.0 * v


SHAPES: dict[str, Surface] = {
    "S-wall": wall(0.0),
    "S-wall, leaning": wall(15.0),
    "dome above": sphere(100.0, 165.0, 1.0),
    "dome below": sphere(50.0, 85.0, 1.0),
    "bowl": graph(lambda x, y: 6.0 * (x**2 + y**2)),
    "saddle": graph(lambda x, y: 6.0 * (x**2 - y**2)),
    "plane": graph(lambda x, y: 3.0 * x),
    "freeform": graph(lambda x, y: 4.0 * np.sin(2.0 * x) * np.cos(1.5 * y)),
    "torus": torus,
    "cone": cone,
    "ruled blade": blade,
}


def path_on(name: str) -> fx.Toolpath:
    """Cut a surface in rows there and back."""
    surface = SHAPES[name]
    v, u = np.meshgrid(np.linspace(0.0, 1.0, ROWS), np.linspace(0.0, 1.0, POINTS), indexing="ij")
    u[1::2] = u[1::2, ::-1]
    u, v = u.ravel(), v.ravel()

    def at(u, v):
        return np.stack(surface(u, v), axis=1)

    along, across = at(u + STEP, v) - at(u - STEP, v), at(u, v + STEP) - at(u, v - STEP)
    normal = np.cross(along, across)
    # The free side is above; at a wall and an overhang it is outside.
    outside = np.column_stack([at(u, v)[:, :2], np.zeros(len(u))])
    away = {"S-wall": [0, -1, 0], "S-wall, leaning": [0, -1, 0], "ruled blade": [0, -1, 0]}.get(name)
    side = outside if name in ("dome below", "cone") else np.array([0.0, 0.0, 1.0] if away is None else away)
    normal *= np.sign(np.sum(normal * side, axis=1, keepdims=True)) / np.linalg.norm(normal, axis=1)[:, None]
    return fx.Toolpath.from_contacts(at(u, v), normal, fx.Tool.ball(8), name=name)


def try_job(file: Path, machine: str, effort: str) -> tuple[bool, str]:
    """Run a job; return whether it ends in a program, and the saving or the reason."""
    settings = {"tool": "ball:8", "tilt": (10.0, 60.0), "machine": machine}
    if not fx.load_machine(machine).length_is_along_z:
        settings["tool_length"] = 120.0
    try:
        outcome = run_job(make_job(input=file, effort=effort, **settings))
    except FiveAxisError as fault:
        return False, str(fault).splitlines()[0]
    if not outcome.ok:
        return False, str(outcome.gate.report.summary()[0])
    savings, ranges = outcome.solution.savings(), outcome.solution.savings_ranges()
    name = min(savings, key=savings.__getitem__, default=None)
    if name is None:
        return True, "no baseline"
    low, high = ranges.get(name, (savings[name],) * 2)
    offset = "X{:g} Y{:g} Z{:g}".format(*outcome.solution.machine.setup.offset)
    saved = f"{100.0 * savings[name]:.1f} % ({100.0 * low:.0f}…{100.0 * high:.0f})"
    return True, f"{saved} against {name}, part at {offset}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("machines", nargs="*", default=MACHINES)
    parser.add_argument("--shapes", nargs="*", default=list(SHAPES))
    parser.add_argument("--effort", default="quick")
    given = parser.parse_args()
    ended = tried = 0
    with tempfile.TemporaryDirectory() as folder:
        for shape in given.shapes:
            file = write_toolpath(path_on(shape), Path(folder) / f"{shape}.csv")
            for machine in given.machines or MACHINES:
                start = time.process_time()
                ok, text = try_job(file, machine, given.effort)
                took = time.process_time() - start
                ended, tried = ended + ok, tried + 1
                end = "program" if ok else "none"
                print(f"{shape:16} {machine:20} {end:8} {took:6.1f} s  {text}", flush=True)
    print(f"{ended} of {tried} jobs end in a verified program: {100.0 * ended / tried:.0f} %")


if __name__ == "__main__":
    main()
