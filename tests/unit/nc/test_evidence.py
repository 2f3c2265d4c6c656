"""What a program leaves open (zero, decimal points, units of angles and feeds) is told by sizes and path."""

import numpy as np
import pytest

import fiveaxis as fx

BALL = fx.Tool.ball(6)
TURNING = "G21 G90 G54\nG0 X0. Y0. Z50. B0. C0.\nG1 Z2. F1000\nX12. Y2. B5. C10.\nX14. Y4. B10. C20.\nM30\n"
INCHES = "UNITS/INCHES\nCUTTER/.25,.125\nFEDRAT/40,IPM\nGOTO/0,0,2,0,0,1\nGOTO/1,0,0,0,.6,.8\n"
WHOLE = """G21 G90 G54
G0 X0 Y0 B0 C0
G43.4 H1 Z50000
G1 X10000 Z2000 F1000
X12000 Y2000 B5000 C10000
M30
"""


@pytest.fixture(scope="module")
def machine():
    return fx.load_machine("dmu50ev")


def found(read, code):
    return [f for f in read.findings if f.code == code]


def test_a_zero_that_isnt_stated_is_told_by_the_path(write, machine):
    path = fx.read_toolpath(write(TURNING), tool=BALL, machine=machine)
    [told] = found(path, "zero-by-path")
    assert "set zero" in told.message
    # With the rotary axes at 0 the words are positions on the workpiece.
    np.testing.assert_allclose(path.tips(path.axis)[:2], [[0, 0, 50], [0, 0, 2]], atol=1e-9)
    steps = np.linalg.norm(np.diff(path.tips(path.axis)[1:], axis=0), axis=1)
    wrong = fx.read_toolpath(write(TURNING), tool=BALL, machine=machine, zero={"X": 0.0})
    assert 2 * steps.sum() < np.linalg.norm(np.diff(wrong.tips(wrong.axis)[1:], axis=0), axis=1).sum()
    assert not found(wrong, "zero-by-path")
    motion = fx.read_program(write(TURNING), machine, rapid=1e4)
    assert [f.message for f in found(motion, "zero-by-path")] == [told.message]


def test_words_without_decimal_points_are_increments_where_sizes_fit_only_that(write, machine):
    path = fx.read_toolpath(write(WHOLE), tool=BALL, machine=machine)
    [told] = found(path, "increment-assumed")
    assert "cuts over 2 mm" in told.message
    assert "cuts over 2000 mm" in told.message
    np.testing.assert_allclose(path.tips(path.axis)[-1], [12, 2, 2])
    np.testing.assert_allclose(np.degrees(path.rotary[-1]), [10, -5])  # C, B reversed
    np.testing.assert_allclose(path.feed[-1] * 60, 1000)
    as_written = fx.read_toolpath(write(WHOLE), tool=BALL, machine=machine, increment=1.0)
    np.testing.assert_allclose(as_written.tips(as_written.axis)[-1], [12_000, 2000, 2000])
    with_a_point = fx.read_toolpath(write(WHOLE.replace("Y0", "Y0.")), tool=BALL, machine=machine)
    assert not found(with_a_point, "increment-assumed")


def test_angles_in_radians_are_a_warning_with_both_figures(write, machine):
    text = (
        "G21 G90 G54\nG0 X0 Y0 B0 C0\nG43.4 H1 Z50.\nG1 X10. F500\nX12. B.1 C1.5708\nX14. B.2 C3.1416\nM30\n"
    )
    [told] = found(fx.read_toolpath(write(text), tool=BALL, machine=machine), "angles-doubtful")
    assert "1.5708 deg, not 90 deg" in told.message
    assert told.place.line == 5
    degrees = text.replace("3.1416", "31.416")
    assert not found(fx.read_toolpath(write(degrees), tool=BALL, machine=machine), "angles-doubtful")


def test_a_unit_in_place_of_the_files_holds_for_its_feeds_too(write):
    stated = fx.read_toolpath(write(INCHES, "part.apt"))
    np.testing.assert_allclose(stated.feed * 60, 40 * 25.4)
    asked = fx.read_toolpath(write(INCHES, "part.apt"), unit="mm")
    np.testing.assert_allclose(asked.feed * 60, 40)
    # A feed in another unit than the file's says what it is.
    other = INCHES.replace("40,IPM", "1000,MMPM")
    np.testing.assert_allclose(fx.read_toolpath(write(other, "part.apt"), unit="mm").feed * 60, 1000)
