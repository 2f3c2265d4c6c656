"""Blocks of G-code and the words in them."""

import pytest

from fiveaxis.base.errors import ToolpathError
from fiveaxis.nc.languages.choice import ISO
from fiveaxis.nc.source import Source


def blocks_of(text, **options):
    return list(ISO.split(Source("part.nc", text.split("\n")), **options))


def words_of(text):
    [block] = blocks_of(text)
    return dict(block.words)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("X  16.339 Y -25.409", {"X": 16.339, "Y": -25.409}),
        ("x1y-2z+3", {"X": 1, "Y": -2, "Z": 3}),
        ("X.5Y-.25Z7.", {"X": 0.5, "Y": -0.25, "Z": 7}),
        ("X 1 0 . 5", {"X": 10.5}),
        ("\tX1\tF 100 ", {"X": 1, "F": 100}),
        ("N10X1", {"X": 1}),
        ("/X1", {"X": 1}),
        ("/2 N10 X1", {"X": 1}),
        ("(to X9) X1 (and Y9)", {"X": 1}),
        ("X1 ; Y2 (or Z3", {"X": 1}),
        ("(a ; b) X1", {"X": 1}),
        ("(#508= (MILL_.25_PROFILE   )) X1", {"X": 1}),
    ],
)
def test_words_have_many_forms(text, words):
    assert words_of(text) == words


def test_g_and_m_words_lose_their_leading_zeros_and_keep_their_order():
    [block] = blocks_of("N5 G01 G43.4 M03 G005 M8")
    assert block.g == ("G1", "G43.4", "G5")
    assert block.m == ("M3", "M8")
    assert block.words == {}


def test_g5_with_p_alone_is_a_mode_and_no_spline():
    mode, spline = blocks_of("N1 G05 P10000\nG5 X1 Y2 I3 J4 P5 Q6")
    assert (mode.g, dict(mode.words), mode.ignored) == ((), {}, ("G5",))
    assert spline.g == ("G5",)


def test_lines_without_words_make_no_blocks():
    # Some posts of NX write the third line for the operator to fill in.
    text = "%\nO0001 (PART)\nO ENTER OP AND LAST 3 DIGITS\n\n(a comment)\n; another\nN10\nX1\n%"
    found = blocks_of(text)
    assert [(b.line, dict(b.words)) for b in found] == [(2, {"O": 1}), (8, {"X": 1})]


def test_block_delete_skips_blocks_unread():
    found = blocks_of("/#1=5\nX1\n / X2", block_delete=True)
    assert [b.skipped for b in found] == [True, False, True]
    assert found[0].words == found[2].words == {}


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("X1 X2", "X has two values, 1 and 2; write one of them"),
        ("F1 f2", "F has two values"),
        ("X", "'X' isn't a word of a letter and a number"),
        ("X1.2.3", "'.3' isn't a word"),
        ("X--1", "'X--1' isn't a word"),
        ("X1,R2", "is a chamfer or a rounding"),
        ("X#1", "#1 has no value yet"),
        ("#1=#2", "#2 has no value"),
        ("X[1+]", "']' where a number"),
        ("X[1/0]", "'[1/0]' has no value"),
        ("X#1+2", "'#' is a variable or an expression"),
        ("#1=5 X2", "'=' is Sinumerik code"),
        ("o<move> call", "calls the subroutine O<MOVE>"),
        ("O100 while [0]", "WHILE of 100 without ENDWHILE"),
        ("IF X1 GOTO 5", "jumps or repeats"),
        ("G1 X=5", "'=' is Sinumerik code"),
        ("CYCLE800(1)", "'CYCLE800' is a cycle"),
        ("TRANS X5", "'TRANS' changes the coordinates"),
        ("0 BEGIN PGM part MM", "Heidenhain"),
        ("X1 (no end", "opens a comment that isn't closed"),
        ("X1) Y2", "')' isn't a word"),
        ("X" + "1" * 50, "is longer than any number"),
        # The upper case of the long s is S, and this is a digit to Python: controls accept neither.
        ("ſ100", "isn't a word"),
        ("X١", "isn't a word"),
    ],
)
def test_other_text_is_refused_with_its_line_and_reason(text, fact):
    with pytest.raises(ToolpathError) as caught:
        blocks_of("X0\n" + text)
    assert str(caught.value).startswith("part.nc:2: ")
    assert fact in str(caught.value)


def switches_of(text):
    return [b.tip_control for b in blocks_of(text)]


@pytest.mark.parametrize(
    ("on", "off"),
    [
        ("G0 G43.4 H1", "G49"),
        ("g 43.5", "G43 H2"),
        ("N5 M428 ; TCP", "M429"),
        ("G141", "G40"),
        ("G234", "G49"),
        ("M128 F1000", "M129"),
    ],
)
def test_each_control_has_its_words_for_tcp(on, off):
    assert switches_of(f"{on}\nX1\n{off}") == [True, None, False]


def test_words_that_switch_off_on_one_control_mean_something_else_on_another():
    # LinuxCNC: G43 and G49 are tool length compensation, whatever the kinematics.
    assert switches_of("M428\nG43 H1\nG49\nM429") == [True, None, None, False]


@pytest.mark.parametrize("text", ["G43 H4", "M1280", "G43.45", "X1 (M428)", "X1 ; TRAORI", "X1 G40"])
def test_words_that_resemble_tcp_do_not_switch_it(text):
    assert switches_of(text) == [None]
