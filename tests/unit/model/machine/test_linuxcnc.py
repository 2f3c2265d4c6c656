"""Machines from LinuxCNC configurations: small ones written here, and real ones where there are any."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from support.linuxcnc_kinematics import five_axis, max5, pointing
from typer.testing import CliRunner

from fiveaxis.base.errors import MachineError
from fiveaxis.cli.commands import app
from fiveaxis.job import load_job_machine, read_job
from fiveaxis.model import Machine, load_machine, tool_poses
from fiveaxis.model.machine.ini import read_configuration
from fiveaxis.model.machine.linuxcnc import read_linuxcnc

RNG = np.random.default_rng(99)

TRUNNION = """# a trunnion
[EMC]
MACHINE = Trunnion

[KINS]
KINEMATICS = xyzac-trt-kins sparm=identityfirst
JOINTS = 5

[HAL]
HALUI = halui
HALFILE = LIB:basic_sim.tcl
HALCMD = net  :y-offset     xyzac-trt-kins.y-offset => trt-gui.y-offset
HALCMD = sets :y-offset     20
HALCMD = setp xyzac-trt-kins.z-offset 10
HALCMD = setp xyzac-trt-kins.x-rot-point 1.5

[TRAJ]
COORDINATES = X Y Z A C
LINEAR_UNITS = mm
ANGULAR_UNITS = degree

[AXIS_X]
MIN_LIMIT = -200
MAX_LIMIT = 210
MAX_VELOCITY = 20
; no acceleration

[AXIS_A]
   MIN_LIMIT = -100
   MAX_LIMIT =   50
MAX_VELOCITY = 30

[JOINT_0]
TYPE = LINEAR
MIN_LIMIT = -150   # where the switch is
MAX_LIMIT = 220
MAX_VELOCITY = 25
MAX_ACCELERATION = 300

[JOINT_3]
TYPE = ANGULAR
MIN_LIMIT = -90
MAX_LIMIT = 60
MAX_VELOCITY = 20
"""
BRIDGE = """[KINS]
KINEMATICS = 5axiskins
[TRAJ]
COORDINATES = XYZBCW
LINEAR_UNITS = inch
[HAL]
HALCMD = setp 5axiskins.pivot-length 10
[JOINT_3]
MIN_LIMIT = -100
MAX_LIMIT = 90
MAX_VELOCITY = 60
[JOINT_2]
MIN_LIMIT = -20
MAX_VELOCITY = 2
MAX_ACCELERATION = 4
"""
MAX = """[KINS]
KINEMATICS = maxkins
[MAX]
B_PIVOT_LENGTH = 75.5
[TRAJ]
COORDINATES = X Y Z B C
LINEAR_UNITS = 1.0
ANGULAR_UNITS = 1.0
[HAL]
HALFILE = max.hal
[JOINT_4]
MIN_LIMIT = -90
"""


def write(folder: Path, text: str, name: str = "mill.ini") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def read(folder: Path, text: str) -> Machine:
    return read_linuxcnc(write(folder, text))


def limits_deg(machine: Machine, letter: str) -> tuple[float, float]:
    limits = machine.axis(letter).limits
    return machine.axis(letter).shown(limits.low), machine.axis(letter).shown(limits.high)


def source(machine: Machine, figure: str) -> str:
    return next(p for p in machine.provenance if p.figure == figure).origin


# What is read


def test_a_trunnion_is_read_with_its_points_of_rotation(tmp_path):
    machine = read(tmp_path, TRUNNION)
    assert (machine.name, str(machine.code), machine.letters) == ("mill", "640123", "XYZAC")
    assert machine.description.startswith("Trunnion: ")
    lines = {j.letter: j.line.point for j in machine.chain.joints}
    assert lines["A"] == (1.5, 20.0, 10.0)
    assert lines["C"] == (1.5, 0.0, 0.0)


def test_limits_of_axis_and_joint_both_hold(tmp_path):
    x = read(tmp_path, TRUNNION.replace("; no acceleration", "MAX_JERK = 4000")).axis("X")
    assert (x.limits.low, x.limits.high) == (-150.0, 210.0)
    assert (x.max_speed, x.max_acceleration, x.max_jerk) == (20.0, 300.0, 4000.0)


def test_an_axis_that_counts_table_motion_is_reversed_and_its_limits_change_ends(tmp_path):
    machine = read(tmp_path, TRUNNION)
    assert [a.letter for a in machine.axes if a.reversed] == ["A", "C"]
    assert limits_deg(machine, "A") == pytest.approx((-50.0, 90.0))
    assert machine.axis("A").max_speed == pytest.approx(np.radians(20.0))
    assert "min -90, max 50 in the control's own sign" in source(machine, "A limits")


def test_where_there_is_no_limit_there_is_none(tmp_path):
    machine = read(tmp_path, TRUNNION.replace("MIN_LIMIT = -90\n", "").replace("   MIN_LIMIT = -100\n", ""))
    assert limits_deg(machine, "A") == pytest.approx((-50.0, np.inf))
    assert machine.axis("C").limits.unlimited
    assert read(tmp_path, TRUNNION.replace("= -90", "= -1e99")).axis("A").limits.high < 2.0


def test_without_axis_sections_the_joints_hold(tmp_path):
    machine = read(tmp_path, TRUNNION.replace("[AXIS_", "[FORMER_"))
    assert limits_deg(machine, "A") == pytest.approx((-60.0, 90.0))
    assert machine.axis("X").max_speed == 25.0


def test_conventional_directions_take_the_reversal_away(tmp_path):
    flag = "HALCMD = setp xyzac-trt-kins.conventional-directions"
    for value, counted in (("1", []), ("TRUE", []), ("0", ["A", "C"])):
        machine = read(tmp_path, TRUNNION.replace("[HAL]\n", f"[HAL]\n{flag} {value}\n"))
        assert [a.letter for a in machine.axes if a.reversed] == counted
        wanted = (-90.0, 50.0) if not counted else (-50.0, 90.0)
        assert limits_deg(machine, "A") == pytest.approx(wanted)


def test_every_figure_names_file_section_and_key(tmp_path):
    machine = read(tmp_path, TRUNNION)
    assert source(machine, "X limits") == "mill.ini [JOINT_0] MIN_LIMIT, [AXIS_X] MAX_LIMIT"
    assert source(machine, "X max_speed") == "mill.ini [AXIS_X] MAX_VELOCITY"
    line = source(machine, "A line")
    assert line.startswith(
        "mill.ini [KINS] KINEMATICS, setp xyzac-trt-kins.x-rot-point 1.5, sets :y-offset 20"
    )
    assert line.endswith("unset, so y-rot-point 0, z-rot-point 0")
    assert all(p.source for p in machine.provenance)
    assert [p.figure for p in machine.provenance if p.assumed] == ["structure"]


# Two sections of one name, others in another case, keys in another case, and keys that begin alike.
NAMES = """[axis_x]
MIN_LIMIT = -1
[AXIS_X] of the table
min_limit = -2
MIN_LIMIT2 = -3
MIN_LIMIT = -4
MIN_LIMIT = -5
[AXIS_Z]
MAX_VELOCITY = 9
 [AXIS_Y]
max_limit = 6
[AXIS_Z]
MIN_LIMIT = -7
[ JOINT_0 ]
MIN_LIMIT = -3
"""
HEAD = "[KINS]\nKINEMATICS = xyzac-trt-kins\n[TRAJ]\nCOORDINATES = XYZAC\nLINEAR_UNITS = mm\n"


def test_an_axis_has_the_figures_that_the_control_finds(tmp_path):
    machine = read(tmp_path, HEAD + NAMES)
    low, speed = ([getattr(machine.axis(c), k) for c in "XYZ"] for k in ("limits", "max_speed"))
    assert [limits.low for limits in low] == [-4.0, -np.inf, -np.inf]
    assert [limits.high for limits in low] == [np.inf] * 3
    assert speed == [None, None, 9.0]
    assert "not in force: [axis_x] MIN_LIMIT of line 7, [AXIS_X] min_limit of line 9" in machine.description
    assert "[AXIS_Z] MIN_LIMIT of line 18" in machine.description


def test_a_jerk_that_the_control_does_not_find_is_named_too(tmp_path):
    machine = read(tmp_path, HEAD + "[AXIS_X]\nmax_jerk = 900\n")
    assert machine.axis("X").max_jerk is None
    assert "not in force: [AXIS_X] max_jerk of line 7" in machine.description


@pytest.mark.skipif(shutil.which("inivar") is None, reason="inivar isn't installed (linuxcnc-uspace)")
@pytest.mark.parametrize("section", ["AXIS_X", "axis_x", "AXIS_Y", "AXIS_Z", "JOINT_0"])
@pytest.mark.parametrize("key", ["MIN_LIMIT", "min_limit", "MAX_LIMIT", "MAX_VELOCITY", "MIN"])
def test_linuxcncs_own_lookup_finds_the_same(tmp_path, section, key):
    path = write(tmp_path, HEAD + NAMES)
    command = ["inivar", "-ini", str(path), "-sec", section, "-var", key]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    found = read_configuration(path).find(section, key)
    assert (found.value if found else None) == (run.stdout.strip() if run.returncode == 0 else None)


def test_inches_become_mm(tmp_path):
    machine = read(tmp_path, BRIDGE)
    z = machine.axis("Z")
    assert (z.limits.low, z.limits.high) == pytest.approx((-508.0, np.inf))
    assert (z.max_speed, z.max_acceleration) == pytest.approx((50.8, 101.6))
    assert machine.chain.joints[-1].line.point == pytest.approx((0.0, 0.0, 254.0))
    number = read(tmp_path, BRIDGE.replace("= inch", "= 0.03937007874016"))
    assert number.axis("Z").limits.low == pytest.approx(-508.0)


def test_the_order_of_the_joints_is_that_of_the_module(tmp_path):
    swapped = TRUNNION.replace("sparm=identityfirst", "coordinates=xyzca").replace("[JOINT_3]", "[JOINT_4]")
    assert limits_deg(read(tmp_path, swapped), "A") == pytest.approx((-50.0, 90.0))


def test_both_joints_of_a_gantry_hold(tmp_path):
    text = (
        "[KINS]\nKINEMATICS = trivkins coordinates=XYYZ\n[TRAJ]\nCOORDINATES = XYYZ\nLINEAR_UNITS = mm\n"
        "[JOINT_1]\nMIN_LIMIT = -5\n[JOINT_2]\nMIN_LIMIT = -4\nMAX_LIMIT = 9\n[JOINT_3]\nMIN_LIMIT = -1\n"
    )
    machine = read(tmp_path, text)
    assert (machine.letters, machine.code.kind) == ("XYZ", "3-axis")
    assert (machine.axis("Y").limits.low, machine.axis("Y").limits.high) == (-4.0, 9.0)
    assert machine.axis("Z").limits.low == -1.0


def test_hal_files_beside_the_ini_are_read_and_look_up_its_keys(tmp_path):
    write(
        tmp_path, "loadrt [KINS]KINEMATICS\nsetp maxkins.pivot-length [MAX]B_PIVOT_LENGTH # mm\n", "max.hal"
    )
    machine = read(tmp_path, MAX)
    assert machine.chain.joints[-1].line.point == (0.0, 0.0, 75.5)
    assert "max.hal setp maxkins.pivot-length [MAX]B_PIVOT_LENGTH" in source(machine, "B line")


def test_without_its_hal_file_a_pivot_keeps_the_modules_default(tmp_path):
    machine = read(tmp_path, MAX)
    assert machine.chain.joints[-1].line.point == (0.0, 0.0, 0.666)
    entry = next(p for p in machine.provenance if p.figure == "B line")
    assert "unset, so pivot-length 0.666" in entry.source
    assert entry.assumed
    assert entry.note == "max.hal wasn't read and may set more"


def test_a_hal_file_that_calls_for_another_says_so(tmp_path):
    write(tmp_path, "source lengths.hal\n", "max.hal")
    entry = next(p for p in read(tmp_path, MAX).provenance if p.figure == "B line")
    assert entry.note == "lengths.hal wasn't read and may set more"


def test_included_files_are_read(tmp_path):
    head, tail = TRUNNION.split("[TRAJ]")
    write(tmp_path, f"[TRAJ]{tail}", "rest.inc")
    machine = read(tmp_path, f"{head}#INCLUDE rest.inc\n# INCLUDE is no comment of ours\n")
    assert limits_deg(machine, "A") == pytest.approx((-50.0, 90.0))
    assert "rest.inc [JOINT_3] MIN_LIMIT" in source(machine, "A limits")


def test_a_line_may_be_continued(tmp_path):
    assert (
        read(tmp_path, TRUNNION.replace("MAX_LIMIT = 210", "MAX_LIMIT = \\\n  210")).axis("X").limits.high
        == 210
    )


# The equations of the C sources


def test_5axiskins_is_reproduced(tmp_path):
    machine = read(tmp_path, BRIDGE.replace("= inch", "= mm").replace("length 10", "length 250"))
    joints, b, c = RNG.uniform(-100, 100, (50, 3)), RNG.uniform(-2, 2, 50), RNG.uniform(-6, 6, 50)
    tip, axis = tool_poses(machine, np.column_stack([joints, -b, c]))
    np.testing.assert_allclose(tip, five_axis(joints, b, c, 250.0), rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(axis, pointing(b, c), rtol=0.0, atol=1e-12)
    assert [a.letter for a in machine.axes if a.reversed] == ["B"]


@pytest.mark.parametrize("sense", [-1.0, 1.0])
def test_maxkins_is_reproduced(tmp_path, sense):
    words = f"conventional-directions {int(sense > 0)}\nsetp maxkins.pivot-length 75"
    write(tmp_path, f"setp maxkins.{words}", "max.hal")
    machine = read(tmp_path, MAX)
    joints, b, c = RNG.uniform(-100, 100, (50, 3)), RNG.uniform(-1.5, 1.5, 50), RNG.uniform(-6, 6, 50)
    tip, _ = tool_poses(machine, np.column_stack([joints, sense * b, c]))
    np.testing.assert_allclose(tip, max5(joints, b, c, 75.0, sense), rtol=0.0, atol=1e-10)
    assert [a.letter for a in machine.axes if a.reversed] == ([] if sense > 0 else ["B"])


# What is refused


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("[KINS]", "[KINE]", None, "has no [KINS] KINEMATICS"),
        (
            "[KINS]",
            "[kins]",
            None,
            "has no [KINS] KINEMATICS (line 6 isn't found: LinuxCNC 2.9 reads capitals",
        ),
        (
            "xyzac-trt-kins sparm",
            "genhexkins sparm",
            6,
            "'genhexkins' isn't known; known are trivkins, xyzac",
        ),
        (
            "xyzac-trt-kins sparm=identityfirst",
            "trivkins",
            18,
            "doesn't say where the rotary axes lie (A, C)",
        ),
        ("LINEAR_UNITS = mm", "LINEAR_UNITS = furlong", 19, "'furlong' must be one of mm, metric, in, inch"),
        ("LINEAR_UNITS = mm", "LINEAR_UNITS = 10", 19, "'10' must be one of mm"),
        ("LINEAR_UNITS = mm", "", None, "has no [TRAJ] LINEAR_UNITS, for example mm"),
        ("= degree", "= radian", 20, "xyzac-trt-kins counts in degrees, write deg"),
        ("X Y Z A C", "X Y Z A", 18, "xyzac-trt-kins needs the axis C"),
        ("sparm=identityfirst", "coordinates=xyza", 6, "needs the axis C, which [KINS] KINEMATICS"),
        ("MIN_LIMIT = -200", "MIN_LIMIT = low", 23, "[AXIS_X] MIN_LIMIT: 'low' must be a finite number"),
        ("MIN_LIMIT = -200", "MIN_LIMIT = nan", 23, "'nan' must be a finite number"),
        ("MIN_LIMIT = -200", "MIN_LIMIT =", 23, "'' must be a finite number"),
        ("MIN_LIMIT = -200", "MIN_LIMIT = 300", 23, "300 is not below MAX_LIMIT = 210; exchange them"),
        ("MAX_VELOCITY = 20\n;", "MAX_VELOCITY = 0\n;", 25, "MAX_VELOCITY = 0 must be above 0"),
        ("z-offset 10", "z-offset ten", 14, "z-offset ten: 'ten' must be a finite number"),
        ("HALCMD = sets :y-offset     20\n", "", 12, "takes its value from the signal :y-offset"),
        ("TYPE = ANGULAR", "TYPE = LINEAR", 41, "joint 3 of xyzac-trt-kins is A (ANGULAR)"),
        ("JOINTS = 5", "JOINTS 5", 7, "neither [SECTION] nor KEY = value"),
        ("JOINTS = 5", "#INCLUDE gone.inc", None, "gone.inc: no such file"),
        ("JOINTS = 5", "#INCLUDE mill.ini", 7, "nested more than 16 deep"),
    ],
)
def test_a_fault_is_named_with_file_and_line(tmp_path, old, new, line, message):
    assert old in TRUNNION
    path = write(tmp_path, TRUNNION.replace(old, new, 1))
    with pytest.raises(MachineError) as caught:
        read_linuxcnc(path)
    assert message in str(caught.value)
    assert str(caught.value.file).startswith(str(tmp_path))
    assert caught.value.line == line


def test_ranges_of_axis_and_joint_that_do_not_overlap_are_named_together(tmp_path):
    path = write(tmp_path, TRUNNION.replace("MIN_LIMIT = -90", "MIN_LIMIT = 55"))
    with pytest.raises(
        MachineError, match=r"\[JOINT_3\] MIN_LIMIT = 55 is not below \[AXIS_A\] MAX_LIMIT = 50"
    ) as caught:
        read_linuxcnc(path)
    assert caught.value.line == 42
    assert "the ranges of axis and joint don't overlap" in str(caught.value)


def test_conventional_directions_that_are_neither_are_refused(tmp_path):
    flag = "[HAL]\nHALCMD = setp xyzac-trt-kins.conventional-directions maybe\n"
    with pytest.raises(MachineError, match="'maybe' must be 0 or 1"):
        read(tmp_path, TRUNNION.replace("[HAL]\n", flag))


# Where an ini may stand


def test_a_machine_is_loaded_by_the_suffix_of_its_file(tmp_path):
    path = write(tmp_path, TRUNNION)
    assert load_machine(path).letters == "XYZAC"
    assert load_machine(str(path)).axis("A").reversed
    with pytest.raises(
        MachineError,
        match=r"mill\.yaml: has the unknown suffix '\.yaml'.* read from \.toml, \.ini, \.urdf, \.mch",
    ):
        load_machine(tmp_path / "mill.yaml")
    with pytest.raises(MachineError, match=r"mill: has no suffix"):
        load_machine(tmp_path / "mill")


def test_an_ini_in_a_job_is_relative_to_the_job(tmp_path, monkeypatch):
    write(tmp_path, TRUNNION)
    (tmp_path / "ring.csv").write_text("x,y,z,nx,ny,nz\n0,0,0,0,0,1\n")
    job = write(tmp_path, 'input = "ring.csv"\nmachine = "mill.ini"\ntool = "ball:10"\n', "job.toml")
    monkeypatch.chdir("/")
    assert load_job_machine(read_job(job)).name == "mill"


def test_import_writes_a_machine_file_that_is_the_same_machine(tmp_path):
    path, target = write(tmp_path, TRUNNION), tmp_path / "out" / "mill.toml"
    result = CliRunner().invoke(app, ["import", str(path), "-o", str(target)])
    assert result.exit_code == 0, result.output
    assert result.stdout == ""
    printed = CliRunner().invoke(app, ["import", str(path)]).stdout
    assert printed == target.read_text(encoding="utf-8")
    found, wanted = load_machine(target), load_machine(path)
    positions = RNG.uniform(-2, 2, (20, 5))
    np.testing.assert_allclose(tool_poses(found, positions), tool_poses(wanted, positions), atol=1e-12)
    assert [a.reversed for a in found.axes] == [a.reversed for a in wanted.axes]


def test_import_of_a_wrong_file_is_one_message(tmp_path):
    result = CliRunner().invoke(app, ["import", str(write(tmp_path, "[KINS]\nKINEMATICS = hexapod\n"))])
    assert result.exit_code == 2
    assert result.stderr.startswith("error: ")
    assert "mill.ini:2: kinematics 'hexapod' isn't known" in result.stderr
    assert result.stdout == ""


def test_info_shows_a_machine_from_an_ini(tmp_path):
    shown = json.loads(CliRunner().invoke(app, ["info", str(write(tmp_path, TRUNNION)), "--json"]).stdout)
    assert [joint["axis"] for joint in shown["chain"]] == list("CAXYZ")


# The real ones


def test_the_real_xyzac_configuration_is_the_machine_of_the_library(data, trunnion):
    found = read_linuxcnc(data / "machines" / "linuxcnc_xyzac-trt.ini")
    assert found.code == trunnion.code
    for mine, theirs in zip(found.chain.joints, trunnion.chain.joints, strict=True):
        assert (mine.letter, mine.line) == (theirs.letter, theirs.line)
    np.testing.assert_array_equal(found.chain.tool_home, trunnion.chain.tool_home)
    assert found.axes == trunnion.axes


def test_the_real_xyzbc_configuration_has_the_tighter_limits_of_its_joint(data):
    found = read_linuxcnc(data / "machines" / "linuxcnc_xyzbc-trt.ini")
    assert limits_deg(found, "B") == pytest.approx((-50.0, 100.0))
    assert limits_deg(found, "C") == pytest.approx((-36000.0, 36000.0))
    lines = {j.letter: j.line.point for j in found.chain.joints if j.is_rotary}
    assert lines == {"B": (-20.0, 0.0, -15.0), "C": (0.0, 0.0, 0.0)}
    library = load_machine("linuxcnc-xyzbc-trt")
    positions = RNG.uniform(-2, 2, (20, 5))
    np.testing.assert_allclose(tool_poses(found, positions), tool_poses(library, positions), atol=1e-12)
    assert found.axes == library.axes
