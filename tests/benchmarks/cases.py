"""Print the table of results: every case, the optimised posture and each baseline.

Usage: python tests/benchmarks/cases.py [vase] [dome] [dome-free] [example] [propeller]     (default: all)

J is the travel metric of the feed drives at the locations; "program J" is the same metric of the blocks of
the program in axis words: with those inserted that hold the path, without those that it doesn't need.
"""

import sys
import time
from pathlib import Path

import fiveaxis as fx
from fiveaxis.energy import motion_energy
from fiveaxis.job.planned import fill_path, thin
from fiveaxis.motion import Interpolation

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"


def plan(path: Path, diameter: float, **options) -> fx.Toolpath:
    return fx.plan_contour(path, fx.Tool.ball(diameter), **options)


def read(name: str, diameter: float) -> fx.Toolpath:
    return fx.read_toolpath(DATA / "cases" / name, tool=fx.Tool.ball(diameter))


CASES = {
    "vase": (lambda: read("vase_overhang.csv", 10), {"tilt": (15, 75)}),
    "dome": (lambda: read("dome_underside.csv", 6), {"tilt": (10, 70)}),
    "dome-free": (lambda: read("dome_underside.csv", 6), {"tilt": (10, 70), "max_turn": None}),
    "example": (
        lambda: plan(ROOT / "examples/overhang/part.stl", 8, stepdown=3, overhang=True),
        {"tilt": (15, 75)},
    ),
    "propeller": (lambda: plan(DATA / "meshes/propeller_d.stl", 4, stepdown=1), {"tilt": (15, 75)}),
}


def program_energy(solution: fx.Solution, motion: fx.Motion) -> float:
    lean = solution.constraints
    fill = fill_path(solution.toolpath, solution.machine, motion, lean, Interpolation.JOINT)
    return motion_energy(solution.machine, thin(fill, lean, Interpolation.JOINT).blocks).total


def run(name: str) -> None:
    make, options = CASES[name]
    toolpath = make()
    started = time.perf_counter()
    solution = fx.optimise(toolpath, fx.load_machine("hayashi-640123"), **options)
    seconds = time.perf_counter() - started
    print(f"{name}: {len(toolpath)} locations, {options}, {len(toolpath) / seconds:.0f} locations/s")
    driven = program_energy(solution, solution.motion)
    print(f"  {'optimised':14} {solution.energy.total:10.0f} J          program {driven:10.0f} J")
    for baseline, record in solution.compared.items():
        here, there = record.energy.total, program_energy(solution, record.motion)
        saved, program = 1 - solution.energy.total / here, 1 - driven / there
        print(f"  {baseline:14} {here:10.0f} J {saved:7.1%}  program {there:10.0f} J {program:7.1%}")
    for baseline, reason in solution.missing.items():
        print(f"  {baseline:14} {reason}")


if __name__ == "__main__":
    for case in sys.argv[1:] or CASES:
        run(case)
