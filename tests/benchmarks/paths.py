"""The paths that the benchmarks share, by name: how each is made, on which machine, and its usual bounds.

Paths from ../shared/data are read there; nothing of it is part of the project.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

import fiveaxis as fx
from fiveaxis.check import Fixture
from fiveaxis.model import Box
from fiveaxis.model.toolpath.tool import Holder, Section

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
    around : makes part and fixtures that the tool keeps clear of
    """

    what: str
    read: Callable[[], fx.Toolpath]
    options: dict[str, Any] = field(default_factory=dict)
    machine: str = HAYASHI
    shared: bool = True
    around: Callable[[], tuple[trimesh.Trimesh, tuple[Fixture, ...]]] | None = None

    def make(self) -> tuple[fx.Toolpath, fx.Machine]:
        """Make path and machine, without bodies: nothing says where the part stands on its table."""
        machine = replace(fx.load_machine(self.machine), bodies=())
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
    return fx.read_toolpath(file, tool=fx.Tool.ball(diameter), machine=machine, rapid=rapid)


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


def cone(n: int) -> fx.Toolpath:
    """Lay eight rings of n contacts on an overhanging cone of radius 15 to 33."""
    turn = 2.0 * np.pi * np.arange(n + 1) / n
    out = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n + 1)])
    up = np.array([0.0, 0.0, 1.0])
    contacts = np.vstack([r * out + (r - 15.0) * up for r in np.linspace(15.0, 33.0, 8)])
    return fx.Toolpath.from_contacts(contacts, np.tile(out - up, (8, 1)), fx.Tool.ball(8), feed_mm_min=1000)


def block() -> tuple[trimesh.Trimesh, tuple[Fixture, ...]]:
    """Make the block of examples/04_keep_clear.py, and the clamp beside it."""
    part = trimesh.creation.box((16.0, 16.0, 10.0))
    part.apply_translation((0.0, 0.0, 5.0))
    return part, (Fixture("clamp", Box(size=(20.0, 40.0, 20.0), center=(35.0, 0.0, 10.0))),)


def walls() -> fx.Toolpath:
    """Plan the block's walls for a ball in a wide holder."""
    holder = Holder(stick_out=30.0, sections=(Section(length=40.0, diameter=40.0),))
    tool = fx.Tool.ball(8, shank_diameter=7.0, holder=holder)
    return fx.plan_contour(block()[0], tool, stepdown=10, spacing=0.1)


def dense_vase(times: int = 28) -> fx.Toolpath:
    """Put more contacts between those of the vase, on its facets."""
    path = table("vase_overhang.csv", 10)
    given = np.arange(len(path), dtype=float)
    rows = np.arange(times * (len(path) - 1) + 1) / times
    contacts, normals = (
        np.column_stack([np.interp(rows, given, column) for column in values.T])
        for values in (path.contact, path.normal)
    )
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return fx.Toolpath.from_contacts(contacts, normals, path.tool, feed_mm_min=1000.0)


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
    "dome-top": NamedPath(
        "upper side of a dome, ball 8", lambda: table("dome_top.csv", 8), {"tilt": (10, 50)}
    ),
    **{
        f"cone-{n}": NamedPath(
            f"cone of {n} locations a ring", partial(cone, n), {"tilt": (15, 70)}, shared=False
        )
        for n in (60, 120, 240, 480, 960)
    },
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
    "clamp": NamedPath(
        "walls of a block beside a clamp, ball 8, holder 40",
        walls,
        WALLS,
        shared=False,
        around=block,
    ),
    "vase-dense": NamedPath("vase with 28 times as many contacts", dense_vase, WALLS),
    "boat": NamedPath("LinuxCNC's boat program, ball 6", lambda: program("boat", 6), {"cone": 15}, TRUNNION),
}
