"""Print how long LinuxCNC's demonstration programs take: as programmed, and optimised for least time.

Usage: python tests/benchmarks/times.py [impeller] [boat] [--modes axes,tip] [--clocks LinuxCNC,blended]
       [--effort quick] [--rows 0:600] [--energy] [--bodies] [--stages]

Each row is the program of one posture, without approach and retract, on LinuxCNC's simulated trunnion with a
ball of 6 mm and 20 deg about the programmed axis. *feed*: at the feed and the highest speeds; *blended*: with
accelerations, corners passed within 5 µm; *LinuxCNC*: as this package predicts its exact path (G61). Then
what limits the blended one, in s. ``--energy`` is the default objective beside it, and *energy at the feed*
what it finds if it knows no accelerations; J are those of LinuxCNC's time. ``--bodies`` keeps the tool clear
of the machine's own bodies. `simulated.py` holds these times against LinuxCNC's simulated machine.
"""

import argparse
import time
from dataclasses import replace

import numpy as np
from paths import program

import fiveaxis as fx
from fiveaxis.model import Clock, Filling, Interpolation, Motion
from fiveaxis.model import time_motion as run_in_time
from fiveaxis.model.motion.limiting import law_limiting
from fiveaxis.nc import DIALECTS
from fiveaxis.posture.solution import blocks_energy

CONE = 20.0
# mm: a corner passed within the tolerance of the blocks themselves.
CORNERS = 0.005


def machine_and_path(name: str, given: argparse.Namespace) -> tuple[fx.Machine, fx.Toolpath]:
    bare = fx.load_machine("linuxcnc-xyzac-trt")
    path = program(name, 6, rapid=1200.0)
    if given.rows:
        first, last = map(int, given.rows.split(":"))
        path = path.at(np.arange(first, last))
    machine = bare.with_drives_of(fx.load_machine("hayashi-640123"))
    return (machine if given.bodies else replace(machine, bodies=())), path


def row(name: str, machine: fx.Machine, blocks: Motion, clock: Clock) -> str:
    law = run_in_time(blocks, machine, corners=CORNERS)
    turning = np.count_nonzero(np.abs(blocks.moves[:, machine.rotary_columns]).max(axis=1) > 1e-8)
    slow = {what: s for what, s in law_limiting(law).by_cause.items() if what != "feed" and s >= 0.05}
    return (
        f"  {name:24} {len(blocks):6d} blocks, {turning:6d} turn; feed {blocks.time.sum():8.2f} s, "
        f"blended {law.total:8.2f} s, LinuxCNC {clock(blocks, machine).total:8.2f} s, "
        f"{blocks_energy(machine, blocks, clock).total:.0f} J;  "
        + ", ".join(f"{what} {s:.1f}" for what, s in slow.items())
    )


def run(name: str, mode: str, given: argparse.Namespace) -> None:
    machine, path = machine_and_path(name, given)
    interpolation = Interpolation.JOINT if mode == "axes" else Interpolation.TCP
    filling = Filling(interpolation)
    exact = Clock(DIALECTS["linuxcnc"], mode)
    print(f"{name}, {mode}: {len(path)} locations", flush=True)
    asked = [("time", clock) for clock in given.clocks.split(",")]
    asked += [("energy", "LinuxCNC"), ("energy", "feed")] * given.energy
    for objective, clock in asked:
        begun = time.perf_counter()
        options = {"cone": CONE, "effort": given.effort, "objective": objective}
        unaware = replace(machine, axes=tuple(replace(a, max_acceleration=None) for a in machine.axes))
        planned = unaware if clock == "feed" else machine
        control = None if clock == "blended" else "linuxcnc"
        solution = fx.optimise(path, planned, control=control, coordinates=mode, **options)
        spent = time.perf_counter() - begun
        blocks = filling.blocks(solution.toolpath, machine, solution.motion)
        said = {"feed": "energy at the feed"}.get(clock, objective)
        said += f", {clock}" if objective == "time" else ""
        print(row(said, machine, blocks, exact), f"[{spent:.0f} s to solve]", flush=True)
        for baseline, saved in () if clock == "feed" else solution.time_savings().items():
            before = solution.baselines[baseline].time
            after = solution.energy.time
            print(f"    {after:8.2f} s against {baseline:14} {before:8.2f} s: {100.0 * saved:5.2f} % saved")
        for stage in solution.stages if given.stages else ():
            print("     ", stage.name, stage.status, stage.before, stage.after)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", default=["impeller", "boat"])
    parser.add_argument("--modes", default="axes,tip")
    parser.add_argument("--clocks", default="LinuxCNC,blended")
    parser.add_argument("--effort", default="quick")
    parser.add_argument("--rows")
    for flag in ("energy", "bodies", "stages"):
        parser.add_argument(f"--{flag}", action="store_true")
    given = parser.parse_args()
    for name in given.names:
        for mode in given.modes.split(","):
            run(name, mode, given)


if __name__ == "__main__":
    main()
