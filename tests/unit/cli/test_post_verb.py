"""The verbs that write a motion for a control and list the controls."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import fiveaxis as fx
from fiveaxis.check import Against
from fiveaxis.cli.commands import app
from fiveaxis.job import post_program
from fiveaxis.model import follow
from fiveaxis.model.machine.files import find_machine
from fiveaxis.nc import DIALECTS, read_program, write_motion
from fiveaxis.nc.motion_table import read_motion
from fiveaxis.nc.source import load_source


@pytest.fixture
def table(tmp_path, trunnion):
    """A motion as `optimise` leaves it."""
    positions = np.array([[0, 0, 0, 0, 0], [5, 4, 3, 10, 20], [6, 4, 3, 12, 200]]) * [
        1,
        1,
        1,
        *[np.pi / 180] * 2,
    ]
    motion = fx.Motion(
        "XYZAC", positions, np.full(3, 10.0), np.array([0.0, 1.0, 2.0]), np.zeros(3, int), np.arange(1, 4)
    )
    return write_motion(motion, tmp_path / "motion.csv", trunnion)


def run(*words):
    return CliRunner().invoke(app, [*map(str, words)])


@pytest.mark.parametrize("control", DIALECTS)
def test_a_motion_is_written_for_every_control(table, tmp_path, trunnion, control):
    output = tmp_path / f"part{DIALECTS[control].suffix}"
    words = ("post", table, "-m", "linuxcnc-xyzac-trt", "-c", control, "-o", output)
    done = run(*words)
    # Nobody said which path it should follow: the program is there, and that it isn't verified is loud.
    assert done.exit_code == 1, done.stderr
    assert "NOT VERIFIED: there is nothing to verify the program against" in done.stderr
    text = output.read_text()
    assert "motion.csv sha256" in text.lower().replace("\n", " ")
    assert "NOT VERIFIED" in text
    again = run(*words, "--unverified")
    assert again.exit_code == 2
    assert "exists already and isn't overwritten" in again.stderr
    assert output.read_text() == text
    assert run(*words, "--unverified", "--overwrite").exit_code == 0
    posted = post_program(
        table, trunnion, control=control, output=tmp_path / "again" / output.name, unverified=True
    )
    assert posted.path is not None
    assert posted.path.read_text() == text


def test_a_table_keeps_its_durations_under_tcp_whatever_the_tool(tmp_path, hayashi):
    positions = np.array([[0.0, 0, 0, 0, 0], [5, 4, 3, 0.2, 0.3], [6, 4, 3, 0.25, 0.6]])
    time = np.array([0.0, 1.0, 2.0])
    motion = fx.Motion("XYZAC", positions, np.full(3, 10.0), time, np.zeros(3, int), np.arange(1, 4))
    table = write_motion(motion, tmp_path / "motion.csv", hayashi)
    against = Against(tool=fx.Tool.ball(6))
    posted = post_program(table, hayashi, control="heidenhain", coordinates="tip", against=against)
    assert posted.made.blocks.time.sum() == pytest.approx(3.0, rel=1e-3)


def test_options_reach_the_program(table, tmp_path):
    output = tmp_path / "part.nc"
    done = run(
        *("post", table, "-m", "linuxcnc-xyzac-trt", "-c", "fanuc", "--coordinates", "tip", "-o", output),
        *("--tool-number", 3, "--spindle-rpm", 9000, "--spindle-direction", "left", "--coolant", "mist"),
        *("--zero-word", "G55", "--line-numbers", 5, "--retract", 0, "--home", "XY", "--program-number", 77),
        *("--length-offset", 13, "--nc-unit", "inch", "--unverified"),
    )
    assert done.exit_code == 0, done.stderr
    lines = output.read_text().splitlines()
    words = " ".join(line.split(" ", 1)[1] for line in lines if line.startswith("N"))
    assert lines[1] == "O0077"
    for block in (
        "G20 ",
        "G55",
        "T3 M6",
        "S9000 M4",
        "M7",
        "G43.4 H13",
        "G53 G0 Z0.0000",
        "G53 G0 X0.0000 Y0.0000",
    ):
        assert block in words


def test_a_program_goes_from_one_control_to_another(table, tmp_path, trunnion):
    first, second = tmp_path / "part.h", tmp_path / "part.mpf"
    to_klartext = ("post", table, "-m", "linuxcnc-xyzac-trt", "-c", "heidenhain", "-o", first)
    assert run(*to_klartext, "--unverified").exit_code == 0
    words = ("post", first, "-m", "linuxcnc-xyzac-trt", "-c", "sinumerik", "-o", second, "--json")
    done = run(*words, "--unverified")
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["control"] == "sinumerik"
    assert document["coordinates"] == "axes"
    assert document["verified"] is False
    wanted = read_motion(load_source(table), trunnion)
    again = read_program(second, trunnion)
    # C turns by 180° at no more than 30°/s; before it Z comes down and leads in, after it comes the lead-out.
    assert again.time[3:-1].sum() == pytest.approx(wanted.time[1] + 180.0 / 30.0, rel=1e-3)
    np.testing.assert_allclose(again.positions[-2], wanted.positions[-1], atol=2e-4)


def test_with_a_tool_its_text_is_verified_and_errors_are_accepted_by_name(table, tmp_path):
    output = tmp_path / "part.nc"
    words = (
        "post",
        table,
        "-m",
        "linuxcnc-xyzac-trt",
        "-c",
        "fanuc",
        "--coordinates",
        "tip",
        "--tool",
        "ball:4",
    )
    refused = run(*words, "-o", output)
    assert refused.exit_code == 1
    assert "no program is written" in refused.stderr
    # C turns by half a turn in one cut, and zero lies in the table of this machine.
    assert "[jump]" in refused.stderr
    assert not output.exists()
    # Its durations are made up.
    codes = ("jump", "fixture-collision", "speed", "feed-differs")
    done = run(*words, "-o", output, *(word for code in codes for word in ("--override", code)))
    assert done.exit_code == 0, done.stderr
    text = output.read_text()
    assert "NOT VERIFIED" not in text
    assert "(OVERRIDDEN: JUMP [" in text


@pytest.fixture
def slope(tmp_path, hayashi):
    """A path, a motion along it, and a job that says both."""
    contact = np.column_stack([np.linspace(0.0, 7.0, 15), np.zeros(15), np.linspace(0.0, 0.7, 15)])
    path = fx.Toolpath.from_contacts(contact, [[-0.1, 0.0, 1.0]] * 15, fx.Tool.ball(6))
    rows = [f"{x:.9f},{y:.9f},{z:.9f},-0.1,0,1" for x, y, z in contact]
    (tmp_path / "slope.csv").write_text("\n".join(["x,y,z,nx,ny,nz", *rows]) + "\n")
    (tmp_path / "job.toml").write_text(
        'input = "slope.csv"\nmachine = "hayashi-640123"\ntool = "ball:6"\ntilt = [10, 60]\n'
    )
    turn = np.radians(np.column_stack([np.linspace(0.0, 60.0, 15), np.linspace(-20.0, -50.0, 15)]))
    write_motion(follow(path, hayashi, turn), tmp_path / "motion.csv", hayashi)
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        ["linuxcnc"],
        ["fanuc"],
        ["fanuc", "--coordinates", "tip"],
        ["fanuc", "--coordinates", "vector"],
        ["haas"],
        ["sinumerik"],
    ],
)
def test_a_table_along_its_path_becomes_a_program_that_verify_finds_no_errors_in(slope, words):
    output = slope / "out.nc"
    done = run("post", slope / "motion.csv", "--path", slope / "job.toml", "-c", *words, "-o", output)
    assert done.exit_code == 0, done.stderr
    again = run("verify", output, "--path", slope / "job.toml")
    assert again.exit_code == 0, again.stdout
    assert "verification: no errors" in again.stdout
    # Between the rows of the table the axes turn far: blocks are inserted.
    assert len(output.read_text().splitlines()) > 15 + 30


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda text: text.replace("A,C,feed", "B,C,feed"), "isn't that of machine 'hayashi-640123'"),
        (lambda text: text.replace("X,Y,Z,A", "X,Y,Z,Q,A"), "isn't that of machine 'hayashi-640123'"),
        (lambda text: text.replace("-20.000000000", "nan", 1), "a = nan isn't a finite number"),
        (lambda text: text.replace("-20.000000000", "-0.349065850", 1), "belongs to another path"),
        (lambda text: "\n".join(text.splitlines()[:-3]) + "\n", "path-missed"),
    ],
)
def test_a_foreign_table_is_one_clear_error_and_no_file(slope, change, fault):
    table, output = slope / "motion.csv", slope / "out.nc"
    table.write_text(change(table.read_text()))
    done = run("post", table, "--path", slope / "job.toml", "-c", "fanuc", "-o", output)
    assert done.exit_code in (1, 2)
    assert fault in done.stderr.lower().replace("\n", " ") or fault in done.stderr.replace("\n", " ")
    assert not output.exists()


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (["-c", "fanuk"], "unknown control 'fanuk'; did you mean 'fanuc'"),
        (["-c", "fanuc", "--coordinates", "tcp"], "coordinates = 'tcp' is unknown; give 'axes' or 'tip'"),
        ([], "--control is missing; give a name (`fiveaxis controls`) or a control table"),
        (["-c", "haas", "--coordinates", "vector"], "a Haas has no words for a direction of the tool"),
        (["-c", "fanuc", "--coolant", "steam"], "no coolant 'steam'; known: flood, mist"),
        (["-c", "fanuc", "--spindle-rpm", "-3"], "spindle_rpm = -3.0 must be above 0"),
        (["-c", "fanuc", "--winding", "rezero"], "has no winding 'rezero'"),
        (["-c", "gone.toml"], "gone.toml: no such file"),
    ],
)
def test_what_cannot_be_written_is_one_message_and_no_file(table, tmp_path, words, fault):
    output = tmp_path / "part.nc"
    done = run("post", table, "-m", "linuxcnc-xyzac-trt", "-o", output, *words)
    assert done.exit_code == 2
    assert fault in done.stderr
    assert done.stdout == ""
    assert not output.exists()


@pytest.fixture
def mill(tmp_path):
    """Give what writes the machine of `table` with a control."""

    def write(control):
        text = find_machine("linuxcnc-xyzac-trt").read_text(encoding="utf-8")
        file = tmp_path / "mill.toml"
        file.write_text(f'control = "{control}"\n{text}', encoding="utf-8")
        return file

    return write


def test_a_program_is_for_the_control_of_its_machine_unless_another_is_named(table, tmp_path, mill):
    (tmp_path / "mine.toml").write_text('based_on = "fanuc"\n')
    for stated, words, header in (
        ("fanuc", (), "CONTROL: FANUC AXES"),
        ("mine.toml", (), "CONTROL: MINE AXES"),
        ("fanuc", ("-c", "sinumerik"), "control: sinumerik axes"),
    ):
        output = tmp_path / "part.mpf" if words else tmp_path / "part.nc"
        done = run("post", table, "-m", mill(stated), "-o", output, "--overwrite", "--unverified", *words)
        assert done.exit_code == 0, done.stderr
        assert header in output.read_text()
    assert json.loads(run("info", mill("fanuc"), "--json").stdout)["control"] == "fanuc"


def test_an_unknown_control_of_a_machine_names_the_machine_and_the_nearest_control(table, tmp_path, mill):
    file = mill("fanuk")
    fault = "machine 'linuxcnc-xyzac-trt': unknown control 'fanuk'; did you mean 'fanuc'?"
    for words in (("post", table, "-m", file, "-o", tmp_path / "part.nc"), ("check", file)):
        done = run(*words)
        assert done.exit_code == 2
        assert fault in done.stderr.replace("\n", " ")
    assert not (tmp_path / "part.nc").exists()


def test_the_controls_are_listed():
    rows = json.loads(run("controls", "--json").stdout)
    assert list(rows) == list(DIALECTS)
    assert rows["haas"]["coordinates"] == ["axes", "tip"]
    assert any("19696 bit 6" in note for note in rows["fanuc"]["notes"]["tip"])
    assert any("to the tip itself" in note for note in rows["heidenhain-m128"]["notes"]["tip"])
    text = run("controls").stdout
    assert all(name in text for name in DIALECTS)


def test_what_cannot_be_written_is_reported_before_the_work(tmp_path, monkeypatch):
    def never(*_, **__):
        raise AssertionError("the work has begun")

    monkeypatch.setattr("fiveaxis.job.task.load_job_toolpath", never)
    path = tmp_path / "ring.csv"
    path.write_text("x,y,z,nx,ny,nz\n1,0,0,0,0,1\n2,0,0,0,0,1\n")
    words = ("optimise", path, "-m", "hayashi-640123", "--tool", "ball:6", "--tilt", "15:75")
    for options, fault in (
        (("--control", "fanuc", "--coolant", "steam"), "no coolant 'steam'"),
        (("--control", "haas", "--coordinates", "vector"), "a Haas has no words"),
        (("--control", "gone.toml"), "gone.toml: no such file"),
        (("--winding", "modulo", "--control", "haas"), "has no winding 'modulo'"),
    ):
        done = run(*words, *options)
        assert done.exit_code == 2
        assert fault in done.stderr.replace("\n", " ")


def test_a_fault_of_a_motion_names_file_and_line_of_its_table(tmp_path):
    table = tmp_path / "q.csv"
    table.write_text(
        "X,Y,Z,A,C,feed,time,source\n# from elsewhere\n0,0,0,0,0,600,0,1\n1,0,0,-10,0,600,600000,2\n"
    )
    done = run("post", table, "-m", "hayashi-640123", "-c", "fanuc", "-o", tmp_path / "p.nc")
    assert done.exit_code == 2
    assert "q.csv:4: location 1: F0 1/min of a block of 600000 s" in done.stderr.replace("\n", "")


def test_a_list_of_cutter_locations_is_posted_with_its_postures(tmp_path):
    (tmp_path / "p.apt").write_text("MULTAX/ON\nFEDRAT/600,MMPM\nGOTO/0,0,0,0,0,1\nGOTO/1,2,0,0,.6,.8\n")
    words = ("-m", "hayashi-640123", "-c", "linuxcnc", "--coordinates", "tip")
    done = run("post", tmp_path / "p.apt", *words, "-o", tmp_path / "p.ngc")
    assert (done.exit_code, "angles-assumed" in done.stderr) == (0, True)
    cuts = [line for line in (tmp_path / "p.ngc").read_text().splitlines() if "X1.0000" in line]
    assert "Y2.0000" in cuts[0]


@pytest.mark.usefixtures("undrawn")
def test_optimise_writes_for_the_control_with_its_settings(tmp_path):
    rows = [f"{x},0,{x / 10},{-0.1},0,1" for x in range(8)]
    (tmp_path / "slope.csv").write_text("\n".join(["x,y,z,nx,ny,nz", *rows]) + "\n")
    (tmp_path / "mine.toml").write_text('based_on = "fanuc"\nsuffix = ".tap"\n')
    (tmp_path / "job.toml").write_text(
        'input = "slope.csv"\nmachine = "hayashi-640123"\ntool = "ball:6"\ntilt = [10, 40]\n'
        'control = "mine.toml"\ncoordinates = "tip"\n[nc]\ntool_number = 4\nspindle_rpm = 8000\n'
    )
    done = run("optimise", tmp_path / "job.toml", "-o", tmp_path / "out", "--spindle-rpm", 9000, "-v")
    assert done.exit_code == 0, done.stderr
    lines = (tmp_path / "out" / "program.tap").read_text().splitlines()
    assert {"T4 M6", "S9000 M3"} <= set(lines)
    assert any(line.startswith("G0 G43.4 H4 X") for line in lines)
    assert "no program number was given: 1 is written [number-assumed]" in done.stdout


def test_a_program_has_the_name_of_a_program(table, tmp_path):
    words = ("post", table, "-m", "linuxcnc-xyzac-trt", "-c", "sinumerik", "--unverified", "-o")
    refused = run(*words, tmp_path / "part.svg")
    assert refused.exit_code == 2
    assert "part.svg: is not a name for a program; let it end in .mpf, " in refused.stderr.replace("\n", "")
    assert not (tmp_path / "part.svg").exists()
    for name in ("part.MPF", "part.nc", "O1000"):
        assert run(*words, tmp_path / name).exit_code == 0
