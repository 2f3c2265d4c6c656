"""The table of readers."""

from __future__ import annotations

import gzip

import pytest

from fiveaxis.errors import SettingError, ToolpathError
from fiveaxis.nc import read_toolpath
from fiveaxis.toolpath import Tool

BALL = Tool.ball(10)


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


@pytest.mark.parametrize(("name", "fault"), [("part.stp", "unknown suffix '.stp'"), ("part", "no suffix")])
def test_a_file_of_no_kind_lists_the_known_suffixes(tmp_path, name, fault):
    (tmp_path / name).write_text("ISO-10303-21;\nHEADER;\n#10=CARTESIAN_POINT('',(0.,1.,2.));\n")
    with pytest.raises(ToolpathError, match=f"{fault}, and its lines are no .*; known: .csv, .txt, .apt, "):
        read_toolpath(tmp_path / name, tool=BALL)


@pytest.mark.parametrize("feed", [0.0, -1.0, float("nan"), float("inf")])
def test_a_feed_that_is_not_positive_is_refused(tmp_path, feed):
    with pytest.raises(SettingError, match="must be a positive number"):
        read_toolpath(tmp_path / "a.csv", tool=BALL, feed_mm_min=feed)


def test_an_unknown_unit_is_refused(tmp_path):
    with pytest.raises(SettingError, match="unit = 'cm' is unknown; give 'mm' or 'inch'"):
        read_toolpath(tmp_path / "a.csv", tool=BALL, unit="cm")
