"""Write one solution for three controls, and verify each program from its text alone.

A program is not the motion: numbers are rounded, angles are counted as the control counts them, and the
control decides how the axes move between two blocks. LinuxCNC gets axis positions here, the Sinumerik and
the Heidenhain get the tip and use TCP. So `write` reads its text back and verifies it before there is a
file; here the file is verified once more, like a program from anywhere else.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import fiveaxis as fx

CONTROLS = {"linuxcnc": "wall.ngc", "sinumerik": "wall.mpf", "heidenhain": "wall.h"}
TILT = (15, 75)  # degrees between tool axis and surface normal


def main() -> None:
    machine = fx.load_machine("hayashi-640123")
    turn = np.radians(np.linspace(0.0, 60.0, 30))
    normals = np.column_stack([np.cos(turn), np.sin(turn), np.full_like(turn, -0.5)])
    contacts = np.column_stack([25.0 * np.cos(turn), 25.0 * np.sin(turn), np.full_like(turn, 20.0)])
    toolpath = fx.Toolpath.from_contacts(contacts, normals, fx.Tool.ball(8), feed_mm_min=1000)
    solution = fx.optimise(toolpath, machine, tilt=TILT, effort="quick")
    with tempfile.TemporaryDirectory() as folder:
        for control, name in CONTROLS.items():
            file = Path(folder, name)
            solution.write(file, control=control)
            report = fx.verify_program(file, machine, toolpath=toolpath, tilt=TILT)
            lines = file.read_text(encoding="utf-8").splitlines()
            print(f"{control}: {len(lines)} lines, verified {report.ok}, findings {dict(report.counts)}")


if __name__ == "__main__":
    main()
