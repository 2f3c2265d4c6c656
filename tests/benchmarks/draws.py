"""Draw machines whose axis powers lie anywhere in their bands: the cheapest has to be among those claimed.

Usage: python tests/benchmarks/draws.py [--draws 100]

A ring on an overhanging wall, on machines of the library with estimated powers. For each width of their
bands the claim of `fiveaxis compare` is made once, from the ranges that jobs report; then the powers of all
axes are drawn, each within its band, and the machine whose program takes the least is looked up in it.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import fiveaxis as fx
from fiveaxis.job import MachineComparison, Row
from fiveaxis.job.batch.machines import Candidate
from fiveaxis.job.batch.record import Status

MACHINES = ("dmu50ev", "linuxcnc-xyzac-trt", "variaxis-630", "variaxis-730")
# Ends of each band, as powers of those that the library has: 1 for a machine's estimate as it is.
WIDTHS = (1.0, 0.3, 0.1, 0.03)


def ring() -> fx.Toolpath:
    """Return a ring on an overhanging wall, 40 mm in diameter."""
    turn = np.linspace(0.0, 2.0 * np.pi, 40)
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full(40, -0.2)])
    contact = 20.0 * normal * [1.0, 1.0, 0.0] + [0.0, 0.0, 15.0]
    return fx.Toolpath.from_contacts(contact, normal, fx.Tool.ball(8), feed_mm_min=1000.0, name="ring")


def with_bands(machine: fx.Machine, width: float) -> fx.Machine:
    """Return a machine with the bands of its powers narrowed."""
    figures = (
        p if p.band is None else replace(p, band=(p.band[0] ** width, p.band[1] ** width))
        for p in machine.provenance
    )
    return replace(machine, provenance=tuple(figures))


def count(draws: int, machines: tuple[str, ...] = MACHINES) -> Iterator[tuple[float, int, tuple[str, ...]]]:
    """Yield each width, how many draws have their cheapest machine in the claim, and who is claimed."""
    solved = {name: fx.optimise(ring(), name, tilt=(15.0, 70.0), effort="quick") for name in machines}
    rng = np.random.default_rng(1)
    for width in WIDTHS:
        on = {name: replace(one, machine=with_bands(one.machine, width)) for name, one in solved.items()}
        candidates = []
        for name, one in on.items():
            least, most = one.energy_range()
            spent = {"energy": one.energy.total, "energy_least": least, "energy_most": most}
            row = Row(name, "", Status.FINE, values={"machine": name}, time=one.energy.time, **spent)
            candidates.append(Candidate(row, {}))
        claimed = MachineComparison("ring", tuple(candidates), None).contenders(lambda c: c.energy)
        names = tuple(c.machine for c in claimed)
        hits = 0
        for _ in range(draws):
            true = {name: drawn(one, rng) for name, one in on.items()}
            hits += min(true, key=true.__getitem__) in names
        yield width, hits, names


def drawn(one: fx.Solution, rng: np.random.Generator) -> float:
    """Draw the powers of a machine's axes within their bands, and return what its program then takes, J."""
    bands = one.machine.bands
    joules = zip(one.machine.letters, one.energy.joules, strict=True)
    return sum(e * np.exp(rng.uniform(*np.log(bands.get(letter, (1.0, 1.0))))) for letter, e in joules)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=100)
    draws = parser.parse_args().draws
    for width, hits, names in count(draws):
        print(f"bands ^ {width:g}: in {hits} of {draws} draws the cheapest is claimed ({', '.join(names)})")


if __name__ == "__main__":
    main()
