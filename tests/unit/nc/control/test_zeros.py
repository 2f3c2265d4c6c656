"""Zeros and planes that G-code moves: local shifts, positions that are set anew, tables that turn."""

import re

import numpy as np
import pytest
from support.rs274 import canonical, needs_rs274

from fiveaxis.base.errors import ToolpathError
from fiveaxis.model import Machine, MoveKind, Tool, load_machine
from fiveaxis.nc import read_operations, read_program, read_toolpath

HEAD = "G21 G90 G94 F100\nG0 X0 Y0 Z0\n"
BALL = Tool.ball(4)


@pytest.fixture
def cuts(tmp_path):
    """Read a program of three axes; return the ends of its cuts, (n, 3) mm."""

    def read(text):
        path = tmp_path / "part.ngc"
        path.write_text(HEAD + text, encoding="ascii")
        found = read_program(path, Machine.from_code("0123"), rapid=1e4)
        return found.positions[found.kind == MoveKind.CUT]

    return read


def interpreted(path):
    """Return where the axes end in every cut, (n, 3) mm, as LinuxCNC's interpreter has it."""
    ends, offset = [], np.zeros(3)
    for word, numbers in re.findall(r"(SET_G92_OFFSET|STRAIGHT_FEED)\(([^)]*)\)", canonical(path)):
        values = np.array([float(v) for v in numbers.split(",")[:3]])
        if word == "STRAIGHT_FEED":
            ends.append(values + offset)
        else:
            offset = values
    return np.array(ends)


@needs_rs274
@pytest.mark.parametrize(
    "text",
    [
        "G52 X10 Y20\nG1 X1 Y1\nG52 X5\nG1 X1 Y2\nG91 G1 X1\nG90\nG52 X0 Y0 Z0\nG1 X0 Y3",
        "G1 X3 Y4\nG92 X0 Z10\nG1 X1 Y1 Z9\nG92 Y0\nG1 X2 Y2\nG92.1\nG1 X2 Y2",
        "G52 X1\nG1 X1\nY1",
    ],
)
def test_shifts_are_those_of_linuxcnc_s_interpreter(text, cuts, tmp_path):
    ours = cuts(f"{text}\nM2\n")
    theirs = interpreted(tmp_path / "part.ngc")
    assert len(theirs) > 1
    np.testing.assert_allclose(ours, theirs, atol=0.51e-4)


@pytest.mark.parametrize("plane", ["G17", "G18", "G19"])
def test_absolute_centres_are_points_of_the_program(plane, cuts):
    # A quarter about (10, 20, 30) of a radius of 5 mm, from the plane's second axis to its first, reversed.
    axes = {"G17": "XY", "G18": "ZX", "G19": "YZ"}[plane]
    centre = dict(zip("XYZ", (10.0, 20.0, 30.0), strict=True))
    begin = dict(centre) | {axes[0]: centre[axes[0]] + 5.0}
    end = dict(centre) | {axes[1]: centre[axes[1]] + 5.0}
    ijk = " ".join(f"{'IJK'['XYZ'.index(c)]}{centre[c]:g}" for c in axes)
    text = f"{plane} G90.1\nG0 {_words(begin)}\nG3 {_words(end)} {ijk}\n"
    points = cuts(text)
    distance = np.linalg.norm(points - list(centre.values()), axis=1)
    np.testing.assert_allclose(distance, 5.0, atol=1e-9)
    np.testing.assert_allclose(points[-1], list(end.values()))
    np.testing.assert_allclose(
        cuts(text.replace("G90.1", "G91.1").replace(ijk, _from(begin, centre, axes))), points
    )


def _words(place):
    return " ".join(f"{c}{v:g}" for c, v in place.items())


def _from(begin, centre, axes):
    return " ".join(f"{'IJK'['XYZ'.index(c)]}{centre[c] - begin[c]:g}" for c in axes)


def test_a_tilted_plane_lies_at_its_origin_from_the_local_shift(tmp_path):
    path = tmp_path / "part.nc"
    text = "G52 X100.\nG68.2 X10. Y0. Z5. I90. J90. K0.\nG53.1\nG0 X0 Y0 Z1.\nG1 X1. Y2. F100\nG69\nM30\n"
    path.write_text("G21 G90 G94\n" + text, encoding="ascii")
    found = read_toolpath(path, tool=BALL)
    # Rotated by 90 about Z, then by 90 about the new X: the plane's X is Y, its Y is Z, its Z is X.
    np.testing.assert_allclose(found.tips(found.axis)[-1], [100 + 10 + 1, 1, 5 + 2], atol=1e-12)
    np.testing.assert_allclose(found.axis[-1], [1, 0, 0], atol=1e-12)
    again = path.read_text().replace("I90. J90. K0.", "P1 J90.")
    path.write_text(again, encoding="ascii")
    found = read_toolpath(path, tool=BALL)
    # About Y alone: the plane's X is -Z, its Z is X.
    np.testing.assert_allclose(found.tips(found.axis)[-1], [100 + 10 + 1, 2, 5 - 1], atol=1e-12)


def test_under_dynamic_work_offset_the_zero_goes_with_the_table(tmp_path):
    machine = load_machine("linuxcnc-xyzac-trt")
    path = tmp_path / "part.nc"
    text = (
        "G21 G90 G94\nG0 A-90. C0.\nG43 H1\nG254\nG0 X1. Y2.\nG0 Z3.\nG1 X5. Y2. F100\nG255\nG0 A0 C0\nM30\n"
    )
    path.write_text(text, encoding="ascii")
    found = read_toolpath(path, tool=BALL, machine=machine)
    [operation] = read_operations(path, machine=machine)
    cut = found.cutting
    axis = found.axis[cut][-1]
    assert operation.kind == "3+2"
    # The tool, along the machine's Z, is the workpiece's axis; X stays the same, and A turns Y and Z.
    np.testing.assert_allclose(np.abs(axis), [0, 1, 0], atol=1e-12)
    across = np.cross(axis, [1.0, 0.0, 0.0])
    np.testing.assert_allclose(
        found.tips(found.axis)[cut][-1], np.array([5.0, 0, 0]) + 3 * axis + 2 * across, atol=1e-12
    )


@pytest.mark.parametrize(
    ("text", "line", "fact"),
    [
        ("G52 X1 G1", 3, "G52 is supported for X, Y, Z"),
        ("G52 C5", 3, "G52 is supported for X, Y, Z"),
        ("G68.2 I90\nG52 X5", 4, "outside of a tilted plane"),
        ("G91\nG52 X5", 4, "G52 under G91"),
        ("G92 X5\nG52 X5", 4, "after G92 depends on the control"),
        ("G52 X5\nG92.1", 4, "G92.1 cancels G52 on LinuxCNC alone"),
        ("G68.2 I90\nG92 X5", 4, "outside of TCP and tilted planes"),
        ("G68.2 P1 I10 J20", 3, "G68.2 P1 isn't supported"),
        ("G68.3", 3, "where a parameter of the control says"),
        ("G54.4 P1", 3, "which only the control knows"),
        ("G254", 3, "G254 without the machine"),
        ("G16 H2", 3, "G16 shifts"),
        ("G10 L20 P1 X0", 3, "isn't supported"),
        ("G90.1\nG2 X1 I5", 4, "starts"),
    ],
)
def test_what_depends_on_the_control_is_refused_with_its_line(text, line, fact, tmp_path):
    path = tmp_path / "part.nc"
    path.write_text(HEAD + text + "\nG1 X9 Y9 Z9\n", encoding="ascii")
    with pytest.raises(ToolpathError) as caught:
        read_toolpath(path, tool=BALL)
    assert f"part.nc:{line}: " in str(caught.value)
    assert fact in str(caught.value)


def test_rotary_axes_do_not_turn_under_dynamic_work_offset(tmp_path):
    path = tmp_path / "part.nc"
    path.write_text("G21 G90\nG0 A-90. C0.\nG254\nG0 X1. Y2. Z3.\nG1 C5. F100\nM30\n", encoding="ascii")
    with pytest.raises(ToolpathError, match=r"part\.nc:5: rotary axes turn under G254 \(line 3\)"):
        read_toolpath(path, tool=BALL, machine=load_machine("linuxcnc-xyzac-trt"))


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("G15 H1", "G15 H2"), ("G15 H1", "G15 H2")),
        (("G54 P1", "G54 P12"), ("G54.1 P1", "G54.1 P12")),
        (("G59.1", "G154 P3"), ("G59.1", "G154 P3")),
    ],
)
def test_each_zero_is_an_operation_under_the_name_of_its_control(words, named, tmp_path):
    path = tmp_path / "part.nc"
    parts = (f"{word}\nG0 X0 Y0\nZ5.\nG1 Z0 F100\nX9.\nG0 Z5.\n" for word in words)
    path.write_text("G21 G90 G94\n" + "".join(parts) + "M30\n", encoding="ascii")
    assert [operation.work_offset for operation in read_operations(path)] == list(named)
