"""The unit of lengths: stated, asked for, or told from the sizes."""

import numpy as np
import pytest

from fiveaxis.model import Tool, load_machine
from fiveaxis.nc import read_program, read_toolpath

BALL = Tool.ball(10)


@pytest.fixture
def read(tmp_path):
    def read_text(name, text, **options):
        path = tmp_path / name
        path.write_text(text)
        return read_toolpath(path, tool=BALL, **options)

    return read_text


def finding(path, code):
    [found] = [f for f in path.findings if f.code == code]
    return found.message


INCH_HEAD = "UNITS/INCHES\nCUTTER/10\nFEDRAT/1193.66\nGOTO/0,0,0\nGOTO/240,10,0\n"


def test_a_header_of_inches_over_numbers_of_mm_is_told_and_unit_overrides_it(read):
    """240 in are 6096 mm, 1193.66 in/min are 30 319 mm/min, a cutter of 10 in is 254 mm."""
    stated = read("part.cls", INCH_HEAD)
    assert stated.tips(stated.axis)[-1].tolist() == [6096, 254, 0]
    message = finding(stated, "unit-doubtful")
    assert "as inch, cuts over 240 mm at up to F1193.66 mm/min by a cutter of 10 mm as mm" in message
    assert "cuts over 6096 mm at up to F30319 mm/min by a cutter of 254 mm" in message
    assert message.endswith("set unit=mm (--unit mm) if that is meant")
    asked = read("part.cls", INCH_HEAD, unit="mm")
    assert asked.tips(asked.axis)[-1].tolist() == [240, 10, 0]
    np.testing.assert_allclose(asked.feed * 60.0, 1193.66)
    assert finding(asked, "unit-overridden").startswith(
        "the file states inch, and is read in mm as asked for"
    )
    assert "unit-doubtful" not in {f.code for f in asked.findings}


def test_a_file_without_unit_is_in_inches_where_mm_cannot_be(read):
    """F1.5 mm/min is no feed of milling, and 1.5 in/min is 38 mm/min."""
    path = read("part.nc", "G90\nG0 X0 Y0 Z1\nG1 X2 F1.5\nM30\n")
    assert path.tips(path.axis)[-1].tolist() == [50.8, 0, 25.4]
    message = finding(path, "unit-assumed")
    assert "the feed of 1.5 mm/min is below 4: cuts over 0 mm" in message
    assert message.endswith("inch is assumed instead, set unit=mm (--unit mm) if it isn't")
    usual = read("part.nc", "G90\nG0 X0 Y0 Z1\nG1 X2 F15\nX4\nM30\n")
    assert usual.tips(usual.axis)[-1].tolist() == [4, 0, 1]
    assert "F15 mm/min as mm, cuts over 50.8 mm at up to F381 mm/min as inch" in finding(
        usual, "unit-assumed"
    )


def test_sizes_that_fit_neither_unit_are_told_with_both_figures(read):
    """Cuts over 9 m are too large in mm; in inches they are too large, too, and F1 isn't too slow."""
    path = read("part.nc", "G90\nG0 X0 Y0 Z1\nG1 Z0 F1\nX9000\nM30\n")
    assert path.tips(path.axis)[-1].tolist() == [9000, 0, 0]
    doubt = finding(path, "unit-doubtful")
    assert (
        "in mm, as they are read, the cuts' extent of 9000 mm is above 4000 and the feed of 1 mm/min" in doubt
    )
    assert "; in inch, the cuts' extent of 228600 mm is above 4000: cuts over 9000 mm at up to F1" in doubt
    assert "cuts over 228600 mm at up to F25.4 mm/min as inch" in doubt


def test_the_travel_of_a_machine_is_evidence(tmp_path):
    """The longest travel is 500 mm, so that no part is over 1 m; 60 in are 1524 mm."""
    machine = load_machine("dmu50ev")
    file = tmp_path / "part.nc"
    file.write_text("G20 G90\nG0 X0 Y0 Z0 B0 C0\nG1 X-30 F20\nX30\nM30\n")
    doubt = finding(read_program(file, machine, rapid=5000), "unit-doubtful")
    assert (
        "lengths are read in inch, as the file says, and the cuts' extent of 1524 mm is above 1000" in doubt
    )
    asked = read_program(file, machine, rapid=5000, unit="mm")
    assert machine.shown(asked.positions)[-1, 0] == pytest.approx(30)
    assert "unit-doubtful" not in {f.code for f in asked.findings}


def test_points_of_ten_metres_are_doubted(read):
    doubt = finding(
        read("part.csv", "x,y,z,i,j,k\n0,0,0,0,0,1\n400,0,0,0,0,1\n", unit="inch"), "unit-doubtful"
    )
    assert "cuts over 10160 mm as inch, cuts over 400 mm as mm" in doubt
    assert read("part.csv", "x,y,z,i,j,k\n0,0,0,0,0,1\n400,0,0,0,0,1\n").findings == ()
