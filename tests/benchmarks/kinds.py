"""Print what it takes to keep a holder clear of the part, beside the same path without one.

Usage: python tests/benchmarks/kinds.py part [--effort quick]

The whole vase on `hayashi-640123`, solid, with a holder of two stick-outs; its time stands beside that of the
plain path of the same run, seconds of the processor. With ``PYTHONPATH`` at another checkout the same is
printed of that build.
"""

import argparse
import time
from dataclasses import replace
from typing import Any

import numpy as np
import trimesh
from paths import PATHS

import fiveaxis as fx
from fiveaxis.model.toolpath.tool import Holder, Section


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
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", nargs="?", choices=["part"], default="part")
    parser.add_argument("--effort", default="quick")
    print_clear_of_part(parser.parse_args().effort)


if __name__ == "__main__":
    main()
