"""Print what each kind of problem costs: masks, cones, starts, accelerations, TCP, heads, objectives.

Usage: python tests/benchmarks/kinds.py [--effort quick] [KIND …]

Every fourth location of the vase on `hayashi-640123`, or what the kind needs instead; the drives are its in
any case. Beside energy and time stand the best baseline's by what is minimised, starts and reversals, and
seconds of the processor. ``part`` is the whole vase, solid, with a holder kept clear of it; its time stands
beside the plain one of the same run. With ``PYTHONPATH`` at another checkout the same is printed of that
build.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import trimesh
from masks import wall
from paths import PATHS

import fiveaxis as fx
from fiveaxis.model import Clock, Constraints, Interpolation
from fiveaxis.model.toolpath.tool import Holder, Section
from fiveaxis.nc import DIALECTS
from fiveaxis.posture import Options, optimise_postures

Case = tuple[fx.Toolpath, fx.Machine, dict[str, Any], dict[str, Any]]


def vase(**options: Any) -> Case:
    """Make the plain case, with other options."""
    path = PATHS["vase"].read()
    return path.at(np.arange(0, len(path), 4)), fx.load_machine("hayashi-640123"), {"tilt": (15, 75)}, options


def head() -> Case:
    """Cut the upper side of a dome on a machine whose head swivels and turns."""
    own = fx.load_machine("hayashi-640123")
    machine = replace(fx.load_machine("linuxcnc-bridgemill").with_drives_of(own), bodies=())
    return PATHS["dome-top"].read(), machine, {"tilt": (10, 50)}, {}


def quick_axes(**options: Any) -> Case:
    """Make the case of a machine that states speeds and accelerations."""
    path, machine, bounds, _ = vase()
    axes = (
        replace(a, max_speed=1.0 if a.is_rotary else 200.0, max_acceleration=5.0 if a.is_rotary else 2000.0)
        for a in machine.axes
    )
    return path, replace(machine, axes=tuple(axes)), bounds, options


def started() -> Case:
    """Begin from the baseline along the normal."""
    path, machine, bounds, _ = vase()
    found = optimise_postures(path, machine, Constraints.of_degrees(**bounds), Options(effort="quick"))
    start = found.compared["greedy"].motion.positions
    given = start if found.motion.location is None else start[found.motion.location % 1.0 == 0.0]
    return path, machine, bounds, {"start": given[:, machine.rotary_columns]}


def cone() -> Case:
    """Keep C still about the singular direction on the upper side of a dome."""
    path = PATHS["dome-top"].read()
    return path, fx.load_machine("hayashi-640123"), {"tilt": (10, 50), "singular_cone": 3.0}, {}


def masked() -> Case:
    """Keep clear of a wall across the feed."""
    path, machine, bounds, _ = vase()
    return path, machine, bounds, {"mask": wall(path)}


KINDS: dict[str, Callable[[], Case]] = {
    "plain": vase,
    "mask": masked,
    "singular cone": cone,
    "start": started,
    "accelerations": lambda: quick_axes(clock=Clock(DIALECTS["linuxcnc"])),
    "TCP": lambda: quick_axes(clock=Clock(DIALECTS["linuxcnc"], "tip"), interpolation=Interpolation.TCP),
    "head": head,
    "travel": lambda: vase(objective="travel"),
    "time": lambda: quick_axes(objective="time"),
}


def solid_vase(path: fx.Toolpath, step: float = 1.0) -> trimesh.Trimesh:
    """Make the part of which ten rings of 360 contacts are a path: its profiles are parabolas."""
    rings = path.contact.reshape(10, 360, 3)
    radii, turn = np.hypot(rings[..., 0], rings[..., 1]), np.arctan2(rings[0, :, 1], rings[0, :, 0])
    heights = np.arange(0.0, 60.0 + step / 2.0, step)
    profiles = np.polyfit(rings[:, 0, 2], radii, 2)
    radius = np.stack([np.polyval(one, heights) for one in profiles.T], axis=1)
    corners = [radius * np.cos(turn), radius * np.sin(turn), np.repeat(heights[:, None], 360, axis=1)]
    wall = np.stack(corners, axis=-1).reshape(-1, 3)
    number = np.arange(len(wall)).reshape(-1, 360)
    a, b, c, d = number[:-1], np.roll(number, -1, 1)[:-1], np.roll(number, -1, 1)[1:], number[1:]
    bottom, top = (np.full(360, len(wall) + k) for k in range(2))
    faces = [(a, b, c), (a, c, d), (bottom, b[0], a[0]), (top, d[-1], c[-1])]
    return trimesh.Trimesh(
        np.vstack([wall, [[0.0, 0.0, 0.0], [0.0, 0.0, heights[-1]]]]),
        np.vstack([np.stack(face, axis=-1).reshape(-1, 3) for face in faces]),
        process=False,
    )


def print_clear_of_part(effort: str) -> None:
    """Print what it takes to keep holders of two stick-outs clear of the vase that is cut."""
    path, machine = PATHS["vase"].read(), fx.load_machine("hayashi-640123")
    part = solid_vase(path)
    options: dict[str, Any] = {"tilt": (15, 75), "effort": effort}
    for stick_out in (40.0, 25.0):
        tool = fx.Tool.ball(10, holder=Holder(stick_out, (Section(length=40.0, diameter=40.0),)))
        held = replace(path, tool=tool)
        fx.optimise(held, machine, part=part, **options)  # compiling isn't what is measured
        began = time.process_time()
        fx.optimise(path, machine, **options)
        between = time.process_time()
        found = fx.optimise(held, machine, part=part, **options)
        plain, kept = between - began, time.process_time() - between
        print(
            f"{'part':14} {len(path):5} locations {found.energy.total:8.0f} J, stick-out {stick_out:.0f} mm, "
            f"{kept:5.2f} s of processor, {kept / plain:.2f} times the plain {plain:.2f} s; {found.verify()}",
            flush=True,
        )


def main() -> None:
    """Print a line of each kind."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kinds", nargs="*")
    parser.add_argument("--effort", default="quick")
    given = parser.parse_args()
    for name in given.kinds or (*KINDS, "part"):
        if name == "part":
            print_clear_of_part(given.effort)
            continue
        path, machine, bounds, options = KINDS[name]()
        began = time.process_time()
        found = optimise_postures(
            path, machine, Constraints.of_degrees(**bounds), Options(effort=given.effort, **options)
        )
        seconds, energy = time.process_time() - began, found.energy
        measure = {"travel": "travel", "time": "time"}.get(options.get("objective", "energy"), "total")
        best = min((getattr(e, measure), n) for n, e in found.baselines.items())
        print(
            f"{name:14} {len(path):5} locations {energy.total:8.0f} J {energy.time:7.1f} s, {measure} "
            f"{getattr(energy, measure):8.1f} (best baseline {best[1]} {best[0]:8.1f}), {energy.starts} + "
            f"{energy.reversals} starts and reversals, {seconds:5.2f} s of processor",
            flush=True,
        )


if __name__ == "__main__":
    main()
