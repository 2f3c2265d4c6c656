"""Print how LinuxCNC's simulated machine runs a program of ours under several path-control words.

Usage: python tests/benchmarks/referee.py [PROGRAM MOTION.CSV MACHINE HEIGHT]
       [--words "G61,G64 P0.01"] [--speed 500] [--acceleration 5000] [--coordinates tip]

Without a program it is the overhang example, optimised here. "off path" is the distance of the point of the
tool that keeps to the path (HEIGHT mm above the tip, a ball's radius) from the straight ways between the
locations of the motion table, of which the blocks themselves take up to 5 µm; "off blocks" is its distance
from where the program's blocks lead it, which is the control's part. Each with the angle of the tool axis.
The predicted time is that of the package's own table of the control. Needs linuxcnc-uspace.
"""

import argparse
import math
import re
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

import fiveaxis as fx
from fiveaxis.base import Coordinates
from fiveaxis.model import predicted_time, tool_poses
from fiveaxis.nc import DIALECTS
from fiveaxis.nc.motion_table import read_motion
from fiveaxis.nc.source import load_source

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from referee.deviation import deviations, joint_path  # noqa: E402
from referee.linuxcnc import run_program  # noqa: E402

WORDS = "G64 P0.01,G64 P0.001,G64 P0.0005,G64 P0.0001,G64 P0.001 Q0.001,G64 P0.001 Q0,G61,G61.1"
# mm/s or deg/s, and per second: of axes for which the machine states none.
USUAL = 500.0, 5000.0
# Rows of G64, G61 and G61.1 in a program.
PATH_CONTROL = re.compile(r"^(N\d+ )?G6[14].*$", re.MULTILINE)


def limited(machine: fx.Machine, speed: float | None, acceleration: float | None) -> fx.Machine:
    """Give all axes these highest speeds and accelerations; without any, `USUAL` to those that have none."""
    axes = []
    for axis in machine.axes:
        unit = math.pi / 180.0 if axis.is_rotary else 1.0
        own = axis.max_speed or USUAL[0] * unit, axis.max_acceleration or USUAL[1] * unit
        given = [most if v is None else v * unit for v, most in zip((speed, acceleration), own, strict=True)]
        axes.append(replace(axis, max_speed=given[0], max_acceleration=given[1]))
    return replace(machine, axes=tuple(axes))


def overhang(folder: Path) -> tuple[Path, Path, str, float]:
    verb = ["optimise", "examples/overhang/job.toml", "-o", str(folder)]
    command = [sys.executable, "-m", "fiveaxis.cli", *verb]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return folder / "program.ngc", folder / "motion.csv", "hayashi-640123", 4.0


def told(values: np.ndarray, unit: str, digits: int) -> str:
    return f"{values.max():8.{digits}f} {np.quantile(values, 0.999):8.{digits}f} {unit}"


def measure(
    program: Path, table: Path, machine: fx.Machine, height: float, words: list[str], coordinates: Coordinates
) -> None:
    text = program.read_text(encoding="ascii")
    read = fx.read_program(program, machine)
    motion = read_motion(load_source(table), machine)
    tips, axes = tool_poses(machine, motion.positions)
    paths = [(tips, axes), joint_path(machine, read.positions)]
    predicted = predicted_time(read, machine, DIALECTS["linuxcnc"], coordinates)
    print(
        f"{program}: {len(read)} rows; {read.time.sum():.3f} s programmed, {predicted.total:.3f} s predicted"
    )
    print(f"{'':18} {'s':>8}   off path: max, p99.9   tool axis: max, p99.9    off blocks: max, p99.9")
    for word in words:
        run = run_program(PATH_CONTROL.sub(word, text), machine, limit=900.0)
        line = int(read.source[1]), int(read.source[-1])
        run = run.of_lines(*line)
        tip, axis = run.poses
        row = f"{word:18} {run.seconds:8.3f}  "
        for path, directions in paths:
            away, turned = deviations(tip + height * axis, axis, path + height * directions, directions)
            row += f" {told(away, 'mm', 5)} {told(np.degrees(turned), 'deg', 4)}  "
        print(row, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("inputs", nargs="*", metavar="PROGRAM MOTION.CSV MACHINE HEIGHT")
    parser.add_argument("--words", default=WORDS)
    parser.add_argument("--speed", type=float)
    parser.add_argument("--acceleration", type=float)
    parser.add_argument("--coordinates", choices=("axes", "tip"), default="axes")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        program, table, machine, height = given.inputs or overhang(Path(folder))
        limits = given.speed, given.acceleration
        measure(
            Path(program),
            Path(table),
            limited(fx.load_machine(machine), *limits),
            float(height),
            [word.strip() for word in given.words.split(",")],
            given.coordinates,
        )


if __name__ == "__main__":
    main()
