"""Print how many faults that are planted in programs and in motion.csv are found, by class, control and mode.

Usage: python tests/benchmarks/faults.py [--count 4] [--part hayashi|trunnion|passes] [--class WORD] [--short]
       [--missed]

A fault is one in the text of what was verified. Its classes are in `planted.registry` and, for motion.csv, in
`planted.tables`, each with the rule by which it matters; where a rule measures, it does so apart from the
verification. *made*: planted (as many as `--count` of those that chance draws); *matter*: of those made;
*program*: of those that matter, found by `verify` of the file beside the path and what the job asks;
*read-back*: found when the text is read back beside the motion that it was written for, and for motion.csv by
`post`. A warning is enough for a class that says so.
The family *clean* has no fault: there, *false* counts the programs and tables with an error, or with a
warning that they don't have as they were written.
The exit code is 1 where less than 99 % of what matters in a class is found by either check, or there is a
false alarm.
"""

import argparse
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from planted.fault import Fault
from planted.jobs import jobs, of_job, of_settings
from planted.registry import FAULTS
from planted.tables import TABLE_FAULTS, TableTrial
from planted.trial import CLEAN, MODES, PARTS, Count, Trial, try_program

import fiveaxis as fx

LEAST = 0.99
SHORT = [
    ("linuxcnc", "axes"),
    ("fanuc", "tip"),
    ("heidenhain", "tip"),
    ("sinumerik", "vector"),
    ("apt", "vector"),
]
FAMILY = {fault.name: fault.family for fault in (*FAULTS, *TABLE_FAULTS)}
ROW = "{:10} {:22} {:30} {:>5} {:>6} {:>8} {:>10} {:>6}"


def is_bad(count: Count) -> bool:
    """Whether a class has too many misses, or a false alarm."""
    least = LEAST * count.mattered
    return count.by_program < least or count.by_read_back < least or count.false_alarms > 0


def line(name: str, where: str, count: Count) -> str:
    """Return a row of the table."""
    figures = count.made, count.mattered, count.by_program, count.by_read_back, count.false_alarms
    mark = "  <-" if is_bad(count) else ""
    return ROW.format(FAMILY.get(name, CLEAN), name, where, *figures) + mark


def results(
    solutions: dict[str, fx.Solution], given: argparse.Namespace, folder: Path
) -> Iterator[tuple[str, str, Count]]:
    """Try each program and table: class, place and numbers."""

    def wanted(fault: Fault) -> bool:
        return given.only is None or given.only in f"{fault.family} {fault.name}"

    modes = SHORT if given.short else MODES
    for part_name, solution in solutions.items():
        for seed, (control, mode) in enumerate(modes):
            trial = Trial.of(PARTS[part_name], solution, control, mode)
            where = f"{part_name} {control} {mode}"
            for name, count in try_program(trial, folder, given.count, seed, wanted).items():
                yield name, where, count
        for control, mode, beside_path in (
            ("linuxcnc", "axes", True),
            ("heidenhain", "tip", True),
            ("linuxcnc", "axes", False),
        ):
            table = TableTrial(solution, control, mode, beside_path)
            where = f"{part_name} table {control} {'path' if beside_path else 'tool'}"
            for name, count in try_program(table, folder, given.count, 0, wanted).items():
                yield name, where, count
    if given.only is not None and given.only not in CLEAN:
        return
    for part_name, solution in solutions.items():
        for control, mode in modes:
            yield "settings", f"{part_name} {control} {mode}", of_settings(solution, control, mode, folder)
    for job in [] if given.short else jobs():
        yield "jobs", job.name, of_job(job, folder)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=4)
    parser.add_argument("--part", choices=PARTS, action="append", help="default: all of them")
    parser.add_argument("--class", dest="only", help="only families and classes with this text in their name")
    parser.add_argument("--short", action="store_true", help="five controls, one of each drawn fault")
    parser.add_argument("--missed", action="store_true", help="name each fault that wasn't found")
    given = parser.parse_args()
    given.count = 1 if given.short else given.count
    solutions = {name: PARTS[name].solve() for name in given.part or PARTS}
    totals: dict[str, Count] = {}
    controls: dict[str, Count] = {}
    header = ROW.format("family", "class", "where", "made", "matter", "program", "read-back", "false")
    print(header)
    with tempfile.TemporaryDirectory() as folder:
        for name, where, count in results(solutions, given, Path(folder)):
            print(line(name, where, count), flush=True)
            for text in count.missed if given.missed else ():
                print(f"    {text}")
            totals.setdefault(name, Count()).add(count)
            if name in FAMILY:
                controls.setdefault(where.split()[-2], Count()).add(count)
    print(header)
    everything = Count()
    for name, count in totals.items():
        print(line(name, "all", count))
        everything.add(count)
    for control, count in controls.items():
        print(line("everything", control, count))
    print(line("everything", "all", everything))
    return int(any(is_bad(count) for count in totals.values()))


if __name__ == "__main__":
    sys.exit(main())
