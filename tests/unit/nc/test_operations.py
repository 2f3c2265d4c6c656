"""Programs and CL files of several operations: which they are, that none is merged, and that one is taken."""

import pytest

import fiveaxis as fx
from fiveaxis.base import Reading
from fiveaxis.base.errors import InputError, JobError, SeveralOperations
from fiveaxis.nc import ProgramReading, list_operations, load_program, load_source
from fiveaxis.nc.control.interpreter import Interpreter

BALL = fx.Tool.ball(6)
FACE = "T1 M6\nG0 B0 C0\nS2000 M3\nG0 X-40 Y0 M8\nG43 H1 Z50\nG1 Z0 F500\nX40\nG0 Z50\nM9\n"
DRILL = "T2 M6\nS3000 M3\nG0 X20 Y20\nG43 H2 Z50\nG98 G81 X20 Y20 Z-15 R3 F200\nX-20\nG80\n"
FINISH = (
    "T3 M6\nS12000 M4\nG0 X30 Y0 B0 C0\nG43.4 H3 Z50 M7\nG1 X30 Y0 Z2 F1500\nG1 X28 Y5 B12 C5\n"
    "X25 Y10 B14 C10\nG49\nG0 Z100\n"
)
APT = """UNITS/MM
LOADTL/1,ADJUST,11
CUTTER/10,5
SPINDL/8000,CCLW
COOLNT/MIST
FEDRAT/800,MMPM
GOTO/0,0,20,0,0,1
GOTO/10,0,0,0,0.6,0.8
LOADTL/2
CUTTER/6
CYCLE/DRILL,DEPTH,10,MMPM,200,CLEAR,3
GOTO/10,0,0,0,0,1
GOTO/20,0,0
CYCLE/OFF
FINI
"""


@pytest.fixture
def shop(write):
    """A program that faces with T1, drills with T2 and finishes in five axes with T3."""
    return write(f"G21 G90 G54\n{FACE}{DRILL}{FINISH}M30\n")


@pytest.fixture(scope="module")
def machine():
    return fx.load_machine("dmu50ev")


def test_operations_say_what_is_in_force_in_them(shop, machine):
    face, drill, finish = fx.read_operations(shop, machine=machine)
    assert [each.kind for each in (face, drill, finish)] == ["3-axis", "drilling", "simultaneous"]
    assert [each.tool for each in (face, drill, finish)] == ["1", "2", "3"]
    assert [each.length_offset for each in (face, drill, finish)] == ["1", "2", "3"]
    assert [each.spindle for each in (face, drill, finish)] == [2000, 3000, -12000]
    assert [each.coolant for each in (face, drill, finish)] == ["M8", "", "M7"]
    assert [each.tcp for each in (face, drill, finish)] == [False, False, True]
    assert (finish.first_line, finish.last_line, finish.work_offset) == (20, 24, "G54")


@pytest.mark.parametrize("read", ["path", "motion", "verify", "post"])
def test_every_reading_refuses_to_merge_them_and_lists_them(read, shop, machine):
    readings = {
        "path": lambda: fx.read_toolpath(shop, tool=BALL, machine=machine),
        "motion": lambda: fx.read_program(shop, machine, rapid=1e4),
        "verify": lambda: fx.verify_program(shop, machine, tool=BALL),
        "post": lambda: fx.post_program(shop, machine, control="fanuc", rapid=1e4),
    }
    with pytest.raises(SeveralOperations) as caught:
        readings[read]()
    told = str(caught.value)
    assert "3 operations" in told
    assert "--operation N" in told
    assert "2: lines 13-16, drilling, tool 2, length offset 2, S3000 M3, G54" in told


def test_one_operation_is_read_alone(shop, machine):
    path = fx.read_toolpath(shop, tool=BALL, machine=machine, operation=3)
    assert set(path.source.tolist()) == set(range(20, 25))
    motion = fx.read_program(shop, machine, rapid=1e4, operation=3)
    assert (motion.source[0], motion.time[0]) == (20, 0.0)
    assert {motion.technology.states[state].tool for state in motion.technology.state} == {"3"}
    with pytest.raises(InputError, match="has no operation 4; it holds 3"):
        fx.read_toolpath(shop, tool=BALL, machine=machine, operation=4)


def test_operations_of_a_cl_file(write):
    mill, drill = fx.read_operations(write(APT, "part.apt"))
    assert (mill.kind, mill.tool, mill.length_offset, mill.spindle, mill.coolant) == (
        *("simultaneous", "1", "11"),
        *(-8000, "MIST"),
    )
    assert (drill.kind, drill.tool) == ("drilling", "2")
    assert str(fx.read_toolpath(write(APT, "part.apt"), operation=2).tool) == "flat:6"


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        (FACE, "3-axis"),
        (DRILL.replace("G0 X20", "G0 B0 C0 X20"), "drilling"),
        (FACE.replace("B0", "B30"), "3+2"),
    ],
)
def test_only_5_axis_cuts_are_leaned(write, machine, text, kind):
    with pytest.raises(JobError, match=f"^[^:]*:[0-9]+: {kind.replace('+', '.')} work is never leaned"):
        fx.optimise(write(f"G21 G90 G54\n{text}M30\n"), machine, tool=BALL, cone=20)


def test_a_subprogram_that_two_tools_run_is_two_operations(tmp_path):
    path = tmp_path / "plate.h"
    path.write_text(
        "0 BEGIN PGM PLATE MM\n1 TOOL CALL 1 Z S1000\n2 L X+0 Y+0 Z+50 FMAX M3\n3 CALL LBL 1\n"
        "4 TOOL CALL 2 Z S2000\n5 CYCL DEF 247 SET Q339=+2\n6 L X+0 Y+0 Z+50 FMAX M3\n7 CALL LBL 1\n8 L M30\n"
        "9 LBL 1\n10 CYCL DEF 200 D Q200=2 Q201=-5 Q206=100 Q203=0 Q204=50\n11 L X+7 Y+8 FMAX M99\n12 LBL 0\n"
        "13 END PGM PLATE MM\n"
    )
    found = fx.read_operations(path)
    assert [(o.kind, o.tool, o.spindle, o.work_offset) for o in found] == [
        ("drilling", "1", 1000.0, ""),
        ("drilling", "2", 2000.0, "2"),
    ]
    for number in (1, 2):
        read = fx.read_toolpath(path, tool=fx.Tool.ball(4), operation=number)
        assert read.tips(read.axis)[read.cutting].tolist() == [[7.0, 8.0, -5.0]]
        assert read.source[read.cutting].tolist() == [12]


def test_where_nothing_can_be_read_the_first_fault_is_the_error(write, machine):
    file = write("G21 G90 G54\nT1 M6\nG91 G1 X5 F100\nT2 M6\nG91 G1 X5\nM30\n")
    with pytest.raises(InputError, match=r":3: X by an increment \(G91\) from a position"):
        fx.read_operations(file, machine=machine)


def test_what_is_found_in_an_operation_is_about_its_own_lines(tmp_path, machine):
    # Both operations dwell in a file that they call.
    (tmp_path / "O0100.nc").write_text("O0100\nG1 X5 B12 F900\nG4 P500\nX9 B14\nM99\n")
    each = "G53 G0 Z0\nT{} M6\nG0 X0 Y0 B0 C0\nG0 Z50\nG1 Z10 F500\nM98 P100\nG0 Z50\n"
    path = tmp_path / "main.nc"
    path.write_text("G21 G90 G94\n" + each.format(1) + each.format(2) + "M30\n")
    for number, begin in ((1, 2), (2, 9)):
        found = fx.read_toolpath(path, tool=BALL, machine=machine, operation=number).findings
        lines = {f.code: f.place.line for f in found if f.place.line is not None}
        assert lines["long-dwell"] == begin + 5
        assert ("approach-unknown" in lines) == (number == 1)
        [dwell] = [f.message for f in found if f.code == "long-dwell"]
        assert dwell.startswith("in O0100.nc, line 3, G4 P500 is taken as seconds")


def test_a_fault_in_a_called_file_is_named_with_that_files_line(tmp_path, machine):
    (tmp_path / "O0100.nc").write_text("O0100\nG1 X5 B12 F900\nX9 E3\nM99\n")
    path = tmp_path / "main.nc"
    path.write_text("G21 G90 G94\nG0 X0 Y0 Z5 B0 C0\nM98 P100\nM30\n")
    with pytest.raises(InputError, match=r"main\.nc:3: in O0100\.nc, line 3, E3: extrusion isn't read"):
        fx.read_toolpath(path, tool=BALL, machine=machine)
    plain = "".join(f"X{x} A{x}\n" for x in range(40))
    (tmp_path / "O0100.nc").write_text(f"O0100\nG1 X0 F900\n{plain}M99\n")
    with pytest.raises(InputError, match=r"main\.nc:3: in O0100\.nc, line 3, A0: .* no A"):
        fx.read_toolpath(path, tool=BALL, machine=machine)


def said(motion) -> list[tuple]:
    """Everything that is said of a motion, but the file's folder."""
    findings = [(f.code, f.message, f.place.line, f.place.location) for f in motion.findings]
    joins = [(join.step, join) for join in motion.technology.joins]
    return [
        motion.positions.tolist(),
        motion.time.tolist(),
        motion.source.tolist(),
        findings,
        joins,
        motion.ignored,
    ]


def test_operations_are_taken_from_one_run_of_their_program_and_read_as_from_one_of_their_own(
    shop, machine, monkeypatch, tmp_path
):
    alone = []
    for number in (1, 2, 3):
        copied = tmp_path / str(number) / shop.name
        copied.parent.mkdir()
        copied.write_bytes(shop.read_bytes())
        alone.append(said(fx.read_program(copied, machine, rapid=1e4, operation=number)))
    source, runs = load_source(shop), []
    begin = Interpreter.run
    monkeypatch.setattr(Interpreter, "run", lambda self, *lines: runs.append(1) or begin(self, *lines))
    listed = list_operations(source, ProgramReading(machine=machine, rapid=1e4))
    readings = [Reading(rapid=1e4, operation=number) for number in (3, 1, 2, 3, 1)]
    found = [said(load_program(source, machine, None, reading).motion) for reading in readings]
    assert found == [alone[number - 1] for number in (3, 1, 2, 3, 1)]
    assert [operation.number for operation in listed] == [1, 2, 3]
    assert len(runs) == 1
    load_program(source, machine, None, Reading(rapid=2e4, operation=1))
    assert len(runs) == 2
