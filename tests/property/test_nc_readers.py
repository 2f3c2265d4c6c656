"""Laws of the readers: what was written is read, and nonsense gives an error, never a crash."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fiveaxis.errors import ToolpathError
from fiveaxis.nc import read_toolpath
from fiveaxis.toolpath import Tool

BALL = Tool.ball(8)
QUIET = settings(
    deadline=None,
    derandomize=True,
    max_examples=200,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)

number = st.one_of(
    st.floats(-100, 100).map(str),
    st.sampled_from(
        ["0", "1", "-1.", ".5", "1e9", "1E308", "-1e-320", "nan", "inf", "", " ", "x", "1_0", "٣", "0x1"]
    ),
)
numbers = st.lists(number, max_size=8).map(",".join)
word = st.sampled_from(
    "GOTO FROM RAPID FEDRAT UNITS SPINDL MSYS CIRCLE CYCLE PPRINT PARTNO GO,GOFWD".split()  # noqa: SIM905
)
minor = st.one_of(
    numbers,
    st.sampled_from(
        ["MM", "INCHES", "10,IPM", "MMPM,250", "0.1,MMPR", "RPM,1000,CLW", "OFF", "1,2,3", "1,2,3,0,0,1"]
    ),
)
statement = st.builds(
    "{}{}{}{}".format, word, st.sampled_from(["/", " / ", "", " "]), minor, st.sampled_from(["", "$", "$$"])
)


def read_quietly(path: Path) -> None:
    """Read; the only error is the one that is meant for the user."""
    with contextlib.suppress(ToolpathError):
        toolpath = read_toolpath(path, tool=BALL)
        assert np.isfinite(toolpath.pivot).all()
        assert (toolpath.feed > 0.0).all()


@QUIET
@given(lines=st.lists(statement, max_size=8))
@example(lines=["FEDRAT/1e308,IPM", "GOTO/1,2,3"])
def test_no_apt_file_crashes_the_reader(tmp_path: Path, lines: list[str]):
    path = tmp_path / "part.apt"
    path.write_text("\n".join(lines), encoding="utf-8")
    read_quietly(path)


@QUIET
@given(
    header=st.sampled_from(["x,y,z,nx,ny,nz", "x,y,z,i,j,k", "x,y,z,i,j,k,feed", "", "x,y", "x;y;z"]),
    rows=st.lists(numbers, max_size=5),
)
def test_no_table_crashes_the_reader(tmp_path: Path, header: str, rows: list[str]):
    path = tmp_path / "points.csv"
    path.write_text("\n".join([header, *rows]), encoding="utf-8")
    read_quietly(path)


@QUIET
@given(content=st.binary(max_size=200), name=st.sampled_from(["a.csv", "a.apt", "a.cls.gz"]))
def test_no_bytes_crash_the_reader(tmp_path: Path, content: bytes, name: str):
    path = tmp_path / name
    path.write_bytes(content)
    read_quietly(path)


@QUIET
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
