"""Print what comes of batches whose workers, and whose command, are killed at random moments.

Usage: python tests/benchmarks/soak.py [--runs 5] [--jobs 40] [--kills 100] [--workers 2] [--seed 1]

Each run does the same jobs in a new folder. *start-up*, *taking*, *running*, *idle*: workers killed while
they started, as they took a job, at work, and between two jobs; *batch*: the command itself, which is started
again (*starts*). *jobs*: results at the end; *twice*, *lost*: jobs with several and with none; *differ*:
files that are not byte for byte those of an undisturbed run; *orphans*: workers alive 2 s after their command
was killed. The exit code is 1 where a run isn't clean.
"""

import argparse
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from soaking.killing import KINDS, Tally, compare, draw_kinds, soak
from soaking.rings import write_ring_jobs

from fiveaxis.job import run_batch

HEAD = ("run", "kills", *KINDS, "starts", "jobs", "twice", "lost", "differ", "orphans", "exit", "s")
ROW = " ".join(["{:>8}"] * len(HEAD))


def cells(run: int, tally: Tally) -> tuple[object, ...]:
    kinds = [tally.kills[kind] for kind in KINDS]
    results = tally.jobs, tally.duplicated, tally.lost, len(tally.differing), tally.orphans
    code = "hung" if tally.exit_code is None else tally.exit_code
    return run, tally.kills.total(), *kinds, tally.starts, *results, code, f"{tally.seconds:.0f}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, value in (("runs", 5), ("jobs", 40), ("kills", 100), ("workers", 2), ("seed", 1)):
        parser.add_argument(f"--{name}", type=int, default=value)
    given = parser.parse_args()
    clean = True
    with tempfile.TemporaryDirectory() as place:
        files = write_ring_jobs(Path(place, "jobs"), given.jobs)
        undisturbed = run_batch(files, Path(place, "undisturbed"), workers=given.workers)
        print(f"undisturbed: {len(undisturbed.rows)} jobs, exit code {undisturbed.exit_code}")
        print(ROW.format(*HEAD), flush=True)
        for run in range(1, given.runs + 1):
            folder = Path(place, f"run-{run}")
            seed = given.seed + run - 1
            tally = soak(files, folder, draw_kinds(given.kills, seed), seed, given.workers)
            compare(tally, files, folder, undisturbed.folder)
            clean = clean and tally.is_clean and tally.kills.total() == given.kills
            print(ROW.format(*cells(run, tally)), flush=True)
            for name in tally.differing:
                print(f"    differs: {name}")
    return 0 if clean else 1


if __name__ == "__main__":
    sys.exit(main())
