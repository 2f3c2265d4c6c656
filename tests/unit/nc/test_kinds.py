"""What a file holds, told from its content."""

from __future__ import annotations

from pathlib import Path

import pytest

from fiveaxis.errors import ToolpathError
from fiveaxis.machine import load_machine
from fiveaxis.nc import read_toolpath
from fiveaxis.nc.kinds import kind_of
from fiveaxis.nc.source import Source, load_source
from fiveaxis.toolpath import Tool

GOLDEN = Path(__file__).parents[2] / "golden"
LISTS = {".apt": "apt", ".csv": "points"}


def kind(text: str, name: str = "part") -> str:
    return kind_of(Source(name, text.split("\n")))


@pytest.mark.parametrize("name", ["part", "part.nc", "part.csv", "part.apt", "part.stp"])
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
def test_content_tells_the_kind_whatever_the_name(name, text, found):
    assert kind(text, name) == found


@pytest.mark.parametrize("suffix", [".apt", ".csv", ".nc"])
def test_a_name_decides_where_nothing_is_told(suffix):
    found = {".apt": "apt", ".csv": "points", ".nc": "program"}[suffix]
    assert kind("hello\n", f"part{suffix}") == kind("", f"part{suffix.upper()}.gz") == found
    with pytest.raises(ToolpathError, match="no suffix, and its lines are no points"):
        kind("hello\n")


@pytest.mark.parametrize("file", sorted(p.name for p in GOLDEN.glob("*_*.*") if p.suffix != ".py"))
def test_every_file_of_our_own_is_told_without_its_name(file):
    expected = "motion" if file.startswith("motion") else LISTS.get(Path(file).suffix, "program")
    assert kind_of(Source("renamed", load_source(GOLDEN / file).lines)) == expected


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
