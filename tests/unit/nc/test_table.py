"""Comma-separated points."""

import numpy as np
import pytest

from fiveaxis.base.errors import ToolpathError
from fiveaxis.model import MoveKind, Tool
from fiveaxis.nc import read_toolpath

BALL = Tool.ball(10)


@pytest.fixture
def read(tmp_path):
    def read_text(text, **options):
        path = tmp_path / "points.csv"
        path.write_text(text, encoding="utf-8")
        return read_toolpath(path, tool=BALL, **options)

    return read_text


def test_contacts_with_normals_place_the_ball_on_the_surface(read):
    path = read("x,y,z,nx,ny,nz\n1,2,3,0,0,2\n4,5,6,1,0,0\n")
    np.testing.assert_array_equal(path.contact, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(path.normal, [[0, 0, 1], [1, 0, 0]])
    np.testing.assert_array_equal(path.pivot, [[1, 2, 8], [9, 5, 6]])
    np.testing.assert_allclose(path.feed, 1000 / 60)
    assert path.source.tolist() == [2, 3]
    assert not path.has_axes


def test_tips_with_axes_place_the_ball_behind_the_tip(read):
    path = read("x,y,z,i,j,k,feed\n1,2,3,0,0,1,600\n4,5,6,-1,0,0,1200\n")
    np.testing.assert_array_equal(path.pivot, [[1, 2, 8], [-1, 5, 6]])
    np.testing.assert_array_equal(path.feed, [10, 20])
    assert path.has_axes
    assert not path.has_normals


def test_columns_may_stand_in_any_order_and_case(read):
    path = read("FEED, nz,ny,nx,Z,Y,X\n60,1,0,0,3,2,1\n")
    np.testing.assert_array_equal(path.contact, [[1, 2, 3]])
    assert path.feed.tolist() == [1.0]


def test_blank_lines_and_comments_are_skipped_and_still_counted(read):
    path = read("# from a scanner\n\nx,y,z,nx,ny,nz\n\n1,2,3,0,0,1\n  # second pass\n4,5,6,0,0,1\n\n")
    assert path.source.tolist() == [5, 7]


def test_a_feed_that_the_caller_gives_replaces_default_and_column(read):
    assert read("x,y,z,i,j,k\n1,2,3,0,0,1\n", feed_mm_min=300).feed.tolist() == [5.0]
    assert read("x,y,z,i,j,k,feed\n1,2,3,0,0,1,999\n", feed_mm_min=300).feed.tolist() == [5.0]


def test_inches_scale_positions_and_leave_the_feed(read):
    path = read("x,y,z,nx,ny,nz,feed\n1,2,3,0,0,1,600\n", unit="inch")
    np.testing.assert_allclose(path.contact, [[25.4, 50.8, 76.2]])
    assert path.feed.tolist() == [10.0]


@pytest.mark.parametrize("length", [1e-300, 1e-9, 1e6, 1e300])
def test_normals_of_any_length_are_normalised(read, length):
    path = read(f"x,y,z,nx,ny,nz\n0,0,0,0,{0.6 * length:.17g},{0.8 * length:.17g}\n")
    np.testing.assert_allclose(path.normal, [[0, 0.6, 0.8]], atol=1e-15)


def test_a_rounded_tool_vector_is_normalised(read):
    path = read("x,y,z,i,j,k\n0,0,0,0,0.6005,0.8\n")
    np.testing.assert_allclose(np.linalg.norm(path.axis, axis=1), 1.0, atol=1e-15)


@pytest.mark.parametrize(
    "rows",
    [
        "1;2;3,5;0;0;1\n4;-5,25;6;0;0,6;0,8",
        "1\t2\t3,5\t0\t0\t1\n4\t-5,25\t6\t0\t0,6\t0,8",
        "1\t2\t3.5\t0\t0\t1\n4\t-5.25\t6\t0\t0.6\t0.8",
        "1 2 3,5 0 0 1\n4 -5,25 6 0 0,6 0,8",
        "1, 2, 3.5, 0, 0, 1\n4, -5.25, 6, 0, 0.6, 0.8",
    ],
)
def test_fields_are_separated_as_spreadsheets_do(read, rows):
    for text, options in ((rows, {"columns": ("x", "y", "z", "i", "j", "k")}), (_with_head(rows), {})):
        path = read(text, **options)
        np.testing.assert_allclose(path.tips(path.axis), [[1, 2, 3.5], [4, -5.25, 6]], atol=1e-12)
        np.testing.assert_allclose(path.axis[1], [0, 0.6, 0.8])


def _with_head(rows):
    separator = next(sign for sign in (";", "\t", ", ", " ") if sign in rows)
    return separator.join("xyzijk") + "\n" + rows


def test_a_comma_that_may_be_decimal_or_of_thousands_is_refused(read):
    with pytest.raises(ToolpathError, match="csv:3: numbers with commas, in a list that has points too"):
        read("x;y;z;i;j;k\n1;2;3.5;0;0;1\n1,234;2;3;0;0;1\n")


NORMALS = "x,y,z,nx,ny,nz\n"
AXES = "x,y,z,i,j,k,feed\n"


@pytest.mark.parametrize(
    ("text", "line", "fault"),
    [
        ("", None, "is empty; a header is needed"),
        ("\n# nothing\n", None, "is empty"),
        ("\n" + NORMALS, 2, "has a header but no rows"),
        ("1,2,3,0,0,1\n1,2,4,0,0,1\n", 1, "starts with numbers; the first line must be a header"),
        ("x,y,z,nx,ny,n_z\n1,2,3,0,0,1\n", 1, "unknown column 'n_z'; the nearest known one is 'nz'"),
        ("x,y,z,nx,ny\n1,2,3,0,0\n", 1, "lacks nz"),
        ("x,y,z\n1,2,3\n", 1, "neither normals nor tool axes"),
        ("x,y,z,nx,ny,nz,i,j,k\n1,2,3,0,0,1,0,0,1\n", 1, "both normals and tool axes"),
        ("x,y,z,nx,ny,nz,x\n1,2,3,0,0,1,1\n", 1, "column 'x' appears twice"),
        (NORMALS + "1,2,3,0,0,1\n1,2,3,0,0\n", 3, "5 fields where the header has 6"),
        (NORMALS + "1,2,3,0,0\n1,2,3,0,0\n", 2, "5 fields where the header has 6"),
        (NORMALS + "1,2,3,0,0,1,\n", 2, "7 fields where the header has 6"),
        (NORMALS + "1,2,3,0,0,1\n\n1,two,3,0,0,1\n", 4, "'two' isn't a number"),
        (NORMALS + "1,,3,0,0,1\n", 2, "'' isn't a number"),
        (NORMALS + "1_0,2,3,0,0,1\n", 2, "'1_0' isn't a number"),
        (NORMALS + "1,2,nan,0,0,1\n", 2, "z = nan isn't a finite number"),
        (NORMALS + "1,2,3,0,0,1\n1,2,3,-inf,0,1\n", 3, "nx = -inf isn't a finite number"),
        (NORMALS + "1,2,3e9,0,0,1\n", 2, "is beyond 1e[+]06 mm; check the unit"),
        (NORMALS + "1,2,3,0,0,1\n1,2,3,0,0,0\n", 3, r"the normal \(nx, ny, nz\) has length 0"),
        (AXES + "1,2,3,0,0,0,100\n", 2, "has length 0, which is more than 0.001 away from 1"),
        (AXES + "1,2,3,0,0,1.002,100\n", 2, "has length 1.002, which is more than 0.001 away from 1"),
        (AXES + "1,2,3,0,0,1,100\n1,2,3,0,0,1,0\n", 3, "feed = 0 mm/min; it must be above 0"),
        (AXES + "1,2,3,0,0,1,-5\n", 2, "feed = -5 mm/min"),
    ],
)
def test_a_fault_is_named_with_its_line(read, text, line, fault):
    with pytest.raises(ToolpathError, match=fault) as caught:
        read(text)
    assert caught.value.line == line
    assert caught.value.file.endswith("points.csv")


def test_the_vase_is_read_as_numpy_reads_it(data, vase):
    path = read_toolpath(data / "cases" / "vase_overhang.csv", tool=vase.tool)
    np.testing.assert_allclose(path.pivot, vase.pivot, atol=1e-12)
    assert path.source.tolist() == list(range(2, 3602))


def test_a_fault_late_in_a_long_file_is_still_named(read):
    row = "1,2,3,0,0,1\n"
    with pytest.raises(ToolpathError, match=r"points\.csv:50002: 'x' isn't a number"):
        read(NORMALS + row * 50_000 + "x,2,3,0,0,1\n" + row)


def test_a_list_without_header_is_read_with_the_columns_that_the_caller_names(data):
    columns = ("x", "y", "z", "nx", "ny", "nz")
    path = read_toolpath(data / "toolpaths" / "guoxin_waypoints.txt", tool=BALL, columns=columns)
    assert len(path) == 7593
    assert path.source[-1] == 7593
    tilt = np.degrees(np.arccos(path.normal[:, 2]))
    assert (round(tilt.min()), round(tilt.max())) == (29, 144)


def test_a_list_without_header_is_not_guessed(data):
    with pytest.raises(ToolpathError, match=r"guoxin_waypoints.txt:1: .*the columns must be named"):
        read_toolpath(data / "toolpaths" / "guoxin_waypoints.txt", tool=BALL)


def test_blanks_and_commas_separate_the_fields_of_a_list_without_header(tmp_path):
    path = tmp_path / "points.txt"
    path.write_text("# by hand\n1 2\t3 0 0 1\n\n4, 5, 6, 0, 0, 1\n")
    read = read_toolpath(path, tool=BALL, columns=("x", "y", "z", "i", "j", "k"))
    np.testing.assert_allclose(read.tips(read.axis), [[1, 2, 3], [4, 5, 6]], atol=1e-12)
    assert read.source.tolist() == [2, 4]
    with pytest.raises(ToolpathError, match=r"points.txt:2: 6 fields where the header has 7"):
        read_toolpath(path, tool=BALL, columns=("x", "y", "z", "i", "j", "k", "feed"))


def test_a_rapid_move_has_its_own_column_and_touches_nothing(read):
    path = read("x,y,z,nx,ny,nz,rapid\n1,2,3,0,0,1,0\n4,5,6,0,0,1,1\n7,8,9,0,0,1,0\n", rapid=6000)
    assert path.kind.tolist() == [MoveKind.CUT, MoveKind.RAPID, MoveKind.CUT]
    assert np.isnan(path.contact[1]).all()
    assert path.feed[1] == 100.0
    both = read("x,y,z,i,j,k,cut,rapid\n1,2,3,0,0,1,1,0\n4,5,6,0,0,1,0,1\n4,5,9,0,0,1,0,0\n")
    assert both.kind.tolist() == [MoveKind.CUT, MoveKind.RAPID, MoveKind.LINK]


@pytest.mark.parametrize(
    ("row", "said"),
    [("1,2,3,0,0,1,1,1", "cut and rapid are both 1"), ("1,2,3,0,0,1,0,2", "rapid is 2; write 1 for a rapid")],
)
def test_a_rapid_move_that_cuts_is_refused(read, row, said):
    with pytest.raises(ToolpathError, match=rf":2: {said}"):
        read(f"x,y,z,i,j,k,cut,rapid\n{row}\n")
