"""Print how smoothly programs run: energy, blocks, starts and reversals, of results and baselines.

Usage: python tests/benchmarks/smoothness.py [cone-60] [vase] … [--shape chord] [--steady 0] [--effort quick]

The cones are one surface, sampled at 60 to 960 locations a ring.
"""

import argparse

from paths import PATHS

import fiveaxis as fx
from fiveaxis.base import Search

CASES = [name for name in PATHS if name.startswith("cone-")]
CASES += ["dome-top", "vase", "dome", "wall", "example", "propeller"]


def row(name: str, energy: fx.Energy, blocks: int) -> str:
    steady = energy.steadiness
    starts, reversals = sum(steady.starts.values()), sum(steady.reversals.values())
    return f"  {name:10} {energy.total:9.0f} J {blocks:7} blocks {starts:6} starts {reversals:6} reversals"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", default=CASES)
    parser.add_argument("--shape", choices=("smooth", "chord"))
    parser.add_argument("--steady", type=float, default=Search.steady)
    parser.add_argument("--effort", default="normal")
    given = parser.parse_args()
    for name in given.cases:
        path, machine = PATHS[name].make()
        options = PATHS[name].options | {"steady": given.steady, "effort": given.effort}
        found = fx.optimise(path, machine, path_shape=given.shape, **options)
        share = found.toolpath.curved.mean()
        print(f"{name}: {len(path)} locations, {100.0 * share:.0f} % of the moves follow a curve", flush=True)
        print(row("optimised", found.energy, len(found.program().motion.blocks)), flush=True)
        for other, baseline in found.compared.items():
            along = baseline.toolpath or found.toolpath
            print(row(other, baseline.energy, len(found.filling.blocks(along, machine, baseline.motion))))


if __name__ == "__main__":
    main()
