"""The paths that the benchmarks share, by name: how each is made, on which machine, and its usual bounds.

Paths from ../shared/data are read there; nothing of it is part of the project.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import fiveaxis as fx

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
HAYASHI = "hayashi-640123"
TRUNNION = "linuxcnc-xyzac-trt"


@dataclass(frozen=True)
class NamedPath:
    """A path with what is usually asked of its postures.

    Parameters
    ----------
    what : in words
    read : makes the path
    options : of `fx.optimise`
    machine : its name; powers that it lacks are those of `HAYASHI`
    shared : whether the path is read from ../shared
    """

    what: str
    read: Callable[[], fx.Toolpath]
    options: dict[str, Any] = field(default_factory=dict)
    machine: str = HAYASHI
    shared: bool = True

    def make(self) -> tuple[fx.Toolpath, fx.Machine]:
        """Make path and machine."""
        machine = fx.load_machine(self.machine)
        if self.machine != HAYASHI:
            machine = machine.with_drives_of(fx.load_machine(HAYASHI))
        return self.read(), machine


def table(name: str, diameter: float, feed: float = 1000.0) -> fx.Toolpath:
    """Read a table of contacts and normals."""
    return fx.read_toolpath(DATA / "cases" / name, tool=fx.Tool.ball(diameter), feed_mm_min=feed)


def mesh(name: str, diameter: float, **options: Any) -> fx.Toolpath:
    """Plan passes on a mesh."""
    return fx.plan_contour(DATA / "meshes" / name, fx.Tool.ball(diameter), **options)


def program(name: str, diameter: float, rapid: float = 10_000.0) -> fx.Toolpath:
    """Read one of LinuxCNC's programs on its own machine."""
    machine = fx.load_machine(TRUNNION)
    file = DATA / "toolpaths" / f"linuxcnc_{name}_xyzac.ngc"
    return fx.read_toolpath(file, tool=fx.Tool.ball(diameter), machine=machine, rapid_mm_min=rapid)


def example() -> fx.Toolpath:
    """Plan the README's example."""
    part = ROOT / "examples" / "overhang" / "part.stl"
    return fx.plan_contour(part, fx.Tool.ball(8), stepdown=3, overhang=True)


WALLS = {"tilt": (15, 75)}


def arc() -> fx.Toolpath:
    """Lay 60 contacts on an overhanging arc of 120 deg."""
    turn = np.radians(np.linspace(0.0, 120.0, 60))
    normals = np.column_stack([0.9 * np.cos(turn), 0.9 * np.sin(turn), np.full(60, -0.436)])
    contacts = 30.0 * normals + [40.0, 0.0, 30.0]
    return fx.Toolpath.from_contacts(contacts, normals, fx.Tool.ball(8), feed_mm_min=1000)


PATHS = {
    "vase": NamedPath("overhanging vase, ball 10", lambda: table("vase_overhang.csv", 10), WALLS),
    "dome": NamedPath(
        "underside of a dome, ball 6", lambda: table("dome_underside.csv", 6), {"tilt": (10, 70)}
    ),
    "dome-free": NamedPath(
        "underside of a dome, ball 6, turns as far as the axes reach",
        lambda: table("dome_underside.csv", 6),
        {"tilt": (10, 70), "max_turn": 180},
    ),
    "wall": NamedPath(
        "leaning S-wall, ball 8", lambda: table("leaning_s_wall.csv", 8, 500.0), {"tilt": (20, 80)}
    ),
    "example": NamedPath("examples/overhang, ball 8, stepdown 3", example, WALLS, shared=False),
    "propeller": NamedPath(
        "propeller, ball 4, stepdown 4", lambda: mesh("propeller_d.stl", 4, stepdown=4), WALLS
    ),
    "propeller-fine": NamedPath(
        "propeller, ball 4, stepdown 1", lambda: mesh("propeller_d.stl", 4, stepdown=1), WALLS
    ),
    "supportless": NamedPath(
        "supportless sample, ball 6, stepdown 5",
        lambda: mesh("supportless_sample.stl", 6, stepdown=5, overhang=True),
        WALLS,
    ),
    "featuretype": NamedPath(
        "letters, ball 0.2", lambda: mesh("featuretype.stl", 0.2, stepdown=0.3, spacing=0.05), WALLS
    ),
    "impeller": NamedPath(
        "LinuxCNC's impeller program, ball 6", lambda: program("impeller", 6), {"cone": 15}, TRUNNION
    ),
    "arc": NamedPath("60 contacts on an overhanging arc, ball 8", arc, WALLS, shared=False),
    "boat": NamedPath("LinuxCNC's boat program, ball 6", lambda: program("boat", 6), {"cone": 15}, TRUNNION),
}
