"""The command line as its user meets it: answers, files, messages and exit codes."""

import json
import re
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

import fiveaxis.job
import fiveaxis.show.viewer
from fiveaxis.base.findings import Finding, Place, Severity
from fiveaxis.check import Report
from fiveaxis.cli.commands import app
from fiveaxis.lab import power_surface

PART = Path(__file__).parents[3] / "examples" / "overhang" / "part.stl"
MACHINE = ("--machine", "hayashi-640123")
BALL = ("--tool", "ball:10")
TILT = ("--tilt", "15:75")
# Along chords the program needs locations in between.
QUICK = ("--path-shape", "chord", "--effort", "quick")
CONE = ("--cone", "20")
FILES = ["motion.csv", "preview.html", "program.ngc", "report.html", "report.json"]
HEAVY = ("casadi", "trimesh", "matplotlib", "pinocchio", "numba", "meshcat", "scipy", "numpy")


def ring(count: int = 36) -> np.ndarray:
    """Contacts and normals around a cylinder, the normals pointing slightly down."""
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    normal = np.cos(0.5) * around - np.sin(0.5) * np.array([0.0, 0.0, 1.0])
    return np.hstack([20.0 * around + [0.0, 0.0, 30.0], normal])


def write_table(path: Path, rows: np.ndarray, directions: str = "nx,ny,nz") -> Path:
    lines = (",".join(f"{value:.9g}" for value in row) for row in rows)
    path.write_text("\n".join([f"x,y,z,{directions}", *lines]) + "\n")
    return path


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return write_table(tmp_path / "ring.csv", ring())


def run(*words: object) -> Any:
    return CliRunner().invoke(app, [str(word) for word in words])


def refused(result: Any, code: int = 2) -> str:
    """The one message of a run that failed cleanly."""
    assert result.exit_code == code, result.output
    assert result.exception is None or isinstance(result.exception, SystemExit)
    lines = [line for line in result.stderr.splitlines() if line.strip()]
    assert sum(line.startswith("error: ") for line in lines) == 1
    assert lines[0].startswith("error: ")
    if code == 2:
        assert len(lines) == 1
    return lines[0]


@dataclass(frozen=True)
class Finished:
    """A run that went well."""

    source: Path
    folder: Path
    result: Any


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    folder = tmp_path_factory.mktemp("finished")
    source = write_table(folder / "ring.csv", ring())
    result = run("optimise", source, *MACHINE, *BALL, *TILT, *QUICK, "--json", "-o", folder / "out")
    assert result.exit_code == 0, result.output
    return Finished(source, folder / "out", result)


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What one run says in words, with every detail and as a document."""
    source = write_table(tmp_path_factory.mktemp("said") / "ring.csv", ring())
    words = ("optimise", source, *MACHINE, *BALL, *TILT, "--effort", "quick")
    return {kind: run(*words, *kind.split()) for kind in ("", "-v", "--json")}


# What a good run leaves


def test_optimise_leaves_the_five_files_and_nothing_else(finished):
    assert sorted(p.name for p in finished.folder.iterdir()) == FILES


def test_json_is_one_document_on_stdout_and_the_same_as_the_report(finished):
    document = json.loads(finished.result.stdout)
    assert document == json.loads((finished.folder / "report.json").read_text())


def test_the_document_has_the_keys_of_the_design(finished):
    document = json.loads(finished.result.stdout)
    energy = {"total", "by_axis", "base", "time"}
    assert {"locations", "energy", "baselines", "findings", "solver"} <= document.keys()
    assert document["locations"] == len(ring())
    assert all(energy <= record.keys() for record in (document["energy"], *document["baselines"].values()))
    assert {"normal", "lead-lean", "greedy"} <= document["baselines"].keys()
    assert list(document["energy"]["by_axis"]) == list("XYZAC")
    assert sum(document["energy"]["by_axis"].values()) == pytest.approx(document["energy"]["total"])
    assert document["solver"]


def test_the_motion_has_a_row_for_each_location_with_nine_decimals(finished):
    header, *rows = (finished.folder / "motion.csv").read_text().splitlines()
    assert header == "X,Y,Z,A,C,feed,time,source,location"
    fields = [row.split(",") for row in rows]
    given = [int(source) for *_, source, place in fields if float(place).is_integer()]
    assert given == [*range(2, len(ring()) + 2)]
    numbers = [field for *figures, _, place in fields for field in (*figures, place)]
    assert {len(field.partition(".")[2]) for field in numbers} == {9}


def test_a_second_run_gives_the_same_bytes(finished, tmp_path):
    words = (*MACHINE, *BALL, *TILT, *QUICK, "--json", "-o", tmp_path / "out")
    again = run("optimise", finished.source, *words)
    assert again.stdout == finished.result.stdout
    for name in FILES:
        assert (tmp_path / "out" / name).read_bytes() == (finished.folder / name).read_bytes(), name


def test_without_json_the_table_is_on_stdout_and_the_progress_is_not(said):
    result = said[""]
    assert result.exit_code == 0
    assert "optimised" in result.stdout
    assert "done in" in result.stderr
    assert "done in" not in result.stdout


def test_one_look_has_the_reports_three_answers_and_the_programs_compared(said):
    document, lines = json.loads(said["--json"].stdout), said[""].stdout.splitlines()
    answers = [document["answers"][key] for key in ("safe", "saved", "next")]
    assert max(map(len, lines)) <= 80
    assert len(lines) <= 24
    assert lines[0].startswith(answers[0]["question"])
    words = " ".join(" ".join(lines).split())
    places = [words.index(" ".join(f"{a['question']} {a['text']}".split())) for a in answers]
    assert places == sorted(places)
    heads = ["program", "J", "saved", "s", "starts", "reversals"]
    begin = [line.split() for line in lines].index(heads)
    names = [line.split()[0] for line in lines[begin + 1 : begin + 5]]
    assert names == ["optimised", *document["baselines"]]


def test_verbose_has_every_detail_of_the_answers(said):
    words, document = " ".join(said["-v"].stdout.split()), json.loads(said["--json"].stdout)
    answers = [document["answers"][key] for key in ("safe", "saved", "next")]
    texts = [" ".join(detail["text"].split()) for answer in answers for detail in answer["details"]]
    assert [text for text in texts if text.lower() not in words.lower()] == []
    # The share that is saved of each baseline stands behind its energy, in both tables.
    for name, baseline in document["baselines"].items():
        share = 1.0 - document["energy"]["total"] / baseline["total"]
        assert words.count(f" {name} {baseline['total']:.0f} {100.0 * share:.1f} %") == 2


def test_a_machine_without_powers_has_estimates_or_takes_those_of_another(path):
    trunnion = ("--machine", "linuxcnc-xyzac-trt")
    words = (*trunnion, *BALL, *TILT, "--effort", "quick", "--only-verify")
    estimated, borrowed = (
        run("optimise", path, *words),
        run("optimise", path, *words, "--drives", "hayashi-640123"),
    )
    assert estimated.exit_code == borrowed.exit_code == 0
    assert "powers-estimated" in estimated.output
    assert "Range: Powers are estimated" in estimated.output
    assert "powers are borrowed: X from X of hayashi-640123" in borrowed.output


# Runs that must not leave anything


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        ("empty.csv", "", "empty.csv: is empty"),
        ("empty.apt", "", "empty.apt: no GOTO"),
        ("empty.stl", "", "empty.stl: has no triangles"),
        ("empty.toml", "", "empty.toml: input is missing"),
        ("nan.csv", "x,y,z,nx,ny,nz\n0,0,0,0,0,1\n1,0,0,nan,0,1\n", "nan.csv:3: nx = nan isn't a finite"),
        ("zero.csv", "x,y,z,nx,ny,nz\n0,0,0,0,0,0\n", "zero.csv:2: the normal (nx, ny, nz) has length 0"),
        ("axis.csv", "x,y,z,i,j,k\n0,0,0,0,0,0\n", "axis.csv:2: tool vector (0, 0, 0) has length 0"),
        ("axis.apt", "GOTO/0,0,0,0,0,0\n", "axis.apt:1: tool vector (0, 0, 0) has length 0"),
        ("none.apt", "PARTNO/A\nUNITS/MM\nFINI\n", "none.apt: no GOTO"),
        ("mixed.apt", "UNITS/MM\nGOTO/1,2,3\nUNITS/INCHES\nGOTO/1,2,4\n", "mixed.apt:3: mixed units"),
        ("part.prt", "", "part.prt: unknown suffix '.prt'; a mesh (.stl"),
    ],
)
def test_a_bad_file_is_one_message_with_file_and_line(tmp_path, name, content, fault):
    source = tmp_path / name
    source.write_text(content)
    message = refused(run("optimise", source, *MACHINE, *BALL, *TILT, "-o", tmp_path / "out"))
    assert f"error: {tmp_path}/{fault}" in message.replace("\\", "/")
    assert [p.name for p in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["gone.csv", "gone.stl", "gone.cls.gz"])
def test_a_missing_file_is_named(tmp_path, name):
    message = refused(run("optimise", tmp_path / name, *MACHINE, *BALL, *TILT))
    assert f"{name}: no such file" in message


def test_a_missing_program_is_all_that_is_told_where_powers_would_be_estimated(tmp_path):
    message = refused(run("energy", tmp_path / "gone.nc", "-m", "dmu50ev"))
    assert "gone.nc: no such file" in message


@pytest.mark.parametrize("name", ["folder", "folder.csv", "folder.stl"])
def test_a_folder_is_not_an_input(tmp_path, name):
    (tmp_path / name).mkdir()
    message = refused(run("optimise", tmp_path / name, *MACHINE, *BALL, *TILT))
    assert f"{name}: is a folder" in message


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        (("--tilt", "75:15"), "tilt range 75…15 deg is empty, reversed"),
        (("--tilt", "a:b"), "--tilt 'a:b' isn't of the form MIN:MAX"),
        (("--tilt", "15"), "'15' isn't of the form MIN:MAX"),
        (("--cone", "nan"), "cone = nan must be a finite number"),
        (("--cone", "20"), "has no programmed tool axes, so a cone means nothing"),
        ((), "give either tilt"),
        ((*TILT, *CONE), "give either tilt"),
        ((*TILT, "--control", "linuxcn"), "unknown control 'linuxcn'; did you mean 'linuxcnc'?"),
        ((*TILT, "--machine", "hayash"), "unknown machine 'hayash'; did you mean hayashi-640123?"),
        ((*TILT, "--machine", ""), "unknown machine ''; known: "),
        ((*TILT, "--tool", "ball:x"), "'x' is no diameter"),
        ((*TILT, "--feed", "0"), "feed = 0.0 must be above 0"),
        ((*TILT, "--stepdown", "2"), "stepdown is for planning on a mesh"),
        ((*TILT, "--part", "gone.stl"), "gone.stl: no such file"),
        ((*TILT, "--drives", "linuxcnc-xyzac-trt"), "has no power of"),
    ],
)
def test_a_wrong_option_is_one_message(path, options, fault):
    out = path.parent / "out"
    assert fault in refused(run("optimise", path, *MACHINE, *BALL, "-o", out, *options))
    assert not out.exists()


@pytest.mark.parametrize(
    ("missing", "said"),
    [("machine", "--machine is missing"), ("tool", "ring.csv: the file states no tool; say which with tool")],
)
def test_a_missing_option_is_named(path, missing, said):
    options = {"machine": MACHINE, "tool": BALL, "tilt": TILT}
    del options[missing]
    words = [word for pair in options.values() for word in pair]
    assert said in refused(run("optimise", path, *words))


def test_tilt_needs_normals(tmp_path):
    source = write_table(tmp_path / "axes.csv", ring(), "i,j,k")
    assert "use cone (--cone 20)" in refused(run("optimise", source, *MACHINE, *BALL, *TILT))


def test_columns_for_a_mesh_are_refused_instead_of_ignored():
    result = run("optimise", PART, *MACHINE, "--tool", "ball:8", *TILT, "--columns", "x,y,z")
    assert "the input is a mesh" in refused(result)


def test_an_error_is_a_json_document_too(path):
    result = run("optimise", path, *MACHINE, *BALL, "--tilt", "75:15", "--json")
    assert json.loads(result.stdout)["error"] in refused(result)


@pytest.mark.parametrize("inside", ["", "deeper/still"])
def test_a_file_with_the_name_of_the_folder_is_found_before_the_work(path, monkeypatch, inside):
    monkeypatch.setattr(fiveaxis.job.stages, "optimise_postures", lambda *_, **__: pytest.fail("too late"))
    (path.parent / "out").write_text("mine")
    message = refused(run("optimise", path, *MACHINE, *BALL, *TILT, "-o", path.parent / "out" / inside))
    assert "out: is a file; name a folder for the results" in message
    assert (path.parent / "out").read_text() == "mine"


def test_a_part_that_cannot_be_read_is_found_before_the_work(path, monkeypatch):
    monkeypatch.setattr(fiveaxis.job.stages, "optimise_postures", lambda *_, **__: pytest.fail("too late"))
    (path.parent / "part.stl").write_text("")
    options = (*MACHINE, *BALL, *TILT, "--part", path.parent / "part.stl")
    assert "part.stl: has no triangles" in refused(run("optimise", path, *options))


@pytest.mark.usefixtures("undrawn")
def test_a_folder_in_the_place_of_a_file_keeps_the_old_results(path):
    out = path.parent / "out"
    (out / "motion.csv").mkdir(parents=True)
    (out / "program.ngc").write_text("old")
    message = refused_after_the_work(run("optimise", path, *MACHINE, *BALL, *TILT, *QUICK, "-o", out))
    assert "motion.csv: is a folder" in message
    assert sorted(p.name for p in out.iterdir()) == ["motion.csv", "program.ngc"]
    assert (out / "program.ngc").read_text() == "old"


def refused_after_the_work(result: Any) -> str:
    assert result.exit_code == 2, result.output
    return next(line for line in result.stderr.splitlines() if line.startswith("error: "))


def test_the_open_edges_of_a_mesh_are_counted(data, tmp_path):
    bunny = data / "meshes" / "bunny_not_watertight.ply"
    message = refused(run("optimise", bunny, *MACHINE, *BALL, *TILT, "-o", tmp_path / "out"))
    assert "bunny_not_watertight.ply: not watertight: 273 of its edges" in message
    assert "--allow-open" in message
    assert not (tmp_path / "out").exists()


def test_allow_open_plans_on_an_open_mesh(tmp_path):
    tube = trimesh.creation.cylinder(radius=20.0, height=30.0, sections=60)
    wall = tube.face_normals[:, 2] < 0.9
    tube.submesh([np.flatnonzero(wall)], append=True).export(tmp_path / "open.stl")
    options = ("plan", tmp_path / "open.stl", *BALL, "--stepdown", "10")
    assert "open.stl: not watertight: 60 of its edges" in refused(run(*options))
    result = run(*options, "--allow-open", "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["cutting"] > 100


# Exit code 3


@pytest.fixture
def downward(tmp_path: Path) -> Path:
    """Tool axes towards −z: A would have to turn by 180°, and its range ends at −120°."""
    rows = ring(8)
    rows[:, 3:] = [0.0, 0.0, -1.0]
    rows[:3, 3:] = [0.0, 0.0, 1.0]
    return write_table(tmp_path / "down.csv", rows, "i,j,k")


def test_locations_without_a_posture_are_listed_by_cause_and_nothing_is_written(downward):
    result = run("optimise", downward, *MACHINE, *BALL, *CONE, "-o", downward.parent / "out")
    assert "5 of 8 locations have no admissible posture on hayashi-640123" in refused(result, code=3)
    _, cause, more = result.stderr.splitlines()
    assert cause.startswith("  error: no-posture (5): ")
    assert f"first at {downward}:5, location 3" in cause
    assert "axis limits" in cause
    assert more == "  --json lists all 5 findings"
    assert result.stdout == ""
    assert [p.name for p in downward.parent.iterdir()] == ["down.csv"]


def test_what_is_infeasible_is_a_json_document_too(downward):
    result = run("optimise", downward, *MACHINE, *BALL, *CONE, "--json")
    document = json.loads(result.stdout)
    assert result.exit_code == 3
    assert document["error"] in refused(result, code=3)
    assert [f["place"]["location"] for f in document["findings"]] == [3, 4, 5, 6, 7]
    assert {f["code"] for f in document["findings"]} == {"no-posture"}


def test_a_real_path_that_the_machine_cannot_reach_ends_with_exit_code_3(data, tmp_path):
    source = data / "toolpaths" / "nx_ust_a.cls"
    result = run("optimise", source, *MACHINE, *BALL, *CONE, "-o", tmp_path / "out", "--json")
    assert "locations have no admissible posture" in refused(result, code=3)
    findings = json.loads(result.stdout)["findings"]
    told = result.stderr.splitlines()
    # The error, its cause, and how many places there are.
    assert len(findings) == 354
    assert len(told) == 3
    assert told[1].startswith("  error: no-posture (354): ")
    assert findings[0]["place"]["file"] in told[1]
    assert told[-1] == "  --json lists all 354 findings"
    assert not (tmp_path / "out").exists()


def test_programs_of_an_earlier_run_go_where_this_one_has_no_posture(downward, tmp_path):
    out = tmp_path / "out"
    earlier = [out / "program.ngc", out / "front" / "2" / "program.ngc", out / "operation-3" / "program.mpf"]
    for file in (*earlier, out / "notes.txt"):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("of an earlier run\n")
    assert run("optimise", downward, *MACHINE, *BALL, *CONE, "-o", out).exit_code == 3
    assert [file for file in earlier if file.exists()] == []
    assert (out / "notes.txt").exists()


# Exit code 1, and interruption


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let verification find an error in whatever text it looks at."""
    honest: Callable[..., Any] = fiveaxis.job.program.verify_text
    jump = Report.of_findings([Finding(Severity.ERROR, "jump", "an axis jumps; a remedy", Place(3), 1.0)])

    def verify_text(*args: Any, **settings: Any) -> Any:
        return honest(*args, **settings).merge(jump)

    monkeypatch.setattr(fiveaxis.job.program, "verify_text", verify_text)


@pytest.mark.usefixtures("failing", "undrawn")
def test_a_motion_with_errors_gets_no_program_and_a_stale_one_is_removed(path):
    out = path.parent / "out"
    out.mkdir()
    (out / "program.ngc").write_text("stale")
    (out / "notes.txt").write_text("mine")
    result = run("optimise", path, *MACHINE, *BALL, *TILT, *QUICK, "--json", "-o", out)
    assert result.exit_code == 1
    assert (
        "verification found errors: no NC program was written, because of jump (1): a remedy" in result.stderr
    )
    document = json.loads(result.stdout)
    assert document["verification"]["ok"] is False
    assert "jump" in {f["code"] for f in document["findings"]}
    kept = [name for name in FILES if not name.startswith("program")]
    assert sorted(p.name for p in out.iterdir()) == sorted([*kept, "notes.txt"])


@pytest.mark.parametrize(("room", "stage"), [("stages", "optimise_postures"), ("results", "write_report")])
def test_ctrl_c_leaves_nothing(path, monkeypatch, room, stage):
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(getattr(fiveaxis.job, room), stage, interrupt)
    result = run("optimise", path, *MACHINE, *BALL, *TILT, *QUICK, "-o", path.parent / "out")
    assert result.exit_code == 130
    assert "interrupted; nothing was written" in result.stderr
    assert [p.name for p in path.parent.iterdir()] == ["ring.csv"]


# The other verbs


def test_machines_and_info_answer_in_words_and_in_json():
    for verb in (("machines",), ("info", "hayashi-640123")):
        assert "hayashi-640123" in run(*verb).stdout
    listed = json.loads(run("machines", "--json").stdout)
    assert {"name": "hayashi-640123", "code": "640123", "axes": "XYZAC"} in listed
    shown = json.loads(run("info", "hayashi-640123", "--json").stdout)
    assert [joint["axis"] for joint in shown["chain"]] == list("CAXYZ")
    assert all(figure["source"] for figure in shown["figures"])


@pytest.mark.parametrize(
    ("name", "said"),
    [("nosuch.nc", "no such file"), ("part.stl", "is no program, CAD file (.step, .stp, .iges, .igs) or")],
)
def test_info_of_what_it_cant_show_says_what_is_wrong_with_the_file(name, said, tmp_path):
    (tmp_path / "part.stl").write_text("solid", encoding="utf-8")
    assert f"{name}: {said}" in refused(run("info", tmp_path / name))


def test_info_names_the_nearest_machine():
    assert "did you mean linuxcnc-xyzac-trt" in refused(run("info", "linuxcnc-xyzac"))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("info", "linuxcnc-xyzac-trt"), ["table-table", "singular direction (0, 0, 1)", "0 … 50 deg"]),
        (("info", "--code", "650123"), ["C - B - bed", "B = 0 deg ±", "table-table"]),
        (("info", "--code", "012346"), ["no choice of posture: C, the rotary axis next to the tool"]),
        (("info", "takisawa-mac-v3"), ["3-axis", "base power 2763.18 W", "it has 0 rotary axes"]),
        (("info", "dmu50ev"), ["0.707107", "inclination 0 … 90 deg"]),
    ],
)
def test_info_prints_structure_branches_and_singular_direction(words, said):
    result = run(*words)
    assert result.exit_code == 0
    text = " ".join(result.stdout.split())
    assert all(part in text for part in said)


def test_info_of_a_code_answers_in_json_too():
    sheet = json.loads(run("info", "--code", "601235", "--json").stdout)
    assert sheet["kind"] == "table-head"
    assert [joint["side"] for joint in sheet["chain"]] == ["table", "head", "head", "head", "head"]
    assert sheet["orientation"]["branches"] == 2
    assert sheet["limits"]["C"] == [None, None]


@pytest.mark.parametrize("words", [("info",), ("info", "hayashi-640123", "--code", "640123")])
def test_info_wants_a_machine_or_a_code(words):
    assert "give either a machine" in refused(run(*words))


def test_check_lists_findings_and_fails_on_errors(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text(
        'name = "m"\ncode = "640123"\n[axes.X]\nlimits = {min = 9, max = 1, unit = "mm", source = "s"}\n'
    )
    result = run("check", path)
    assert result.exit_code == 1
    assert f"error: {path}:4: axes.X.limits: min 9 mm is not below max 1 mm" in result.stdout
    assert "1 errors, 0 warnings, 0 notes" in result.stdout
    document = json.loads(run("check", path, "--json").stdout)
    assert document["counts"] == {"reversed-limits": 1}
    sound = run("check", "hayashi-640123")
    assert sound.exit_code == 0
    assert "note:" in sound.stdout


def test_urdf_writes_what_the_library_does(tmp_path):
    from fiveaxis.model import load_machine

    text = load_machine("linuxcnc-max5").to_urdf("bed")
    assert run("urdf", "linuxcnc-max5", "--root", "bed").stdout == text
    assert run("urdf", "linuxcnc-max5", "--root", "bed", "-o", tmp_path / "m.urdf").exit_code == 0
    assert (tmp_path / "m.urdf").read_text() == text
    assert "no URDF tree with root 'tool'" in refused(run("urdf", "linuxcnc-max5", "--root", "tool"))


@pytest.mark.usefixtures("undrawn")
def test_setup_and_tool_length_reach_the_report_and_the_program(path):
    out = path.parent / "out"
    options = ("--work-offset", "10,-5,3", "--part-rotation", "0,0,90", "--tool-length", "70")
    result = run("optimise", path, *MACHINE, *BALL, *TILT, "--effort", "quick", *options, "-o", out)
    assert result.exit_code == 0, result.output
    machine = json.loads((out / "report.json").read_text())["machine"]
    assert machine["setup"] == {"offset": [10.0, -5.0, 3.0], "rotation_deg": [0.0, 0.0, 90.0], "stated": True}
    assert machine["tool_length"] == 70.0
    program = (out / "program.ngc").read_text()
    assert "tool length: 70 mm, contained in the words" in program
    assert "70 mm long" in (out / "report.html").read_text()


def test_a_plan_read_back_is_the_path_planned_in_one_go(tmp_path):
    planning = ("--tool", "ball:8", "--stepdown", "6", "--overhang")
    result = run("plan", PART, *planning, "--json", "-o", tmp_path / "path.csv")
    assert result.exit_code == 0, result.output
    job = fiveaxis.job.make_job(input=PART, tool="ball:8", plan={"stepdown": 6.0, "overhang": True})
    planned = fiveaxis.job.loading.load_job_toolpath(job)
    read = fiveaxis.job.loading.load_job_toolpath(
        fiveaxis.job.make_job(input=tmp_path / "path.csv", tool="ball:8")
    )
    told = json.loads(result.stdout)
    assert told["locations"] == len(planned) > 100
    assert (told["cutting"], told["links"]) == (planned.cutting.sum(), (~planned.cutting).sum())
    np.testing.assert_allclose(read.pivot, planned.pivot, rtol=0.0, atol=1e-8)
    np.testing.assert_array_equal(read.kind, planned.kind)
    np.testing.assert_allclose(read.normal, planned.normal, rtol=0.0, atol=1e-8, equal_nan=True)
    np.testing.assert_allclose(read.feed, planned.feed)


def test_plan_wants_a_mesh(path):
    assert "ring.csv: passes are planned on a part" in refused(run("plan", path, *BALL))


@pytest.mark.parametrize("tip", ["10,20,30", "-10,20,30"])
def test_the_surface_table_is_the_power_surface(hayashi, tmp_path, tip):
    result = run("surface", tip, *MACHINE, "--step", "30", "-o", tmp_path / "surface.csv")
    assert result.exit_code == 0, result.output
    header, *_ = (tmp_path / "surface.csv").read_text().splitlines()
    assert header == "C_deg,A_deg,S_WL_J,S_WR_J,S_W_J"
    table = np.loadtxt(tmp_path / "surface.csv", delimiter=",", skiprows=1)
    first, second = np.unique(table[:, 0]), np.unique(table[:, 1])
    assert (first[0], first[-1], second[0], second[-1]) == (-180.0, 180.0, -120.0, 30.0)
    place = [float(part) for part in tip.split(",")]
    found = power_surface(hayashi, place, 1000.0, (np.radians(first), np.radians(second)))
    for column, part in zip(table[:, 2:].T, (found.linear, found.rotary, found.total), strict=True):
        np.testing.assert_allclose(column, part.ravel(), rtol=0.0, atol=1e-6)


def test_the_surface_goes_to_stdout_as_a_table_or_as_json():
    words = ("surface", "1,2,3", *MACHINE, "--step", "45")
    header, *rows = run(*words).stdout.splitlines()
    document = json.loads(run(*words, "--json").stdout)
    assert header.split(",") == list(document)
    assert {len(column) for column in document.values()} == {len(rows)}


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (("1,2", *MACHINE), "'1,2' isn't of the form X,Y,Z"),
        (("1,2,nan", *MACHINE), "'1,2,nan' isn't of the form X,Y,Z"),
        (("1,2,3",), "--machine is missing"),
        (("1,2,3", *MACHINE, "--step", "0"), "--step is 0 deg; it must be between"),
        (("1,2,3", *MACHINE, "--step", "1e-9"), "--step is 1e-09 deg; it must be between"),
        (("1,2,3", *MACHINE, "--feed", "inf"), "--feed is inf mm/min; it must be between"),
        (("1,2,3", *MACHINE, "--drives", "takisawa-mac-v3"), "has no rotary 2 axis"),
        (("1,2,3", *MACHINE, "--tilt", "15:75"), "tilt needs normal too"),
        (("1,2,3", *MACHINE, "--location", "3"), "--location has no effect at a tip"),
        (("absent.toml",), "absent.toml: no such file"),
        (("path.csv",), "path.csv: is no tip (X,Y,Z) and no job (.toml)"),
        (("job.toml", *MACHINE), "--machine is for a tip; state it in the job"),
    ],
)
def test_a_surface_that_cannot_be_computed_is_one_message(words, fault):
    assert fault in refused(run("surface", *words))


@pytest.mark.parametrize(("suffix", "begins"), [(".svg", b"<?xml"), (".html", b"<!DOC")])
def test_the_surface_is_drawn_as_its_suffix_says(tmp_path, suffix, begins):
    target = tmp_path / f"surface{suffix}"
    bounds = ("--normal", "0,0,1", "--tilt", "15:75", "--step", "15")
    result = run("surface", "1,2,3", *MACHINE, *bounds, "-o", target)
    assert result.exit_code == 0, result.output
    assert f"wrote {target}" in result.stderr.replace("\n", "")
    assert target.read_bytes().startswith(begins)


@pytest.fixture
def quick_job(path, tmp_path):
    file = tmp_path / "job.toml"
    file.write_text(
        f'input = "{path}"\nmachine = "hayashi-640123"\ntool = "ball:10"\ntilt = [15, 75]\neffort = "quick"\n'
    )
    return file


def test_the_surface_of_a_job_is_its_valley_or_that_of_a_location(quick_job, tmp_path):
    words = ("surface", quick_job)
    valley = json.loads(run(*words, "--json").stdout)
    assert {"location", "position_mm", "C_deg", "S_W_J", "optimised_C_deg", "normal_S_W_J"} <= set(valley)
    result = run(*words, "--location", "5", "--step", "20", "-o", tmp_path / "at.csv")
    assert result.exit_code == 0, result.output
    header = (tmp_path / "at.csv").read_text().splitlines()[0]
    assert header == "C_deg,A_deg,S_WL_J,S_WR_J,S_W_J,admissible"


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (("--location", "5000"), "location is 5000; it must be between 0 and"),
        (("--step", "5"), "--step is for one location"),
        (("--normal", "0,0,1"), "--normal is for a tip"),
    ],
)
def test_a_surface_of_a_job_that_cannot_be_drawn_is_one_message(quick_job, words, fault):
    result = run("surface", quick_job, *words)
    assert fault in refused_after_the_work(result)


# Every verb that writes a file, and what it may be called.
WRITING = [
    (("plan", "part.stl", "--tool", "ball:10"), ".csv"),
    (("surface", "1,2,3", *MACHINE), ".csv, .svg or .html"),
    (("energy", "part.ngc", *MACHINE), ".csv, .svg or .html"),
    (
        (
            "calibrate",
            "log.csv",
            *("--axis", "X", "--model", "friction", "--power", "p", "--power-unit", "W"),
        ),
        ".toml, .csv, .svg or .html",
    ),
    (("urdf", "hayashi-640123"), ".urdf"),
    (("import", "machine.ini"), ".toml"),
    (("machine", "new"), ".toml"),
]


@pytest.mark.parametrize(("words", "known"), WRITING, ids=lambda value: value[0])
def test_an_unknown_suffix_is_one_message_before_any_work(tmp_path, monkeypatch, words, known):
    monkeypatch.chdir(tmp_path)
    message = refused(run(*words, "-o", "out.pdf"))
    assert "out.pdf: is not a name for" in message
    assert message.rstrip().endswith(f"let it end in {known}")
    assert not list(tmp_path.iterdir())


def test_the_page_of_commands_lists_the_suffixes():
    page = (Path(__file__).parents[3] / "docs/pages/commands.md").read_text(encoding="utf-8")
    for words, known in WRITING:
        verb = "machine new" if words[0] == "machine" else words[0]
        [row] = [line for line in page.splitlines() if line.startswith("|") and f"`{verb}`" in line]
        assert all(f"`{suffix}`" in row for suffix in re.findall(r"\.\w+", known)), verb


def test_preview_serves_this_computer_only_until_it_is_closed(quick_job, monkeypatch):
    seen: dict[str, Any] = {}

    def look(viewer: fiveaxis.show.Preview) -> None:
        seen["url"] = viewer.url()
        seen["threads"] = {t for t in threading.enumerate() if t.name == "fiveaxis-preview"}

    monkeypatch.setattr("fiveaxis.show.viewer.serving.Preview.wait", look)
    result = run("preview", quick_job, "--no-browser")
    assert result.exit_code == 0, result.output
    assert "preview at http://127.0.0.1:" in result.stdout
    assert seen["url"] in result.stdout
    assert len(seen["threads"]) == 1
    assert not seen["threads"] & set(threading.enumerate())


# As a program of its own


def test_help_comes_without_loading_anything_heavy():
    code = (
        "import sys\n"
        "from typer.testing import CliRunner\n"
        "from fiveaxis.cli import app\n"
        "result = CliRunner().invoke(app, ['optimise', '--help'])\n"
        "assert result.exit_code == 0 and '--tilt' in result.output\n"
        f"print([name for name in {HEAVY} if name in sys.modules])\n"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_the_program_itself_keeps_stdout_and_the_exit_code(downward):
    words = ("optimise", str(downward), *MACHINE, *BALL, *CONE, "--json")
    found = subprocess.run(
        [sys.executable, "-m", "fiveaxis.cli", *words], capture_output=True, text=True, check=False
    )
    assert found.returncode == 3
    assert len(json.loads(found.stdout)["findings"]) == 5
    assert "Traceback" not in found.stderr


def test_bounds_and_prices_of_the_optimiser_reach_it(path, tmp_path):
    """Each option changes what it names; verification is told of each bound."""
    words = ("optimise", path, *MACHINE, *BALL, *TILT, "--effort", "quick", "--json")
    plain = json.loads(run(*words).stdout)
    held = json.loads(run(*words, "--hold", "A-50").stdout)
    assert held["rates"]["optimised"]["A"]["speed_deg_s"] == 0.0
    slow = json.loads(run(*words, "--turn-rate", "2", "--max-turn", "12").stdout)
    rates = [d["rates"]["optimised"]["C"]["speed_deg_s"] for d in (slow, plain)]
    assert rates[0] <= 2.0 * 1000.0 / 60.0 + 1e-6
    leaning = json.loads(run(*words, "--lean", "-20:20").stdout)
    told = {"A at -50 deg": held, "axis in cuts, at most 2": slow, "lean": leaning, "at most 12 deg": slow}
    for sentence, document in told.items():
        assert any(sentence in text for text in document["verification"]["passed"]), sentence
    steady = json.loads(run(*words, "--smoothing", "1e5").stdout)
    assert steady["energy"]["total"] > plain["energy"]["total"]


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        (("--hold", "B10"), "B"),
        (("--hold", "Q"), "isn't of the form"),
        (("--lead", "20"), "'20' isn't of the form MIN:MAX"),
        (("--plane", "0,0,0"), "plane"),
        (("--effort", "much"), "effort = 'much' must be 'quick', 'normal' or 'thorough'"),
        (("--winding", "round"), "winding = 'round' must be"),
        (("--front", "3", "--smoothing", "5"), "smoothing is varied along a front"),
        (("--pick", "2"), "pick = 2 chooses from a front; give front too"),
        (("--feed-share", "0.7"), "feed_share belongs to a front"),
        (("--least-cutting-speed", "60"), "needs the speed of the spindle"),
        (("--least-cutting-speed", "600", "--spindle-rpm", "8000"), "is out of reach"),
        (("--front", "3", "--pick", "4"), "pick = 4 is none of the 3 solutions of the front"),
    ],
)
def test_a_wrong_bound_or_price_is_one_message(path, options, fault):
    assert fault in refused(run("optimise", path, *MACHINE, *BALL, *TILT, *options))
