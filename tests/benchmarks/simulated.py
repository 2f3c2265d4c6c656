"""Print how long programs take: as predicted, and in LinuxCNC's simulated machine.

Usage: python tests/benchmarks/simulated.py [impeller] [boat] [wave] [square] [curve] [--rows 0:300]
       [--words "G61,G64,G64 P0.01"] [--modes axes,tip]

Impeller and boat are LinuxCNC's demonstration programs with their own postures, the wave turns both rotary
axes along 40 mm, square and curve have no turns. Each is written for LinuxCNC by this package without ways in
and out, and run in real time with each path-control word in place of G61. Predictions are those of a table of
the control with that word's corners. Counted from the first block of the cut to the end of the last one.
The first line says which version was run, and whose planner is predicted. Needs linuxcnc-uspace.
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from paths import DATA, ROOT

import fiveaxis as fx
from fiveaxis.base import Coordinates
from fiveaxis.model import Motion, follow, predicted_time, tool_axes
from fiveaxis.nc import DIALECTS, ProgramSettings, compose_program
from fiveaxis.nc.writing.tables import Dialect

sys.path.insert(0, str(ROOT / "tests"))
from referee.linuxcnc import run_program

TRUNNION = fx.load_machine("linuxcnc-xyzac-trt")
# The row of a program that was read at which the cut begins: after its start and the way in.
CUT = 2
LINUXCNC = DIALECTS["linuxcnc"]


def demonstration(name: str, rows: slice) -> Motion:
    """Read one of LinuxCNC's own programs."""
    motion = fx.read_program(DATA / "toolpaths" / f"linuxcnc_{name}_xyzac.ngc", TRUNNION)
    columns = {each: getattr(motion, each)[rows] for each in ("positions", "feed", "time", "kind", "source")}
    columns["time"][0] = 0.0
    return Motion(letters=motion.letters, **columns)


def wave(turning: bool, count: int = 81) -> Motion:
    """Go once through a wave of 40 mm."""
    u = np.linspace(0.0, 1.0, count)
    rotary = np.radians(np.column_stack([40.0 + 50.0 * u, -30.0 + 20.0 * np.sin(6.0 * u)])) * turning
    tips = np.column_stack([40.0 * u - 20.0, 6.0 * np.sin(7.0 * u), 3.0 * np.cos(5.0 * u)])
    path = fx.Toolpath.from_tips(tips, tool_axes(TRUNNION, rotary), fx.Tool.ball(8), feed_mm_min=900.0)
    return follow(path, TRUNNION, rotary)


def as_planned(word: str) -> Dialect:
    """Give the control's table that has the corners of a path-control word."""
    if word == "G61":
        return LINUXCNC
    tolerance = re.search(r"P([\d.]+)", word)
    blend = float(tolerance[1]) if tolerance else 0.0
    return LINUXCNC.model_copy(update={"corners": "blended", "blend": blend})


def compare(name: str, motion: Motion, mode: Coordinates, words: list[str]) -> None:
    settings = ProgramSettings(way_out=False)
    text = compose_program(motion, machine=TRUNNION, coordinates=mode, settings=settings).text
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "program.ngc"
        file.write_text(text, encoding="ascii")
        read = fx.read_program(file, TRUNNION)
    lines = int(read.source[CUT]), int(read.source[-1])
    for word in words:
        predicted = float(predicted_time(read, TRUNNION, as_planned(word), mode).times[CUT:].sum())
        run = run_program(text.replace("\nG61\n", f"\n{word}\n"), TRUNNION, limit=2.0 * predicted + 60.0)
        seconds = run.of_lines(*lines).seconds
        print(
            f"{name:10} {mode:5} {word:10} {read.time[CUT:].sum():10.2f} {predicted:10.2f} {seconds:10.2f} "
            f"{100.0 * (predicted / seconds - 1.0):+8.2f} %",
            flush=True,
        )


def installed_version() -> str:
    """Ask Debian's package for its version."""
    asked = ["dpkg-query", "-W", "-f", "${Version}", "linuxcnc-uspace"]
    return subprocess.run(asked, check=True, capture_output=True, text=True).stdout


def square() -> Motion:
    """Go around a square of 20 mm, without turns."""
    corners = np.array([[0, 0], [20, 0], [20, 20], [0, 20], [0, 0]], dtype=float)
    tips = np.column_stack([corners, np.zeros(5)])
    path = fx.Toolpath.from_tips(tips, np.tile([0.0, 0.0, 1.0], (5, 1)), fx.Tool.ball(8), feed_mm_min=600.0)
    return follow(path, TRUNNION, np.zeros((5, 2)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", default=["impeller", "boat", "wave", "square"])
    parser.add_argument("--rows", default="0:300")
    parser.add_argument("--words", default="G61,G64,G64 P0.01")
    parser.add_argument("--modes", default="axes,tip")
    given = parser.parse_args()
    rows = slice(*map(int, given.rows.split(":")))
    words = [word.strip() for word in given.words.split(",")]
    planner, run = LINUXCNC.planner, installed_version()
    print(f"run: linuxcnc-uspace {run}; predicted: the planner of {planner.version}")
    if not run.startswith(planner.version):
        print("\n".join(planner.later))
    print(f"{'program':10} {'words':5} {'corners':10} {'feed, s':>10} {'predicted':>10} {'simulated':>10}")
    for name in given.names:
        made = {"wave": lambda: wave(turning=True), "curve": lambda: wave(turning=False, count=1001)}
        made |= {"square": square}
        motion = made[name]() if name in made else demonstration(name, rows)
        for mode in given.modes.split(","):
            compare(name, motion, mode, words)


if __name__ == "__main__":
    main()
