"""Detection of a program's language."""

import pytest

from fiveaxis.base.errors import SettingError, ToolpathError
from fiveaxis.model import Tool
from fiveaxis.nc import read_toolpath
from fiveaxis.nc.languages.choice import ISO, KLARTEXT, LONGEST_LINE, find_language
from fiveaxis.nc.source import Source, load_source


def language_of(text, name="part.nc"):
    return find_language(Source(name, text.split("\n"))).name


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("G0 X1\nN20 TRAORI", "Sinumerik 840D"),
        ("G1 X=R1", "Sinumerik 840D"),
        ("G1 X1 A3=0.6 B3=0 C3=0.8", "Sinumerik 840D"),
        ("G0 SUPA Z0", "Sinumerik 840D"),
        ("DEF REAL _X", "Sinumerik 840D"),
        ('MSG("part")', "Sinumerik 840D"),
        ('CYCLE800(1,"TC1")', "Sinumerik 840D"),
        ("TRANS X5", "Sinumerik 840D"),
        ("%_N_PART_MPF", "Sinumerik 840D"),
        ("0 BEGIN PGM part MM", "Heidenhain Klartext"),
        ("begin pgm part inch", "Heidenhain Klartext"),
        ("N10 G141 L2=0 F2=15000.", "MillPlus"),
        ("G00 B=E254 C=E255", "MillPlus"),
        ("G7 A5=15. B5=0.0 C5=210. L1=1", "MillPlus"),
        ("%\nO1\nG0 X1", "ISO"),
        ("#101=5\nX#101", "ISO"),
        ("(TRAORI)\nG1 X1 (X=5)", "ISO"),
        ("(MSG, hello)\nG1 X1 ; CYCLE800(1)", "ISO"),
        ("IF [#1 EQ 2] GOTO 5", "ISO"),
        ("", "ISO"),
        ("(a (TRAORI) b DEF REAL x) G1 X1", "ISO"),
        (f"({'a' * 250} TRANS X5)\nG1 X1", "ISO"),
        ("Information TRANS\nMSG(1)\n%\nO1\nG0 X1", "ISO"),
    ],
)
def test_words_show_the_language(text, name):
    assert language_of(text) == name


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("linuxcnc_impeller_xyzac.ngc", "ISO"),
        ("linuxcnc_boat_xyzac.ngc", "ISO"),
        ("nx_haas_vf2tr_machine_inch.nc", "ISO"),
        ("nx_nmv5000_fanuc_mm.nc", "ISO"),
        ("nx_dmc160u_millplus.nc", "MillPlus"),
        ("nx_dmu70_840d_traori_inch.mpf", "Sinumerik 840D"),
        ("spinner_achskreuz_840D_mm.mpf", "Sinumerik 840D"),
    ],
)
def test_real_programs_are_recognised_without_their_suffix(data, file, name):
    lines = load_source(data / "toolpaths" / file).lines
    assert find_language(Source("part", lines)).name == name


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("a.mpf", "Sinumerik 840D"),
        ("a.SPF.gz", "Sinumerik 840D"),
        ("a.h", "Heidenhain Klartext"),
        ("a.i", "ISO"),
    ],
)
def test_without_a_sign_the_suffix_decides(file, name):
    assert language_of("G1 X1 F5", file) == name
    # The words take precedence.
    assert language_of("0 BEGIN PGM a MM", file) == "Heidenhain Klartext"


@pytest.mark.parametrize(
    ("lines", "name"),
    [
        (("%", "O1 (TOOL CALL 5 Z, TRAORI, BEGIN PGM X MM)", "N1 G1 X1 (G141 R1=0)", "; MSG(TRAORI)"), "ISO"),
        (("; BEGIN PGM X MM", ";TOOL CALL 1 G43.4", 'MSG("TOOL CALL 1")', "TRAORI", "X=1"), "Sinumerik 840D"),
        (("0 BEGIN PGM X MM ; TRAORI", "1 ; G43.4 H1 CYCLE81(1)", "2 L X+1 ; R1=5"), "Heidenhain Klartext"),
        (("N1 G141 R1=0 L1=0 (TRAORI)", "(TOOL CALL 1)"), "MillPlus"),
    ],
)
def test_words_in_comments_and_texts_tell_no_language(lines, name):
    assert language_of("\n".join(lines), "part") == name


def test_the_language_that_is_said_outright_is_taken(tmp_path):
    path = tmp_path / "part.nc"
    path.write_text("Q1 = 5\nL X+1 Y+2 Z+3 FMAX\nL X+4 F100\n")
    read = read_toolpath(path, tool=Tool.ball(6), language="klartext")
    assert read.tips(read.axis)[-1].tolist() == [4.0, 2.0, 3.0]
    assert read.operation.language == "Heidenhain Klartext"
    with pytest.raises(ToolpathError, match=r"part\.nc:1: .*Q1"):
        read_toolpath(path, tool=Tool.ball(6), language="iso")
    with pytest.raises(SettingError, match="klartext"):
        read_toolpath(path, tool=Tool.ball(6), language="heidenhain")


def test_words_of_g_code_outweigh_a_foreign_suffix():
    assert language_of("%\nO0001\nG21 G90\nG1 X1 F5\n%", "program.mpf") == "ISO"
    assert language_of("G92.1\nG1 X1 F5", "program.h") == "ISO"


def words_of(text, language=ISO):
    return [(b.line, b.g, dict(b.words)) for b in language.split(Source("part.nc", text.split("\n")))]


def test_a_listing_before_the_program_is_no_program():
    listing = "Part list, form-shaping\nmachine: X 5 axes\n\n"
    assert words_of(f"{listing}%\nG0 X1\n%") == [(5, ("G0",), {"X": 1})]
    klartext = f"{listing}0 BEGIN PGM A MM\n1 L X+1 R0 FMAX\n"
    assert words_of(klartext, KLARTEXT)[-1] == (5, ("G0",), {"X": 1})
    # Lines that move are a program, even before %, and text among them is a fault.
    assert words_of("G0 X1\n%\n") == [(1, ("G0",), {"X": 1})]
    with pytest.raises(ToolpathError, match=r"part.nc:1: 'Information': 'INFORMATION' isn't a word"):
        words_of("Information\nG0 X1\n%\nG0 X2")


@pytest.mark.parametrize("name", ["O<PART-1>", "<PART_1>", "N1 O<a.b>", ":0001", "$PART.MIN%"])
def test_a_name_of_a_program_moves_nothing(name):
    assert words_of(f"%\n{name}\nG0 X1") == [(2, (), {"O": 0}), (3, ("G0",), {"X": 1})]


@pytest.mark.parametrize("head", ["%PART G71 *", "N10 G30 G17 X+0 Y+0 Z-40 *"])
def test_heidenhains_own_iso_is_refused_as_such(head):
    with pytest.raises(ToolpathError, match=r"part.nc:1: .* is DIN/ISO of Heidenhain"):
        words_of(f"{head}\nN20 G31 X+100 Y+100 Z+0 *\nN30 G01 X+5 F100 M128")


def test_lost_line_ends_are_reported_as_such():
    with pytest.raises(
        ToolpathError, match=r"part.nc:2: 'X1X1X1X1X1X1X1X1X1X1'…: a line of 10000 characters"
    ):
        list(ISO.split(Source("part.nc", ["G0 X1", "X1" * 5000])))
    assert LONGEST_LINE < 10_000
