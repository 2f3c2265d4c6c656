"""Block delete: what a program does otherwise with the switch in the other position."""

from dataclasses import replace

import pytest

from fiveaxis.base.findings import Severity
from fiveaxis.check import Fixture, verify_program
from fiveaxis.model import Box, Tool, load_machine
from fiveaxis.nc import read_program

MACHINE = replace(load_machine("linuxcnc-xyzac-trt"), control="fanuc")
LINES = (
    "G21 G90 G94 G17 G54",
    "T1 M6",
    "S3000 M3",
    "M8",
    "G0 X0 Y0 Z40 A0 C0",
    "G43.4 H1 Z30",
    "G1 Z10 F500",
    "X20",
    "X30 Y5",
    "G0 Z30",
    "G0 X60",
    "G1 Z10",
    "X70",
    "G0 Z40",
    "G49",
    "M30",
)
BAD, DOUBTFUL = Severity.ERROR, Severity.WARNING


@pytest.fixture
def read(tmp_path):
    def read_text(lines, **options):
        path = tmp_path / "part.nc"
        path.write_text("\n".join(lines) + "\n", encoding="ascii")
        start = dict.fromkeys(MACHINE.letters, 0.0)
        return read_program(path, MACHINE, start=start, rapid=6e3, **options)

    return read_text


def skipping(*texts):
    """The program with ``/`` before some of its lines."""
    return [f"/{line}" if line in texts else line for line in LINES]


def told(motion):
    return [(f.severity, f.message) for f in motion.findings if f.code == "skipped-blocks"]


@pytest.mark.parametrize(
    ("lines", "what"),
    [
        (("G0 Z30",), "1 rapid moves go elsewhere, from a cut"),
        (("G43.4 H1 Z30",), "cuts have TCP or the tool's length in another state"),
        (("S3000 M3",), "5 cuts have another spindle"),
        (("G21 G90 G94 G17 G54",), "5 cuts have another work offset"),
        (("T1 M6",), "5 cuts have another tool"),
        (("X20",), "1 cuts begin or end elsewhere"),
    ],
)
@pytest.mark.parametrize("block_delete", [False, True])
def test_what_harms_the_cuts_is_an_error(read, lines, what, block_delete):
    # Without G54 the first offset is in force, and the unit that is stated nowhere is the caller's.
    [(severity, message)] = told(read(skipping(*lines), block_delete=block_delete, unit="mm"))
    assert severity == BAD
    if not block_delete:
        assert what in message
    assert f"with block delete {'off' if block_delete else 'on'}" in message


def test_cuts_that_are_left_out_between_retracts_and_coolant_are_a_warning(read):
    [(severity, message)] = told(read(skipping("G0 X60", "G1 Z10", "X70")))
    assert severity == DOUBTFUL
    assert "(11-13): with block delete on, 3 moves, 2 of them at feed, are left out" in message
    [(severity, message)] = told(read(skipping("M8")))
    assert (severity, "5 cuts have another coolant" in message) == (DOUBTFUL, True)


def test_what_changes_nothing_is_not_told(read):
    assert told(read([*LINES[:9], "/M1", "/(check)", "/N10", *LINES[9:]])) == []
    assert told(read(LINES)) == []


def test_a_program_that_stops_in_the_other_position_is_an_error(read):
    [(severity, message)] = told(read([*LINES[:8], "/G65 P9810", *LINES[8:]], block_delete=True))
    assert severity == BAD
    assert "with block delete off, it stops in line 9: '/G65 P9810': calls the program O9810" in message


def test_both_positions_are_verified(tmp_path):
    path = tmp_path / "part.nc"
    path.write_text("\n".join(skipping("G0 Z30")) + "\n", encoding="ascii")
    post = Fixture("post", Box((4.0, 60.0, 20.0), (45.0, 0.0, 10.0)))
    report = verify_program(path, MACHINE, tool=Tool.flat(6.0), fixtures=(post,))
    hits = [f for f in report.findings if f.code == "fixture-collision"]
    assert {(f.message.startswith("with block delete on: "), f.place.line) for f in hits} == {(True, 11)}
