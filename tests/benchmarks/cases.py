"""Print the table of results: every case, the optimised program and each baseline's.

Usage: python tests/benchmarks/cases.py [vase] [wall] [dome-top] [dome] [example] [propeller] [supportless]
       python tests/benchmarks/cases.py readings [CASE …]  the optimised programs alone, by both readings
       python tests/benchmarks/cases.py invariance       the same path given more densely, and the part turned

J is ∫P dt of the feed drives in the blocks of the program, without approach and retract: the price, by which
power falls in proportion to speed below the slowest measured one. "constant" is the same if drives took
their whole power there, too (`Energy.most`). The prototype minimises the price at the given locations alone,
and blocks are inserted afterwards.

Until commit 9fdc0877 the constant reading was the price. There, `cases.py vase` prints the same two readings
of the programs that were optimised for it: "J" is the constant one, "lower" the price of today.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from paths import PATHS
from support.sampled_surfaces import denser, turned

import fiveaxis as fx
from fiveaxis.model import Constraints, Filling, block_costs, feed_times, follow, motion_energy
from fiveaxis.posture import Options, optimise_postures
from fiveaxis.posture.local.optima import refine
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.strategy.rotary_bounds import turn_bounds

CASES = ("vase", "wall", "dome-top", "dome", "example", "propeller", "supportless")
READ_BOTH_WAYS = ("vase", "wall", "dome-top", "dome")
INVARIANT = ("vase", "wall", "dome")


def figures(energy: fx.Energy) -> str:
    return f"{energy.total:8.0f} J, constant {energy.most:8.0f} J, travel {energy.travel:8.0f} J"


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
            f"{spent.starts} starts, {spent.reversals} reversals, {seconds:.1f} s of processor",
            flush=True,
        )
        if objective == "energy":
            least = solution
    print(f"  prototype  {figures(prototype(toolpath, machine, options))}")
    for baseline, energy in least.baselines.items():
        print(f"  {baseline:10} {figures(energy)}, saved {least.savings()[baseline]:.1%}", flush=True)
    for baseline, reason in least.missing.items():
        print(f"  {baseline:10} {reason}")


def readings(names: list[str]) -> None:
    """Print the optimised programs by both readings of the power of slow axes, and the cheapest baseline."""
    print(f"{'case':10} {'price':>10} {'constant':>10}   cheapest baseline by each")
    for name in names:
        path, machine = PATHS[name].make()
        solution = fx.optimise(path, machine, **PATHS[name].options)
        spent = motion_energy(machine, solution.program().motion.blocks)
        others = solution.baselines
        cheapest = (min((getattr(e, key), b) for b, e in others.items()) for key in ("total", "most"))
        said = ", ".join(f"{b} {joules:.0f} J" for joules, b in cheapest)
        print(f"{name:10} {spent.total:8.0f} J {spent.most:8.0f} J   {said}", flush=True)


def prototype(path: fx.Toolpath, machine: fx.Machine, options: dict) -> fx.Energy:
    """Solve at the given locations alone, priced near the last solution, three times."""
    by_travel = Options(objective="travel")
    constraints = Constraints.of_degrees(**options)
    start = optimise_postures(path, machine, constraints, by_travel)
    given = start.motion.positions[~start.toolpath.inserted][:, machine.rotary_columns]
    turns = turn_bounds(path, constraints)
    problem = Problem.build(path, machine, constraints.lean_bounds(path), max_turn=turns)
    costs = block_costs(machine, path.feed[1:], time=feed_times(path)[1:])
    for share in (0.1, 0.03, 0.01):
        travel = np.abs(np.diff(problem.positions(slice(None), given), axis=0))
        plus, minus = costs.near(travel, share)
        given = refine(
            replace(problem, plus=plus, minus=minus), given, iterations=120, barrier=4e-2, near=True
        ).rotary
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
    asked = sys.argv[1:] or list(CASES)
    if asked[0] == "readings":
        readings(asked[1:] or list(READ_BOTH_WAYS))
    elif asked == ["invariance"]:
        invariance()
    else:
        for case in asked:
            run(case)
