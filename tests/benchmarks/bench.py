"""Print the table of results as Markdown: the optimised posture, every baseline and the lower bound.

Usage: python tests/benchmarks/bench.py [vase] [dome] [impeller] [propeller]
           [--effort quick,normal,thorough]        (default: vase dome impeller propeller, normal)

What is minimised is the travel metric, which the bound is of; it and the energy are of the feed drives in the
program's blocks. The total has the base power too, where the machine's is known. The time is that at the
programmed feed and the axes' highest speeds.
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import fiveaxis as fx
from fiveaxis.energy import Energy
from fiveaxis.posture import Options, optimise
from fiveaxis.posture.strategy.effort import EFFORTS
from fiveaxis.toolpath import Constraints

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"


class Case(NamedTuple):
    """A path, a machine, and what the optimiser is asked for."""

    what: str
    make: Callable[[], tuple[fx.Toolpath, fx.Machine]]
    options: dict[str, Any]


def measured() -> fx.Machine:
    return fx.load_machine("hayashi-640123")


def contacts(name: str, diameter: float) -> tuple[fx.Toolpath, fx.Machine]:
    return fx.read_toolpath(DATA / "cases" / name, tool=fx.Tool.ball(diameter)), measured()


def impeller() -> tuple[fx.Toolpath, fx.Machine]:
    machine = fx.load_machine("linuxcnc-xyzac-trt").with_drives_of(measured())
    program = DATA / "toolpaths" / "linuxcnc_impeller_xyzac.ngc"
    return fx.read_toolpath(program, machine=machine, tool=fx.Tool.ball(6)), machine


def propeller() -> tuple[fx.Toolpath, fx.Machine]:
    part = DATA / "meshes" / "propeller_d.stl"
    return fx.plan_contour(part, fx.Tool.ball(4), stepdown=1), measured()


CASES = {
    "vase": Case("overhanging vase, ball 10", lambda: contacts("vase_overhang.csv", 10), {"tilt": (15, 75)}),
    "dome": Case(
        "underside of a dome, ball 6", lambda: contacts("dome_underside.csv", 6), {"tilt": (10, 70)}
    ),
    "impeller": Case("LinuxCNC's impeller program, ball 6", impeller, {"cone": 15}),
    "propeller": Case("propeller, ball 4, stepdown 1", propeller, {"tilt": (15, 75)}),
}


def row(name: str, energy: Energy, saved: str = "") -> str:
    total = "unknown" if energy.with_base is None else f"{energy.with_base:,.0f}"
    figures = f"{energy.travel:,.0f} | {energy.total:,.0f} | {total} | {energy.time:,.0f}"
    return f"| {name} | {figures} | {saved} |"


def run(name: str, efforts: list[str]) -> None:
    case = CASES[name]
    toolpath, machine = case.make()
    wanted = ", ".join(f"{key} {value}" for key, value in case.options.items())
    print(f"\n**{name}**: {case.what}; {len(toolpath):,} locations, {wanted}, {machine.name}\n")
    print("| posture | travel metric, J | energy, J | with base power, J | time, s | saved by it |")
    print("|---|---:|---:|---:|---:|---:|")
    found = {}
    notes = []
    for effort in efforts:
        started = time.perf_counter()
        options = Options(objective="travel", effort=effort)
        found[effort] = optimise(toolpath, machine, Constraints.of_degrees(**case.options), options)
        rate = len(toolpath) / (time.perf_counter() - started)
        notes.append(f"{effort}: {rate:,.0f} locations/s")
        print(row(f"optimised, {effort}", found[effort].energy), flush=True)
        if found[effort].optima is not None:
            optima = found[effort].optima
            costs = list(optima.costs.values())
            notes.append(
                f"{len(costs)} starts, {optima.distinct} different optima, "
                f"{min(costs):,.0f} / {np.median(costs):,.0f} / {max(costs):,.0f} J (min, median, max)"
            )
    best = min(found.values(), key=lambda solution: solution.travel)
    for baseline, energy in best.baselines.items():
        print(row(baseline, energy, f"{best.savings().get(baseline, 0.0):.1%}"))
    bound = best.bound
    print(f"| lower bound | {bound.total:,.0f} | | | | gap {best.gap:.1%} |\n")
    each = ", ".join(f"{letter} {joules:,.0f}" for letter, joules in bound.linear.items())
    notes.append(f"bound: rotary axes {bound.rotary:,.0f} J, {each} J")
    notes += [f"no {baseline}: {reason}" for baseline, reason in best.missing.items()]
    print("\n".join(f"- {note}" for note in notes), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="*", help=", ".join(CASES))
    parser.add_argument("--effort", default="normal", help=", ".join(EFFORTS))
    given = parser.parse_args()
    for name in given.cases or ["vase", "dome", "impeller", "propeller"]:
        run(name, given.effort.split(","))


if __name__ == "__main__":
    main()
