"""What was written is read."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fiveaxis.model import Tool
from fiveaxis.nc import read_toolpath

BALL = Tool.ball(8)


@given(points=arrays(float, st.tuples(st.integers(1, 6), st.just(6)), elements=st.floats(-1e5, 1e5)))
def test_apt_and_table_give_the_numbers_that_were_written(tmp_path: Path, points: np.ndarray):
    lengths = np.linalg.norm(points[:, 3:], axis=1, keepdims=True)
    axis = np.where(lengths > 1.0, points[:, 3:] / np.maximum(lengths, 1.0), [0.0, 0.0, 1.0])
    rows = [",".join(map(repr, row)) for row in np.hstack([points[:, :3], axis]).tolist()]
    apt, table = tmp_path / "a.apt", tmp_path / "a.csv"
    apt.write_text("".join(f"GOTO/{row}\n" for row in rows))
    table.write_text("\n".join(["x,y,z,i,j,k", *rows]))
    for path in (apt, table):
        toolpath = read_toolpath(path, tool=BALL)
        np.testing.assert_allclose(toolpath.axis, axis, atol=1e-15)
        assert toolpath.tips(toolpath.axis) == pytest.approx(points[:, :3], abs=1e-10)
