"""Print what each part of the search is worth: energies and time with the part left out, beside the whole.

Usage: python tests/benchmarks/ablation.py [--effort quick|normal] [CASE …]

Cases are those of `paths.py` and the shapes of `tests/shapes.py` (60 locations, four passes). The first row
of a case is the effort as it is; the others say by how many per cent the program is dearer without a part,
and how long that takes.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from paths import PATHS
from support.sampled_surfaces import SHAPES, sampled

import fiveaxis as fx
from fiveaxis.model import Constraints
from fiveaxis.posture import Options, optimise_postures
from fiveaxis.posture.strategy.effort import Effort, effort_of

CASES = ("vase", "wall", "dome-top", *SHAPES)


def parts(effort: Effort) -> dict[str, Effort]:
    """Leave out each part of an effort that it has, the smaller effort aside."""
    forwards = tuple(one for one in effort.everywhere if not one.backwards)
    without = {
        "no search from the end": replace(effort, everywhere=forwards),
        "no search about the best": replace(effort, around=()),
        "the first level and spin alone": replace(effort, everywhere=effort.everywhere[:2]),
        "no corridor": replace(effort, corridors=()),
        "no smaller effort": replace(effort, contains=None),
    }
    return {name: one for name, one in without.items() if one != effort}


def main() -> None:
    """Print a block of each case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*")
    parser.add_argument("--effort", default="quick")
    given = parser.parse_args()
    whole, machine = effort_of(given.effort), fx.load_machine("hayashi-640123")
    for name in given.cases or CASES:
        path = sampled(SHAPES[name], 60) if name in SHAPES else PATHS[name].read()
        bounds = Constraints.of_degrees(**({"tilt": (15, 70)} if name in SHAPES else PATHS[name].options))
        first = None
        for what, effort in {given.effort: whole, **parts(whole)}.items():
            began = time.process_time()
            joules = optimise_postures(path, machine, bounds, Options(effort=effort, steady=0.0)).energy.total
            first = joules if first is None else first
            seconds = time.process_time() - began
            print(
                f"{name:9} {what:30} {joules:8.0f} J {joules / first - 1.0:+7.1%} {seconds:6.2f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
