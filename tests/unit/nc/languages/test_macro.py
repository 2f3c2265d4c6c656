"""Variables, loops, jumps and subprograms of G-code: what runs, where it leads, which line it belongs to."""

import re

import numpy as np
import pytest
from support.rs274 import canonical, needs_rs274

from fiveaxis.base.errors import ToolpathError
from fiveaxis.model import Machine, MoveKind
from fiveaxis.nc import read_program

MOVE = re.compile(r"STRAIGHT_FEED\(([^)]*)\)")
HEAD = "G21 G90 G94 F100\n"


@pytest.fixture
def cuts(tmp_path):
    """Read a program and the files beside it; return the ends of its cuts, (n, 3) mm, and their lines."""

    def read(text, **beside):
        for name, other in beside.items():
            (tmp_path / name.replace("_", ".")).write_text(other, encoding="ascii")
        path = tmp_path / "main.ngc"
        path.write_text(text, encoding="ascii")
        found = read_program(path, Machine.from_code("0123"), start=dict.fromkeys("XYZ", 0.0), rapid=1e4)
        cut = found.kind == MoveKind.CUT
        return found.positions[cut], found.source[cut].tolist()

    return read


@pytest.fixture
def fault(cuts):
    def of(text, **beside):
        with pytest.raises(ToolpathError) as caught:
            cuts(text, **beside)
        return str(caught.value)

    return of


def interpreted(text, folder):
    """Run a program on LinuxCNC's interpreter; return the ends of its cuts, (n, 3) mm."""
    run = canonical(folder / "main.ngc")
    return np.array([[float(v) for v in found[1].split(",")][:3] for found in MOVE.finditer(run)])


SUBROUTINES = """
o100 sub
  o101 if [#2 EQ 0]
    o100 return [#1]
  o101 endif
  G1 X#1 Y[#2*2] Z[#3+#<_depth>]
o100 endsub [5]
#<_depth>=-1
o100 call [1] [2] [3]
o100 call [7]
o100 call [#<_value>] [4]
"""
LOOPS = """
#<a>=3 #5=10
o101 while [#<a> GT 0]
  G1 X[#<a>] Y[SIN[#<a>*#5]]
  o102 repeat [#<a>]
    G91 G1 Z-0.5
  o102 endrepeat
  G90
  #<a>=[#<a>-1]
o101 endwhile
o103 do
  #<a>=[#<a>+1]
  G1 Z#<a>
o103 while [#<a> LT 3]
o104 while [1]
  #<a>=[#<a>+1]
  o105 if [#<a> EQ 5]
    o104 continue
  o105 elseif [#<a> GT 7]
    o104 break
  o105 else
    G1 Y#<a>
  o105 endif
o104 endwhile
G1 X[ATAN[1]/[-1]] Y[-2**2] Z[FIX[2.8]+FUP[2.2]+LN[EXP[2]]]
"""
FANUC_STYLE = """
G1 X1
M98 P100 L3
G1 Y7
M98 P200
M2
O100
G91 G1 X2 Y1
G90
M99
O200
G1 X0
M98 P100
G1 Z3
M99
"""
CALLED = (
    "o<pocket> sub\nG1 X#1\no101 while [#1 LT 3]\n#1=[#1+1]\nG1 Y#1\no101 endwhile\no<pocket> endsub\nM2\n"
)


@needs_rs274
@pytest.mark.parametrize(
    "text", [SUBROUTINES, LOOPS, FANUC_STYLE, "o<pocket> call [1]\nG1 X5\no<pocket> call [0]\n"]
)
def test_cuts_end_where_linuxcnc_s_interpreter_has_them(text, cuts, tmp_path):
    ours, _ = cuts(f"{HEAD}{text}M2\n", pocket_ngc=CALLED)
    theirs = interpreted(text, tmp_path)
    assert len(theirs) > 1
    # It prints four decimals.
    np.testing.assert_allclose(ours, theirs, atol=0.51e-4)


PATTERN = "O1000\nG91 G1 X#1 Y1.\nG90\nM99\n"


@pytest.mark.parametrize(
    ("text", "ends", "lines"),
    [
        ("M98 P1000\nM30\nO1000\nG1 X1.\nM99\n", [[1, 0, 0]], [5]),
        ("M98 P21000\nM30\nO1000\nG91 X1. G1\nM99\n", [[1, 0, 0], [2, 0, 0]], [5, 5]),
        ("G0 Z5. M98 P1000\nG1 Y2.\nM30\n%\nO1000\nG1 X1.\nM99\n", [[1, 0, 5], [1, 2, 5]], [7, 3]),
        ("M97 P10 L2\nG1 Z1.\nM30\nN10 G91 G1 X1.\nG90 M99\n", [[1, 0, 0], [2, 0, 0], [2, 0, 1]], [5, 5, 3]),
        ("#1=9.\nG65 P1000 A2. L2\nG1 Z#1\nM30\n" + PATTERN, [[2, 1, 0], [4, 2, 0], [4, 2, 9]], [7, 7, 4]),
        ("#1=3.\nM98 P1000\nM30\n" + PATTERN, [[3, 1, 0]], [6]),
        ("M98 P1000\nG1 X1.\nN7 G1 Y1.\nM30\nO1000\nG1 Z1.\nM99 P7\n", [[0, 0, 1], [0, 1, 1]], [7, 4]),
        (
            "#1=0\nWHILE [#1 LT 2.5] DO1\n#1=#1+1\nG1 X#1\nEND1\nG1 Y1.\n",
            [[1, 0, 0], [2, 0, 0], [3, 0, 0], [3, 1, 0]],
            [5, 5, 5, 7],
        ),
        (
            "#1=0\nN10 #1=#1+1\nG1 X#1\nIF[#1 LT 2.5]GOTO10\n"
            "IF [#1 EQ 3] THEN #2=8\nG1 Y#2\nGOTO 20\nX99\nN20 Z1.\n",
            [[1, 0, 0], [2, 0, 0], [3, 0, 0], [3, 8, 0], [3, 8, 1]],
            [4, 4, 4, 7, 10],
        ),
    ],
)
def test_statements_of_fanuc_and_haas_lead_where_the_manual_says(text, ends, lines, cuts):
    found, told = cuts(HEAD + text)
    np.testing.assert_allclose(found, ends, atol=1e-12)
    assert told == lines


def test_a_file_beside_the_program_runs_as_the_line_of_its_call(cuts):
    found, lines = cuts(
        HEAD + "M98 P7 L2\nG1 Y1.\n", O0007_NC="%\nO0007 (HOLES)\nG91 G1 X1.\nX1.\nG90 M99\n%\n"
    )
    np.testing.assert_allclose(found[:, 0], [1, 2, 3, 4, 4])
    assert lines == [2, 2, 2, 2, 3]


def test_block_delete_leaves_out_calls_and_statements_too(tmp_path):
    path = tmp_path / "part.nc"
    path.write_text(HEAD + "/2 M98 P1\n/#1=5.\nG1 X1.\nM30\nO1\nG1 Z9.\nM99\n", encoding="ascii")
    machine, start = Machine.from_code("0123"), dict.fromkeys("XYZ", 0.0)
    assert read_program(path, machine, start=start).positions[:, 2].max() == 9.0
    assert read_program(path, machine, start=start, block_delete=True).positions[:, 2].max() == 0.0


@pytest.mark.parametrize(
    ("text", "line", "fact"),
    [
        (
            "M98 P1000",
            2,
            "calls the program O1000, which is neither in this file nor in one of this name beside",
        ),
        ("M98 P31000", 2, "calls the program O31000"),
        ("M98 P1\nM30\nO1\nX1\nM99\nO1\nM99", 2, "its file has 2 times"),
        ("M98 P10001\nM30\nO1\nM99\nO10001\nM99", 2, "both exist, write L1"),
        ("M98 P1 L0\nM30\nO1\nM99", 2, "L0 depends on the control"),
        ("M98 P1 Q5\nM30\nO1\nM99", 2, "M98 with Q5 isn't supported"),
        ("M98\nM30", 2, "M98 needs P"),
        ("M98 P1\nM30\nO1\nM98 P1\nM99", 5, "calls and repetitions within one another"),
        ("M98 P1\nM30\nO1\nG1 X1.", 6, "has no return"),
        ("G65 P1\nM30\nO1\nG1 X#1\nM99", 5, "#1 has no value yet"),
        ("G66 P1", 2, "G66 calls or ends a subprogram"),
        ("o<hole> call [1]", 2, "calls the subroutine O<HOLE>"),
        ("o1 sub\nM2", 2, "SUB of 1 without ENDSUB"),
        ("o1 while [1]\nG1 X1\no2 endwhile", 4, "ENDWHILE of 2 without WHILE"),
        ("o1 if [0]\nG1 X1", 2, "IF without ENDIF"),
        ("o1 return", 2, "wasn't called"),
        ("#1=1\nWHILE [#1 LT 5] DO1\nG1 X1\nEND2", 5, "ENDWHILE of DO2 without WHILE"),
        ("WHILE [#1 LT 5] DO1\nEND1", 2, "#1 has no value yet"),
        ("IF [#100 EQ 1] GOTO 5", 2, "#100 has no value yet"),
        ("IF [1 EQ 1] G1 X1", 2, "after IF; write THEN or GOTO"),
        ("GOTO 5", 2, "goes to block N5, which none of the program's blocks is"),
        ("GOTO 5\nN5 X1\nN5 X2", 2, "which 2 of the program's blocks is"),
        ("#3000=1 (WRONG TOOL)", 2, "stops the program with an alarm"),
        ("M99 P5\nN5", 2, "goes where only the control says"),
        ("WHILE [1 EQ 1] DO1\nEND1", 3, "calls and repetitions; correct what doesn't end"),
        ("N1 GOTO 1", 2, "calls and repetitions; correct what doesn't end"),
    ],
)
def test_what_is_not_certain_or_not_there_is_refused_with_its_line(text, line, fact, fault):
    message = fault(HEAD + text + "\n")
    assert f"main.ngc:{line}: " in message
    assert fact in message


def test_a_fault_in_a_called_file_names_it_and_the_call(fault):
    message = fault(HEAD + "M98 P7\n", O7_nc="O7\nG1 X1\nG1 X1 X2\nM99\n")
    assert "main.ngc:2: " in message
    assert "in O7.nc, line 3, 'G1 X1 X2': X has two values" in message
