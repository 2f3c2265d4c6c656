"""Rotary words from 0 to 360, unwrapped by the control's rule."""

import numpy as np
import pytest

from fiveaxis.base.errors import FiveAxisError, SettingError, ToolpathError
from fiveaxis.model import Tool
from fiveaxis.nc import compose_program, read_program, read_toolpath

WORDS = "G21 G90 G94 G0 X0 Y0 Z0 A0 C350\n{}M30\n"


def turned(folder, text, machine, suffix=".nc", **options):
    """C, deg, of every row."""
    path = folder / f"part{suffix}"
    path.write_text(text)
    motion = read_program(path, machine, rapid=1e4, **options)
    return np.degrees(motion.positions[:, machine.column("C")]).tolist(), {f.code for f in motion.findings}


@pytest.mark.parametrize(
    ("wrap", "words", "places"),
    [
        ("unwound", ["C10", "C350"], [350, 10, 350]),
        ("shorter", ["C10", "C350", "C170", "C0"], [350, 370, 350, 530, 360]),
        ("shorter", ["C700", "C-10"], [350, 340, 350]),
        ("signed", ["C10", "C350", "C-10", "C-0"], [350, 370, 710, 370, 360]),
        ("signed", ["C350", "X1", "C-350"], [350, 350, 350]),
    ],
)
def test_a_word_is_unwrapped_by_its_rule(tmp_path, hayashi, wrap, words, places):
    text = WORDS.format("".join(f"G1 {word} F500\n" for word in words))
    found, codes = turned(tmp_path, text, hayashi, wrap=wrap)
    kept = [c for i, c in enumerate(places) if i == 0 or c != places[i - 1] or words[i - 1][0] == "X"]
    assert found == pytest.approx(kept)
    assert ("turn-assumed" in codes) == (wrap != "unwound")


def test_start_gives_the_turn_on_which_the_axis_begins(tmp_path, hayashi):
    text = WORDS.format("G1 C10 F500\n")
    begin = {"X": 0, "Y": 0, "Z": 0, "A": 0, "C": 725}
    found, codes = turned(tmp_path, text, hayashi, wrap="shorter", start=begin)
    assert found == pytest.approx([725, 710, 730])
    assert "turn-assumed" not in codes


def test_increments_are_not_wrapped(tmp_path, hayashi):
    text = WORDS.format("G91 G1 C200 F500\nG90 C180\n")
    assert turned(tmp_path, text, hayashi, wrap="shorter")[0] == pytest.approx([350, 550, 540])


def test_a_work_offset_of_the_axis_is_no_turn(tmp_path, hayashi):
    text = WORDS.format("G1 C10 F500\n")
    found, _ = turned(tmp_path, text, hayashi, wrap="signed", zero={"C": 90})
    assert found == pytest.approx([440, 460])


KLARTEXT = (
    "BEGIN PGM A MM\nL X+0 Y+0 Z+0 A+0 C+350 R0 FMAX\nL C+340 F500\n{}L C+10\n{}L C+350\nEND PGM A MM\n"
)


def test_klartext_takes_the_shorter_direction_under_m126(tmp_path, hayashi):
    on_and_off = KLARTEXT.format("L M126\n", "L M127\n")
    found, codes = turned(tmp_path, on_and_off, hayashi, ".h", wrap="shorter")
    assert found == pytest.approx([350, 340, 370, 350])
    assert "angles-as-written" not in codes
    # Which axes wrap at 360 deg is set at the control, and not assumed.
    found, codes = turned(tmp_path, on_and_off, hayashi, ".h")
    assert found == pytest.approx([350, 340, 10, 350])
    assert "angles-as-written" in codes


def test_a_path_is_read_by_the_same_rule(tmp_path, hayashi):
    path = tmp_path / "part.nc"
    path.write_text(WORDS.format("G1 C10 F500\nX5\n"))
    plain, wrapped = (
        read_toolpath(path, tool=Tool.ball(6), machine=hayashi, wrap=wrap) for wrap in ("unwound", "shorter")
    )
    assert {f.code for f in plain.findings} >= {"long-turn"}
    assert "long-turn" not in {f.code for f in wrapped.findings}


@pytest.mark.parametrize(
    ("suffix", "text", "wrap", "message"),
    [
        (".mpf", "G90 G0 X0 Y0 Z0 A0 C=DC(10)\nG1 C=DC(20) F1\n", "shorter", "DC, ACP, ACN"),
        (".h", KLARTEXT.format("", ""), "signed", "set wrap=shorter"),
        (".nc", WORDS.format("G1 C400 F1\n"), "signed", "C400 is beyond a turn"),
        (
            ".nc",
            WORDS.format("G1 C4 F1\n"),
            "short",
            "wrap = 'short' is unknown; give 'unwound' or 'shorter' or 'signed'",
        ),
    ],
)
def test_a_rule_that_does_not_apply_is_refused(tmp_path, hayashi, suffix, text, wrap, message):
    with pytest.raises(FiveAxisError, match=message.replace("(", r"\(")):
        turned(tmp_path, text, hayashi, suffix, wrap=wrap)


def test_a_rule_without_an_axis_is_refused(tmp_path, hayashi):
    path = tmp_path / "part.nc"
    path.write_text("G21 G0 X0 Y0 Z0\nG1 X5 F100\n")
    with pytest.raises(SettingError, match="rotary axes of more than a turn, and give the machine"):
        read_toolpath(path, tool=Tool.ball(6), wrap="shorter")


def test_the_header_gives_the_rule_and_the_axes(tmp_path, hayashi):
    path = tmp_path / "part.ngc"
    path.write_text(WORDS.format("G1 C10 F500\nG1 C-350\n"))
    motion = read_program(path, hayashi, rapid=1e4, wrap="signed")
    text = compose_program(motion, machine=hayashi, winding="modulo").text
    assert "(winding: modulo signed C)\n" in text
    assert turned(tmp_path, text, hayashi, ".ngc")[0][-2:] == pytest.approx([370, 350])
    # The caller's rule takes precedence.
    assert turned(tmp_path, text, hayashi, ".ngc", wrap="unwound")[0][-2:] == pytest.approx([10, -350])


SHIFTED = "G21 G90 G0 X0 Y0 Z0 A0 C800\nG92 C80\nG1 C100 F500\nG92.1\nG1 C810\nM2\n"


def test_g92_shifts_a_rotary_axis(tmp_path, hayashi):
    assert turned(tmp_path, SHIFTED, hayashi)[0] == pytest.approx([800, 820, 810])


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ("G92", "G92 shifts named axes"),
        ("M428 G92 X0 C0", "G92 shifts named axes, X, Y, Z outside of TCP"),
        ("G1 G92 C0", "G92 together with a move"),
    ],
)
def test_g92_under_tcp_without_axes_or_with_a_move_is_refused(tmp_path, hayashi, block, message):
    with pytest.raises(ToolpathError, match=f"part.nc:2: {message}"):
        turned(tmp_path, SHIFTED.replace("G92 C80", block), hayashi)


def test_g92_needs_a_known_position(tmp_path, hayashi):
    with pytest.raises(ToolpathError, match="G92 shifts C, whose position isn't in the program"):
        turned(tmp_path, "G21 G90\nG92 C80\nG0 X0 Y0 Z0 A0 C0\nG1 X1 F500\n", hayashi)
