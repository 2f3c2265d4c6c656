"""Print the share of each stage in the time of jobs, and how far off remaining times were.

    python tests/benchmarks/stages.py JOB.toml [EFFORT]

The weights of `fiveaxis/base/progress.py` are rounded means of what this prints for the examples.
"""

import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import numpy as np

from fiveaxis.base import Meter, ProgressReport
from fiveaxis.job import read_job, run_job, write_outcome


def main(path: Path, **settings: str) -> None:
    """Run a job, and print the table of its stages."""
    heard: list[tuple[float, ProgressReport]] = []
    meter = Meter(lambda report: heard.append((time.monotonic(), report)))
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        write_outcome(run_job(read_job(path, **settings), meter), Path(folder) / "out", meter)
    end = time.monotonic()
    spent: dict[str, float] = defaultdict(float)
    for (at, report), after in zip(heard, [*(at for at, _ in heard[1:]), end], strict=True):
        spent[report.id or report.stage] += after - at
    print(f"{path}: {end - began:.1f} s, {len(heard)} reports")
    for stage, seconds in spent.items():
        print(f"  {stage:12} {100.0 * seconds / (end - began):5.1f} %")
    expected = [(at - began, at + report.left - began) for at, report in heard if report.left is not None]
    for share in (0.25, 0.5, 0.75):
        near = [whole for at, whole in expected if abs(at / (end - began) - share) < 0.1]
        if near:
            print(f"  near {share:.0%} of it, expected in all: {np.median(near):.1f} s")
    shares = [report.share for _, report in heard if report.share is not None]
    print(f"  share at the last report {shares[-1]:.2f}; never back: {bool((np.diff(shares) >= 0).all())}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), **({"effort": sys.argv[2]} if len(sys.argv) > 2 else {}))
