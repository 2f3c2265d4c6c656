"""Feed damaged inputs to every reader, and print how each ends.

Usage: python tests/benchmarks/fuzz.py [--count 100000] [--seed 0] [--only READER…] [--keep FOLDER]

*accepted*: read; *refused*: by an error of fiveaxis; *foreign*: any other exception, a warning, or no end
within ten seconds (a verb: two minutes); *s*: processor time of the slowest input; *MB*: the most that the
process came to need beyond what it needs for inputs without damage. Verbs work after reading, and are given
a hundredth of the inputs or less. The first traceback of every kind of foreign end follows the table; with
`--keep`, its input and the slowest one are written to a folder. Each reader runs in a process of its own, one
after the other. The exit code is 1 where an end is foreign.
"""

import argparse
import multiprocessing
import re
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from fuzzing.readers import Reader, readers
from fuzzing.trial import Outcome, try_reader

ROW = "{:16} {:>8} {:>8} {:>8} {:>8} {:>7} {:>5} {:>9}"


def keep(folder: Path, reader: Reader, outcome: Outcome) -> None:
    """Write the inputs that a look is worth."""
    folder.mkdir(parents=True, exist_ok=True)
    inputs = {kind: content for kind, (content, _) in outcome.first.items()}
    for kind, content in (inputs | {"slowest": outcome.slowest_input}).items():
        (folder / re.sub(r"[^\w.]+", "_", f"{reader.name} {kind}")).write_bytes(content)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100_000, help="inputs of each reader")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="*", help="names of readers")
    parser.add_argument("--keep", type=Path, help="folder for inputs that end foreign")
    given = parser.parse_args()
    bad, told = 0, []
    print(ROW.format("reader", "inputs", "accepted", "refused", "foreign", "s", "MB", "inputs/s"))
    for reader in readers():
        if given.only and reader.name not in given.only:
            continue
        start = time.perf_counter()
        with multiprocessing.get_context("fork").Pool(1, _adopt, (reader,)) as pool:
            outcome = pool.apply(_try, (given.count, given.seed))
        foreign, took = sum(outcome.foreign.values()), time.perf_counter() - start
        figures = outcome.inputs, outcome.accepted, outcome.refused, foreign
        rates = f"{outcome.slowest:.3f}", f"{outcome.memory:.0f}", f"{outcome.inputs / took:.0f}"
        print(ROW.format(reader.name, *figures, *rates), flush=True)
        bad += foreign
        told += [(reader, kind, n, outcome.first[kind][1]) for kind, n in outcome.foreign.items()]
        if given.keep is not None:
            keep(given.keep, reader, outcome)
    for reader, kind, count, text in told:
        print(f"\n{reader.name}: {kind} ({count})\n{text}")
    return 1 if bad else 0


_OWN: list[Reader] = []


def _adopt(reader: Reader) -> None:
    """Keep the reader of this process: it has functions, which aren't sent from one to another."""
    _OWN.append(reader)


def _try(count: int, seed: int) -> Outcome:
    return try_reader(_OWN[0], count, seed)


if __name__ == "__main__":
    sys.exit(main())
