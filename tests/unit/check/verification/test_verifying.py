"""Programs verified, wherever they come from: each check, its place, and the command line."""

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from support.unverified_text import write_text
from typer.testing import CliRunner

import fiveaxis as fx
from fiveaxis.base import normalise
from fiveaxis.base.codes import CODES
from fiveaxis.base.errors import SettingError, ToolpathError
from fiveaxis.cli.commands import app
from fiveaxis.model import Limits, Tool, Toolpath, follow, rotary_angles
from fiveaxis.model.motion.filling import fill_in
from fiveaxis.model.toolpath.tool import Holder, Section
from fiveaxis.nc import write_motion, write_toolpath

BALL = 10.0
RADIUS = 40.0
TILT = (15.0, 75.0)


@pytest.fixture(scope="module")
def wall() -> Toolpath:
    """A third of a turn around a cone, 40 contacts, normals 20 deg below level."""
    angle = np.linspace(0.0, 2.0, 40)
    around = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    down = np.radians(20.0)
    normals = np.cos(down) * around - np.sin(down) * np.array([0.0, 0.0, 1.0])
    return Toolpath.from_contacts(RADIUS * around, normals, Tool.ball(BALL), name="wall.csv")


@pytest.fixture(scope="module")
def cone() -> trimesh.Trimesh:
    """The part under that path: a cone that widens upwards, 1 µm inside of the contacts' circle."""
    count, height = 720, 30.0
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    rise = np.tan(np.radians(20.0))
    rings = []
    for z in (-height, height):
        radius = RADIUS + z * rise - 1e-3
        rings.append(np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle + z], axis=1))
    i, j = np.arange(count), np.roll(np.arange(count), -1)
    low, high = 2 * count, 2 * count + 1
    faces = np.concatenate(
        [
            np.stack([i, j, count + i], axis=1),
            np.stack([j, count + j, count + i], axis=1),
            np.stack([0 * i + low, j, i], axis=1),
            np.stack([0 * i + high, count + i, count + j], axis=1),
        ]
    )
    points = np.concatenate([*rings, [[0.0, 0.0, -height], [0.0, 0.0, height]]])
    mesh = trimesh.Trimesh(points, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0.0
    return mesh


def lean(path: Toolpath, degrees: float = 30.0) -> np.ndarray:
    """Tool axes that lean from the normals upwards."""
    up = np.array([0.0, 0.0, 1.0])
    across = normalise(up - (path.normal @ up)[:, None] * path.normal)
    angle = np.radians(degrees)
    return path.normal * np.cos(angle) + across * np.sin(angle)


@pytest.fixture(scope="module")
def program(wall, hayashi, tmp_path_factory):
    """The path's program, blocks inserted so that axes that run linearly hold it."""
    rotary = np.unwrap(rotary_angles(hayashi, lean(wall))[1], axis=0)
    _, motion, _ = fill_in(wall, hayashi, rotary)
    return write_text(motion, tmp_path_factory.mktemp("nc") / "wall.ngc", machine=hayashi)


def edited(program, tmp_path, change):
    """Write the program with its lines changed."""
    lines = program.read_text().splitlines()
    change(lines)
    path = tmp_path / "edited.ngc"
    path.write_text("\n".join(lines) + "\n")
    return path


def blocks(lines):
    return [i for i, line in enumerate(lines) if line.startswith("G1 ")]


def test_a_good_program_has_no_finding_but_that_its_begin_is_unknown(program, hayashi, wall, cone):
    report = fx.verify_program(program, hayashi, toolpath=wall, part=cone, tilt=TILT)
    assert report.ok
    assert report.counts == {"approach-unknown": 1}
    assert report.figures["off_path_mm"] < 1e-4
    assert report.figures["gouge_depth_mm"] < 0.02
    assert report.figures["tilt_max_deg"] == pytest.approx(30.0, abs=1e-4)
    assert any("where the axes stand before it" in sentence for sentence in report.not_checked)


def test_without_a_tool_only_the_tip_is_followed_and_the_report_says_so(program, hayashi):
    report = fx.verify_program(program, hayashi)
    assert report.ok
    text = " ".join(report.not_checked)
    assert "no tool was given" in text
    assert "no path was given to compare it with" in text
    assert "gouges: no mesh" in text


def test_a_limit_is_named_with_the_line_of_its_block(program, hayashi):
    lines = program.read_text().splitlines()
    angles = {i + 1: float(lines[i].split("A")[1].split()[0]) for i in blocks(lines) if " A" in lines[i]}
    bound = 0.5 * (min(angles.values()) + max(angles.values()))
    axes = tuple(
        replace(a, limits=Limits(np.radians(-180.0), np.radians(bound))) if a.letter == "A" else a
        for a in hayashi.axes
    )
    report = fx.verify_program(program, replace(hayashi, axes=axes))
    found = {f.place.line for f in report.findings if f.code == "axis-limit"}
    assert {line for line, angle in angles.items() if angle > bound} <= found
    assert not {line for line, angle in angles.items() if angle < bound} & found
    assert all(f.place.file.endswith("wall.ngc") for f in report.findings)


def test_a_flip_is_an_error_and_a_warning_where_its_sweep_was_checked(program, hayashi, wall, cone, tmp_path):
    def flip(lines):
        i = blocks(lines)[20]
        words = [f"C{float(w[1:]) + 180.0:.6f}" if w[0] == "C" else w for w in lines[i].split()]
        lines[i] = " ".join(words)

    path = edited(program, tmp_path, flip)
    line = 1 + blocks(program.read_text().splitlines())[20]
    alone = fx.verify_program(path, hayashi)
    jump = next(f for f in alone.findings if f.code == "jump")
    assert (jump.severity, jump.place.line) == ("error", line)
    beside = fx.verify_program(path, hayashi, part=cone, tool=wall.tool)
    assert next(f for f in beside.findings if f.code == "jump").severity == "warning"


def test_a_feed_that_an_axis_cannot_keep_is_a_warning(program, hayashi):
    slow = replace(hayashi, axes=tuple(replace(a, max_speed=0.01) for a in hayashi.axes))
    report = fx.verify_program(program, slow)
    assert report.ok
    assert report.counts["feed-over"] > 10


def test_blocks_far_apart_leave_their_chord(wall, hayashi, tmp_path):
    coarse = wall.at(np.arange(0, 40, 6))
    rotary = np.unwrap(rotary_angles(hayashi, lean(coarse))[1], axis=0)
    path = write_text(follow(coarse, hayashi, rotary), tmp_path / "p.ngc", machine=hayashi)
    report = fx.verify_program(path, hayashi, tool=wall.tool)
    assert report.ok
    assert report.counts["tip-deviation"] >= 5
    # A table that stands still takes no part in the wall's bend.
    straight = np.repeat(rotary[:1], len(coarse), axis=0)
    path = write_text(follow(coarse, hayashi, straight), tmp_path / "p.ngc", machine=hayashi)
    following = fx.verify_program(path, hayashi, toolpath=wall)
    assert {"off-path", "path-missed"} <= set(following.counts)
    missed = [f.place.location for f in following.findings if f.code == "path-missed"]
    assert len(missed) == following.counts["path-missed"]
    assert all(i % 6 for i in missed)


def test_another_path_altogether_is_missed_from_the_first_location(program, hayashi, wall):
    scaled = replace(wall, pivot=wall.pivot / 25.4, contact=wall.contact / 25.4)
    report = fx.verify_program(program, hayashi, toolpath=scaled)
    assert report.counts["path-missed"] == len(wall)


def test_tip_programs_are_followed_as_the_control_leads_the_tip(trunnion, tmp_path):
    path = tmp_path / "tip.ngc"
    path.write_text("G21\nM428\nG0 X0 Y0 Z30 A0 C0\nG1 Z5 F600\nG1 X30 A-20 C40\nG1 Y30 C60\nM429\nM2\n")
    report = fx.verify_program(path, trunnion, tool=Tool.ball(6), rapid=5000.0)
    # Led straight by the control, and cut into parts here: the tip keeps to its way.
    assert "tip-deviation" not in report.counts
    assert report.figures["tip_deviation_mm"] <= 0.01
    box = trimesh.creation.box(extents=(20.0, 20.0, 20.0))
    box.apply_translation([30.0, 0.0, 0.0])
    sunk = fx.verify_program(path, trunnion, tool=Tool.ball(6), part=box, rapid=5000.0)
    assert {f.place.line for f in sunk.findings if f.code == "gouge"} <= {5, 6}
    assert sunk.counts["gouge"] > 1


def test_the_table_of_a_motion_is_checked_like_a_program(wall, hayashi, tmp_path):
    rotary = np.unwrap(rotary_angles(hayashi, lean(wall))[1], axis=0)
    table = write_motion(follow(wall, hayashi, rotary), tmp_path / "motion.csv", hayashi)
    assert fx.verify_program(table, hayashi, toolpath=wall, tilt=TILT).ok
    lines = table.read_text().splitlines()
    # C turns with the wall, so Y is across it; 0.1 mm of X would stay on the path.
    x, y, *rest = lines[11].split(",")
    lines[11] = ",".join([x, str(float(y) + 0.1), *rest])
    table.write_text("\n".join(lines) + "\n")
    report = fx.verify_program(table, hayashi, toolpath=wall)
    assert {f.place.line for f in report.findings if f.code == "off-path"} == {12}
    with pytest.raises(SettingError, match="unit is for NC programs"):
        fx.verify_program(table, hayashi, unit="mm")


def test_a_holder_that_is_clamped_too_short_is_found_with_its_line(program, hayashi, cone):
    """Beside a wall that widens upwards, with the tool leaning upwards from its normal."""
    long, short = (
        Tool.ball(BALL, shank_diameter=8.0, holder=Holder(stick_out, (Section(30.0, 60.0),)))
        for stick_out in (60.0, 12.0)
    )
    assert fx.verify_program(program, hayashi, tool=long, part=cone).ok
    report = fx.verify_program(program, hayashi, tool=short, part=cone)
    assert not report.ok
    found = [f for f in report.findings if f.code == "holder-collision"]
    moves = {1 + i for i in blocks(program.read_text().splitlines())}
    assert found
    assert {f.place.line for f in found} & moves


def test_the_command_finds_a_collision_with_a_fixture(program, wall, tmp_path):
    fixtures = tmp_path / "fixtures.toml"
    x, y, z = wall.contact[20] + 8.0 * wall.normal[20]
    fixtures.write_text(
        f'[[fixture]]\nname = "clamp"\nbox = {{size = [6, 6, 6], center = [{x}, {y}, {z}]}}\n'
    )
    asked = ("verify", program, "-m", "hayashi-640123", "--tool", "ball:10", "--json")
    assert run(*asked).exit_code == 0
    result = run(*asked, "--fixtures", fixtures)
    assert result.exit_code == 1, result.output
    found = [f for f in json.loads(result.stdout)["findings"] if f["code"] == "fixture-collision"]
    assert found
    assert all("clamp" in f["message"] for f in found)


def test_a_lean_is_checked_about_the_normals_of_the_part(program, hayashi, wall, cone):
    good = fx.verify_program(program, hayashi, tool=wall.tool, part=cone, tilt=TILT)
    assert good.figures["tilt_max_deg"] == pytest.approx(30.0, abs=0.3)
    tight = fx.verify_program(program, hayashi, tool=wall.tool, part=cone, tilt=(40.0, 75.0))
    assert tight.counts["tilt"] > 30


def test_bounds_that_refer_to_nothing_are_refused(program, hayashi, cone):
    with pytest.raises(SettingError, match="give the part"):
        fx.verify_program(program, hayashi, tool=Tool.ball(10), tilt=TILT)
    with pytest.raises(SettingError, match="axes of a path"):
        fx.verify_program(program, hayashi, tool=Tool.ball(10), cone=10.0)
    with pytest.raises(SettingError, match="name the tool"):
        fx.verify_program(program, hayashi, part=cone)


def test_a_program_that_cannot_be_read_whole_is_no_verdict(hayashi, tmp_path):
    path = tmp_path / "p.ngc"
    path.write_text("G0 X0 Y0 Z0 A0 C0\nG1 X1 W3 F60\n")
    with pytest.raises(ToolpathError, match=r"p\.ngc:2"):
        fx.verify_program(path, hayashi)


def run(*words):
    return CliRunner().invoke(app, [str(w) for w in words])


def test_the_command_reports_what_the_library_reports(program, hayashi, wall, cone, tmp_path):
    write_toolpath(wall, tmp_path / "wall.csv")
    cone.export(tmp_path / "cone.stl")
    asked = ("-m", "hayashi-640123", "--tool", "ball:10", "--path", tmp_path / "wall.csv", "--tilt", "15:75")
    result = run("verify", program, *asked, "--part", tmp_path / "cone.stl", "--json")
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert document["ok"] is True
    assert document["program"] == "wall.ngc"
    tight = run("verify", program, *asked[:-1], "40:75", "--json")
    assert tight.exit_code == 1
    finding = next(f for f in json.loads(tight.stdout)["findings"] if f["code"] == "tilt")
    assert set(finding) == {"severity", "code", "message", "place", "value"}
    assert finding["place"]["line"] > 15
    plain = run("verify", program, *asked[:-1], "40:75")
    assert plain.exit_code == 1
    assert plain.stdout.startswith("error: tilt (")
    assert "verification: errors" in plain.stdout


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ((), "name a program"),
        (("p.ngc",), "--machine is missing"),
        (("p.ngc", "-m", "hayashi-640123"), "no such file"),
        (("p.ngc", "-m", "hayashi-640123", "--tilt", "15"), "isn't of the form MIN:MAX"),
    ],
)
def test_wrong_words_are_refused(words, text):
    result = run("verify", *words)
    assert result.exit_code == 2
    assert text in result.stderr


def test_codes_are_listed():
    table = run("verify", "--codes")
    assert table.exit_code == 0
    assert all(code in table.stdout for code in CODES)
    rows = json.loads(run("verify", "--codes", "--json").stdout)
    assert rows["gouge"]["override"] is True
    assert rows["long-dwell"]["override"] is False


def test_a_program_of_directions_is_checked_as_a_path_and_says_so(trunnion, tmp_path):
    path = tmp_path / "vector.mpf"
    blocks_of = ["N10 G710 G90", "N20 TRAORI", "N30 G0 X0 Y0 Z30 A3=0 B3=0 C3=1"]
    for i in range(12):
        lean = np.radians(2.0 * i)
        blocks_of.append(f"N{40 + i} G1 X{i} Y0 Z5 A3=0 B3={-np.sin(lean):.6f} C3={np.cos(lean):.6f} F600")
    path.write_text("\n".join([*blocks_of, "TRAFOOF", "M30"]) + "\n")
    box = trimesh.creation.box(extents=(3.0, 20.0, 20.0))
    box.apply_translation([6.0, 0.0, -3.0])
    report = fx.verify_program(path, trunnion, tool=Tool.ball(2), part=box)
    assert report.counts["angles-assumed"] == 1
    told = next(f for f in report.findings if f.code == "angles-assumed")
    assert "the control may choose others" in told.message
    # The box reaches to Z 7, the tip runs at Z 5.
    assert {f.place.line for f in report.findings if f.code == "gouge"} <= set(range(8, 14))
    assert report.counts["gouge"] >= 3
    assert "axis-limit" not in report.counts


def test_a_machine_without_rotary_axes_has_no_singular_direction(tmp_path):
    path = tmp_path / "p.ngc"
    path.write_text("G21\nG0 X0 Y0 Z30\nG1 Z5 F600\nG1 X30\nG0 Z30\nM2\n")
    report = fx.verify_program(path, fx.Machine.from_code("0123"), tool=Tool.ball(6))
    assert report.ok
    assert any("durations of rapid moves" in sentence for sentence in report.not_checked)


def test_cutter_locations_are_followed_and_a_fault_in_them_is_their_own(tmp_path, hayashi):
    lines = [
        "$$ form-shaping code",
        "MULTAX/ON",
        "FEDRAT/600,MMPM",
        "GOTO/0,0,0,0,0,1",
        "GOTO/5,0,0,0,0.6,0.8",
    ]
    path = tmp_path / "p.apt"
    path.write_text("\n".join(lines))
    report = fx.verify_program(path, hayashi)
    assumed = [f.message for f in report.findings if f.code == "angles-assumed"]
    assert len(assumed) == 1
    assert "is a list of cutter locations, which names no axes" in assumed[0]
    path.write_text("\n".join([*lines, "GOTO/x,0,0,0,0,1"]))
    with pytest.raises(ToolpathError, match=r"p.apt:6: .*GOTO"):
        fx.verify_program(path, hayashi)


def test_a_bound_that_no_program_can_be_checked_for_is_refused(tmp_path, hayashi):
    with pytest.raises(TypeError, match="unexpected keyword argument 'turn_rate'"):
        fx.verify_program(tmp_path / "part.ngc", hayashi, turn_rate=5.0)
