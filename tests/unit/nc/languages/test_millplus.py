"""MillPlus programs as blocks."""

import numpy as np
import pytest
from support.whole_files import each_path

import fiveaxis as fx
from fiveaxis.base.errors import ToolpathError
from fiveaxis.nc.languages.choice import MILLPLUS
from fiveaxis.nc.source import Source


def blocks_of(text, **options):
    return list(MILLPLUS.split(Source("part.nc", text.split("\n")), **options))


def block_of(text):
    return blocks_of(text)[-1]


def test_words_are_those_of_iso_except_indexed_ones():
    block = block_of("N10 G01 X1.5 Y-.5 F78.7 M03")
    assert (block.g, block.m, dict(block.words)) == (("G1",), ("M3",), {"X": 1.5, "Y": -0.5, "F": 78.7})
    assert block_of("G141 L2=0 F2=15000.").words == {}
    assert block_of("X=2").words == {"X": 2.0}


def test_tcp_is_on_between_its_words():
    assert [b.tip_control for b in blocks_of("G40\nG141 L2=0\nX1\nG40\nG174")] == [
        None,
        True,
        None,
        False,
        None,
    ]


def test_g93_shifts_the_zero_and_g7_tilts_the_plane_there():
    shift, tilt = blocks_of("G93 X1 Y2 Z3\nG7 A5=90. B5=0.0 C5=90.")
    assert tuple(shift.frame.origin) == (1.0, 2.0, 3.0)
    assert tuple(tilt.frame.origin) == (1.0, 2.0, 3.0)
    # A quarter about X, then one about the fixed Z: the plane's Z is the old X.
    np.testing.assert_allclose(tilt.frame.rotation[:, 2], [1, 0, 0], atol=1e-12)
    assert [f.code for f in tilt.findings] == ["plane-assumed"]


def test_the_angles_that_g7_computes_point_the_tool_along_its_normal():
    block = block_of("G00 B=E254 C=E255")
    assert block.vector == (0.0, 0.0, 1.0)
    assert block.words == {}


def test_arc_words_give_the_plane_and_start_at_the_centre():
    block = block_of("G03 Z215.5 J0.0 K4.5")
    assert block.g == ("G19", "G3")
    assert dict(block.words) == {"Z": 215.5, "J": -0.0, "K": -4.5}
    assert [f.code for f in block.findings] == ["arc-centre-assumed"]


def test_retractions_are_in_machine_coordinates():
    block = block_of("G74 X-.1 Y-.1 L1")
    assert (block.g, dict(block.words)) == (("G0", "G53"), {"X": -0.1, "Y": -0.1})


def test_a_cycle_drills_where_it_is_called():
    blocks = blocks_of("G81 Y.1 Z-.8 B2 F12.5\nG79 X1 Y2 Z8\nG79 X3")
    moves = [(b.g, dict(b.words)) for b in blocks[1:]]
    assert moves[:5] == [
        (("G0",), {"X": 1.0, "Y": 2.0}),
        (("G0",), {"Z": 8.1}),
        (("G1",), {"Z": 7.2, "F": 12.5}),
        (("G0",), {"Z": 8.1}),
        (("G0",), {"Z": 10.0}),
    ]
    assert moves[5:7] == [(("G0",), {"X": 3.0}), (("G0",), {"Z": 8.1})]


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("G79 X1", "none is in force"),
        ("G1 X1 X2", "X has two values"),
        ("G1 X1 Q", "'Q' isn't a word of MillPlus"),
        ("G1 X=E5", "X=E5 isn't supported"),
        ("G1 X1 K7=3", "K7=3.0 isn't supported"),
        ("X" + "1" * 50, "is longer than any number"),
    ],
)
def test_other_text_is_refused_with_its_line(text, fact):
    with pytest.raises(ToolpathError) as caught:
        blocks_of("X0\n" + text)
    assert caught.value.line == 2
    assert fact in caught.value.message


def test_block_delete_skips_blocks():
    assert [b.skipped for b in blocks_of("/N10 X1\nX2", block_delete=True)] == [True, False]


def test_every_arc_of_a_real_program_starts_and_ends_at_its_radius(data):
    """Read from start to centre, as on other controls, the first arc already fits no circle."""
    path = data / "toolpaths" / "nx_dmc160u_millplus.nc"
    read = each_path(path, machine=fx.Machine.from_code("650123"), tool=fx.Tool.ball(6))
    sources = np.concatenate([each.source for each in read])
    text = path.read_text(encoding="latin-1").split("\n")
    arcs = [i for i, line in enumerate(text, start=1) if " I" in line or " J" in line or " K" in line]
    moving = {i for i in arcs if any(c in text[i - 1] for c in ("X", "Y", "Z")) and "G54" not in text[i - 1]}
    chords = [int((sources == i).sum()) for i in sorted(moving) if "G84" not in text[i - 1]]
    assert len(chords) > 60
    assert min(chords) > 1
