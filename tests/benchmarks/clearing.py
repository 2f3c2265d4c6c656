"""How long it takes to keep a tool with its holder clear of a part, and to prove it.

    python tests/benchmarks/clearing.py

A lobed cup whose wall overhangs, of some 40 000 triangles, is finished by some 10 000 locations; without a
mask the holder hits it. Printed are the times of optimisation and verification and the share of collisions
in each. Times are the processor's, of all threads: the machines that this runs on are shared.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh

import fiveaxis as fx
from fiveaxis.check import Surroundings
from fiveaxis.check.collision.accessibility import Accessibility
from fiveaxis.check.verification import collisions
from fiveaxis.model import Constraints
from fiveaxis.model.toolpath.tool import Holder, Section
from fiveaxis.posture import optimise_postures

TILT = (15.0, 75.0)
AROUND, UP = 200, 100


def lobed_cup() -> trimesh.Trimesh:
    """Make the part, mm: a cup with three lobes, 40 high, wider at the top."""
    height, turn = np.linspace(0.0, 40.0, UP + 1), np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    z, phi = np.meshgrid(height, turn, indexing="ij")
    radius = 18.0 + 14.0 * (z / 40.0) ** 1.5 + 2.0 * np.cos(3.0 * phi) * (0.3 + z / 40.0)
    wall = np.stack([radius * np.cos(phi), radius * np.sin(phi), z], axis=-1).reshape(-1, 3)
    corner = np.arange((UP + 1) * AROUND).reshape(UP + 1, AROUND)
    a, b = corner[:-1], np.roll(corner, -1, axis=1)[:-1]
    c, d = corner[1:], np.roll(corner, -1, axis=1)[1:]
    sides = [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, d), (a, d, c))]
    middle = len(wall)
    below = np.column_stack([np.full(AROUND, middle), np.roll(corner[0], -1), corner[0]])
    above = np.column_stack([np.full(AROUND, middle + 1), corner[-1], np.roll(corner[-1], -1)])
    vertices = np.vstack([wall, [[0.0, 0.0, 0.0], [0.0, 0.0, 40.0]]])
    return trimesh.Trimesh(vertices, np.vstack([*sides, below, above]), process=False)


def main() -> None:
    """Print what it takes."""
    part = lobed_cup()
    holder = Holder(22.0, (Section(12.0, 44.0, 60.0), Section(60.0, 60.0)))
    tool = fx.Tool.ball(8.0, shank_diameter=8.0, holder=holder)
    machine = fx.load_machine("hayashi-640123")
    with TemporaryDirectory() as folder:
        file = Path(folder) / "cup.stl"
        part.export(file)
        path = fx.plan_contour(file, tool, stepdown=1.25, overhang=True)
    # Compiling isn't what is measured.
    few = path.at(np.arange(60))
    fx.optimise(few, machine, tilt=TILT, part=part, effort="quick")
    spent = {"mask": 0.0}
    clear = Accessibility.clear

    def timed(self: Accessibility, *question: np.ndarray) -> np.ndarray:
        began = time.process_time()
        answer = clear(self, *question)
        spent["mask"] += time.process_time() - began
        return answer

    Accessibility.clear = timed  # type: ignore[method-assign, assignment]
    began = time.process_time()
    free = optimise_postures(path, machine, Constraints.of_degrees(tilt=TILT))
    alone = time.process_time() - began
    began, wall = time.process_time(), time.perf_counter()
    kept = fx.optimise(path, machine, tilt=TILT, part=part)
    together = time.process_time() - began
    began = time.process_time()
    report = fx.verify(kept.motion, machine, kept.toolpath, tilt=TILT, part=part)
    checked = time.process_time() - began
    elapsed = time.perf_counter() - wall
    effort: dict[tuple[str, str], collisions.SweepCount] = {}
    around = Surroundings(part=part)
    hit = fx.verify(free.motion, machine, free.toolpath, tilt=TILT, surroundings=around)
    context = collision_context(kept, machine)
    collisions.check_collisions(context, around, effort=effort)
    queries = sum(e.seconds for e in effort.values())
    print(f"{len(path):,} locations, {len(part.faces):,} triangles, holder 60 mm wide, stick-out 22 mm")
    print(f"without a mask {alone:.1f} s, {free.energy.total:,.0f} J; {hit.counts}")
    print(
        f"kept clear {together:.1f} s, {kept.energy.total:,.0f} J, of which the mask {spent['mask']:.1f} s "
        f"({100.0 * spent['mask'] / together:.0f} %)"
    )
    print(f"verified in {checked:.1f} s, of which collisions {queries:.1f} s; {report.counts}")
    print(f"together {together + checked:.1f} s of the processor, {elapsed:.1f} s on the clock")


def collision_context(solution: fx.Solution, machine: fx.Machine) -> collisions.CheckContext:
    """Put a solution as verification sees it."""
    from fiveaxis.check import PathConstraints
    from fiveaxis.check.verification.check_context import DEFAULT_TOLERANCES, make_context

    constraints = PathConstraints.of(solution.toolpath, machine, Constraints())
    return make_context(solution.motion, machine, solution.toolpath, constraints, DEFAULT_TOLERANCES)


if __name__ == "__main__":
    main()
