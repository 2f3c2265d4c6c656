"""Blocks of Heidenhain Klartext programs."""

import numpy as np
import pytest
from support.nc_blocks import about, one_by_one

from fiveaxis.base.errors import ToolpathError
from fiveaxis.nc.languages import tape
from fiveaxis.nc.languages.choice import KLARTEXT
from fiveaxis.nc.source import Source


def blocks_of(*lines, name="part.h", **options):
    return list(KLARTEXT.split(Source(name, list(lines)), **options))


def last(*lines):
    return blocks_of(*lines)[-1]


def place(frame, *point):
    """Convert a point from the frame to the coordinates before."""
    return frame.rotation @ np.array(point, float) + frame.origin


@pytest.mark.parametrize(
    ("text", "g", "words"),
    [
        ("12 L X+1.5 Y-2 Z+3 A+10 C-20 R0 F500", ("G1",), dict(X=1.5, Y=-2, Z=3, A=10, C=-20, F=500)),
        ("L X1 R0 FMAX", ("G0",), dict(X=1)),
        ("L X+1 R0 F MAX M3", ("G0",), dict(X=1)),
        ("  7  l x+1 y-.5 fmax", ("G0",), dict(X=1, Y=-0.5)),
        ("L X+1,5 Y-0,25", ("G1",), dict(X=1.5, Y=-0.25)),
        ("LX+1Y+2", ("G1",), dict(X=1, Y=2)),
        ("L  X +1  Y -2", ("G1",), dict(X=1, Y=-2)),
        ("X+5 R0 FMAX", ("G0",), dict(X=5)),
        ("C+45 FMAX", ("G0",), dict(C=45)),
        ("L Z+0 R0 FMAX M91", ("G0", "G53"), dict(Z=0)),
        ("L X+1 ; to the right ~ no", ("G1",), dict(X=1)),
        ("/ 12 L X+1", ("G1",), dict(X=1)),
        ("12 / L X+1", ("G1",), dict(X=1)),
    ],
)
def test_straight_lines_have_many_forms(text, g, words):
    block = last(text)
    assert block.g == g
    assert dict(block.words) == words


def test_fmax_applies_to_one_block_only():
    assert [b.g for b in blocks_of("L X+1 FMAX", "L X+2", "L Y+1 F100 M8", "L Y+2 M9 FMAX")] == [
        *(("G0",), ("G1",), ("G1",), ("G0",)),
    ]


def test_programs_begin_with_their_unit_and_end():
    found = blocks_of("0 BEGIN PGM PART MM", "1 L X+1", "2 END PGM PART MM", "3 L X+2")
    assert [(b.line, b.g, b.m) for b in found] == [(1, ("G21",), ()), (2, ("G1",), ()), (3, (), ("M30",))]
    assert last("BEGIN PGM PART INCH").g == ("G20",)
    assert [b.m for b in blocks_of("L M30", "M2")] == [("M30",), ("M2",)]


def test_lines_without_effect_are_counted():
    lines = (
        "BLK FORM 0.1 Z X-50 Y-50 Z-10",
        "* - Roughing",
        '5 TOOL CALL "MILL_10" Z S8000 F1200 DL+0 DR-0.0 DR2+0',
        "TOOL DEF 7",
        "CYCL DEF 32.0 TOLERANCE",
        "CYCL DEF 32.1 T0.02",
        "CYCL DEF 247 DATUM SETTING ~",
        "  Q339=+1 ;DATUM NUMBER",
        "STOP",
        "LBL 1",
        "M138 A C",
        "L M8",
        "FN 16: F-PRINT TNC:\\A.A",
        "; only this",
        "",
    )
    found = blocks_of(*lines)
    assert [b.ignored for b in found] == [
        *(("BLK FORM",), ("*",), ("TOOL CALL",), ("TOOL DEF",), ("CYCL DEF 32",), ("CYCL DEF 32",)),
        *(("CYCL DEF 247",), ("STOP",), ("LBL",), ("M138",), ("M8",), ("FN 16:",)),
    ]
    assert found[7].line == 9
    # The spindle speed is read nevertheless.
    assert [dict(b.words) for b in found if b.words] == [{"S": 8000.0}]
    assert not any(b.g for b in found)


def test_tcp_lasts_from_m128_to_the_end_of_the_block_with_m129():
    found = blocks_of("M128", "L X+1 F500 M128 F1000", "L X+2 M129", "M129")
    assert [(b.tip_control, dict(b.words)) for b in found] == [
        (True, {}),
        (True, {"X": 1.0, "F": 500.0}),
        (None, {"X": 2.0}),
        (False, {}),
        (False, {}),
    ]
    found = blocks_of("FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS REFPNT TIP-TIP", "FUNCTION RESET TCPM")
    assert [b.tip_control for b in found] == [True, False]


def test_lines_with_vectors_give_the_tool_direction_and_the_normal():
    text = "LN X+1 Y+2 Z+3 NX+0.6 NY+0 NZ+0.8 TX+0 TY+0.1 TZ+0.9 F500"
    for code in (text, f"{text} M8"):
        block = last(code)
        assert block.normal == (0.6, 0.0, 0.8)
        assert block.vector == (0.0, 0.1, 0.9)
        assert dict(block.words) == {"X": 1, "Y": 2, "Z": 3, "F": 500}
    assert last("LN X+1 TZ+1").normal is None


def test_under_m128_a_normal_alone_is_the_tool_direction():
    block = last("M128", "LN X+1 NX+0.6 NY+0 NZ+0.8")
    assert block.vector == block.normal == (0.6, 0.0, 0.8)
    assert [f.code for f in block.findings] == ["axis-from-normal"]
    assert last("LN X+1 NX+0.6 NY+0 NZ+0.8").vector is None
    assert last("M128", "LN X+1 A+5 NX+0.6 NY+0 NZ+0.8").vector is None


def test_spatial_angles_of_tcpm_are_a_direction():
    found = blocks_of("FUNCTION TCPM F TCP AXIS SPAT PATHCTRL VECTOR", "L X+1 A+90 B+0 C+90", "L IC-90")
    np.testing.assert_allclose(found[1].vector, [1, 0, 0], atol=1e-15)
    assert dict(found[1].words) == {"X": 1.0}
    np.testing.assert_allclose(found[2].vector, [0, -1, 0], atol=1e-15)
    with pytest.raises(ToolpathError, match="the first angles after AXIS SPAT must be all three"):
        blocks_of("FUNCTION TCPM AXIS SPAT", "L A+10")


def test_increments_are_listed():
    block = last("L IX+5 Y+2 IC-10")
    assert dict(block.words) == {"X": 5, "Y": 2, "C": -10}
    assert block.increments == "XC"


def test_circles_have_an_absolute_centre():
    block = last("CC X+10 Y-5", "C X+20 Y-5 DR+ F200")
    assert (block.g, block.centre) == (("G3",), {"X": 10.0, "Y": -5.0})
    assert dict(block.words) == {"X": 20, "Y": -5, "F": 200}
    assert last("CC X+10 Y-5", "C X+20 DR-").g == ("G2",)
    assert last("L X+3 Y+4", "CC", "C X+3 Y+4 DR+").centre == {"X": 3.0, "Y": 4.0}
    assert last("L X+3 Y+4", "CC IX+5 IY-1", "C X+9 Y+9 DR+").centre == {"X": 8.0, "Y": 3.0}
    assert last("CC X+1 Y+2", "CC Y+5", "C X+9 Y+9 DR+").centre == {"X": 1.0, "Y": 5.0}


def test_circles_may_have_a_radius():
    block = last("CR X+10 Y+40 R+20 DR- R0")
    assert (block.g, dict(block.words)) == (("G2",), {"X": 10, "Y": 40, "R": 20})
    assert last("CR X+10 Y+40 R-20 DR+").words["R"] == -20


def test_polar_positions_are_relative_to_the_pole():
    found = blocks_of("CC X+10 Y+20", "LP PR+5 PA+90 Z+1 F100", "LP IPA-90", "LP IPR+1", "LP PR+2")
    places = [(b.words["X"], b.words["Y"]) for b in found[1:]]
    np.testing.assert_allclose(places, [(10, 25), (15, 20), (16, 20), (12, 20)], atol=1e-12)
    assert found[1].words["Z"] == 1.0
    assert found[1].g == ("G1",)


@pytest.mark.parametrize(
    ("words", "end", "turns"),
    [
        ("PA+90 DR+", (0, 10), 0),
        ("IPA+360 DR+", (10, 0), 0),
        ("IPA+1080 DR+", (10, 0), 2),
        ("IPA-450 DR-", (0, -10), 1),
    ],
)
def test_a_helix_turns_about_the_pole(words, end, turns):
    block = last("CC X+0 Y+0", "L X+10 Y+0 Z+0", f"CP {words} IZ-5")
    np.testing.assert_allclose([block.words["X"], block.words["Y"]], end, atol=1e-12)
    assert (block.turns, block.increments, block.words["Z"]) == (turns, "Z", -5.0)
    assert block.centre == {"X": 0.0, "Y": 0.0}


def test_parameters_have_values():
    lines = (
        "Q1 = 5",
        "FN 0: Q2 = +7.5",
        "FN1: Q3 = +Q1 + -Q2",
        "FN 4: Q4 = +Q2 DIV +2",
        "QL5 = Q1 * (2 + SIN 30)",
        "FN 5: Q6 = SQRT 16",
        'QS1 = "text"',
        "L X+Q1 Y-Q2 Z+Q3 A+Q4 C+QL5 FQ6",
    )
    assert dict(last(*lines).words) == {"X": 5, "Y": -7.5, "Z": -2.5, "A": 3.75, "C": 12.5, "F": 4}


def test_f_auto_is_the_feed_of_the_tool_call():
    assert last("TOOL CALL 5 Z S1000 F800", "L X+1 F AUTO").words["F"] == 800.0


def test_shifts_replace_axis_by_axis():
    lines = ("CYCL DEF 7.0 DATUM SHIFT", "CYCL DEF 7.1 X+10", "CYCL DEF 7.2 IY+5", "CYCL DEF 7.3 IY+5")
    frames = [b.frame for b in blocks_of(*lines, "TRANS DATUM AXIS X-1 Z+2", "TRANS DATUM RESET")]
    assert frames[0] is None
    np.testing.assert_allclose([f.origin for f in frames[1:]], [
        *((10, 0, 0), (10, 5, 0), (10, 10, 0), (-1, 10, 2), (0, 0, 0)),
    ])  # fmt: skip


def test_spatial_angles_are_about_fixed_axes():
    block = last("PLANE SPATIAL SPA+20 SPB-30 SPC+40 TURN FMAX SEQ- TABLE ROT")
    expected = about("Z", 40) @ about("Y", -30) @ about("X", 20)
    np.testing.assert_allclose(block.frame.rotation, expected, atol=1e-15)
    assert (block.tip_control, block.vector) == (True, (0.0, 0.0, 1.0))
    # Example of the manual: A 45, B 0, C 90 leads Z to X.
    block = last("PLANE SPATIAL SPA+45 SPB+0 SPC+90 STAY")
    np.testing.assert_allclose(block.frame.rotation @ [0, 0, 1], [np.sqrt(0.5), 0, np.sqrt(0.5)], atol=1e-15)
    assert (block.tip_control, block.vector) == (None, None)


def test_planes_have_other_forms():
    euler = last("PLANE EULER EULPR20 EULNU30 EULROT40 STAY").frame.rotation
    np.testing.assert_allclose(euler, about("Z", 20) @ about("X", 30) @ about("Z", 40), atol=1e-15)
    relative = last("PLANE SPATIAL SPA+45 SPB+0 SPC+0 STAY", "PLANE RELATIV SPB+30 STAY").frame.rotation
    np.testing.assert_allclose(relative, about("X", 45) @ about("Y", 30), atol=1e-15)
    vector = last("PLANE VECTOR BX+0 BY+1 BZ+0.2 NX+1 NY+0 NZ+0 STAY").frame.rotation
    np.testing.assert_allclose(vector[:, 2], [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(vector[:, 0] @ [0, 1, 0.2], np.hypot(1, 0.2))
    assert np.linalg.det(vector) == pytest.approx(1.0)


def test_the_angles_that_plane_computes_point_the_tool_along_its_normal():
    block = last("PLANE SPATIAL SPA+90 SPB+0 SPC+0 STAY", "L A+Q120 C+Q122 R0 FMAX M126")
    assert (block.tip_control, block.vector, dict(block.words)) == (True, (0.0, 0.0, 1.0), {})
    assert block.shorter is True


def test_a_plane_starts_at_the_shift_before_it_and_has_its_own_shift():
    lines = (
        "TRANS DATUM AXIS X+10",
        "PLANE SPATIAL SPA+0 SPB+90 SPC+0 STAY",
        "PLANE RESET STAY",
        "TRANS DATUM RESET",
        "PLANE SPATIAL SPA+0 SPB+90 SPC+0 STAY",
        "TRANS DATUM AXIS X+10",
        "CYCL DEF 10.0 ROTATION",
        "CYCL DEF 10.1 ROT+90",
    )
    frames = [b.frame for b in blocks_of(*lines) if b.frame is not None]
    np.testing.assert_allclose(place(frames[1], 0, 0, 1), [11, 0, 0], atol=1e-15)
    np.testing.assert_allclose(place(frames[2], 0, 0, 1), [10, 0, 1], atol=1e-15)
    np.testing.assert_allclose(place(frames[5], 0, 0, 1), [1, 0, -10], atol=1e-15)
    np.testing.assert_allclose(place(frames[6], 1, 0, 0), [0, 1, -10], atol=1e-15)


def test_a_dwell_is_in_seconds():
    block = last("CYCL DEF 9.0 DWELL TIME", "CYCL DEF 9.1 DWELL 1.5")
    assert (block.g, dict(block.words)) == (("G4",), {"P": 1.5})


def test_moves_that_depend_on_the_machine_are_omitted_with_a_note():
    for text in ("L M140 MB MAX FMAX", "M140 MB 50 F750", "L Z+0 FMAX M92"):
        block = last(text)
        assert not block.words
        assert not block.g
        assert [f.code for f in block.findings] == ["fixed-point-left-out"]


def test_block_delete_skips_blocks_unread():
    found = blocks_of("/ CALL LBL 5", "7 / L X+1", "L X+2", block_delete=True)
    assert [b.skipped for b in found] == [True, True, False]


def test_presets_and_datums_of_tables_are_zeros_by_name():
    lines = ("CYCL DEF 7.1 X+10", "CYCL DEF 247 SET ~", "Q339=+2", "CYCL DEF 7.1 #5")
    assert [b.work_offset for b in blocks_of(*lines)] == ["", "2", "2 #5"]
    # A preset resets the shift, and another shift takes the table's place once it names all axes.
    found = blocks_of(*lines[:3], "CYCL DEF 7.1 #5", "TRANS DATUM AXIS X+1 Y+2 Z+3")
    assert [tuple(b.frame.origin) for b in found] == [(10, 0, 0), (0, 0, 0), (0, 0, 0), (1, 2, 3)]
    assert found[-1].work_offset == "2"
    with pytest.raises(ToolpathError, match=r"part\.h:2: .*only in the table; write all of X, Y and Z"):
        blocks_of("CYCL DEF 7.1 #5", "CYCL DEF 7.1 X+1")
    with pytest.raises(ToolpathError, match="a preset while the plane is tilted"):
        blocks_of("PLANE SPATIAL SPA+5 SPB+0 SPC+0 STAY", "CYCL DEF 247 Q339=+1")


DRILL = (
    "CYCL DEF 200 DRILLING ~",
    "  Q200=+2 ;SET-UP CLEARANCE ~",
    "  Q201=-15 ;DEPTH ~",
    "  Q206=+150 ;FEED ~",
    "  Q202=+5 ;PLUNGING DEPTH ~",
    "  Q210=+0 ;DWELL AT TOP ~",
    "  Q203=+1 ;SURFACE ~",
    "  Q204=+50 ;2ND CLEARANCE ~",
    "  Q211=+0.5 ;DWELL AT DEPTH",
)
# From the surface at 1: 2 above it, down by 15, a dwell, up to 50 above it.
HOLE = [
    *(("G0", {"Z": 3.0}), ("G1", {"Z": -14.0, "F": 150.0}), ("G4", {"P": 0.5}), ("G0", {"Z": 51.0})),
]


def holes_of(*lines):
    """The moves of the holes, and the positions between them."""
    found = [b for b in blocks_of(*lines) if b.drills or not b.words.keys().isdisjoint("XY")]
    return [(*b.g, dict(b.words)) for b in found]


@pytest.mark.parametrize(
    "call",
    [
        ("L X+10 Y+20 FMAX M99",),
        ("L X+10 Y+20 FMAX", "CYCL CALL"),
        ("L X+10 Y+20 FMAX", "CYCL CALL M3"),
        ("CYCL CALL POS X+10 Y+20 Z+0 FMAX M8",),
    ],
)
def test_a_cycle_is_drilled_where_it_is_called(call):
    assert holes_of(*DRILL, *call, "L Z+60 FMAX") == [("G0", {"X": 10.0, "Y": 20.0}), *HOLE]
    one_line = " ".join(line.partition(";")[0].rstrip(" ~") for line in DRILL)
    assert holes_of(one_line, *call) == holes_of(*DRILL, *call)
    noted = [f.code for b in blocks_of(*DRILL, *call) for f in b.findings]
    assert noted == ["cycle-simplified"]


def test_m89_drills_at_every_position_up_to_m99():
    lines = ("L X+1 Y+0 FMAX M89", "L X+2", "L M8", "L X+3 M99", "L X+4")
    found = holes_of(*DRILL, *lines)
    assert [words["X"] for *_, words in found if "X" in words] == [1.0, 2.0, 3.0, 4.0]
    assert found[-1] == ("G1", {"X": 4.0})
    assert [words for *_, words in found].count({"Z": -14.0, "F": 150.0}) == 3


def test_a_cycle_is_not_called_twice_under_m89():
    with pytest.raises(ToolpathError, match=r"part\.h:11: .*M89 calls at every position; write M99 before"):
        blocks_of(*DRILL, "L X+1 Y+2 FMAX M89", "CYCL CALL")


def test_a_feed_per_revolution_drills_nothing():
    with pytest.raises(ToolpathError, match=r"part\.h:11: .*a cycle under M136 isn't supported"):
        blocks_of(*DRILL, "L M136", "L X+1 Y+2 FMAX M99")


def test_the_feed_before_a_hole_is_in_force_after_it():
    found = blocks_of(*DRILL, "L X+1 Y+2 F800 M99", "L X+5")
    assert [dict(b.words) for b in found][-2:] == [{"F": 800.0}, {"X": 5.0}]


@pytest.mark.parametrize(
    ("number", "values", "back", "out"),
    [
        (201, "Q208=+300", "G1", 300.0),
        (201, "Q208=+0", "G1", 150.0),
        (202, "Q208=+99 Q214=+1 Q336=+0", "G1", 99.0),
        (203, "Q208=FMAX", "G0", None),
        (205, "Q208=+400 Q257=+0", "G1", 400.0),
        (206, "", "G1", 150.0),
        (207, "Q239=+1.25", "G1", 1250.0),
        (209, "Q239=-1.25 Q257=+5", "G1", 1250.0),
        (240, "Q343=+0 Q344=+0", "G0", None),
        (241, "Q208=+1000 Q379=+0", "G1", 1000.0),
    ],
)
def test_other_cycles_leave_the_hole_at_their_own_feed(number, values, back, out):
    text = f"CYCL DEF {number} X Q200=2 Q201=-15 Q206=150 Q203=+1 Q204=20 {values}"
    found = holes_of("TOOL CALL 1 Z S1000", text, "L X+0 Y+0 FMAX M99")
    down = 1250.0 if "Q239" in values else 150.0
    assert found[1:3] == [("G0", {"Z": 3.0}), ("G1", {"Z": -14.0, "F": down})]
    if back == "G0":
        assert found[3:] == [("G0", {"Z": 21.0})]
    else:
        assert found[3:] == [("G1", {"Z": 3.0, "F": out}), ("G0", {"Z": 21.0})]


def test_a_depth_of_zero_and_auto_feeds_are_read():
    assert len(holes_of("CYCL DEF 200 D Q200=2 Q201=+0 Q206=AUTO Q203=+0 Q204=9".replace("AUTO", "1"))) == 0
    lines = ("TOOL CALL 1 Z S9 F77", "CYCL DEF 200 D Q200=2 Q201=-1 Q206=AUTO Q203=+0 Q204=9", "L X1 M99")
    assert holes_of(*lines)[2] == ("G1", {"Z": -1.0, "F": 77.0})


@pytest.mark.parametrize(
    ("lines", "fact"),
    [
        (("CYCL DEF 200 D Q200=2", "L X+1 M99"), "cycle 200 needs a number for Q201"),
        (("CYCL DEF 200 D Q200=2 Q201=5 Q206=1 Q203=0 Q204=9", "CYCL CALL"), "a depth is below 0"),
        ((f"CYCL DEF 200 D {' '.join(('Q200=2', 'Q201=-5', 'Q395=1'))}", "CYCL CALL"), "with Q395=0"),
        (("CYCL DEF 207 T Q200=2 Q201=-5 Q239=1 Q203=0 Q204=9", "CYCL CALL"), "S isn't known"),
        (("CYCL DEF 200 D Q200=2 Q201=-5", "Q200 = 5"), "Q200 belongs to the cycle in force"),
        (("CYCL DEF 200 D Q200=2", "CYCL CALL POS X+1 Y+2 Z-5 FMAX"), "needs X, Y and Z\\+0"),
        (("L M136", "L X+1 M99"), "none is defined"),
        (("L X+1", "CYCL DEF 200 D Q200=2 Q200=3"), "Q200 has two values"),
        (("L X+1", "CYCL DEF 200 D Q200=PREDEF"), "PREDEF has no value"),
        (("L X+1", "CYCL DEF 208 BORE MILLING Q335=20"), "CYCL DEF 208 is a cycle, which isn't expanded"),
    ],
)
def test_holes_that_are_not_certain_are_refused(lines, fact):
    with pytest.raises(ToolpathError, match=rf"part\.h:2: .*{fact}"):
        blocks_of(*lines)


def places_of(blocks):
    return [(b.line, b.words["X"]) for b in blocks if "X" in b.words]


def test_a_subprogram_runs_where_it_is_called_with_the_lines_of_the_file():
    lines = ("Q1 = 1", "CALL LBL 5", "Q1 = 2", "CALL LBL 5", "L X+9", "M30", "LBL 5", "L X+Q1", "LBL 0")
    found = blocks_of(*lines)
    assert places_of(found) == [(8, 1.0), (8, 2.0), (5, 9.0), (8, 2.0)]
    steps = [b.step or b.line for b in found]
    assert steps == sorted(steps)
    assert len(set(steps)) == len(steps)


def test_a_part_is_repeated_after_its_first_time():
    lines = ("L X+0", 'LBL "A"', "L IX+5", 'CALL LBL "A" REP 3/3', "L X+1")
    assert [line for line, _ in places_of(blocks_of(*lines))] == [1, 3, 3, 3, 3, 5]
    # Parts within one another: 3 times 2 of the inner one.
    lines = ("LBL 1", "LBL 2", "L X+1", "CALL LBL 2 REP1", "L X+2", "CALL LBL 1 REP2")
    assert [x for _, x in places_of(blocks_of(*lines))] == [1.0, 1.0, 2.0] * 3


def test_runs_of_plain_lines_are_repeated_as_single_lines_are():
    plain = [f"L X+{x} Y+1" for x in range(40)]
    found = list(one_by_one(KLARTEXT.split(Source("part.h", ["LBL 1", *plain, "CALL LBL 1 REP 2"]))))
    assert [b.words["X"] for b in found if b.words] == [float(x) for x in range(40)] * 3
    assert [b.line for b in found if b.words] == list(range(2, 42)) * 3
    assert [b.step or b.line for b in found if b.words][40:42] == [44, 45]


def test_a_called_program_has_the_line_of_its_call_and_parameters_of_its_own(tmp_path):
    (tmp_path / "Sub.H").write_text(
        "0 BEGIN PGM SUB MM\n1 QL1 = 7\n2 L X+QL1 Y+Q1\n3 CALL LBL 1\n4 LBL 1\n5 L X+3\n6 LBL 0\n7 END PGM\n"
    )
    lines = [
        "BEGIN PGM MAIN MM",
        "Q1 = 4",
        "QL1 = 5",
        "CALL PGM TNC:\\NC\\SUB.H",
        "L X+QL1",
        "END PGM MAIN MM",
    ]
    found = blocks_of(*lines, name=str(tmp_path / "main.h"))
    # LBL 1 is run through once more after its call.
    assert places_of(found) == [(4, 7.0), (4, 3.0), (4, 3.0), (5, 5.0)]
    assert found[-1].m == ("M30",)
    (tmp_path / "Sub.H").write_text("0 BEGIN PGM SUB MM\n1 L X+Q9\n2 END PGM SUB MM\n")
    with pytest.raises(ToolpathError, match=r"main\.h:4: .*in Sub\.H, line 2, '1 L X\+Q9': Q9 has no value"):
        blocks_of(*lines, name=str(tmp_path / "main.h"))
    for text, fact in (
        ("BEGIN PGM SUB INCH", "the program that calls is in MM"),
        ("L X+1 M30", "ends the program within one that is called"),
        ("CALL PGM SUB", "more than 20 calls and repetitions within one another"),
        ("CALL PGM OTHER", "no such file is beside the program"),
    ):
        (tmp_path / "Sub.H").write_text(text)
        with pytest.raises(ToolpathError, match=rf"main\.h:4: .*{fact}"):
            blocks_of(*lines, name=str(tmp_path / "main.h"))


@pytest.mark.parametrize(
    ("lines", "fact"),
    [
        (("L X+1", "CALL LBL 1"), "calls LBL 1, which stands in the program 0 times"),
        (("LBL 1", "CALL LBL 1", "LBL 1"), "calls LBL 1, which stands in the program 2 times"),
        (("L X+1", "CALL LBL 1 REP 2", "LBL 1", "LBL 0"), "repeats from LBL 1, which isn't before it"),
        (("LBL 1", "CALL LBL 1", "LBL 0"), "more than 20 calls and repetitions within one another"),
        (("CALL LBL 1", "END PGM", "LBL 1", "END PGM X MM"), "isn't ended; write LBL 0"),
        (("L X+1", "CALL LBL Q5"), "takes a number or a name"),
        (("L X+1", "CALL LBL QS5 REP 2"), "takes a number or a name"),
    ],
)
def test_calls_that_are_not_certain_are_refused_with_their_line(lines, fact):
    with pytest.raises(ToolpathError, match=fact) as caught:
        blocks_of(*lines)
    assert str(caught.value).startswith("part.h:4: " if "END" in lines[1] else "part.h:2: ")


@pytest.mark.parametrize("bound", ["MOST_REPEATED", "MOST_SINGLE", "MOST_JUMPS"])
def test_repetitions_without_end_stop_with_one_error(monkeypatch, bound):
    monkeypatch.setattr(tape, bound, 500)
    lines = ("LBL 1", "LBL 2", *["L X+1"] * 20, "CALL LBL 2 REP 99", "CALL LBL 1 REP 65534")
    with pytest.raises(ToolpathError, match=r"part\.h:[0-9]+: .*(are repeated|more than 500 calls)"):
        blocks_of(*lines)


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("L X+1 X+2", "X has two values, 1 and 2; write one of them"),
        ("L X+1 IX+2", "X has two values"),
        ("LN X+1 TX+1 TX+1", "X has two values"),
        ("L X+1.5E3", "'E3' would be an exponent"),
        ("L X+1.2.3", "isn't a word"),
        ("L X+10 20", "'20' isn't a word"),
        ("L X", "'X' isn't a word"),
        ("L X" + "1" * 50, "isn't a word"),
        ("L X+Q7", "Q7 has no value yet"),
        ("Q1 = Q7 + 1", "Q7 has no value yet"),
        ("Q1 = 5 +", "a number is missing"),
        ("L X+1 RL", "RL offsets the path by the tool radius"),
        ("X+5 R+", "R+ offsets the path"),
        ("L X+1 FU0.2", "FU is a feed per revolution"),
        ("L X+1 F AUTO", "none was given"),
        ("L X+1 R5", "R5 belongs to CR"),
        ("L X+1 PA+5", "PA belongs to LP and CP"),
        ("L X+1 M99", "calls a cycle, and none is defined"),
        ("L X+1 M118 Z1", "M118 superimposes handwheel moves"),
        ("L M1.5", "isn't an M word"),
        ("C X+1 Y+2 DR+", "there is no pole"),
        ("C X+1 Y+2", "C needs its direction"),
        ("CC", "X and Y of the position before aren't in the program"),
        ("CC X+1", "the pole has no Y"),
        ("CC X+1 Z+1", "CC takes X and Y"),
        ("CR X+1 Y+2 DR+", "CR needs its radius"),
        ("CR X+1 Y+2 R5 DR+ FMAX", "CR is a move at feed"),
        ("LP PR+5 PA+90", "there is no pole"),
        ("LP PR+5 PA+90 X+1", "one radius and one angle"),
        ("CT X+1 Y+2", "CT generates moves"),
        ("RND R5", "RND generates moves"),
        ("CHF 2", "CHF generates moves"),
        ("APPR LCT X+1 R5 RL", "APPR generates moves"),
        ("CALL SELECTED PGM", "jumps, repeats or calls"),
        ("FN 9: IF +Q1 EQU +1 GOTO LBL 5", "jumps, repeats or calls"),
        ("FN 18: SYSREAD Q1 = ID270 NR1 IDX1", "reads data of the control"),
        ("FN 8: Q1 = +3 LEN +4", "reads data of the control"),
        ("CYCL DEF 251 POCKET", "is a cycle, which isn't expanded"),
        ("CYCL CALL", "calls a cycle, and none is defined"),
        ("CYCL CALL PAT FMAX", "is a cycle, which isn't expanded"),
        ("TCH PROBE 400", "is a cycle, which isn't expanded"),
        ("CYCL DEF 8.1 X", "mirrors or scales"),
        ("CYCL DEF 11.1 SCL 0.5", "mirrors or scales"),
        ("CYCL DEF 19.1 A+0 B+45 C+0", "cycle 19 angles depend on the machine; write PLANE SPATIAL"),
        ("CYCL DEF 7.1 C+5", "a datum shift is supported for X, Y and Z"),
        ("CYCL DEF 7.1 X+5 what", "'WHAT' isn't a word of an axis"),
        ("CYCL DEF A", "CYCL DEF must be followed by a number"),
        ("PLANE SPATIAL SPA+5", "PLANE SPATIAL needs SPB, SPC"),
        ("PLANE AXIAL B+45 TURN", "PLANE sets a coordinate system"),
        ("PLANE VECTOR BX1 BY0 BZ0 NX1 NY0 NZ0", "a base vector across its normal"),
        ("TRANS MIRROR AXIS X", "TRANS sets a coordinate system"),
        ("FUNCTION TCPM F TCP AXIS POS REFPNT CENTER-CENTER", "only REFPNT TIP-TIP is supported"),
        ("FUNCTION MODE TURN", "changes what the words mean"),
        ("TOOL CALL 5 Z S100 DL+0.5", "DL+0.5 changes the tool that the program was posted for"),
        ("TOOL CALL 5 Z DR+1", "DR+1 changes the tool"),
        ('TOOL CALL "DR9" Z S100 F5DR2-.1', "DR2-.1 changes the tool"),
        ("TOOL CALL DL-0.2", "DL-0.2 changes the tool"),
        ("TOOL CALL 5 X S100", "a tool along X isn't supported"),
        ("BEGIN PGM PART", "must end with the unit, MM or INCH"),
        ("BLABLA", "'BLABLA' begins no supported line"),
        ("G1 X10", "'G1' begins no supported line"),
        ("ſ+100", "begins no supported line"),
        ("L X+١", "isn't a word"),
        ("L X+1 " * 1000, "characters, beyond 4096"),
    ],
)
def test_unsupported_lines_are_refused_with_their_line_and_reason(text, fact):
    with pytest.raises(ToolpathError) as caught:
        blocks_of("0 BEGIN PGM PART MM" if "BEGIN" not in text else "; begin", text)
    assert str(caught.value).startswith("part.h:2: ")
    assert fact in str(caught.value)


@pytest.mark.parametrize(
    ("lines", "fact"),
    [
        (("CC X+0 Y+0", "L X+1 Y+0", "CP IPA-90 DR+"), "IPA-90 contradicts DR+"),
        (
            ("TRANS DATUM AXIS X+1", "PLANE SPATIAL SPA1 SPB0 SPC0 STAY", "TRANS DATUM RESET"),
            "in a tilted plane",
        ),
        (
            ("PLANE SPATIAL SPA1 SPB0 SPC0 STAY", "TRANS DATUM AXIS X+1", "PLANE RESET STAY"),
            "a new plane while",
        ),
        (("CYCL DEF 10.0 R", "CYCL DEF 10.1 ROT+5", "TRANS DATUM AXIS X+1"), "while cycle 10 rotates"),
        (("L X+1 Y+1", "PLANE SPATIAL SPA1 SPB0 SPC0 STAY", "CC"), "aren't in the program yet"),
        (("M128", "L X+1", "L Z+10 M140 MB MAX"), "M140 together with a move isn't supported"),
        (("BEGIN PGM A MM", "L X+1", "BEGIN PGM B MM"), "a second program begins"),
    ],
)
def test_faults_that_depend_on_earlier_blocks_are_refused_with_their_line(lines, fact):
    with pytest.raises(ToolpathError) as caught:
        blocks_of(*lines)
    assert str(caught.value).startswith("part.h:3: ")
    assert fact in str(caught.value)


def test_a_line_of_ten_megabytes_is_refused_quickly_and_briefly():
    with pytest.raises(ToolpathError, match="characters, beyond 4096") as caught:
        blocks_of("L X+1 Y+2 " * 1_000_000)
    assert len(str(caught.value)) < 300


def test_a_block_of_many_lines_has_a_longest_length_too():
    with pytest.raises(ToolpathError, match=r"part.h:1: .*6[0-9]* characters in a block, beyond 4096"):
        blocks_of("L X+1 ~", *["Y+1 " * 500 + "~"] * 3, "Z+1")


def test_a_tool_turned_back_by_the_control_keeps_its_direction_until_angles_are_written():
    lines = (
        "PLANE SPATIAL SPA+90 SPB+0 SPC+0 MOVE FMAX",
        "PLANE RESET MOVE FMAX",
        "L X+1",
        "L X+2 A+5 C+5",
        "L X+3 A+6",
        "PLANE RESET MOVE FMAX",
    )
    found = blocks_of(*lines)
    assert [(b.tip_control, b.vector) for b in found] == [
        *((True, (0.0, 0.0, 1.0)), (True, (0.0, 0.0, 1.0)), (None, None), (False, None), (None, None)),
        (False, None),
    ]


@pytest.mark.parametrize(
    "lines",
    [
        ("PLANE SPATIAL SPA+90 SPB+0 SPC+0 TURN FMAX",),
        ("PLANE SPATIAL SPA+90 SPB+0 SPC+0 STAY", "L A+Q120 C+Q122 FMAX"),
    ],
)
def test_a_rotation_without_tcp_discards_the_position(lines):
    """By a block in axis coordinates, unless M128 is on."""
    lost, block = blocks_of(*lines)[-2:]
    assert (lost.tip_control, lost.vector, tuple(lost.frame.origin)) == (False, None, (0.0, 0.0, 0.0))
    assert (block.tip_control, block.vector) == (True, (0.0, 0.0, 1.0))
    np.testing.assert_allclose(block.frame.rotation @ [0, 0, 1], [0, -1, 0], atol=1e-15)
    assert [b.tip_control for b in blocks_of("M128", *lines)].count(False) == 0
