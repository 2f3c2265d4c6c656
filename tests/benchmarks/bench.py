"""Print the table of results as Markdown: the optimised posture, every baseline and the lower bound.

Usage: python tests/benchmarks/bench.py [vase] [dome] [impeller] …
           [--effort quick,normal,thorough]        (default: vase dome impeller propeller-fine, normal)

What is minimised is the travel metric, which the bound is of; it and the energy are of the feed drives in the
program's blocks. The total has the base power too, where the machine's is known. The time is that at the
programmed feed and the axes' highest speeds.
"""

import argparse
import time

from paths import PATHS

from fiveaxis.model import Constraints, Energy
from fiveaxis.posture import Options, optimise_postures, with_bound
from fiveaxis.posture.strategy.effort import EFFORTS


def row(name: str, energy: Energy, saved: str = "") -> str:
    total = "unknown" if energy.with_base is None else f"{energy.with_base:,.0f}"
    figures = f"{energy.travel:,.0f} | {energy.total:,.0f} | {total} | {energy.time:,.0f}"
    return f"| {name} | {figures} | {saved} |"


def run(name: str, efforts: list[str]) -> None:
    case = PATHS[name]
    toolpath, machine = case.make()
    wanted = ", ".join(f"{key} {value}" for key, value in case.options.items())
    print(f"\n**{name}**: {case.what}; {len(toolpath):,} locations, {wanted}, {machine.name}\n")
    print("| posture | travel metric, J | energy, J | with base power, J | time, s | energy saved by it |")
    print("|---|---:|---:|---:|---:|---:|")
    found = {}
    notes = []
    for effort in efforts:
        started = time.perf_counter()
        options = Options(objective="travel", effort=effort, bound=False)
        found[effort] = optimise_postures(toolpath, machine, Constraints.of_degrees(**case.options), options)
        rate = len(toolpath) / (time.perf_counter() - started)
        notes.append(f"{effort}: {rate:,.0f} locations/s")
        print(row(f"optimised, {effort}", found[effort].energy), flush=True)
    best = min(found.values(), key=lambda solution: solution.travel)
    for baseline, energy in best.baselines.items():
        print(row(baseline, energy, f"{best.savings().get(baseline, 0.0):.1%}"))
    started = time.perf_counter()
    best = with_bound(best, Constraints.of_degrees(**case.options), "travel")
    print(f"| lower bound | {best.bound.total:,.0f} | | | | gap {best.gap:.1%} |\n")
    notes.append(f"bound: {best.bound.visits:,} locations visited, {time.perf_counter() - started:.0f} s")
    energy = with_bound(best, Constraints.of_degrees(**case.options), "energy")
    said = "none" if energy.bound.of == "travel" else f"{energy.bound.total:,.0f} J"
    notes.append(f"bound of the energy, of any posture: {said}")
    notes += [f"no {baseline}: {reason}" for baseline, reason in best.missing.items()]
    print("\n".join(f"- {note}" for note in notes), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="*", help=", ".join(PATHS))
    parser.add_argument("--effort", default="normal", help=", ".join(EFFORTS))
    given = parser.parse_args()
    for name in given.cases or ["vase", "dome", "impeller", "propeller-fine"]:
        run(name, given.effort.split(","))


if __name__ == "__main__":
    main()
