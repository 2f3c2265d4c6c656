"""Print the table of results: every case, the optimised program and each baseline's.

Usage: python tests/benchmarks/cases.py [vase] [dome] [wall] [example] [propeller] [supportless]
       python tests/benchmarks/cases.py invariance       the same path given more densely, and the part turned

J is ∫P dt of the feed drives in the blocks of the program, without approach and retract. "lower" is the
same if the power of drives below the slowest measured speed falls with their speed. The prototype minimises
the same at the given locations alone, and blocks are inserted afterwards.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from paths import PATHS
from shapes import denser, turned

import fiveaxis as fx
from fiveaxis.energy import motion_energy
from fiveaxis.motion import Filling, follow
from fiveaxis.posture import Options, Problem
from fiveaxis.posture import optimise as optimise_postures
from fiveaxis.posture.local.optima import refine
from fiveaxis.posture.strategy.turn_bounds import turn_bounds
from fiveaxis.toolpath import Constraints

CASES = ("vase", "dome", "wall", "example", "propeller", "supportless")
INVARIANT = ("vase", "wall", "dome")


def figures(energy: fx.Energy) -> str:
    return f"{energy.total:8.0f} J, lower {energy.least:8.0f} J, travel {energy.travel:8.0f} J"


def run(name: str) -> None:
    options = PATHS[name].options
    toolpath, machine = PATHS[name].make()
    print(f"{name}: {len(toolpath)} locations, {options}")
    for objective in ("energy", "travel"):
        started = time.process_time()
        solution = fx.optimise(toolpath, machine, objective=objective, **options)
        seconds = time.process_time() - started
        made = solution.program()
        spent = motion_energy(machine, made.motion.blocks)
        print(
            f"  by {objective:7} {figures(spent)}, "
            f"{len(made.motion.blocks)} blocks, {'no errors' if made.ok else made.report.counts}, "
            f"{seconds:.1f} s of processor"
        )
    print(f"  prototype  {figures(prototype(toolpath, machine, options))}")
    for baseline, energy in solution.baselines.items():
        print(f"  {baseline:10} {figures(energy)}")
    for baseline, reason in solution.missing.items():
        print(f"  {baseline:10} {reason}")


def prototype(path: fx.Toolpath, machine: fx.Machine, options: dict) -> fx.Energy:
    """Solve at the given locations alone, each linear axis priced by its own last travel, three times."""
    by_travel = Options(objective="travel")
    start = optimise_postures(path, machine, Constraints.of_degrees(**options), by_travel)
    given = start.motion.positions[~start.toolpath.inserted][:, machine.rotary_columns]
    constraints = Constraints.of_degrees(**options)
    turns = turn_bounds(path, constraints)
    problem = Problem.build(path, machine, constraints.lean_bounds(path), max_turn=turns)
    step, linear = path.lengths[1:, None], machine.linear_columns
    for share in (0.1, 0.03, 0.01):
        travel = np.abs(np.diff(problem.positions(slice(None), given), axis=0))[:, linear]
        weight = np.ones_like(problem.plus)
        weight[:, linear] = step / np.maximum(travel + share * step, 1e-9)
        dearer = replace(problem, plus=problem.plus * weight, minus=problem.minus * weight)
        given = refine(dearer, given, iterations=120, barrier=4e-2, near=True).rotary
    blocks = Filling().blocks(path, machine, follow(path, machine, given))
    return motion_energy(machine, blocks)


def invariance() -> None:
    for name in INVARIANT:
        options = PATHS[name].options
        path, machine = PATHS[name].make()
        ways = {f"{n}x its locations": denser(path, n) for n in (1, 2, 4)}
        ways |= {f"turned by {degrees:g} deg": turned(path, degrees) for degrees in (37.0, 90.0, 200.0)}
        energies = {way: fx.optimise(p, machine, **options).energy.total for way, p in ways.items()}
        first = next(iter(energies.values()))
        for way, energy in energies.items():
            print(f"{name:6} {way:18} {energy:8.0f} J {energy / first - 1.0:+7.1%}", flush=True)


if __name__ == "__main__":
    for case in sys.argv[1:] or CASES:
        invariance() if case == "invariance" else run(case)
