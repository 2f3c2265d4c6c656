"""See what a form-shaping code alone says about a machine: its chain, its branches, its singular direction.

The digits name the axes from the workpiece to the tool (1…6 are X Y Z A B C, 0 is the bed), and that order is
all that forward and inverse kinematics need while the axes have no offsets. Two pairs of rotary angles give
the same tool axis, so the inverse has two branches and a posture is also a choice between them. While the
tool points along the first rotary axis, that axis doesn't tilt the tool; near there a small change of the
tool axis needs a large turn.
"""

from __future__ import annotations

import numpy as np

import fiveaxis as fx
from fiveaxis.model import axis_positions, singular_angles, singular_direction, tool_poses

CLOSED = 1e-9  # mm, and of a unit vector
LEANS = (40.0, 10.0, 1.0)  # degrees between tool axis and singular direction


def main() -> None:
    machine = fx.Machine.from_code("640123")  # workpiece, C, A, bed, X, Y, Z, tool
    letters = [axis.letter for axis in machine.axes]
    print(f"axes {' '.join(letters)}, rotary from the workpiece on {' '.join(machine.rotaries)}")

    tip, axis = tool_poses(machine, [[10.0, 20.0, 30.0, 0.4, 1.2]])  # mm and rad
    branches = axis_positions(machine, tip, axis)[:, 0]
    for number, positions in enumerate(branches, 1):
        back_tip, back_axis = tool_poses(machine, positions[None])
        miss = max(np.abs(back_tip - tip).max(), np.abs(back_axis - axis).max())
        shown = np.where([letter in "ABC" for letter in letters], np.degrees(positions), positions)
        words = " ".join(f"{letter}{value:.3f}" for letter, value in zip(letters, shown, strict=True))
        print(f"branch {number}: {words} (mm, degrees), closes {miss < CLOSED}")

    print(f"singular direction {singular_direction(machine).tolist()}")
    for lean in np.radians(LEANS):
        # The tool axis moves half a degree on the cone of that lean.
        side = np.radians([0.0, 0.5]) / np.sin(lean)
        axes = np.column_stack(
            [np.sin(lean) * np.cos(side), np.sin(lean) * np.sin(side), np.cos([lean, lean])]
        )
        c = axis_positions(machine, np.zeros((2, 3)), axes)[0, :, letters.index("C")]
        away = np.degrees(singular_angles(machine, axes)[0])
        print(
            f"{away:4.1f} deg away from it: the tool turns 0.5 deg, C {np.degrees(abs(c[1] - c[0])):.1f} deg"
        )


if __name__ == "__main__":
    main()
