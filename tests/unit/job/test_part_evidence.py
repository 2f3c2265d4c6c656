"""The part decides what a program leaves open."""

import numpy as np
import pytest
import trimesh

from fiveaxis.job import make_job
from fiveaxis.job.loading import load_job_toolpath
from fiveaxis.model import tool_axes
from fiveaxis.nc.control.tip_frames import carried_points


@pytest.fixture
def slanted(tmp_path, hayashi):
    """Cuts of a 6 mm ball, tilted, on top of a flat plate: only 4 of them, too few to show the frame."""
    plate = trimesh.creation.box(bounds=[[-80, -80, -10], [80, 80, 20]])
    plate.export(tmp_path / "plate.stl")
    turns = np.radians([0.0, 5.0, 15.0, 30.0])
    positions = np.zeros((4, 5))
    positions[:, hayashi.rotary_columns] = np.column_stack([turns, np.radians([-20.0] * 4)])  # C, A
    axes = tool_axes(hayashi, positions[:, hayashi.rotary_columns])
    centre = np.column_stack([[20.0, 25.0, 30.0, 35.0], [10.0, 11.0, 12.0, 13.0], [23.0] * 4])
    return hayashi, centre - 3.0 * axes, positions, tmp_path


def settle(case, tips, head, **given):
    machine, _, positions, folder = case
    angles = np.degrees(positions[:, machine.rotary_columns]) * [
        -1.0 if machine.axes[c].reversed else 1.0 for c in machine.rotary_columns
    ]
    words = [
        f"X{x:.4f} Y{y:.4f} Z{z:.4f} A{a:.4f} C{c:.4f}"
        for (x, y, z), (c, a) in zip(tips, angles, strict=True)
    ]
    text = "\n".join([head, "G43.4 H1", f"G0 {words[0]}", "G1 F600", *words, "M30\n"])
    (folder / "part.nc").write_text(text)
    job = make_job(
        input=folder / "part.nc", machine="hayashi-640123", tool="ball:6", part=folder / "plate.stl", **given
    )
    path = load_job_toolpath(job)
    return path, {f.code: f.message for f in path.findings}


def test_the_frame_in_which_the_cutter_touches_the_part_is_taken(slanted):
    machine, tips, positions, _ = slanted
    home = positions * 0.0
    by_machine = np.array(
        [
            np.linalg.solve(*_frame(machine, row, tip, home[:1]))
            for row, tip in zip(positions, tips, strict=True)
        ]
    )
    path, told = settle(slanted, by_machine, "G21 G90 G94")
    assert told["positions-by-part"].startswith(
        "3 cuts touch the part as positions=machine, as they are read"
    )
    np.testing.assert_allclose(path.tips(path.axis)[-3:], tips[-3:], atol=2e-4)
    path, told = settle(slanted, tips, "G21 G90 G94")
    assert told["positions-by-part"].startswith("3 cuts touch the part as positions=table")


def _frame(machine, row, tip, home):
    """Matrix and right side of carried_points(p) = tip for one row."""
    points = np.vstack([np.zeros(3), np.eye(3)])
    carried = carried_points(machine, points, np.repeat(row[None], 4, axis=0), to_work=True)
    return (carried[1:] - carried[0]).T, tip - carried[0]


def test_the_unit_in_which_the_cutter_touches_the_part_is_taken(slanted):
    tips = slanted[1]
    path, told = settle(slanted, tips / 25.4, "G90 G94", program={"positions": "table"})
    assert told["unit-by-part"].startswith(
        "3 cuts touch the part as unit=inch, as they are read, and 0 as unit=mm"
    )
    assert np.abs(path.pivot[-1]).max() > 10.0
