"""Compare the optimiser's results with those on record: a dearer one fails, a slower one is only told.

Usage: python tests/benchmarks/regression.py [vase] [wall] [example] [dome] [dome-top] [boat]
           [--slow]     also the cases of minutes
           [--write]    put the results on record

``baseline.json`` holds, for every case and objective, what is minimised, in J, of the NC program's blocks,
and how many times as long as a fixed computation the optimiser took. Energies are the same on every machine
but for rounding; a result that is more than 0.1 % dearer ends in exit code 1. Times are processor time beside
that of the same matrices just before and after; machines are shared, so a slower result fails nothing.
"""

import argparse
import json
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from paths import DATA, PATHS

import fiveaxis as fx

RECORD = Path(__file__).with_name("baseline.json")
# Cases of seconds, with the objectives that are compared; those of minutes.
QUICK = {
    "vase": ("energy", "travel"),
    "wall": ("energy", "travel"),
    "example": ("energy", "travel"),
    "dome": ("energy",),
    "dome-top": ("energy",),
    "boat": ("energy",),
}
SLOW = {"dome": ("travel",), "propeller": ("energy",), "impeller": ("energy", "travel")}
# Share by which a result may be dearer: what compilers and libraries of linear algebra change.
DEARER = 1e-3
# Cut locations at the begin of a path that are optimised before all of it.
COMPILED = 60
# Times as long, from which on a case is told as slower.
SLOWER = 1.5


@dataclass(frozen=True)
class Row:
    """A result.

    Parameters
    ----------
    cost : J, what was minimised, of the program's blocks
    blocks : of the program, without approach and retract
    ratio : processor time of the optimiser, in times of the fixed computation
    """

    cost: float
    blocks: int
    ratio: float


@dataclass(frozen=True)
class Judgement:
    """What a comparison with the record says.

    Parameters
    ----------
    text : a line for each result
    dearer : names of the results that are dearer than the record
    """

    text: tuple[str, ...]
    dearer: tuple[str, ...]


def judge(found: dict[str, Row], record: dict[str, Row]) -> Judgement:
    """Compare results with those on record, by name.

    A result that isn't on record is told, and fails nothing.
    """
    lines, dearer = [], []
    for name, row in found.items():
        if name not in record:
            lines.append(f"{name:18} {row.cost:10.1f} J, not on record")
            continue
        before = record[name]
        change = row.cost / before.cost - 1.0
        slower = row.ratio / before.ratio
        word = "as on record"
        if change > DEARER:
            word = f"DEARER than {before.cost:.1f} J"
            dearer.append(name)
        elif change < -DEARER:
            word = f"cheaper than {before.cost:.1f} J: put it on record with --write"
        if slower > SLOWER:
            word += f"; slower, {slower:.1f} times the processor time"
        lines.append(
            f"{name:18} {row.cost:10.1f} J ({100.0 * change:+.2f} %), {row.blocks} blocks "
            f"(before: {before.blocks}), time {row.ratio:.1f} (before: {before.ratio:.1f}): {word}"
        )
    return Judgement(tuple(lines), tuple(dearer))


def reference_time() -> float:
    """Time a fixed computation on this core: sines, sorting and a loop of Python, in s.

    No products of matrices: their threads wait in a loop, and that time counts.
    """
    began = time.process_time()
    values = np.random.default_rng(1).normal(size=100_000)
    total = 0.0
    for _ in range(40):
        values = np.sin(np.sort(values) * 100.0)
        for value in values[:10_000]:
            total += float(value) ** 2
    if not np.isfinite(total):
        raise ArithmeticError("the fixed computation has no result")
    return time.process_time() - began


def measure(name: str, objective: str) -> Row:
    """Optimise a case and time it, after a part of its path: the first run compiles."""
    case = PATHS[name]
    path, machine = case.make()
    fx.optimise(
        path.at(np.flatnonzero(path.cutting)[:COMPILED]), machine, objective=objective, **case.options
    )
    before = reference_time()
    began = time.process_time()
    solution = fx.optimise(path, machine, objective=objective, **case.options)
    spent = time.process_time() - began
    fixed = 0.5 * (before + reference_time())
    cost = solution.energy.total if objective == "energy" else solution.energy.travel
    return Row(cost, len(solution.program().motion.blocks), spent / fixed)


def read_record(file: Path = RECORD) -> dict[str, Row]:
    """Read the results on record, by name."""
    return {name: Row(**row) for name, row in json.loads(file.read_text(encoding="utf-8")).items()}


def main() -> int:
    """Measure, compare, and say what is dearer."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--slow", action="store_true", help="also the cases of minutes")
    parser.add_argument("--write", action="store_true", help="put the results on record")
    given = parser.parse_args()
    asked = [(name, objective) for name, objectives in QUICK.items() for objective in objectives]
    asked += [
        (name, objective) for name, objectives in SLOW.items() for objective in objectives if given.slow
    ]
    record = read_record() if RECORD.exists() else {}
    found: dict[str, Row] = {}
    for name, objective in asked:
        if given.names and name not in given.names:
            continue
        if PATHS[name].shared and not DATA.exists():
            print(f"{name}: skipped, no folder {DATA}")
            continue
        key = f"{name}, {objective}"
        found[key] = row = measure(name, objective)
        print("\n".join(judge({key: row}, record).text), flush=True)
    if given.write:
        rows = {name: asdict(row) for name, row in sorted({**record, **found}.items())}
        RECORD.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        return 0
    dearer = judge(found, record).dearer
    if dearer:
        print(f"dearer than on record: {'; '.join(dearer)}")
    return 1 if dearer else 0


if __name__ == "__main__":
    sys.exit(main())
