"""Print how far the results of equivalent problems lie apart: J by effort, and the spread of each shape.

Usage: python tests/benchmarks/scatter.py [--effort quick,normal] [--locations 60] [--bound] [SHAPE …]

The shapes of `tests/support/sampled_surfaces.py` (four passes each), and `dome-top` where ../shared is there.
Each is solved as given, turned by 37, 101 and 200 deg about the table's axis, which has no limits, given
at two and four times its locations, and backwards on a machine whose drives take as much power the other way
round. A range of the lean wider by 5 deg at both ends should cost no more than the cheapest of these.
With --bound each is solved as given alone, and what its lower bound leaves is printed beside its energy.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from paths import DATA, PATHS
from support.sampled_surfaces import SHAPES, backwards, denser, sampled, turned

import fiveaxis as fx

TURNS = (37.0, 101.0, 200.0)


def problems(name: str, count: int) -> tuple[dict[str, tuple[fx.Toolpath, fx.Machine]], dict]:
    """Make the equivalent problems of a shape by name, and the bounds."""
    machine = fx.load_machine("hayashi-640123")
    bounds = {"tilt": (15, 70)}
    if name in SHAPES:
        path = sampled(SHAPES[name], count)
    else:
        path, bounds = PATHS[name].read(), PATHS[name].options
    ways = {"as given": (path, machine)} | {f"{d:g} deg": (turned(path, d), machine) for d in TURNS}
    ways |= {f"{times}x": (denser(path, times), machine) for times in (2, 4)}
    return ways | {"backwards": backwards(path, machine)}, bounds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("shapes", nargs="*")
    parser.add_argument("--effort", default="quick,normal")
    parser.add_argument("--locations", type=int, default=60)
    parser.add_argument("--bound", action="store_true")
    given = parser.parse_args()
    for name in given.shapes or [*SHAPES, *(["dome-top"] if DATA.exists() else [])]:
        ways, bounds = problems(name, given.locations)
        for effort in given.effort.split(","):
            if given.bound:
                path, machine = ways["as given"]
                found = fx.optimise(path, machine, effort=effort, bound=True, **bounds)
                print(f"{name:9} {effort:8} {found.energy.total:.1f} J: {found.left}", flush=True)
                continue
            costs = {
                way: fx.optimise(path, machine, effort=effort, **bounds).energy.total
                for way, (path, machine) in ways.items()
            }
            spread = max(costs.values()) / min(costs.values()) - 1.0
            figures = ", ".join(f"{way} {cost:.1f}" for way, cost in costs.items())
            wider = bounds | {"tilt": (bounds["tilt"][0] - 5, bounds["tilt"][1] + 5)}
            more = fx.optimise(*ways["as given"], effort=effort, **wider).energy.total / min(costs.values())
            print(f"{name:9} {effort:8} spread {spread:6.1%}: {figures}; wider {more - 1.0:+.1%}", flush=True)


if __name__ == "__main__":
    main()
