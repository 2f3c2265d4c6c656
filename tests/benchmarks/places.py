"""Two jobs on which place and posture save in turn: what each saves alone, and both together.

Usage: python tests/benchmarks/places.py

A cup's rim whose part stands off the axis of a rotary table, with a narrow tilt: there the place saves. A
wall on a mill whose table stands still, with a wide tilt: there the postures do. The place is searched along
X and by a turn; the posture that nothing is saved with is the ``normal`` one, and the place the given one.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import fiveaxis as fx
from fiveaxis.job import make_job, run_job
from fiveaxis.nc import write_toolpath

POINTS, RULE = 48, "normal"


def rim() -> fx.Toolpath:
    """Return a ring of 60 mm on a wall that overhangs by 11 deg."""
    turn = np.linspace(0.0, 2.0 * np.pi, POINTS)
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full(POINTS, -0.2)])
    contact = 30.0 * normal * [1.0, 1.0, 0.0] + [0.0, 0.0, 40.0]
    return fx.Toolpath.from_contacts(contact, normal, fx.Tool.ball(8), name="rim")


def wall() -> fx.Toolpath:
    """Return one pass to the top of an S-shaped wall that overhangs by 20 deg."""
    x = np.linspace(-40.0, 40.0, POINTS)
    slope = 0.5 * np.cos(x / 12.0)
    normal = np.column_stack([slope, np.full(POINTS, -1.0), np.full(POINTS, -0.36)])
    contact = np.column_stack([x, 6.0 * np.sin(x / 12.0), np.full(POINTS, 60.0)])
    return fx.Toolpath.from_contacts(contact, normal, fx.Tool.ball(8), name="wall")


CASES: dict[str, tuple[fx.Toolpath, dict[str, Any]]] = {
    "rim off the table's axis": (
        rim(),
        {"machine": "hayashi-640123", "tilt": (15.0, 17.0), "setup": {"offset": (80.0, 0.0, 0.0)}},
    ),
    "wall on a table that stands still": (
        wall(),
        {
            "machine": "linuxcnc-bridgemill",
            "tilt": (15.0, 75.0),
            "tool_length": 120.0,
            "drives": "hayashi-640123",
            "setup": {"offset": (0.0, 0.0, -250.0)},
        },
    ),
}


def measure(folder: Path) -> Iterator[tuple[str, float, float, float]]:
    """Yield the shares that each case saves by its place, by its postures, and by both."""
    for name, (path, settings) in CASES.items():
        file = write_toolpath(path, folder / f"{path.name}.csv")
        job = make_job(input=file, tool="ball:8", feed=1000.0, effort="quick", **settings)
        search = {"x": (-40.0, 80.0), "angle": (-180.0, 180.0), "tries": 20}
        given, moved = (run_job(one).solution for one in (job, make_job(job, setup={"search": search})))
        plain = given.baselines[RULE].total
        spent = moved.baselines[RULE].total, given.energy.total, moved.energy.total
        yield name, *(1.0 - joules / plain for joules in spent)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        for name, *shares in measure(Path(folder)):
            place, posture, both = (f"{share:.1%}" for share in shares)
            print(f"{name}: place {place}, posture {posture}, both {both} saved against {RULE}")


if __name__ == "__main__":
    main()
