"""Laws of the APT reader: each GOTO is a row or an error, arcs keep to their circle, frames to their base."""

import contextlib
import re
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fiveaxis.base import rotation_matrix
from fiveaxis.base.errors import SeveralOperations, ToolError, ToolpathError
from fiveaxis.model import PATH_TOLERANCE, Tool, Toolpath
from fiveaxis.nc import read_toolpath

# Real forms of all dialects, as the CAM systems write them; each can be read after `HEAD`.
HEAD = """\
MSYS/-120.2591,-1196.5000,142.5000,0.0000000,1.0000000,0.0000000,1.0000000,0.0000000,0.0000000
SPINDL/   70.0000,RPM,CLW
GOTO/10.0000,0.0000,0.0000
"""
FORMS = [
    "TOOL PATH/VARIABLE_CONTOUR,TOOL,BPR-SNR-323S32\nTLDATA/MILL,32.0000,5.0000,75.0000,0.0000,0.0000",
    "TLDATA/DRILL,MILL,63.0000,0.0000,239.0000,178.0000,35.0000",
    "MSYS/0.0000,0.0000,5.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000\nGOTO/0,0,9",
    "$$-> CUTTER / 10.000000",
    "$$ centerline data\nPAINT/COLOR,186",
    "UNITS/MM",
    "RAPID\nGOTO/0.0000,222.6719,-177.5000,0.0000000,0.0000000,-1.0000000",
    "GOTO / 0.0000000000, 10.0000000000, 50.0000000000, $\n0.6000000000, 0.0000000000, 0.8000000000",
    "GODLTA/0,0,5",
    "FROM/0,0,100,0,0,1\nGOHOME/0,0,100",
    "FEDRAT/MMPM,250.0000",
    "FEDRAT/ 0.4000,MMPR",
    "CUTTER/6.,0,3.,0,0,0,51.\nLOAD/TOOL,2,ADJUST,2",
    "TLAXIS/ 0.000000, 0.000000, 1.000000\nMULTAX / OFF",
    "GOTO/10,0,0\nCIRCLE/0.0,0.0,0.0,0.0,0.0,-1.0,10.0,0.0600,0.5000,40.0000,1.0000\nGOTO/0,10,0",
    "GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1.\nGOTO/0,10.,0,0,0,1",
    "GOTO/10,0,0\nMOVARC/0,0,0,0,0,1,10,ANGLE,90\nGOTO/0,10,0",
    "GOTO/10,0,0\nINDIRV/   0.00000,   1.00000,   0.00000\n"
    "TLON,GOFWD/ (CIRCLE/ 0.0, 0.0, 0.0, 10.0),ON,(LINE/ 0.0, 0.0, 0.0, 0.0, 10.0, 0.0)",
    "CYCLE/DRILL,RAPTO,3.0000,FEDTO,-33.0043,RTRCTO,AUTO,MMPM,250.0000\nGOTO/5,5,5\nCYCLE/OFF",
    "CYCLE / DEEP, DEPTH, 10.0, STEP, 2, MMPM, 250, CLEAR, 5.0\nGOTO/5,5,5\nCYCLE / OFF",
    "CUTCOM/LEFT\nGOTO/5,5,5\nCUTCOM/OFF",
    "END-OF-PATH",
]

_POINT = re.compile(r"\s*GOTO\s*/", re.IGNORECASE)


def read(text: str, **options: object) -> Toolpath:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.apt"
        path.write_text(text, encoding="utf-8")
        return read_toolpath(path, **options)  # type: ignore[arg-type]


def read_each(text: str, **options: object) -> list[Toolpath]:
    """Read a file, or each operation of one that holds several."""
    try:
        return [read(text, **options)]
    except SeveralOperations as several:
        return [read(text, operation=one.number, **options) for one in several.operations]


def require_whole(text: str) -> None:
    """Read; only errors for the user may come out, and no GOTO may be lost in silence."""
    for tool in (None, Tool.ball(8)):
        with contextlib.suppress(ToolpathError, ToolError):
            path = read(text, tool=tool)
            assert np.isfinite(path.pivot).all()
            np.testing.assert_allclose(np.linalg.norm(path.axis, axis=1), 1.0)
            assert (path.feed > 0.0).all()
            lines = text.split("\n")
            # A line after one that continues isn't a statement of its own.
            own = [n for n, line in enumerate(lines, 1) if n == 1 or not re.search(r"\$", lines[n - 2])]
            points = {n for n in own if _POINT.match(lines[n - 1])}
            assert points <= set(path.source.tolist())


@st.composite
def broken(draw: st.DrawFn) -> str:
    """A real form with some characters changed, left out or added."""
    form = draw(st.sampled_from(FORMS))
    for _ in range(draw(st.integers(1, 2))):
        at = draw(st.integers(0, len(form)))
        cut = draw(st.integers(0, 2))
        form = form[:at] + draw(st.text("0159.,/-+$E ()GOTX", max_size=2)) + form[at + cut :]
    return form


@given(forms=st.lists(st.sampled_from(FORMS), max_size=8))
def test_real_forms_are_read_in_any_order(forms: list[str]):
    # A file that names Creo's words is read by Creo's rule for points on arcs, which keeps them rows, too.
    text = HEAD + "\n".join(forms)
    require_whole(text)
    assert sum(map(len, read_each(text, tool=Tool.ball(8)))) >= text.count("GOTO")


@given(
    lines=st.tuples(
        st.lists(st.sampled_from(FORMS), max_size=4), broken(), st.lists(broken(), max_size=1)
    ).map(lambda parts: [HEAD, *parts[0], parts[1], *parts[2]])
)
@example(lines=["GOTO/1e300,0,0", "CIRCLE/0,0,0,0,0,1", "GOTO/0,1e300,0"])
@example(lines=["GOTO/10,0,0", "MOVARC/0,0,0,0,0,1,10,ANGLE,1e300", "GOTO/0,10,0"])
@example(lines=["GOTO/1e308,0,0", "GODLTA/1e308,0,0"])
@example(lines=["GOTO/1,2,3", "CYCLE/DRILL,DEPTH,1e308,CLEAR,1e308", "GOTO/1,2,1e308,0,0,1e308"])
@example(lines=["MSYS/0,0,0,1e200,0,0,0,1e200,0", "GOTO/1,2,3"])
@example(lines=["CUTTER/1e308,1e308", "GOTO/1,2,3"])
@example(lines=["TLDATA/DRILL,MILL,10,0,80,-1e308,35", "GOTO/1,2,3"])
@example(lines=["TLDATA/MILL,10,5,1e-300,89.9999999,0", "GOTO/1,2,3"])
def test_every_goto_is_a_row_or_an_error(lines: list[str]):
    require_whole("\n".join(lines))


@given(start=st.integers(0, 12_000), lines=st.lists(broken(), max_size=3), at=st.integers(0, 30))
def test_a_broken_line_in_a_real_file_is_no_silent_loss(data: Path, start: int, lines: list[str], at: int):
    real = (data / "toolpaths" / "solidworks_boss_3axis.apt").read_text(encoding="ascii").splitlines()
    window = real[start : start + 30]
    require_whole("\n".join([*window[:at], *lines, *window[at:]]))


unit_vectors = (
    st.tuples(*[st.floats(-1, 1)] * 3)
    .filter(lambda v: float(np.linalg.norm(v)) > 0.1)
    .map(lambda v: np.array(v) / np.linalg.norm(v))
)
places = st.tuples(*[st.floats(-100, 100)] * 3).map(np.array)


def written(*numbers: float) -> str:
    return ",".join(f"{float(n)!r}" for n in np.concatenate([np.atleast_1d(n) for n in numbers]))


@given(
    axis=unit_vectors,
    centre=places,
    radius=st.floats(0.1, 200),
    sweep=st.floats(0.01, 6.27),
    rise=st.sampled_from([0.0, 3.0]),
)
@pytest.mark.parametrize("tail", ["", ",{}", ",{},.06,.5,10,1"])
def test_an_arc_keeps_to_its_circle(axis, centre, radius, sweep, rise, tail):
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    begin, end = (centre + radius * (rotation_matrix(axis, a) @ u) for a in (0.0, sweep))
    end = end + rise * axis
    # The long form of NX turns the other way about its vector.
    stated = -axis if tail.count(",") > 1 else axis
    circle = written(centre, stated) + tail.format(radius)
    path = read(f"GOTO/{written(begin)}\nCIRCLE/{circle}\nGOTO/{written(end)}\n", tool=Tool.ball(8))
    arms = path.tips(path.axis) - centre
    height = arms @ axis
    flat = arms - height[:, None] * axis
    np.testing.assert_allclose(np.linalg.norm(flat, axis=1), radius, atol=1e-9)
    angle = np.unwrap(np.arctan2(flat @ np.cross(axis, u), flat @ u))
    assert np.all(np.diff(angle) > 0)
    assert angle[-1] - angle[0] == pytest.approx(sweep, abs=1e-9)
    np.testing.assert_allclose(height - height[0], rise * (angle - angle[0]) / sweep, atol=1e-6)
    assert radius * (1 - np.cos(np.diff(angle).max() / 2)) <= PATH_TOLERANCE * (1 + 1e-6)


@given(
    frames=st.lists(st.tuples(unit_vectors, st.floats(-3, 3), places), min_size=2, max_size=2),
    points=st.lists(st.tuples(places, unit_vectors), min_size=1, max_size=5),
)
def test_one_place_in_two_frames_is_one_place(frames, points):
    text = []
    for axis, angle, origin in frames:
        rotation = rotation_matrix(axis, angle)
        text.append(f"MSYS/{written(origin, rotation[:, 0], rotation[:, 1])}")
        text += [
            f"GOTO/{written(rotation.T @ (place - origin), rotation.T @ vector)}" for place, vector in points
        ]
    path = read("\n".join(text), tool=Tool.ball(8))
    tips, n = path.tips(path.axis), len(points)
    np.testing.assert_allclose(tips[:n], tips[n:], atol=1e-9)
    np.testing.assert_allclose(path.axis[:n], path.axis[n:], atol=1e-9)
