"""Rapid moves stay rapid from the path to the program, in their time and in what they cost."""

from dataclasses import replace

import numpy as np
import pytest
from support.pairwise_cases import in_pairs
from support.quick_optimiser import optimise, tilt_bounds
from support.unverified_text import write_text

import fiveaxis as fx
from fiveaxis.base import Coordinates
from fiveaxis.check import verify_program
from fiveaxis.job.program import MadeProgram, make_program
from fiveaxis.model import Constraints, Machine, MoveKind, Tool, Toolpath, follow, motion_energy, tool_axes
from fiveaxis.model.motion.filling import fill_in
from fiveaxis.nc import ProgramOptions
from fiveaxis.posture import Optimum
from fiveaxis.posture.baselines.catalogue import as_programmed

CUT, LINK, RAPID = MoveKind
# mm/min, of axes whose speed no machine file tells.
SPEED = 6000.0
CONTROLS = [
    ("linuxcnc", "axes", "G0 "),
    ("sinumerik", "axes", "G0 "),
    ("sinumerik", "tip", "G0 "),
    ("fanuc", "tip", "G0 "),
    ("heidenhain", "tip", "FMAX"),
]


def two_cuts() -> Toolpath:
    """Two cuts; between them a link up and two rapid moves, over and down."""
    tip = np.array(
        [[0, 0, 0], [5, 0, 1], [10, 0, 0], [10, 0, 5], [30, 20, 20], [0, 20, 1], [0, 20, 0], [10, 20, 0]]
    )
    kind = [CUT, CUT, CUT, LINK, RAPID, RAPID, LINK, CUT]
    up, high = np.tile([0.0, 0.0, 1.0], (len(tip), 1)), np.add(tip, [0, 0, 20])
    return Toolpath.from_tips(high, up, Tool.ball(6), feed_mm_min=600.0, kind=kind).with_rapid(SPEED)


def with_postures(path: Toolpath, machine: Machine) -> Optimum:
    """Turn both rotary axes in the rapid moves: axes that run straight lead the tip far about."""
    rotary = np.radians([[0, 0]] * 4 + [[60, -20], [120, -30], [120, -30], [130, -30]])
    motion = follow(path, machine, rotary)
    bounds = tilt_bounds(path, None, cone=40.0)
    return Optimum(machine, path, bounds, motion, motion_energy(machine, motion), {}, {}, ())


def program_of(
    solution: Optimum, coordinates: Coordinates = "axes", cone: float | None = None, **words
) -> MadeProgram:
    """Make a program whose rotary axes may turn far."""
    options = ProgramOptions.of(coordinates=coordinates, header={"tool": "ball:6"}, **words)
    wide = Constraints.of_degrees(cone=cone, max_turn=180.0)
    return make_program(solution.motion, solution.machine, solution.toolpath, wide, options)


@pytest.fixture
def machines(hayashi: Machine, trunnion: Machine) -> dict[str, Machine]:
    """One that states no speed of any axis, and one that states all."""
    return {"hayashi": hayashi, "trunnion": trunnion.with_drives_of(hayashi)}


@pytest.fixture(params=["hayashi", "trunnion"])
def machine(request: pytest.FixtureRequest, machines: dict[str, Machine]) -> Machine:
    return machines[request.param]


@in_pairs(name=["hayashi", "trunnion"], tcp=[True, False], thin=[True, False])
def test_a_rapid_move_is_one_block(machines, name, tcp, thin):
    machine = machines[name]
    solution = with_postures(two_cuts(), machine)
    program = program_of(solution, "tip" if tcp else "axes", thin=thin)
    assert program.ok, program.report.findings
    kind = program.motion.blocks.kind
    assert kind[kind != CUT].tolist() == [LINK, RAPID, RAPID, LINK]
    # What is verified is where a control takes the axes: it leads the tip in many small parts.
    assert bool(program.fill.path.rapid.sum() > 10) is tcp
    spent = motion_energy(machine, program.motion.blocks)
    assert list(spent.by_kind) == ["cut", "link", "rapid"]
    for total, part in (("total", "total"), ("travel", "travel"), ("time", "time")):
        parts = sum(getattr(share, part) for share in spent.by_kind.values())
        assert getattr(spent, total) == pytest.approx(parts)


def test_a_bound_on_the_lean_holds_at_the_ends_of_a_rapid_move_and_not_within(hayashi):
    path = two_cuts()
    # From 30 deg on the one side to 30 deg on the other; the angles go by way of 30 deg in front.
    axes = tool_axes(hayashi, rotary := np.radians([[0, -30]] * 4 + [[180, -30]] * 4))
    leaning = Toolpath.from_tips(
        path.tips(path.axis), axes, path.tool, feed_mm_min=60.0 * path.feed, kind=path.kind
    )
    motion = follow(leaning, hayashi, rotary)
    bounds = tilt_bounds(leaning, None, cone=5.0)
    solution = Optimum(hayashi, leaning, bounds, motion, motion_energy(hayashi, motion), {}, {}, ())
    program = program_of(solution, "tip", cone=5.0)
    assert program.fill.path.rapid.sum() > 10
    assert program.ok, program.report.findings
    # In a cut the same turn leaves the cone.
    elsewhere = replace(motion, kind=np.full(len(motion), CUT))
    cutting = replace(solution, toolpath=replace(leaning, kind=elsewhere.kind), motion=elsewhere)
    assert "tilt" in program_of(cutting, "tip", cone=5.0).report.counts


@pytest.mark.parametrize(("control", "coordinates", "word"), CONTROLS)
def test_a_program_with_rapid_moves_read_back_follows_its_path_and_costs_the_same(
    machine, tmp_path, control, coordinates, word
):
    solution = with_postures(two_cuts(), machine)
    bounds = {"max_turn": 180.0}
    program = program_of(solution, coordinates, control=control)
    file = program.write(tmp_path / ("part.h" if control == "heidenhain" else "part.nc"))
    found = fx.program_energy(file, machine, corners="programmed", rapid=SPEED)
    blocks = program.motion.blocks
    begin = int(np.abs(found.motion.positions - blocks.positions[0]).sum(axis=1).argmin()) + 1
    quick = np.flatnonzero(found.motion.rapid[begin:]) + begin
    written = {int(line): file.read_text().splitlines()[line - 1] for line in found.motion.source[quick]}
    assert len(written) == 2
    assert all(word in block and ("F" in block.replace("FMAX", "")) is False for block in written.values())
    said = motion_energy(machine, blocks).by_kind["rapid"]
    # A control that leads the tip takes the axes about, and is read in other parts than it was checked in.
    near, integral_near = (2e-3, 0.06) if coordinates == "tip" else (1e-4, 1e-3)
    assert found.motion.time[quick].sum() == pytest.approx(said.time, rel=near)
    # Read as a whole, a program that leads the tip comes down at rapid from above its path, too.
    down = found.motion.time[:begin][found.motion.rapid[:begin]].sum()
    assert found.energy.by_kind["rapid"].time == pytest.approx(said.time + down, rel=near)
    # An axis that swerves travels farther than from end to end.
    swerved = motion_energy(machine, program.fill.motion if coordinates == "tip" else blocks)
    assert found.by_block[quick].sum() == pytest.approx(swerved.by_kind["rapid"].total, rel=integral_near)
    report = verify_program(file, machine, toolpath=solution.toolpath, rapid=SPEED, **bounds)
    assert report.ok, report.findings


def test_a_cut_off_the_path_is_named_beside_rapid_moves_that_swerve(hayashi, tmp_path):
    solution = with_postures(two_cuts(), hayashi)
    blocks = program_of(solution).motion.blocks
    away = blocks.positions.copy()
    away[1, 1] += 0.5
    file = write_text(replace(blocks, positions=away), tmp_path / "part.ngc", machine=hayashi)
    report = verify_program(file, hayashi, toolpath=solution.toolpath, rapid=SPEED, max_turn=180.0)
    assert {"off-path"} <= set(report.counts)
    assert "the course of rapid moves between locations of the path" in report.not_checked


def test_a_cut_that_a_program_makes_in_rapid_is_held_to_the_path(hayashi, tmp_path):
    path = two_cuts()
    solution = with_postures(path, hayashi)
    text = list(program_of(solution).text.lines)
    row = next(i for i, line in enumerate(text) if line.startswith("G1 X5.0"))
    text[row : row + 1] = ["G0 X5.0 Y0.5", "G0 Y0"]
    file = tmp_path / "part.ngc"
    file.write_text("\n".join(text))
    report = verify_program(file, hayashi, toolpath=path, rapid=SPEED, max_turn=180.0)
    assert "off-path" in report.counts


# Blocks of a program of `two_cuts`, others in their place, and whether a rapid move touches material.
MADE_RAPID = {
    "a cut": ("G1 X5.0", ["G0 X5.0 Z21"], True),
    "half a cut": ("G1 X5.0", ["G0 X2.5 Z20.5", "G1 X5.0 Z21 F240"], True),
    "a part within a cut": ("G1 X5.0", ["G1 X2 Z20.4 F240", "G0 X3 Z20.6", "G1 X5.0 Z21 F240"], True),
    "down to a cut": ("G1 X17.320508 Y-20.160254", ["G0 X17.320508 Y-20.160254 Z11.918584"], True),
    "off a cut": ("G1 X10.000000 Y0.000000 Z25", ["G0 Z25"], False),
    "nearly down to a cut": (
        "G1 X17.320508 Y-20.160254",
        ["G0 X17.320508 Y-20.210254 Z12.005187", "G1 Y-20.160254 Z11.918584 F600"],
        False,
    ),
}


@pytest.mark.parametrize("made_rapid", MADE_RAPID)
def test_a_rapid_move_that_touches_material_is_found(made_rapid, hayashi, tmp_path):
    begin, others, touches = MADE_RAPID[made_rapid]
    path = two_cuts()
    text = list(program_of(with_postures(path, hayashi)).text.lines)
    row = next(i for i, line in enumerate(text) if line.startswith(begin))
    text[row : row + 1] = others
    file = tmp_path / "part.ngc"
    file.write_text("\n".join(text))
    report = verify_program(file, hayashi, toolpath=path, rapid=SPEED, max_turn=180.0)
    assert ("rapid-in-cut" in report.counts) is touches
    assert "off-path" not in report.counts


def test_a_rapid_move_to_a_cut_is_the_paths_own(hayashi, tmp_path):
    """Where the path comes down to a cut at rapid, its program isn't held to more than that."""
    path = two_cuts()
    kind = np.where(path.kind == LINK, RAPID, path.kind)
    own = replace(path, kind=kind)
    file = tmp_path / "part.ngc"
    file.write_text("\n".join(program_of(with_postures(own, hayashi)).text.lines))
    report = verify_program(file, hayashi, toolpath=own, rapid=SPEED, max_turn=180.0)
    assert "rapid-in-cut" not in report.counts


@pytest.mark.parametrize("speed", [None, 6000.0])
def test_what_the_optimiser_assumes_for_unknown_speeds_is_reported(hayashi, speed):
    path = two_cuts() if speed else two_cuts().with_rapid(600.0)
    found = optimise(path, hayashi, cone=20, effort="quick").toolpath.findings
    (told,) = [f for f in found if f.code == "rapid-speed-unknown"]
    assert f"{speed or 600.0:g} mm/min" in told.message


def test_a_path_of_known_speeds_has_nothing_to_say(trunnion, hayashi):
    found = optimise(two_cuts(), trunnion.with_drives_of(hayashi), cone=20, effort="quick")
    assert "rapid-speed-unknown" not in {f.code for f in found.toolpath.findings}


# A real program of LinuxCNC's, with tool centre point control.


@pytest.fixture(scope="module")
def boat(data, trunnion, hayashi):
    machine = trunnion.with_drives_of(hayashi)
    file = data / "toolpaths" / "linuxcnc_boat_xyzac.ngc"
    return file, machine, fx.read_toolpath(file, tool=Tool.ball(6), machine=machine)


def test_the_baseline_as_programmed_is_the_program_itself(boat):
    file, machine, path = boat
    rotary = as_programmed(path, machine, tilt_bounds(path, None, cone=15.0))
    np.testing.assert_array_equal(rotary, path.rotary)
    program = fx.program_energy(file, machine, tool=Tool.ball(6), corners="programmed").energy
    for motion in (follow(path, machine, rotary), fill_in(path, machine, rotary)[1]):
        said = motion_energy(machine, motion)
        assert said.time == pytest.approx(program.time, rel=0.01)
        assert said.total == pytest.approx(program.total, rel=0.05)
        assert said.by_kind["rapid"].time == pytest.approx(program.by_kind["rapid"].time, rel=0.05)


def test_rapid_moves_of_the_program_no_longer_take_a_feed(boat):
    """At the feed of the cut before them they took 131 s, and 12.9 s at 10 m/min."""
    file, machine, path = boat
    motion = follow(path, machine, path.rotary)
    assert motion.time[motion.rapid].sum() == pytest.approx(87.7, abs=0.1)
    fast = replace(machine, axes=tuple(replace(axis, max_speed=None) for axis in machine.axes))
    motion = follow(path.with_rapid(10_000.0), fast, path.rotary)
    read = fx.read_program(file, fast, rapid=10_000.0)
    assert motion.time[motion.rapid].sum() == pytest.approx(read.time[read.rapid].sum(), rel=0.05)


def test_angles_that_would_lean_the_tool_elsewhere_are_not_the_baselines(boat):
    _, machine, path = boat
    few = path.at(np.arange(200))
    bounds = tilt_bounds(few, None, cone=15.0)
    bare = as_programmed(replace(few, rotary=None), machine, bounds)
    for other in (few.rotary + 0.1, few.rotary[:, :1], np.where(few.rotary == 0.0, np.nan, few.rotary)):
        np.testing.assert_array_equal(as_programmed(replace(few, rotary=other), machine, bounds), bare)
