"""Motions as tables."""

import numpy as np
import pytest

from fiveaxis.base.errors import MachineError, ToolpathError
from fiveaxis.model import Motion
from fiveaxis.nc import write_motion
from fiveaxis.nc.motion_table import read_motion
from fiveaxis.nc.source import load_source

MOTION = Motion(
    letters="XYZAC",
    positions=np.array([[1.5, -2.0, 0.0, np.pi / 6, -4 * np.pi], [1.5, -2.0, -1e-12, np.pi / 6, -4 * np.pi]]),
    feed=np.array([10.0, 20.0]),
    time=np.array([0.0, 0.25]),
    kind=np.array([0, 2]),
    source=np.array([7, 12]),
)


def test_a_motion_of_another_machine_is_not_written(tmp_path):
    from fiveaxis.model import Machine

    with pytest.raises(MachineError, match="axes XYZAC, and machine '650123' has XYZBC"):
        write_motion(MOTION, tmp_path / "motion.csv", Machine.from_code("650123"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (
            "X,Y,Z,B,C,feed,time,source\n1,2,3,4,5,6,7,8\n",
            "isn't that of machine 'hayashi-640123': X,Y,Z,A,C,feed",
        ),
        ("X,Y,Z,A,C,feed,time,source\n1,2,3,4,5,6,7\n", r"motion\.csv:2: 7 fields where the header has 8"),
        (
            "X,Y,Z,A,C,feed,time,source\n1,2,3,4,5,0,7,8\n",
            r"motion\.csv:2: feed = 0 mm/min; it must be above 0",
        ),
        ("X,Y,Z,A,C,feed,time,source\n1,2,3,4,5,6,7,-8\n", r"motion\.csv:2: source is -8; it must be a line"),
        ("X,Y,Z,A,C,feed,time,source,kind\n1,2,3,4,5,6,7,8,3\n", r"motion\.csv:2: kind is 3; it must be 0"),
        ("X,Y,Z,A,C,feed,time,source\n1,2,3,nan,5,6,7,8\n", r"motion\.csv:2: A = nan isn't a finite number"),
    ],
)
def test_a_table_of_something_else_is_refused(hayashi, tmp_path, text, fault):
    path = tmp_path / "motion.csv"
    path.write_text(text)
    with pytest.raises(ToolpathError, match=fault):
        read_motion(load_source(path), hayashi)
