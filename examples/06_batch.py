"""Run two jobs at once and compare them: the same ring with a narrow and with a wide range of tilt.

A wider range holds every posture of the narrow one, so its optimum can't be dearer; how much it wins is worth
knowing before a process is approved for it. Each job is a file of its own and runs in a worker process of its
own. Run a second time, a batch finds its results by the hash of their inputs and computes nothing.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

import fiveaxis as fx

RANGES = {"narrow": (30, 60), "wide": (10, 80)}  # degrees between tool axis and surface normal
JOB = """
input = "ring.csv"
machine = "hayashi-640123"
tool = "ball:8"
tilt = [{0}, {1}]
effort = "quick"
"""


def write_jobs(folder: Path) -> list[Path]:
    """Write the ring's points and a job for each range."""
    turn = np.linspace(0.0, np.pi, 20)
    ring = np.column_stack([40.0 + 20.0 * np.cos(turn), 20.0 * np.sin(turn), np.full_like(turn, 20.0)])
    normals = np.column_stack([0.8 * np.cos(turn), 0.8 * np.sin(turn), np.full_like(turn, -0.6)])
    rows = np.hstack([ring, normals])
    np.savetxt(folder / "ring.csv", rows, "%.6f", ",", header="x,y,z,nx,ny,nz", comments="")
    files = [folder / f"{name}.toml" for name in RANGES]
    for file, tilt in zip(files, RANGES.values(), strict=True):
        file.write_text(JOB.format(*tilt))
    return files


def main(workers: int = 2) -> None:
    with tempfile.TemporaryDirectory() as folder:
        jobs = write_jobs(Path(folder))
        for attempt in ("first", "second"):
            batch = fx.run_batch(jobs, Path(folder, "out"), workers=workers)
            print(f"{attempt} time: {len(batch.rows)} jobs, {len(batch.resumed)} done before")
        for row in batch.rows:
            print(
                f"{row.name}: {row.status}, {row.energy:.0f} J, {row.saved:.1%} saved against {row.baseline}"
            )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
