"""Print what is said of programs and files that a control, or a body, takes otherwise than they look.

Usage: python tests/benchmarks/rules.py [WORD]       only the rows with this word in their title

Each row has what has to be said: a code, or a part of an error; *said* is the worst finding that has it. The
exit code is 1 where something isn't said, or is said of a program that is right.
"""

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fiveaxis as fx
from fiveaxis.base.errors import FiveAxisError
from fiveaxis.base.findings import Severity
from fiveaxis.check import Fixture
from fiveaxis.job import read_fixtures
from fiveaxis.model import Box

DATA = Path(__file__).parents[3] / "shared" / "data" / "programs"
IN_BOX, IN_CLAMPS = "15 mm into the fixture 'box'", "14.4 mm into the fixture 'two clamps'"
CUT = "G21 G90 G94 G17 G40 G49 G80\nG54\nT1 M6\nS3000 M3\nG0 X0. Y0. Z60. A0. C0.\n"
CUT += "G43.4 H1 Z50.\nG1 Z40. F500.\nX10. A-5.\n{}X20. A-6.\n{}G0 Z60.\nG91 G28 Z0.\nG90\nG49\nM5\n{}"
NGC = "G21 G90 G17 G94 F100\nG0 X0 Y0 Z0 A0 C0\n{}\nM2\n"


@dataclass
class Row:
    """A program or file, and what has to be said of it; empty where it is right as it is.

    Parameters
    ----------
    text : of a program; or the name of one in the shared data
    """

    title: str
    text: str
    says: str
    control: str | None = "fanuc"
    fixtures: str = ""
    box: bool = False
    length: float | None = None
    suffix: str = ".nc"


def fanuc(
    title: str,
    says: str,
    middle: str = "",
    end: str = "",
    last: str = "M30\n%\n",
    replaced: tuple[str, str] = ("", ""),
) -> Row:
    return Row(title, "%\nO1\n" + CUT.format(middle, end, last).replace(*replaced, 1), says)


def linuxcnc(title: str, says: str, line: str) -> Row:
    return Row(title, NGC.format(line), says, control="linuxcnc", suffix=".ngc")


def shared(title: str, name: str, says: str, **more: Any) -> Row:
    return Row(title, f"{name}.ngc", says, control=None, **more)


ROWS = (
    shared("G43 H1 and --tool-length, a box in the way", "g43_through_box", IN_BOX, length=150.0, box=True),
    shared("the same without --tool-length", "g43_through_box", IN_BOX, box=True),
    shared(
        "G81 with neither G98 nor G99, a clamp between",
        "cycle_no_g98_g99",
        "1.5 mm into the fixture 'clamp'",
        fixtures="cycle_clamp.toml",
    ),
    fanuc("a comment within a comment", "read-differently", "(G1 X11 (OLD) Z-20. A-96.5)\n"),
    linuxcnc("the same on LinuxCNC", "read-differently", "G1 X1\n(G1 X11 (OLD) Z-20.)\nX2"),
    fanuc("/ before a retract", "skipped-blocks", "/G0 Z50.\nG0 X30. A-6.\nG1 "),
    fanuc("/ before two cuts", "skipped-blocks", "/G1 X12. A-5.2\n/X14. A-5.4\n"),
    fanuc("/ before G43.4", "skipped-blocks", replaced=("G43.4", "/G43.4")),
    fanuc("/ before S M3", "skipped-blocks", replaced=("S3000", "/S3000")),
    fanuc("/ before G54", "skipped-blocks", replaced=("G54", "/G54")),
    fanuc("/ before T M6", "skipped-blocks", replaced=("T1", "/T1")),
    fanuc("% between the cuts", "program-end", "%\n"),
    fanuc("M30 missing", "program-end", last="%\n"),
    fanuc("M99 in its place", "program-end", last="M99\n%\n"),
    fanuc("M17 in its place", "program-end", last="M17\n%\n"),
    fanuc("a dwell of 20 s in the cut", "dwell-in-cut", "G4 P20000\n"),
    fanuc("G4 P2000, 2 s on a Fanuc", "", "G4 P2000\n"),
    fanuc("a tool change after the last cut, TCP on", "tcp-state", end="T2 M6\n"),
    fanuc("G49 without a retract before", "length-off", replaced=("G91 G28 Z0.\nG90\n", "")),
    fanuc("T, S, H, offsets beyond the table", "beyond-control", "S200000\n"),
    fanuc("% in a comment", "beyond-control", "(50% OF F)\n"),
    fanuc("a word without a decimal point", "whole-word", "X12 A-5.5\n"),
    fanuc("nothing wrong", ""),
    linuxcnc("(ABORT, …)", "beyond-control", "G1 X1\n(ABORT,WORN)\nX2"),
    linuxcnc("an arc 0.028 mm off by I J", "", "G2 X20.028 Y0 I10 J0"),
    linuxcnc("0.0284 mm", "more than 0.02828 mm", "G2 X20.0284 Y0 I10 J0"),
    linuxcnc("R 0.0013 mm too short", "too small", "G2 X20.0026 Y0 R10"),
    linuxcnc("EQ within 1e-4", "", "#1=1\n#2=1.00009\nG1 X[#1 EQ #2]"),
    linuxcnc("G94 in G94 clears F", "clears F", "G94\nG1 X1"),
    linuxcnc("G93 below 0.1 mm/min", "feed-floor", "G93 G1 X0.01 F1"),
    linuxcnc("a cycle under G93", "refuses cycles under G93", "G93 G81 X1 Z-1 R1 F1"),
    linuxcnc("a cycle with A", "refuses a cycle with A", "G81 X1 Z-1 R1 A3"),
    linuxcnc("three turns of an arc by P", "", "G2 X0 Y0 Z-3 I5 P3"),
    linuxcnc("ATAN2", "ATAN2", "G1 X[ATAN2[1]/[2]]"),
    linuxcnc("M94 C", "Heidenhain", "M94 C\nG1 X1"),
    linuxcnc("G92 E0", "3D printer", "G92 E0\nG1 X1"),
    shared("an OBJ that counts back", "obj_fixture", IN_CLAMPS, fixtures="fix_neg.toml"),
    shared("the same with plain numbers", "obj_fixture", IN_CLAMPS, fixtures="fix_pos.toml"),
)
# Found in a program that is short and made up, whatever it is about.
BESIDE = ("start-state", "approach-order", "spindle-off", "return-level")


def checked(row: Row, folder: Path) -> Iterator[tuple[Severity, str, str]]:
    """Verify a row's program: severity, code and message of all that is found."""
    file = DATA / row.text if row.text.endswith(".ngc") else folder / f"part{row.suffix}"
    if file.parent == folder:
        file.write_text(row.text)
    machine = fx.load_machine("hayashi-640123")
    machine = machine if row.length is None else machine.with_tool_length(row.length)
    named = read_fixtures(DATA / row.fixtures).get("fixture") if row.fixtures else []
    fixtures = [table.build() for table in named or ()]
    fixtures += [Fixture("box", Box((24.0, 24.0, 30.0), (0.0, 0.0, 15.0)))] if row.box else []
    try:
        report = fx.verify_program(
            file, machine, tool=fx.Tool.flat(6), fixtures=tuple(fixtures), control=row.control
        )
    except FiveAxisError as fault:
        yield Severity.ERROR, "refused", str(fault)
        return
    for finding in report.findings:
        yield finding.severity, finding.code, finding.message


def said(row: Row, folder: Path) -> tuple[bool, str]:
    """Tell whether what has to be said is, and what it is."""
    found = [f for f in checked(row, folder) if f[0] is not Severity.NOTE and f[1] not in BESIDE]
    found.sort(key=lambda f: f[0] is not Severity.ERROR)
    wanted = [f for f in found if row.says and (row.says == f[1] or row.says in f[2])]
    if not row.says:
        errors = [f for f in found if f[0] is Severity.ERROR]
        return not errors, "nothing" if not errors else f"{errors[0][1]}: {errors[0][2]}"
    if not wanted:
        return False, "nothing of it"
    severity, code, message = wanted[0]
    return True, f"{severity.name.lower()} {code}: {message.replace(str(folder), '')}"


def main(only: str = "") -> int:
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        for row in (row for row in ROWS if only in row.title):
            if row.text.endswith(".ngc") and not DATA.exists():
                print(f"     {row.title}: the shared data isn't here")
                continue
            right, text = said(row, Path(folder))
            missed += not right
            print(f"{'     ' if right else 'WRONG'}{row.title}: {text[:150]}", flush=True)
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:2]))
