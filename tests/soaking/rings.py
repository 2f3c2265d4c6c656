"""Small jobs for batches."""

from pathlib import Path

import numpy as np

JOB = """input = "r{0}.csv"
machine = "hayashi-640123"
tool = "ball:10"
tilt = [15, 75]
effort = "quick"
"""


def write_ring_jobs(folder: Path, count: int) -> list[Path]:
    """Write jobs on small overhanging rings, each with a path of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    angle = np.linspace(0.0, 2.0 * np.pi, 40)
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(40, -0.3)], axis=1)
    files = []
    for number in range(count):
        r = 20.0 + number
        contact = np.stack([r * np.cos(angle), r * np.sin(angle), np.zeros(40)], axis=1)
        rows = np.hstack([contact, normal])
        np.savetxt(folder / f"r{number}.csv", rows, delimiter=",", header="x,y,z,nx,ny,nz", comments="")
        files.append(folder / f"r{number}.toml")
        files[-1].write_text(JOB.format(number))
    return files


def contents(folder: Path) -> dict[str, bytes]:
    """Read every file of a folder."""
    found = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}
