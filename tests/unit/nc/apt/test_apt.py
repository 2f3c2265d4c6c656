"""APT cutter locations."""

import gzip

import numpy as np
import pytest
from support.whole_files import each_path

from fiveaxis.base.errors import ToolpathError
from fiveaxis.base.findings import Severity
from fiveaxis.model import MoveKind, Tool
from fiveaxis.nc import read_toolpath

BALL = Tool.ball(10)
CUT, RAPID = MoveKind.CUT, MoveKind.RAPID


def tips(path):
    return path.tips(path.axis)


def feeds(path):
    return np.round(path.feed * 60, 9).tolist()


def test_tool_vectors_stay_in_force_and_begin_upright(read):
    path = read("GOTO/1,2,3\nGOTO/4,5,6,1,0,0\nGOTO/7,8,9\n")
    np.testing.assert_allclose(tips(path), [[1, 2, 3], [4, 5, 6], [7, 8, 9]])
    np.testing.assert_array_equal(path.axis, [[0, 0, 1], [1, 0, 0], [1, 0, 0]])
    assert path.source.tolist() == [1, 2, 3]


def test_words_may_be_small_and_spaced(read):
    path = read("goto / 1.0 ,  2.5,-3E0 , 0.0,0.0, 1.\n")
    np.testing.assert_allclose(tips(path), [[1, 2.5, -3]])


def test_a_dollar_continues_a_statement_and_two_begin_a_comment(read):
    path = read("$$ GOTO/9,9,9\nGOTO/1,2,$ the rest\n$$ in between\n 3,0,$\n0,1 $$ done\nGOTO/4,5,6\n")
    np.testing.assert_allclose(tips(path), [[1, 2, 3], [4, 5, 6]])
    assert path.source.tolist() == [2, 6]


def test_rapid_holds_for_one_location(read):
    path = read("FEDRAT/100,MMPM\nRAPID\nGOTO/1,2,3\nGOTO/1,2,4\nRAPID/\nFEDRAT/50\nGOTO/1,2,5\nGOTO/1,2,6\n")
    assert path.kind.tolist() == [RAPID, CUT, RAPID, CUT]
    assert feeds(path) == [100, 100, 50, 50]


def test_from_is_a_first_location_in_rapid(read):
    path = read("FROM/0,0,100,0,0,1\nFEDRAT/100\nGOTO/1,2,3\n")
    assert path.kind.tolist() == [RAPID, CUT]
    assert tips(path)[0].tolist() == [0, 0, 100]


def test_a_location_before_the_first_feed_takes_that_one(read):
    assert feeds(read("GOTO/1,2,3\nFEDRAT/MMPM,250.0000\nGOTO/1,2,4\nFEDRAT/99\nGOTO/1,2,5\n")) == [
        250,
        250,
        99,
    ]
    assert feeds(read("GOTO/1,2,3\nFEDRAT/250\nFEDRAT/99\n")) == [250]


def test_a_path_without_any_feed_takes_1000(read):
    assert feeds(read("GOTO/1,2,3\n")) == [1000]


def test_a_feed_that_the_caller_gives_replaces_all(read):
    path = read("GOTO/1,2,3\nFEDRAT/0.1,MMPR\nGOTO/1,2,4\n", feed_mm_min=333)
    assert feeds(path) == [333, 333]


@pytest.mark.parametrize(
    ("statement", "feed"),
    [
        ("FEDRAT/411.48,MMPM", 411.48),
        ("FEDRAT/MMPM,411.48", 411.48),
        ("FEDRAT/10,IPM", 254),
        ("FEDRAT/10", 254),
        ("FEDRAT/10,PERMIN", 254),
        ("SPINDL/12000,RPM,CLW\nFEDRAT/0.01,MMPR", 120),
        ("SPINDL/RPM,-12000,CCLW,RANGE,2\nFEDRAT/0.01,MMPR", 120),
        ("SPINDL/RPM,500\nSPINDL/ON\nFEDRAT/IPR,.002", 25.4),
    ],
)
def test_feeds_come_out_in_mm_per_minute(read, statement, feed):
    assert feeds(read(f"UNITS/INCHES\n{statement}\nGOTO/1,2,3\n")) == [feed]


@pytest.mark.parametrize("word", ["UNIT/INCHES", "UNITS/INCH", "UNITS / IN"])
def test_inches_become_mm(read, word):
    np.testing.assert_allclose(tips(read(f"{word}\nGOTO/1,2,-3\n")), [[25.4, 50.8, -76.2]])


def test_the_caller_names_the_unit_of_a_file_that_does_not(read):
    np.testing.assert_allclose(tips(read("GOTO/1,2,3\n", unit="inch")), [[25.4, 50.8, 76.2]])
    np.testing.assert_allclose(tips(read("FEDRAT/10,IPM\nGOTO/1,2,3\n", unit="mm")), [[1, 2, 3]])


def test_the_same_unit_stated_twice_is_accepted(read):
    assert len(read("GOTO/1,2,3\nUNITS/MM\nGOTO/1,2,3\nUNITS/MM\n")) == 2


def test_unused_words_are_counted(read):
    path = read(
        "PARTNO/A part\nPPRINT see a/b and GOTO/1,2,3\nPPRINT x\nTLDATA/MILL,32.0,5.0\nSPINDL/100,RPM\n"
        "COOLNT/ON\nCYCLE/OFF\nMSYS/0,0,0,1,0,0,0,1,0\nCOOLNT/OFF\nTOOL PATH/FINISH,TOOL,B10\nGOTO/1,2,3\n"
        "FINI\n"
    )
    assert path.ignored == {
        "COOLNT": 2, "FINI": 1, "MSYS": 1, "PARTNO": 1, "PPRINT": 2, "SPINDL": 1, "TOOL PATH": 1,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "line", "fault"),
    [
        ("PARTNO/1\nFINI\n", None, "no GOTO"),
        ("FROM/1,2,3\n", None, "no GOTO"),
        ("GOTO/1,2,3\nGOTO/1,2\n", 2, "'GOTO/1,2' has 2 numbers; it needs 3, or 6 with a tool vector"),
        ("GOTO/1,2,3,4\n", 1, "has 4 numbers"),
        ("GOTO/1,2,3,0,1\n", 1, "has 5 numbers"),
        ("GOTO/1,2,\n", 1, "'GOTO/1,2,' has a field that isn't a number"),
        ("GOTO/\n", 1, "isn't a number"),
        ("GOTO/P1\n", 1, "isn't a number"),
        ("GOTO/1,2,3_0\n", 1, "isn't a number"),
        ("GOTO/1,2,nan\n", 1, "z = nan isn't a finite number"),
        ("GOTO/1,2,3\nGOTO/1e300,2,3\n", 2, "is beyond 1e[+]06 mm"),
        ("GOTO/1,2,3,0,0,0\n", 1, "length 0, which is more than 0.001 away from 1"),
        ("GOTO/1,2,3\nGOTO/1,2,3,0,1,1\nGOTO/1,2,3\n", 2, "length 1.41421"),
        ("GOTO/1,2,3,0,0,1e300\n", 1, "which is more than 0.001"),
        ("GOTO/1,2,3,0,0,inf\n", 1, "k = inf isn't a finite number"),
        ("GOTO/1,2,3\nGOTO/1,$\n\n", 2, "the file ends inside the statement 'GOTO/1,'"),
        ("P1) GOTO/1,2,3\n", 1, "isn't understood; write GOTO/x,y,z"),
        ("TLLFT,GOFWD/ (CIRCLE/1,2,3,4)\n", 1, "is a curve that isn't supported"),
        ("NURBS/\n", 1, "is a curve that isn't supported"),
        ("GODLTA/0,0,5\n", 1, "'GODLTA/0,0,5' has no location before it"),
        ("GOTO/1,2,3\nGODLTA/0,5\n", 2, "has 2 numbers; it needs 1, 3 or 6"),
        ("GOTO/1,2,3\nGOMILL/5\n", 2, "isn't understood"),
        ("GOTO/1,2,3\n 4,5,6\n", 2, "'4,5,6' has no word; continue a statement with [$]"),
        ("GOTO/1,2,3\nOTO/1,2,4\n", 2, "'OTO/1,2,4' isn't known, and GOTO would move the tool"),
        ("GOTO/1,2,3\nCIRCL/1,2,4\n", 2, "CIRCLE would move the tool"),
        ("ROTABL/90,CLW\n", 1, "turns or moves the coordinate system"),
        ("SET/MODE,INCR\n", 1, "makes coordinates incremental"),
        ("MODE/INCR\n", 1, "makes coordinates incremental"),
        ("GOTO/1,2,3\nDNTCUT\n", 2, "hides the moves that follow"),
        ("RETRCT\n", 1, "moves the tool to a height that isn't stated"),
        ("CALSUB/1\n", 1, "repeats or moves other statements"),
        ("TLAXIS/NORMPS\n", 1, "isn't a number"),
        ("TLAXIS/0,1\n", 1, "needs a tool vector of 3 numbers"),
        ("COPY/1,TRANSL,1,0,0,3\n", 1, "repeats or moves other statements"),
        ("FEDRAT/0\n", 1, "feed = 0 mm/min; it must be a number above 0"),
        ("FEDRAT/-5,MMPM\n", 1, "feed = -5 mm/min"),
        ("FEDRAT/inf\n", 1, "feed = inf mm/min"),
        ("FEDRAT/MMPM\n", 1, "one number and at most one unit"),
        ("FEDRAT/\n", 1, "one number and at most one unit"),
        ("FEDRAT/1,2\n", 1, "one number and at most one unit"),
        ("FEDRAT/1,INVERS\n", 1, "'INVERS' isn't known; known: MMPM"),
        ("SPINDL/OFF\nFEDRAT/0.1,MMPR\n", 2, "counts per revolution, and no SPINDL before it gives rev/min"),
        ("SPINDL/100,SFM\nFEDRAT/0.1,MMPR\n", 2, "counts per revolution"),
        ("SPINDL/RPM,100,200,CLW\nFEDRAT/0.1,MMPR\n", 2, "counts per revolution"),
        ("UNITS/FEET\n", 1, "UNITS/FEET isn't known"),
        ("UNITS\n", 1, "isn't known"),
        ("GOTO/1,2,3\nUNITS/INCHES\n", 2, "mixed units: inch here, and mm from line 1 on"),
        ("FEDRAT/5\nUNITS/INCHES\n", 2, "mixed units: inch here, and mm from line 1 on"),
        ("UNITS/MM\nGOTO/1,2,3\nUNITS/INCHES\n", 3, "mixed units: inch here, and mm from line 1 on"),
        ("FEDRAT/10,IPM\nGOTO/1,2,3\n", 1, "a feed in inches, in a file without UNITS"),
        ("MSYS/0,0,0\nGOTO/1,2,3\nMSYS/0,0,1\nGOTO/1,2,3\n", 3, "changes the frame given on line 1"),
    ],
)
def test_a_fault_is_named_with_its_line(read, text, line, fault):
    with pytest.raises(ToolpathError, match=fault) as caught:
        read(text)
    assert caught.value.line == line
    assert caught.value.file.endswith("part.apt")


def test_the_callers_unit_replaces_the_files_and_is_told(read):
    path = read("UNITS/MM\nFEDRAT/10\nGOTO/1,2,3\n", unit="inch")
    np.testing.assert_allclose(tips(path), [[25.4, 50.8, 76.2]])
    np.testing.assert_allclose(path.feed, 254 / 60)
    [told] = [f for f in path.findings if f.code == "unit-overridden"]
    assert (told.place.line, told.message) == (
        1,
        "the file states mm, and is read in inch as asked for: cuts over 0 mm at up to F254 mm/min as "
        "inch, cuts "
        "over 0 mm at up to F10 mm/min as mm",
    )


def test_a_frame_stated_again_is_accepted(read):
    assert len(read("MSYS/0,0,0\nMSYS/0,0,1\nGOTO/1,2,3\nMSYS/0,0,1\nGOTO/1,2,3\n")) == 2


@pytest.mark.parametrize(
    ("name", "count", "rapids", "vectors", "paint", "last_line"),
    [("nx_ust_a.cls", 546, 38, 120, 70, 659), ("nx_ust_a2.cls.gz", 20057, 459, 4660, 1718, 22239)],
)
def test_an_nx_file_is_read_completely(data, name, count, rapids, vectors, paint, last_line):
    # The figures were counted with grep and awk: GOTO, GOTO after RAPID, GOTO with six numbers.
    path = read_toolpath(data / "toolpaths" / name, tool=BALL)
    assert len(path) == count
    assert int((path.kind == RAPID).sum()) == rapids
    assert path.ignored["PAINT"] == paint
    assert set(feeds(path)) == {250.0}
    np.testing.assert_allclose(tips(path)[[0, -1]], [[0, 222.6719, -177.5], [784, 3.6875, -97.5]], atol=1e-9)
    np.testing.assert_allclose(path.axis[[0, -1]], [[0, 0, -1], [0, 0, -1]])
    assert path.source[[0, -1]].tolist() == [11, last_line]
    assert path.axis[:, 2].max() < 0.0, "MSYS has Z down"
    lines = _plain_lines(data / "toolpaths" / name)
    assert sum(line.count(",") == 5 for line in lines if line.startswith("GOTO")) == vectors
    own = [[float(f) for f in line[5:].split(",")[:3]] for line in lines if line.startswith("GOTO")]
    np.testing.assert_allclose(tips(path), own, atol=1e-9)


def _plain_lines(path):
    data = path.read_bytes()
    return (gzip.decompress(data) if path.suffix == ".gz" else data).decode("ascii").splitlines()


def test_a_solidworks_file_is_read_completely(data):
    # Counted with grep: 9 814 GOTO, of which 775 come after RAPID and 1 026 after CIRCLE; 8 CSYS, 162 CUTCOM.
    name = data / "toolpaths" / "solidworks_boss_3axis.apt"
    paths = each_path(name)
    path, source = paths[-1], np.concatenate([path.source for path in paths])
    lines = _plain_lines(name)
    gotos = [n for n, line in enumerate(lines, start=1) if line.startswith("GOTO")]
    assert len(gotos) == 9814
    assert sorted(set(source.tolist())) == gotos, "every GOTO is a row, and nothing else is"
    last = np.append(source[1:] != source[:-1], True)
    own = [[float(f) for f in lines[n - 1][5:].split(",")[:3]] for n in gotos]
    np.testing.assert_allclose(np.concatenate([tips(path) for path in paths])[last], own, atol=1e-9)
    assert sum(int((path.kind == RAPID).sum()) for path in paths) == 775
    arcs = [n for n in gotos if lines[n - 2].startswith("CIRCLE")]
    assert len(arcs) == 1026
    assert set(source[~last].tolist()) <= set(arcs), "only arcs have points in between"
    assert [str(path.tool) for path in paths] == ["flat:6", "flat:20", "flat:6", "flat:20"]
    assert path.ignored["CSYS"] == 8
    assert path.ignored["CUTCOM"] == 162
    assert path.axis[-1].tolist() == [1, 0, 0]


def test_the_negative_control_is_reported_as_not_simultaneous(data):
    paths = each_path(data / "toolpaths" / "solidworks_boss_3axis.apt")
    assert [path.operation.kind for path in paths] == ["3-axis", "3-axis", "3+2", "3+2"]
    for path in paths:
        (finding,) = [f for f in path.findings if f.code == "no-simultaneous-path"]
        assert finding.severity is Severity.NOTE
        assert finding.value == 1
    for name in ("nx_ust_a.cls", "nx_ust_a2.cls.gz"):
        others = read_toolpath(data / "toolpaths" / name).findings
        assert "no-simultaneous-path" not in [f.code for f in others]


def codes(path):
    return sorted(f.code for f in path.findings)


def test_increments_start_at_the_last_location(read):
    path = read("GOTO/1,2,3,0,1,0\nGODLTA/1,1,1\nRAPID\nGODLTA/5\nGODLTA/0,0,1,1,0,0\n")
    np.testing.assert_allclose(tips(path), [[1, 2, 3], [2, 3, 4], [2, 8, 4], [2, 8, 5]])
    assert path.kind.tolist() == [CUT, CUT, RAPID, CUT]
    assert path.axis[-1].tolist() == [1, 0, 0]


def test_a_home_position_is_a_rapid_move(read):
    path = read("GOTO/1,2,3\nGOHOME/1,2,50\nGOHOME\n")
    np.testing.assert_allclose(tips(path), [[1, 2, 3], [1, 2, 50]])
    assert path.kind.tolist() == [CUT, RAPID]
    assert path.ignored == {"GOHOME": 1}


def test_tlaxis_is_the_vector_of_what_is_not_multiaxis(read):
    path = read("TLAXIS/0,1,0\nGOTO/1,2,3\nMULTAX\nGOTO/1,2,3,1,0,0\nGOTO/1,2,4\nMULTAX/OFF\nGOTO/1,2,5\n")
    np.testing.assert_array_equal(path.axis, [[0, 1, 0], [1, 0, 0], [1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    "statement", ["SET/MODE,ABSOL", "SET/HOLDER,5", "MODE/MILL", "THREAD/OFF", "TRACUT/NOMORE"]
)
def test_words_that_confirm_what_holds_anyway_are_counted(read, statement):
    path = read(f"{statement}\nGOTO/1,2,3\n")
    assert sum(path.ignored.values()) == 1


def test_exponents_are_read(read):
    np.testing.assert_allclose(tips(read("GOTO/1.5E-3,-2e+2,3.E0\n")), [[0.0015, -200, 3]])


def test_what_is_assumed_is_a_finding(read):
    path = read("GOTO/1,2,3\nGOTO/1,2,4\nFEDRAT/100,MMPM\nGOTO/1,2,5,1,0,0\nGOTO/1,2,6,0,1,0\n")
    assert codes(path) == ["axis-assumed", "feed-assumed", "unit-assumed"]
    by_code = {f.code: f for f in path.findings}
    assert by_code["feed-assumed"].message.startswith("2 cuts have no FEDRAT before them; 100 mm/min")
    assert by_code["feed-assumed"].place.line == 1
    assert by_code["axis-assumed"].message.startswith("2 locations come before the first tool vector")
    stated = read("UNITS/MM\nFEDRAT/100,MMPM\nGOTO/1,2,5,1,0,0\nGOTO/1,2,6,0,1,0\n")
    assert codes(stated) == []


def test_cutter_compensation_is_remarked_on_once(read):
    path = read("GOTO/1,2,3,0,0,1\nCUTCOM/LEFT\nGOTO/1,2,4,0,1,0\nCUTCOM/OFF\nCUTCOM/RIGHT\n")
    assert codes(path).count("cutter-compensation") == 1
    assert path.ignored["CUTCOM"] == 3
    assert "cutter-compensation" not in codes(read("CUTCOM/OFF\nGOTO/1,2,3\n"))
