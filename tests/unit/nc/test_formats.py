"""What a file holds, its reader, and findings on a path as a whole."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from fiveaxis.base.errors import SettingError, ToolpathError
from fiveaxis.base.findings import Severity
from fiveaxis.model import MoveKind, Tool, Toolpath, load_machine
from fiveaxis.nc import read_toolpath
from fiveaxis.nc.formats import kind_of, remark_on
from fiveaxis.nc.source import Source, load_source

BALL = Tool.ball(10)
GOLDEN = Path(__file__).parents[2] / "golden"
LISTS = {".apt": "apt", ".csv": "points"}
CUT, RAPID, LINK = MoveKind.CUT, MoveKind.RAPID, MoveKind.LINK
UP, SIDE = [0, 0, 1], [1, 0, 0]


@pytest.mark.parametrize("suffix", [".apt", ".cls", ".clsf", ".ncl", ".aptsource", ".APT"])
@pytest.mark.parametrize("packed", [False, True])
def test_every_apt_suffix_is_read_packed_or_not(tmp_path, suffix, packed):
    path = tmp_path / f"part.v2{suffix}{'.gz' if packed else ''}"
    path.write_bytes(gzip.compress(b"GOTO/1,2,3") if packed else b"GOTO/1,2,3")
    toolpath = read_toolpath(str(path), tool=BALL)
    assert len(toolpath) == 1
    assert toolpath.name == str(path)


def test_a_packed_table_is_read(tmp_path):
    path = tmp_path / "points.csv.gz"
    path.write_bytes(gzip.compress(b"x,y,z,i,j,k\n1,2,3,0,0,1\n"))
    assert len(read_toolpath(path, tool=BALL)) == 1


@pytest.mark.parametrize(("name", "fault"), [("part.prt", "unknown suffix '.prt'"), ("part", "no suffix")])
def test_a_file_of_no_kind_lists_the_known_suffixes(tmp_path, name, fault):
    (tmp_path / name).write_text("ISO-10303-21;\nHEADER;\n#10=CARTESIAN_POINT('',(0.,1.,2.));\n")
    with pytest.raises(ToolpathError, match=f"{fault}, and its lines are no .*; known: .csv, .txt, .apt, "):
        read_toolpath(tmp_path / name, tool=BALL)


@pytest.mark.parametrize("feed", [0.0, -1.0, float("nan"), float("inf")])
def test_a_feed_that_is_not_positive_is_refused(tmp_path, feed):
    with pytest.raises(SettingError, match="must be above 0"):
        read_toolpath(tmp_path / "a.csv", tool=BALL, feed_mm_min=feed)


def test_an_unknown_unit_is_refused(tmp_path):
    with pytest.raises(SettingError, match="unit = 'cm' is unknown; give 'mm' or 'inch'"):
        read_toolpath(tmp_path / "a.csv", tool=BALL, unit="cm")


def kind(text: str, name: str = "part") -> str:
    return kind_of(Source(name, text.split("\n")))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("# by hand\nX;Y;Z;I;J;K\n", "points"),
        ("1\t2\t3\t0\t0\t1\n", "points"),
        ("1,5 2,5 3,5 0 0 1\n", "points"),
        ("X,Y,Z,A,C,feed,time,source\n", "motion"),
        ("X,Y,Z,A,C,feed,time,source,location\n", "motion"),
        ("X,Y,Z,B,C,feed,time,source,kind,location\n", "motion"),
        ("PARTNO/IMPELLER\n$$ form-shaping code X1 Y2\nGOTO/1,2,3\n", "apt"),
        ("%\nO<X,Y,Z,I,J,K>\nG21 G90\n", "program"),
        ("N1 G00 X 0 . Y 0 Z 0\n", "program"),
        ("TRAORI\nA3=0 B3=0 C3=1\n", "program"),
        ("0 BEGIN PGM GOTO MM\n", "program"),
        ("Information: GOTO the shop, then\n%\n(FEDRAT/5)\nG1 X1 F60\n", "program"),
    ],
)
def test_content_tells_the_kind_whatever_the_name(text, found):
    names = ("part", "part.nc", "part.csv", "part.apt", "part.stp")
    assert {kind(text, name) for name in names} == {found}


@pytest.mark.parametrize("suffix", [".apt", ".csv", ".nc"])
def test_a_name_decides_where_nothing_is_told(suffix):
    found = {".apt": "apt", ".csv": "points", ".nc": "program"}[suffix]
    assert kind("hello\n", f"part{suffix}") == kind("", f"part{suffix.upper()}.gz") == found
    with pytest.raises(ToolpathError, match="no suffix, and its lines are no points"):
        kind("hello\n")


def test_every_file_of_our_own_is_told_without_its_name():
    files = [p.name for p in GOLDEN.glob("*_*.*") if p.suffix not in (".py", ".step")]
    told = {file: kind_of(Source("renamed", load_source(GOLDEN / file).lines)) for file in files}
    assert told == {
        file: "motion" if file.startswith("motion") else LISTS.get(Path(file).suffix, "program")
        for file in files
    }


def test_the_table_of_a_motion_is_a_path_on_its_machine(tmp_path):
    """G54 at the table's centre: with every axis but X at 0, the tip moves as X does."""
    file = tmp_path / "motion.txt"
    file.write_text("X;Y;Z;A;C;feed;time;source;kind\n0;0;5;0;0;600;0;1;1\n10;0;5;0;0;600;1;2;0\n")
    machine = load_machine("hayashi-640123")
    path = read_toolpath(file, tool=Tool.ball(10), machine=machine)
    assert path.tips(path.axis).tolist() == [[0, 0, 5], [10, 0, 5]]
    assert path.feed.tolist() == [10, 10]
    assert path.cutting.tolist() == [False, True]
    with pytest.raises(ToolpathError, match=r"is the table of a motion, .*; give the machine"):
        read_toolpath(file, tool=Tool.ball(10))


def path(axes, kinds):
    tips = np.arange(3 * len(axes)).reshape(-1, 3)
    return Toolpath.from_tips(tips, axes, Tool.ball(6), kind=kinds, name="part.apt")


def test_one_direction_is_a_3_axis_path():
    (finding,) = remark_on(path([UP, UP, UP], [RAPID, CUT, CUT]))
    assert finding.code == "no-simultaneous-path"
    assert finding.severity is Severity.NOTE
    assert finding.value == 1
    assert finding.place.file == "part.apt"
    assert "3-axis path: its cuts have one direction of the tool axis, (0, 0, 1);" in finding.message


def test_several_directions_that_change_in_the_air_are_a_3_2_path():
    (finding,) = remark_on(path([UP, UP, SIDE, SIDE, UP, UP], [RAPID, CUT, RAPID, CUT, LINK, CUT]))
    assert finding.value == 2
    assert "a 3+2 path: its cuts have 2 directions" in finding.message


def test_an_axis_that_changes_in_one_cut_is_simultaneous():
    assert remark_on(path([UP, UP, SIDE], [RAPID, CUT, CUT])) == ()
    assert remark_on(path([UP, SIDE], [RAPID, CUT])) == ()


def test_the_last_digit_of_an_axis_isnt_a_motion():
    (finding,) = remark_on(path([UP, [0, 1e-6, 1], UP], [CUT, CUT, CUT]))
    assert finding.value == 1


@pytest.mark.parametrize("kinds", [[RAPID, RAPID], [RAPID, LINK]])
def test_a_path_without_cuts_has_no_finding(kinds):
    assert remark_on(path([UP, UP], kinds)) == ()


def test_a_path_without_axes_has_no_finding():
    contacts = Toolpath.from_contacts([[0, 0, 0], [1, 0, 0]], [UP, UP], Tool.ball(6))
    assert remark_on(contacts) == ()
