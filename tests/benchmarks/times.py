"""Print how long LinuxCNC's demonstration programs take: as programmed, and optimised for least time.

Usage: python tests/benchmarks/times.py [impeller] [boat] [--modes axes,tip] [--effort quick] [--sim]
       [--bodies] [--objectives time,energy]

Each row is the program of one posture, without approach and retract, on LinuxCNC's simulated trunnion with a
ball of 6 mm and 20 deg about the programmed axis. *feed*: at the feed and the highest speeds; *5 µm*: with
the accelerations, corners passed within 5 µm; *G61*: as this package predicts LinuxCNC's exact path. Then
what limits under 5 µm, in s. With ``--sim`` the texts of the first and of the last row run in LinuxCNC's
simulated machine, which runs in real time. ``--bodies`` keeps the tool clear of the machine's own bodies.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import fiveaxis as fx
from fiveaxis.job import ProgramOptions
from fiveaxis.job.program import make_program
from fiveaxis.motion import Filling, Interpolation, Motion, follow, time_motion
from fiveaxis.nc import DIALECTS, Clock
from fiveaxis.toolpath import Constraints, for_tilt

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from referee.linuxcnc import run_program  # noqa: E402

DATA = ROOT.parent / "shared" / "data" / "toolpaths"
CONE = 20.0
# mm: a corner passed within the tolerance of the blocks themselves.
CORNERS = 0.005


def machine_and_path(name: str, bodies: bool) -> tuple[fx.Machine, fx.Toolpath]:
    bare = fx.load_machine("linuxcnc-xyzac-trt")
    path = fx.read_toolpath(
        DATA / f"linuxcnc_{name}_xyzac.ngc", tool=fx.Tool.ball(6), machine=bare, rapid_mm_min=1200.0
    )
    machine = bare.with_drives_of(fx.load_machine("hayashi-640123"))
    return machine if bodies else replace(machine, bodies=()), path


def row(name: str, machine: fx.Machine, blocks: Motion, clock: Clock, own: float | None = None) -> str:
    law = time_motion(blocks, machine, corners=CORNERS)
    turning = np.count_nonzero(np.abs(blocks.moves[:, machine.rotary_columns]).max(axis=1) > 1e-8)
    slow = {what: s for what, s in law.shares.items() if what != "feed" and s >= 0.05}
    g61 = clock(blocks, machine).total
    return (
        f"  {name:14} {len(blocks):6d} blocks, {turning:6d} turn; feed {blocks.time.sum():8.2f} s, "
        f"5 um {law.total:8.2f} s, G61 {g61:8.2f} s{'' if own is None else f' (told {own:.2f})'}  "
        + ", ".join(f"{what} {s:.1f}" for what, s in slow.items())
    )


def run(name: str, mode: str, given: argparse.Namespace) -> None:
    machine, path = machine_and_path(name, given.bodies)
    interpolation = Interpolation.JOINT if mode == "axes" else Interpolation.TCP
    filling, clock = Filling(interpolation), Clock(DIALECTS["linuxcnc"], mode)
    print(f"{name}, {mode}: {len(path)} locations", flush=True)
    paths = {}
    for objective in given.objectives.split(","):
        for told, own in (("G61", clock), ("5 um", Clock()))[: given.clocks] if objective == "time" else (("", None),):
            begun = time.perf_counter()
            solution = fx.optimise(
                path, machine, cone=CONE, effort=given.effort, objective=objective, interpolation=interpolation, clock=own
            )
            spent = time.perf_counter() - begun
            blocks = filling.blocks(solution.toolpath, machine, solution.motion)
            said = f"{objective} {told}".strip()
            print(row(said, machine, blocks, clock, solution.energy.run_time), f"[{spent:.0f} s to solve]", flush=True)
            for baseline, energy in solution.baselines.items():
                if energy.run_time is not None:
                    saved = 1.0 - solution.energy.run_time / energy.run_time
                    print(f"    against {baseline:14} {energy.run_time:8.2f} s: {100.0 * saved:5.2f} % saved")
            for stage in solution.stages if given.stages else ():
                print("     ", stage.name, stage.status, stage.before, stage.after)
            paths[said] = solution.motion, solution.toolpath


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", default=["impeller", "boat"])
    parser.add_argument("--modes", default="axes,tip")
    parser.add_argument("--objectives", default="energy,time")
    parser.add_argument("--effort", default="quick")
    parser.add_argument("--sim", action="store_true")
    parser.add_argument("--bodies", action="store_true")
    parser.add_argument("--clocks", type=int, default=2)
    parser.add_argument("--stages", action="store_true")
    given = parser.parse_args()
    for name in given.names:
        for mode in given.modes.split(","):
            run(name, mode, given)


if __name__ == "__main__":
    main()
