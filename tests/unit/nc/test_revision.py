"""Operations with other postures in their own lines: words, styles, added lines, and what is refused."""

import difflib
import re

import numpy as np
import pytest
from support.shop_programs import SHOPS

import fiveaxis as fx
from fiveaxis.base.errors import ToolpathError
from fiveaxis.model import tool_axes
from fiveaxis.nc.operation_text import OperationText, Placement
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.revised_words import Reviser
from fiveaxis.nc.source import load_source, with_lines

BALL = fx.Tool.ball(6)
MACHINE = "dmu50ev"
HEAD = "G21 G90 G94 G54\nT3 M6\nS9000 M3\nG0 B30 C0\nG43.4 H3\nG0 X30 Y0\nZ50\n"
CUTS = "G1 X30. Y0. Z2. F900\nX29.5 Y2. B31. C3. (NEXT)\nN40 X28.5 Y4. B32. C6.\n"
TAIL = "G0 Z50.\nG49\nT4 M6\nG0 B0 C0\nG43 H4 X0 Y0 Z80\nG1 Z0 F300\nX10\nG0 Z80\nM30\n"


class Case:
    """A program's operation with its path."""

    def __init__(self, file, machine, number=None, **reading):
        self.file, self.machine = file, fx.load_machine(machine)
        given = {"operation": number, **reading}
        self.text = OperationText.of(load_source(file), ReadOptions(**given, tool=BALL, machine=self.machine))
        whole = fx.read_toolpath(file, tool=BALL, machine=self.machine, **given)
        self.path = self.text.path_of(whole)

    def placed(self, *, turn=0.0, row=None):
        """The path's own postures, C turned further; with rows between them."""
        path = self.path
        count = len(path)
        rows = np.arange(count, dtype=float) if row is None else np.asarray(row)
        rotary = np.column_stack([np.interp(rows, np.arange(count), r) for r in path.rotary.T])
        rotary[:, 0] += turn
        pivot = np.column_stack([np.interp(rows, np.arange(count), p) for p in path.pivot.T])
        axis = tool_axes(self.machine, rotary)
        time = np.full(len(rows), 0.1)
        return Placement(rows, pivot - 3.0 * axis, rotary, time)

    def revised(self, placement):
        revision = Reviser(self.text, self.path, placement).revision()
        self.text.require_same_around(revision)
        return revision


@pytest.fixture
def case(tmp_path):
    def make(text, machine=MACHINE, number=None, name="part.nc", **reading):
        file = tmp_path / name
        file.write_text(text, encoding="utf-8", newline="")
        return Case(file, machine, number, **reading)

    return make


def changed(revision):
    lines = difflib.unified_diff(revision.source.lines, revision.revised.lines, lineterm="", n=0)
    return [line for line in lines if not line.startswith(("---", "+++", "@@"))]


@pytest.mark.parametrize("control", SHOPS)
@pytest.mark.parametrize("number", [3, 5])
def test_the_same_postures_change_no_byte(control, number, case):
    shop = SHOPS[control]
    made = case("\n".join(shop.lines()) + "\n", number=number, name=f"shop{shop.suffix}")
    assert changed(made.revised(made.placed())) == []


@pytest.mark.parametrize(
    ("name", "machine", "number"),
    [
        ("linuxcnc_impeller_xyzac.ngc", "linuxcnc-xyzac-trt", None),
        ("nx_dmu70_840d_traori_inch.mpf", "dmu50ev", 4),
    ],
)
def test_the_same_postures_change_no_byte_of_real_programs(name, machine, number, data):
    made = Case(data / "toolpaths" / name, machine, number)
    path = made.path
    time = np.where(np.isfinite(made.text.columns.at(made.text.cuts).times), 1.0, np.nan)
    own = made.text.columns.at(made.text.cuts).times * time
    placement = Placement(np.arange(len(path), dtype=float), path.tips(path.axis), path.rotary, own)
    assert changed(made.revised(placement)) == []


@pytest.mark.parametrize("control", SHOPS)
def test_other_postures_are_read_back_and_nothing_else_changes(control, case):
    shop = SHOPS[control]
    made = case("\n".join(shop.lines()) + "\n", number=3, name=f"shop{shop.suffix}")
    rows = np.sort(np.concatenate([np.arange(len(made.path)), [3.5, 7.25, 7.75]]))
    placement = made.placed(turn=np.radians(12.0), row=rows)
    revision = made.revised(placement)
    made.file.write_bytes(with_lines(revision.source, revision.replaced))
    again = Case(made.file, MACHINE, 3)
    at = [again.path.source.tolist().index(line) for line in revision.row_lines.tolist()]
    np.testing.assert_allclose(again.path.rotary[at], placement.rotary, atol=np.radians(6e-4))
    np.testing.assert_allclose(again.path.tips(again.path.axis)[at], placement.tip, atol=6e-4)
    for other in (1, 2, 4, 5):
        before = fx.read_toolpath(_written(made, shop), tool=BALL, machine=made.machine, operation=other)
        after = fx.read_toolpath(made.file, tool=BALL, machine=made.machine, operation=other)
        np.testing.assert_array_equal(before.pivot, after.pivot)
        np.testing.assert_array_equal(before.feed, after.feed)


def _written(made, shop):
    file = made.file.with_name(f"before{shop.suffix}")
    file.write_text("\n".join(shop.lines()) + "\n", encoding="utf-8")
    return file


def test_words_keep_their_style_comments_and_numbers(case):
    made = case(HEAD + CUTS + TAIL, number=1)
    lines = made.revised(made.placed(turn=np.radians(5.0))).revised.lines
    kept = ["Z50", "G0 B30. C5.", "G1 X{} Y{} Z{} F900", "X{} Y{} B31. C8. (NEXT)"]
    kept += ["N40 X{} Y{} B32. C11.", "G0 Z50.", "G0 C6.", "G49"]
    begin = lines.index("Z50")
    for form, line in zip(kept, lines[begin:], strict=False):
        assert re.fullmatch(re.escape(form).replace(r"\{\}", r"-?\d+\.\d{0,3}"), line), line


def test_a_number_that_loses_its_zeros_is_not_taken_for_the_one_before(case):
    """X29.496 becomes X29.5: rounded to the digits that are left both would be the same."""
    made = case(HEAD + CUTS.replace("X29.5 ", "X29.496 ") + TAIL, number=1)
    placement = made.placed()
    placement.tip[1, 0] += 0.004
    lines = made.revised(placement).revised.lines
    assert "X29.5 Y2. B31. C3. (NEXT)" in lines


def test_line_ends_and_bytes_outside_stay(case, tmp_path):
    text = (HEAD + CUTS + TAIL).replace("(NEXT)", "(PASSÉ)").replace("\n", "\r\n")
    made = case(text, number=1)
    made.file.write_bytes(text.encode("latin-1"))
    again = Case(made.file, MACHINE, 1)
    revision = again.revised(again.placed(turn=np.radians(5.0)))
    data = with_lines(revision.source, revision.replaced)
    assert data.count(b"\r\n") == data.count(b"\n")
    assert b"(PASS\xc9)\r\n" in data
    assert data.startswith(text.encode("latin-1")[: len(HEAD) + HEAD.count("\n")])
    made.file.write_bytes(b"")  # what was read counts
    assert with_lines(revision.source, revision.replaced) == data


def test_under_inverse_time_each_move_takes_as_long_as_it_did_in_all_its_parts(case):
    cuts = "G93 G1 X30. Y0. Z2. F60\nX29.5 Y2. B31. C3. F120\nX28.5 Y4. B32. C6. F120\nG94\n"
    made = case(HEAD + cuts + TAIL, number=1)
    lines = made.revised(made.placed(turn=np.radians(5.0), row=[0.0, 0.5, 1.0, 2.0])).revised.lines
    cut = lines.index(next(line for line in lines if line.startswith("G93")))
    assert [line.split("F")[1] for line in lines[cut : cut + 4]] == ["60", "240", "240", "120"]


def test_an_arc_becomes_chords_and_keeps_its_other_words(case):
    cuts = CUTS + "N50 G2 X26.5 Y4. I-1. J0. M8 (ROUND)\nG1 X26. Y5. B33.\n"
    made = case(HEAD + cuts + TAIL, number=1)
    lines = made.revised(made.placed(turn=np.radians(5.0))).revised.lines
    [first] = [line for line in lines if line.startswith("N50")]
    assert first.startswith("N50 G1 X")
    assert first.endswith("M8 (ROUND)")
    assert "I" not in first.split("(")[0]
    assert not any("G2 " in line for line in lines)


@pytest.mark.parametrize(
    ("cuts", "why"),
    [
        (CUTS + "G91\nX-1. B1.\nG90\n", "X isn't a plain position"),
        (CUTS + "#1=27.\nX#1 Y5. B33.\n", "part.nc:1"),
        (CUTS.replace("X28.5 Y4.", "X28.5 Y4. X28."), "X"),
    ],
)
def test_what_words_alone_do_not_say_is_refused_with_its_line(cuts, why, case):
    def revise():
        made = case(HEAD + cuts + TAIL, number=1)
        made.revised(made.placed(turn=np.radians(5.0)))

    with pytest.raises(ToolpathError, match=why) as caught:
        revise()
    assert caught.value.line is not None


def test_a_next_operation_that_takes_over_a_position_is_refused(case):
    tail = "G49\nT4 M6\nG43.4 H4\nG1 X0 Y0 Z0 F300\nX10\nM30\n"
    made = case(HEAD + CUTS + tail, number=1)
    with pytest.raises(ToolpathError, match="takes over a position, feed or mode") as caught:
        made.revised(made.placed(turn=np.radians(5.0)))
    assert caught.value.line == 14


def test_where_the_tool_stands_before_the_first_cut_has_to_be_known(case):
    head = "G21 G90 G94 G54\nT3 M6\nG43.4 H3\n"
    made = case(head + "G1 X30. Y0. Z2. B30. C0. F900\n" + CUTS + TAIL, number=1)
    with pytest.raises(ToolpathError, match="where B, C stands before the first cut isn't known"):
        made.revised(made.placed())


def test_lines_that_another_operation_runs_too_are_not_revised(case):
    """A subprogram that two tools run: other postures of one would be those of the other."""
    rows = "\n".join(f"L X+{30 - i} Y+{2 * i} Z+2 B+{30 + i} C+{3 * i} F900" for i in range(4))
    text = (
        "BEGIN PGM A MM\nTOOL CALL 3 Z S9000\nL B+30 C+0 FMAX M3\nL M128\nL X+30 Y+0 FMAX\nL Z+50 FMAX\n"
        "CALL LBL 1\nL Z+50 FMAX\nTOOL CALL 4 Z S9000\nL X+30 Y+0 B+30 C+0 FMAX M3\nCALL LBL 1\nL Z+50 FMAX\n"
        f"L M30\nLBL 1\n{rows}\nLBL 0\nEND PGM A MM\n"
    )
    made = case(text, number=1, name="part.h")
    with pytest.raises(ToolpathError, match=r"run several times \(a loop, a subprogram\)"):
        made.revised(made.placed())
