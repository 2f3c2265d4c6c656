"""Blocks of Sinumerik 840D programs."""

from collections import Counter

import numpy as np
import pytest
from support.nc_blocks import about, one_by_one

from fiveaxis.base.errors import ToolpathError
from fiveaxis.nc.languages import tape
from fiveaxis.nc.languages.choice import SINUMERIK
from fiveaxis.nc.source import Source, load_source


def blocks_of(*lines, name="part.mpf", **options):
    return list(SINUMERIK.split(Source(name, list(lines)), **options))


def words_of(*lines):
    return dict(blocks_of(*lines)[-1].words)


def place(frame, *point):
    """Convert a point from the frame to the coordinates before."""
    return frame.rotation @ np.array(point, float) + frame.origin


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("X1.5 Y-.25 Z7.", {"X": 1.5, "Y": -0.25, "Z": 7.0}),
        ("x1y2", {"X": 1.0, "Y": 2.0}),
        ("X=1.5 Y=-2", {"X": 1.5, "Y": -2.0}),
        ("N10 G1 X = 3*2+1 F=100", {"X": 7.0, "F": 100.0}),
        (":10 X1", {"X": 1.0}),
        ("/X1", {"X": 1.0}),
        ("/3 N10 X1", {"X": 1.0}),
        ("N10 X 1 Y 2", {"X": 1.0, "Y": 2.0}),
        ("X1;Y2", {"X": 1.0}),
        ('X1 MSG("a;b") Y2 ; Z3', {"X": 1.0, "Y": 2.0}),
        ("G2 X1 Y2 I-.1 J.1", {"X": 1.0, "Y": 2.0, "I": -0.1, "J": 0.1}),
        ("G2 X1 Y2 CR=-5", {"X": 1.0, "Y": 2.0, "R": -5.0}),
        ("X10CR=5", {"X": 10.0, "R": 5.0}),
        ("T4 D1 S1000", {"T": 4.0, "D": 1.0, "S": 1000.0}),
        ("G4 F2.5", {"P": 2.5}),
    ],
)
def test_words_have_many_forms(text, words):
    assert words_of(text) == words


def test_lines_without_words_make_no_blocks():
    text = ("%_N_PART_MPF", ";$PATH=/_N_WKS_DIR", "", "N10 ;start", "N20", " ", "X1")
    assert [b.line for b in blocks_of(*text)] == [7]


def test_g_words_are_those_of_iso():
    [block] = blocks_of("G01 G700 G17 G90 G94 G54 G40")
    assert block.g == ("G1", "G20", "G17", "G90", "G94", "G54", "G40")
    assert [b.g for b in blocks_of("G710", "G71", "G70", "G971")] == [("G21",), ("G21",), ("G20",), ("G94",)]
    [block] = blocks_of("G60 G601 G64 FNORM SOFT COMPCAD ORIWKS ORIAXES FFWON M8 G9 FGROUP(X,Y,Z,B,C)")
    assert block.g == block.m == ()
    assert block.ignored == (
        *(
            "G60",
            "G601",
            "G64",
            "FNORM",
            "SOFT",
            "COMPCAD",
            "ORIWKS",
            "ORIAXES",
            "FFWON",
            "M8",
            "G9",
            "FGROUP",
        ),
    )


def test_g70_reports_that_its_feed_is_taken_in_inches():
    [block] = blocks_of("G70")
    assert [(f.code, f.place.line) for f in block.findings] == [("feed-unit-assumed", 1)]
    assert blocks_of("G700")[0].findings == ()


@pytest.mark.parametrize("text", ["SUPA G0 Z-1 D0", "G53 G0 Z-1 D0", "G0 G153 D0 Z-1"])
def test_machine_coordinates_are_those_of_g53(text):
    [block] = blocks_of(text)
    assert "G53" in block.g
    assert dict(block.words) == {"Z": -1.0, "D": 0.0}


def test_tcp_lasts_from_traori_to_trafoof():
    found = blocks_of("TRAORI", "TRAORI(1)", "G0 X1", "TRAFOOF")
    assert [b.tip_control for b in found] == [True, True, None, False]


def test_tool_directions_and_normals_are_vectors():
    [block] = blocks_of("G1 X1 A3=.1 B3=-.2 C3=.97 A5=0 B5=.6 C5=.8")
    assert block.vector == (0.1, -0.2, 0.97)
    assert block.normal == (0.0, 0.6, 0.8)
    [block] = blocks_of("X1 C3=1")
    assert block.vector == (0.0, 0.0, 1.0)


def test_single_words_may_be_incremental_or_absolute():
    [block] = blocks_of("X=IC(5) Y=AC(2*3) Z1 I=AC(1) J=AC(-7)")
    assert dict(block.words) == {"X": 5.0, "Y": 6.0, "Z": 1.0}
    assert (block.increments, block.absolutes) == ("X", "Y")
    assert block.centre == {"X": 1.0, "Y": -7.0}
    assert dict(blocks_of("I=IC(1) J2")[0].words) == {"I": 1.0, "J": 2.0}


@pytest.mark.parametrize(
    ("begin", "mode", "end"),
    [
        (350.0, "DC(10)", 370.0),
        (10.0, "DC(350)", -10.0),
        (-720.0, "DC(90)", -630.0),
        (1985.644, "DC(0)", 1985.644 + 174.356),
        (10.0, "ACP(350)", 350.0),
        (350.0, "ACN(340)", 340.0),
        (340.0, "ACN(350)", -10.0),
        (90.0, "DC(90)", 90.0),
        (90.0, "ACN(90)", 90.0),
    ],
)
def test_dc_acp_and_acn_give_the_end_angle(begin, mode, end):
    block = blocks_of(f"G0 C{begin}", "X1", f"G0 C={mode}")[-1]
    assert block.words["C"] == pytest.approx(end, abs=1e-9)
    assert block.absolutes == "C"


def test_dc_applies_after_increments_too():
    assert words_of("G0 C350", "G91 C15", "X1 C5", "G90 C=IC(-2)", "C=DC(10)")["C"] == pytest.approx(370.0)


def test_variables_have_values():
    text = (
        "DEF REAL _CAM, _X_HOME, SAFE=12.5",
        "DEF INT COUNT",
        "_X_HOME=-365. R1=5",
        "R2=R1*(2+1) _UNDECLARED=COUNT+1",
        "SUPA G0 X=_X_HOME Y=SAFE-R2 Z=_UNDECLARED",
    )
    assert words_of(*text) == {"X": -365.0, "Y": -2.5, "Z": 1.0}


def test_frames_replace_and_add():
    found = blocks_of("TRANS X10 Y=2*10", "AROT Z90", "ATRANS X1", "TRANS X5", "ROT", "TRANS")
    frames = [b.frame for b in found]
    assert [f.word for f in frames] == ["TRANS", "AROT", "ATRANS", "TRANS", "ROT", "TRANS"]
    np.testing.assert_allclose(place(frames[0], 1, 0, 0), [11, 20, 0])
    np.testing.assert_allclose(place(frames[1], 1, 0, 0), [10, 21, 0])
    np.testing.assert_allclose(place(frames[2], 1, 0, 0), [10, 22, 0])
    np.testing.assert_allclose(place(frames[3], 1, 0, 0), [6, 0, 0])
    np.testing.assert_allclose(place(frames[4], 1, 2, 3), [1, 2, 3])
    assert not any(b.words for b in found)


def test_three_angles_turn_about_z_then_the_turned_y_then_the_turned_x():
    [block] = blocks_of("ROT X20 Y30 Z40")
    expected = about("Z", 40) @ about("Y", 30) @ about("X", 20)
    np.testing.assert_allclose(block.frame.rotation, expected, atol=1e-15)
    steps = blocks_of("ROT Z40", "AROT Y30", "AROT X20")
    np.testing.assert_allclose(steps[-1].frame.rotation, expected, atol=1e-15)


def test_rpl_rotates_about_the_tool_axis():
    for plane, letter in (("G17", "Z"), ("G18", "Y"), ("G19", "X")):
        frame = blocks_of(plane, "ROT RPL=30")[-1].frame
        np.testing.assert_allclose(frame.rotation, about(letter, 30), atol=1e-15)


@pytest.mark.parametrize(
    ("mode", "order"), [(57, "XYZ"), (27, "ZYX"), (39, "ZXY"), (45, "XZY"), (30, "YZX"), (54, "YXZ")]
)
def test_a_swivelled_plane_turns_axis_by_axis(mode, order):
    *_, block = blocks_of(f'CYCLE800(1,"TC1",200000,{mode},10,20,30,15,25,35,1,2,3,-1,100,1)')
    rotation = about(order[0], 15) @ about(order[1], 25) @ about(order[2], 35)
    np.testing.assert_allclose(block.frame.rotation, rotation, atol=1e-15)
    np.testing.assert_allclose(block.frame.origin, [10, 20, 30] + rotation @ [1, 2, 3], atol=1e-12)
    assert block.vector == (0.0, 0.0, 1.0)
    assert block.tip_control is True


def test_a_swivelled_plane_is_new_additive_or_reset():
    lines = (
        "TRANS X5",
        'CYCLE800(0,"",0,57,0,0,0,90,0,0,0,0,0,-1)',
        "TRANS Z2",
        'CYCLE800(0,"",1,57,0,0,0,0,90,0,0,0,0,0)',
        "CYCLE800()",
    )
    _, _, new, shifted, added, left = blocks_of(*lines)
    np.testing.assert_allclose(place(new.frame, 0, 0, 1), [0, -1, 0], atol=1e-15)
    np.testing.assert_allclose(place(shifted.frame, 0, 0, 1), [0, -3, 0], atol=1e-15)
    np.testing.assert_allclose(place(added.frame, 0, 0, 1), [1, -2, 0], atol=1e-15)
    # Without a direction the control computes the plane and turns no axis.
    assert added.vector is None
    np.testing.assert_allclose(place(left.frame, 1, 2, 3), [1, 2, 3])
    assert left.tip_control is False
    assert blocks_of("TRAORI", 'CYCLE800(0,"0")')[-1].tip_control is True


def moves_of(blocks):
    return [(b.line, b.g, dict(b.words)) for b in blocks]


def test_a_modal_cycle_drills_at_every_position_until_it_is_cancelled():
    lines = ("G1 X0 F100", "MCALL CYCLE81(10,0,2,-5)", "X1 Y2", "M8", "Y3", "MCALL", "Y4")
    hole = [("G0", 2.0), ("G1", -5.0), ("G0", 10.0)]
    found = moves_of(blocks_of(*lines))
    assert found[2:6] == [(3, (), {"X": 1.0, "Y": 2.0}), *((3, (g,), {"Z": z}) for g, z in hole)]
    assert found[6] == (3, ("G1",), {})
    assert [line for line, *_ in found] == [1, 2, 3, 3, 3, 3, 3, 4, 5, 5, 5, 5, 5, 6, 7]


def test_a_single_cycle_drills_at_the_tool_and_restores_the_modal_state():
    found = moves_of(blocks_of("G91 G0 X5 F80", "G19", "CYCLE85(10,1,2,,6,.5,30,60)", "X1"))
    assert found[3:] == [
        (3, ("G90", "G0"), {"X": 3.0}),
        (3, ("G90", "G1"), {"X": -5.0, "F": 30.0}),
        (3, ("G4",), {"P": 0.5}),
        (3, ("G90", "G1"), {"X": 10.0, "F": 60.0}),
        (3, ("G91", "G0"), {"F": 80.0}),
        (4, (), {"X": 1.0}),
    ]


def test_a_tap_feeds_at_pitch_times_speed():
    found = blocks_of("G0 Z5", "CYCLE84(10,0,2,-8,,0,3,,1.25,0,400,400)")
    assert [b.words.get("F") for b in found if "G1" in b.g] == [500.0, 500.0]
    assert not any(f for b in found for f in b.findings)
    doubted = blocks_of("CYCLE84(10,0,2,-8)")
    assert [f.code for b in doubted for f in b.findings] == ["tap-feed-assumed"]


def test_what_a_cycle_leaves_open_is_reported():
    found = blocks_of("CYCLE81(.2,2.7,.2,2.5)", "CYCLE76(3,0,1,-2,,3,,,,)")
    assert [f.code for b in found for f in b.findings] == ["cycle-retracts-below", "cycle-as-hole"]
    assert found[0].findings[0].place.line == 1


def places_of(blocks):
    return [(b.line, b.words["X"]) for b in blocks if "X" in b.words]


@pytest.mark.parametrize(
    ("lines", "values"),
    [
        (("FOR R1=1 TO 3", "X=R1*10", "ENDFOR", "X=R1"), [10, 20, 30, 4]),
        (("FOR R1=3 TO 1", "X1", "FOR R2=1 TO 2", "X2", "ENDFOR", "ENDFOR", "X9"), [9]),
        (("FOR R1=1 TO 2", "FOR R2=1 TO 2", "X=R1*10+R2", "ENDFOR", "ENDFOR"), [11, 12, 21, 22]),
        (("R1=0", "REPEAT", "R1=R1+2", "X=R1", "UNTIL R1>=5"), [2, 4, 6]),
        (("R1=5", "WHILE (R1>3)", "X=R1", "R1=R1-1", "ENDWHILE", "X0"), [5, 4, 0]),
        (("N10 A: X1", "N20 X2", "N30 REPEAT A P=2", "X3"), [1, 2, 1, 2, 1, 2, 3]),
        (("A: X1", "X2", "ENDLABEL: X4", "X5", "REPEAT A", "X3"), [1, 2, 4, 5, 1, 2, 4, 3]),
        (("A: X1", "X2", "B: X3", "X4", "REPEAT A B P2"), [1, 2, 3, 4, 1, 2, 3, 1, 2, 3]),
        (("A: X1", "X2", "REPEATB A P=3"), [1, 2, 1, 1, 1]),
    ],
)
def test_counted_loops_and_repeated_parts_run(lines, values):
    assert [x for _, x in places_of(blocks_of(*lines))] == values


@pytest.mark.parametrize(
    "call",
    ["SUB", "SUB P1", 'CALL "SUB"', 'EXTCALL "D:\\NC\\SUB.SPF"', 'EXTCALL("_N_SUB_SPF")', "N5 SUB ; now"],
)
def test_a_subprogram_in_a_file_runs_where_it_is_called(tmp_path, call):
    (tmp_path / "Sub.spf").write_text("PROC SUB DISPLOF\nDEF REAL A1=5\nR1=R1+1\nX=R1 Y=A1\nM17\nX99\n")
    lines = ("R1=1", "DEF REAL A1=7", call, "X=R1 Y=A1")
    found = blocks_of(*lines, name=str(tmp_path / "main.mpf"))
    assert [(b.line, dict(b.words)) for b in found if b.words] == [
        (3, {"X": 2.0, "Y": 5.0}),
        (4, {"X": 2.0, "Y": 7.0}),
    ]
    assert not any(b.m for b in found)


def test_a_subprogram_by_number_runs_as_often_as_p_says(tmp_path):
    (tmp_path / "L12.SPF").write_text("X=IC(5)\nRET\n")
    found = blocks_of("X0", "L12 P3", "X1", name=str(tmp_path / "main.mpf"))
    assert [line for line, _ in places_of(found)] == [1, 2, 2, 2, 3]


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("PROC SUB(REAL X)", "which has parameters or restores modal words"),
        ("PROC SUB SAVE", "which has parameters or restores modal words"),
        ("X1 M30", "ends the program within one that is called; end that with M17 or RET"),
        ("SUB", "more than 20 calls and repetitions within one another"),
        ("IF R1==1 GOTOB A", "in SUB.SPF, line 1, 'IF R1==1 GOTOB A': IF jumps"),
    ],
)
def test_subprograms_that_are_not_certain_are_refused_with_the_line_of_the_call(tmp_path, text, fact):
    (tmp_path / "SUB.SPF").write_text(text)
    with pytest.raises(ToolpathError, match=r"main\.mpf:2: ") as caught:
        blocks_of("X0", "SUB", name=str(tmp_path / "main.mpf"))
    assert fact in str(caught.value)


@pytest.mark.parametrize(
    ("lines", "fact"),
    [
        (("REPEAT", "X1", "UNTIL 1>2"), "calls and repetitions"),
        (("R1=1", "FOR R2=1 TO R1", "R1=R1+1", "ENDFOR"), "the limit of R2 changes in the loop"),
        (("R1=0.1*3", "WHILE R1<>0.3", "ENDWHILE"), "differ by rounding only"),
        (("REPEAT B", "B: X1"), "repeats from B, which isn't before it"),
        (("A: X1", "A: X2", "REPEAT A"), "A, which stands in the program 2 times"),
        (("FOR R1=1 TO 2", "UNTIL R1>1"), "UNTIL ends no loop"),
    ],
)
def test_loops_that_are_not_certain_are_refused(monkeypatch, lines, fact):
    monkeypatch.setattr(tape, "MOST_JUMPS", 100)
    with pytest.raises(ToolpathError, match=fact):
        blocks_of(*lines)


def test_a_helix_has_additional_turns():
    [block] = blocks_of("G3 X10 Y0 Z-5 I-10 J0 TURN=3")
    assert block.turns == 3


@pytest.mark.parametrize("word", ["M30", "M17", "RET", "M2", "M02"])
def test_programs_end(word):
    assert blocks_of(word)[0].m in (("M30",), ("M2",), ("M17",))


def test_other_m_words_do_not_have_their_iso_meaning():
    [block] = blocks_of("M128 M428 M98 M1=3")
    assert block.m == ()
    assert block.ignored == ("M128", "M428", "M98", "M1")


def test_fixed_points_of_the_machine_are_omitted_with_a_note():
    [block] = blocks_of("G75 X1=0 Z1=0")
    assert not block.words
    assert [f.code for f in block.findings] == ["fixed-point-left-out"]
    assert not blocks_of("G25 X10 Y20")[0].words


def test_block_delete_skips_blocks_unread():
    found = blocks_of("/GOTOF X", "N5 /X1", "/2 Y1", "X2", block_delete=True)
    assert [b.skipped for b in found] == [True, True, True, False]


def test_work_offsets_are_zeros_by_name():
    assert [b.work_offset or b.g for b in blocks_of("G500", "G54", "G505", "G57")] == [
        *("G500", ("G54",), "G505", ("G57",)),
    ]


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("X1 X2", "X has two values, 1 and 2; write one of them"),
        ("X=1 X2", "X has two values"),
        ("A3=1 A3=0", "X has two values"),
        ("X1.5E3", "E3 isn't an axis, and numbers have no exponent"),
        ("X=1.5EX3", "EX3 isn't a supported word"),
        ("X1.2.3", "isn't a supported word"),
        ("X10 20", "'20' isn't a word"),
        ("X--1", "isn't a supported word"),
        ("X" + "1" * 50, "is longer than any number"),
        ("X=R7", "R7 has no value yet"),
        ("X=(1+2", "isn't closed"),
        ("X=IC(5", "the bracket of IC isn't closed"),
        ("X=DC(5)", "DC is for rotary axes, and X is none"),
        ("C=DC(400)", "must be an angle from 0 to 360 deg"),
        ("F=IC(5)", "IC applies to axes and centres"),
        ("G2 X5 Y0 I=AC(1) J2", "partly absolute, partly incremental"),
        ("CR=IC(5)", "IC applies to axes and centres"),
        ("TURN=1.5", "0 to 999 full turns"),
        ("A2=10", "gives the tool direction by angles"),
        ("LEAD=5", "gives the tool direction by angles"),
        ("CIP X1 Y2 I1=3 J1=4", "CIP is a curve, which isn't supported"),
        ("BSPLINE", "is a curve"),
        ("RND=2", "adds a chamfer or a rounding"),
        ("AP=45 RP=10", "is a polar coordinate"),
        ("G110 X0", "sets a pole"),
        ("G33 Z-5 K1", "cuts a thread"),
        ("G58 X5", "shifts the coordinates; write TRANS"),
        ("G77", "G77 isn't supported"),
        ("G0.5", "G0.5 isn't supported"),
        ("SCALE X2", "scales or mirrors"),
        ("MIRROR X0", "scales or mirrors"),
        ("TRANS C10", "TRANS takes numbers for X, Y, Z"),
        ("ROT Z10 G1", "and no other words"),
        ("TRANSMIT", "is an unsupported transformation"),
        ("GOTOF MARK", "jumps, repeats or calls"),
        ("IF R1==1 GOTOB A", "jumps, repeats or calls"),
        ("LOOP", "jumps, repeats or calls"),
        ("WHILE R1<5", "R1 has no value yet"),
        ("WHILE 5<1", "WHILE has no ENDWHILE"),
        ("WHILE R1", "isn't a comparison of two numbers"),
        ("FOR R1=1", "FOR takes a variable"),
        ("FOR R1=5 TO 1", "FOR has no ENDFOR"),
        ("ENDFOR", "ENDFOR ends no loop"),
        ("REPEAT MARK P=3", "MARK, which stands in the program 0 times"),
        ('EXTCALL "PART"', "no such file is beside the program"),
        ("L100", "calls a subprogram, whose file isn't beside the program"),
        ("X1 L100 P3", "or which has no block of its own"),
        ("MYSUB(1,2)", "MYSUB isn't a supported word, and may be a subprogram"),
        ("TURM=5", "TURM isn't a supported word, and may be a subprogram or an axis"),
        ("POCKET3(1,2)", "is a cycle, which isn't expanded"),
        ("CYCLE76(3,0,1,-2,,3,4)", "mills a spigot"),
        ("CYCLE81(10,0,2)", "needs RTP, RFP, and DP or DPR"),
        ("CYCLE81(10,0,2,5)", "begins at 2 and ends at 5, above it"),
        ('CYCLE81("A",0,2,5)', "'A' where a number is expected"),
        ("CYCLE81(10,0", "a bracket isn't closed"),
        ('CYCLE800(1,"TC",0,192,0,0,0,10,20,0)', "mode 192 (rotary axes direct) isn't supported"),
        ('CYCLE800(1,"TC",0,64,0,0,0,10,20,0)', "mode 64 (solid angle) isn't supported"),
        ('CYCLE800(1,"TC",0,1,0,0,0,10,20,0)', "names no axis for one of its angles"),
        ("$P_UIFR[1]=0", "is a system variable"),
        ("R[1]=5", "is an array element"),
        ("X1=5", "X1 isn't a supported word, and may be a subprogram or an axis"),
        ('MYTEXT="A"', "is assigned a text"),
        ("G4 S30", "G4 takes F in seconds"),
        ("DEF FRAME F1", "DEF is supported with REAL"),
        ("DEF REAL 5", "isn't a name that can be declared"),
        ("M1.5", "isn't an M word"),
        ("ſ100", "isn't a word"),
        ("X١", "isn't a supported word"),
        ("X#1", "isn't a supported word"),
        ("{", "isn't a word"),
        ("X1 " * 2000, "characters, beyond 4096"),
    ],
)
def test_unsupported_lines_are_refused_with_their_line_and_reason(text, fact):
    with pytest.raises(ToolpathError) as caught:
        blocks_of("G0 X0", text)
    assert str(caught.value).startswith("part.mpf:2: ")
    assert fact in str(caught.value)


def test_a_line_of_ten_megabytes_is_refused_quickly_and_briefly():
    with pytest.raises(ToolpathError, match="characters, beyond 4096") as caught:
        blocks_of("X1 Y2 " * 1_700_000)
    assert len(str(caught.value)) < 300


def test_the_nx_program_of_a_dmu_70_is_read_to_its_last_block(data):
    source = load_source(data / "toolpaths" / "nx_dmu70_840d_traori_inch.mpf")
    found = list(one_by_one(SINUMERIK.split(source)))
    written = [n for n, text in enumerate(source.lines, start=1) if text.strip() and ";" not in text]
    assert sorted({b.line for b in found}) == written
    assert found[-1].m == ("M2",) or found[-1].m == ("M30",)
    assert sum(b.tip_control is True for b in found) == 26
    assert max(b.words.get("C", 0.0) for b in found) == 1985.644
    assert sum("G53" in b.g for b in found) == 42
    lines = Counter(b.line for b in found)
    drilled = [n for n, count in lines.items() if count > 1]
    assert len(drilled) == 35
    depths = {b.words["Z"] for b in found if b.line in drilled and b.g == ("G1",) and "Z" in b.words}
    assert depths == {2.5311, 1.7717, 1.9685, 1.6694, 1.5473, *(0.2362, 0.1181)}  # and back at feed
    assert {f.code for b in found for f in b.findings} == {
        *("feed-unit-assumed", "cycle-retracts-below", "tap-feed-assumed", "cycle-as-hole"),
    }


def test_the_program_of_a_turned_cross_is_read_to_its_last_block(data):
    source = load_source(data / "toolpaths" / "spinner_achskreuz_840D_mm.mpf")
    found = list(one_by_one(SINUMERIK.split(source)))
    code = [text.partition(";")[0].split() for text in source.lines]
    assert [b.line for b in found] == [n for n, words in enumerate(code, start=1) if len(words) > 1]
    assert sum(b.frame is not None for b in found) == 63
    assert sum(b.tip_control is True for b in found) == 21
    assert {b.words["Z"] for b in found if "G53" in b.g and "Z" in b.words} == {610.0}
    last = next(b for b in reversed(found) if b.frame is not None and b.frame.word == "AROT")
    assert np.linalg.det(last.frame.rotation) == pytest.approx(1.0)


def test_a_tool_in_a_swivelled_plane_keeps_its_direction_until_angles_are_named():
    found = blocks_of('CYCLE800(0,"",10,57,0,0,0,0,0,0,0,0,0,-1)', "G0 X1", "G0 X1 A5 C5", "G1 X2 A6")
    assert [(b.tip_control, b.vector) for b in found] == [
        *((True, (0.0, 0.0, 1.0)), (None, None), (False, None), (None, None)),
    ]
    assert blocks_of("TRAORI", 'CYCLE800(0,"",0,57,0,0,0,0,0,0,0,0,0,-1)', "X1 A5 C5")[-1].tip_control is True


def test_a_swivel_without_tcp_discards_the_position():
    """By a block in axis coordinates."""
    lost, _ = blocks_of('CYCLE800(0,"",0,57,0,0,0,0,30,0,0,0,0,-1)')
    assert (lost.tip_control, lost.vector, tuple(lost.frame.origin)) == (False, None, (0.0, 0.0, 0.0))
    assert len(blocks_of('CYCLE800(0,"",10,57,0,0,0,0,30,0,0,0,0,-1)')) == 1
    # The retract before it is in machine coordinates.
    assert len(blocks_of('CYCLE800(1,"",10,57,0,0,0,0,30,0,0,0,0,-1)')) == 2
