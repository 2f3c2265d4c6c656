"""Print how many faults that are planted in programs are found, by control, mode and class.

Usage: python tests/benchmarks/faults.py [--count 10] [--machine hayashi|trunnion] [--missed]

Each fault is one in the text of a program that was verified: in the words of one move (as many of each class
as `--count` says), or in what the program puts in force (one of each class). *made*: planted; *mattered*: by
a measure apart from the verification, the tool leaves its path, passes a location by, leans too far or an
axis its travel (what is put in force always matters); *program*: of those that mattered, found by
`verify_program` beside path and machine; *read-back*: found when the text is read back beside the motion that
it was written for. The class *clean* has no fault: there, what is found is a false alarm. The exit code is 1
where a fault that matters isn't found by the read-back, one of a move's words isn't found by
`verify_program`, or a clean program is refused.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from planted.trial import CLEAN, GEOMETRIC, MODES, Count, Trial, on_hayashi, on_trunnion, try_program

SOLUTIONS = {"hayashi": on_hayashi, "trunnion": on_trunnion}
ROW = "{:20} {:7} {:15} {:>5} {:>9} {:>8} {:>10}"


def is_bad(name: str, count: Count) -> bool:
    """Whether a class has a miss that counts, or a false alarm."""
    if name == CLEAN:
        return bool(count.by_program or count.by_read_back)
    short = count.by_program < count.mattered if name in GEOMETRIC else False
    return short or count.by_read_back < count.mattered


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--machine", choices=SOLUTIONS, default="hayashi")
    parser.add_argument("--missed", action="store_true", help="name each fault that wasn't found")
    given = parser.parse_args()
    solution, bad = SOLUTIONS[given.machine](), 0
    totals: Counter[tuple[str, str]] = Counter()
    print(ROW.format("control", "mode", "class", "made", "mattered", "program", "read-back"))
    for number, (control, mode) in enumerate(MODES):
        with tempfile.TemporaryDirectory() as folder:
            counts = try_program(Trial(solution, control, mode), Path(folder), given.count, number)
        for name, count in counts.items():
            figures = count.made, count.mattered, count.by_program, count.by_read_back
            mark = "  <-" if is_bad(name, count) else ""
            bad += is_bad(name, count)
            print(ROW.format(control, mode, name, *figures) + mark, flush=True)
            kind = name if name == CLEAN else "geometric" if name in GEOMETRIC else "modal"
            for what, value in zip(("made", "mattered", "program", "read-back"), figures, strict=True):
                totals[kind, what] += value
            if given.missed:
                print(*(f"    {text}" for text in count.missed if name != CLEAN), sep="\n")
    for kind in (CLEAN, "geometric", "modal"):
        figures = [totals[kind, what] for what in ("made", "mattered", "program", "read-back")]
        print(ROW.format("all", "", kind, *figures))
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main())
