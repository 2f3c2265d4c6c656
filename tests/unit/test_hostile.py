"""Names and sizes that somebody chose to do harm."""

import gzip
import html
import os
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from fiveaxis.base import ReadLog, files
from fiveaxis.base.errors import InputError, JobError, MachineError, MeshError, ToolpathError
from fiveaxis.cam import load_mesh
from fiveaxis.cam.mesh.loading import check_mesh
from fiveaxis.job import make_job, read_fixtures, read_job, run_job, write_outcome
from fiveaxis.lab.calibration.log_columns import LogColumns
from fiveaxis.lab.calibration.motion_log import read_axis_log
from fiveaxis.model import Tool, load_machine, parse_tool
from fiveaxis.nc import find_dialect, read_program, read_toolpath, source
from fiveaxis.nc.motion_table import read_motion
from fiveaxis.nc.source import load_source
from fiveaxis.show import describe_input

MARKUP = "<img src=x onerror=alert(1)>"
FILES = {"motion.csv", "preview.html", "program.ngc", "report.html", "report.json"}


def write_ring(path: Path) -> Path:
    angle = np.linspace(0.0, 2.0 * np.pi, 24)
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))], axis=1)
    rows = np.hstack([20.0 * around + [0.0, 0.0, 30.0], np.cos(0.5) * around - [0.0, 0.0, np.sin(0.5)]])
    np.savetxt(path, rows, delimiter=",", header="x,y,z,nx,ny,nz", comments="")
    return path


def run(folder: Path, name: str, out: Path, **settings: object) -> None:
    job = make_job(
        input=write_ring(folder / name),
        machine="hayashi-640123",
        tool="ball:10",
        tilt=(15, 75),
        effort="quick",
        **settings,
    )
    write_outcome(run_job(job), out)


@pytest.mark.skipif(sys.platform == "win32", reason="such names can't be files on Windows")
def test_a_file_name_is_no_markup_in_the_pages_and_no_block_in_the_program(tmp_path):
    run(tmp_path, f"{MARKUP})\nG0 X999 (.csv", tmp_path / "out")
    for page in ("report.html", "preview.html"):
        assert MARKUP not in (tmp_path / "out" / page).read_text(encoding="utf-8")
    assert html.escape(MARKUP) in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    blocks = (tmp_path / "out" / "program.ngc").read_text().splitlines()
    assert [
        line for line in blocks if "X999" in line and not line.lstrip("N0123456789 ").startswith("(")
    ] == []


@pytest.mark.usefixtures("undrawn")
def test_a_job_writes_into_its_folder_and_nowhere_else(tmp_path):
    inside = tmp_path / "a" / "b"
    inside.mkdir(parents=True)
    run(inside, "ring.csv", inside / "out", nc={"name": "../../../evil"})
    assert {path.name for path in (inside / "out").iterdir()} == FILES
    everything = {path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file()}
    assert everything == {Path("a/b/ring.csv"), *(Path("a/b/out") / name for name in FILES)}


@pytest.mark.parametrize("suffix", ["/../../evil", ".ngc/../../evil", "..", ".a b"])
def test_a_control_of_ones_own_cannot_name_a_file_elsewhere(tmp_path, suffix):
    table = Path(source.__file__).parent / "controls" / "linuxcnc.toml"
    text = table.read_text(encoding="utf-8").replace('suffix = ".ngc"', f'suffix = "{suffix}"')
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    with pytest.raises(Exception, match="suffix"):
        run(tmp_path, "ring.csv", tmp_path / "out", control=str(tmp_path / "own.toml"))
    assert not (tmp_path / "out").exists()


def test_a_job_file_has_no_key_for_where_results_go(tmp_path):
    write_ring(tmp_path / "ring.csv")
    (tmp_path / "job.toml").write_text('input = "ring.csv"\noutput = "/etc"\n')
    with pytest.raises(JobError, match="unknown key 'output'"):
        read_job(tmp_path / "job.toml")


def test_a_program_too_large_to_read_is_refused_with_the_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(source, "MOST_PATH_BYTES", 2 * files.MEGABYTE)
    path = tmp_path / "long.nc"
    with path.open("wb") as stream:
        stream.truncate(2 * files.MEGABYTE + 1)
    with pytest.raises(ToolpathError, match=r"long\.nc: holds more than 2 MB, the most that is read"):
        load_source(path)


def test_a_small_file_that_unpacks_to_a_huge_one_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(source, "MOST_PATH_BYTES", files.MEGABYTE)
    path = tmp_path / "bomb.nc.gz"
    path.write_bytes(gzip.compress(b" " * (3 * files.MEGABYTE)))
    assert path.stat().st_size < 10_000
    with pytest.raises(ToolpathError, match=r"bomb\.nc\.gz: holds more than 1 MB"):
        load_source(path)


def test_a_packed_program_at_the_limit_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(source, "MOST_PATH_BYTES", files.MEGABYTE)
    path = tmp_path / "just.nc.gz"
    path.write_bytes(gzip.compress(b"\n" * files.MEGABYTE))
    assert len(load_source(path).lines) == files.MEGABYTE + 1


def test_a_mesh_too_large_to_read_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "huge.stl"
    with path.open("wb") as stream:
        stream.truncate(files.MOST_MESH_BYTES + 1)  # takes no room on the disk
    with pytest.raises(MeshError, match=r"huge\.stl: holds more than 1000 MB, the most that is read"):
        load_mesh(path)


def test_settings_too_large_to_read_are_refused_with_the_limit(tmp_path):
    path = tmp_path / "huge.toml"
    with path.open("wb") as stream:
        stream.truncate(8_000_000_000)  # takes no room on the disk
    with pytest.raises(MachineError, match=r"huge\.toml: holds more than 1 MB, the most"):
        load_machine(str(path))


LOG = LogColumns.of("p", "W", ReadLog(velocity="v", velocity_unit="mm/s"), rotary=False)
# Every reader that takes a path, with a suffix that it accepts.
OPENERS = {
    "program.nc": lambda path: read_program(path, load_machine("hayashi-640123")),
    "path.csv": lambda path: read_toolpath(path, tool=Tool.ball(8)),
    "path.cls.gz": lambda path: read_toolpath(path, tool=Tool.ball(8)),
    "motion.csv": lambda path: read_motion(load_source(path), load_machine("hayashi-640123")),
    "machine.toml": load_machine,
    "machine.ini": load_machine,
    "job.toml": read_job,
    "fixtures.toml": read_fixtures,
    "control.toml": find_dialect,
    "tool.toml": lambda path: parse_tool(str(path)),
    "log.csv": lambda path: read_axis_log(path, LOG),
    "part.stl": load_mesh,
    "part.ply": load_mesh,
    "input": describe_input,
}


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such files there")
@pytest.mark.parametrize("name", OPENERS)
def test_a_pipe_a_device_and_a_name_that_no_file_can_have_are_refused_and_not_waited_for(tmp_path, name):
    os.mkfifo(tmp_path / name)
    (tmp_path / "device").mkdir()
    (tmp_path / "device" / name).symlink_to("/dev/zero")
    for place in (tmp_path / name, tmp_path / "device" / name):
        with pytest.raises(InputError, match="is a pipe, a socket or a device; name a file"):
            OPENERS[name](place)
    with pytest.raises(InputError, match="can't be read: File name too long"):
        OPENERS[name](tmp_path / (1000 * "long" + name))
    with pytest.raises(InputError, match="can't be read: embedded null"):
        OPENERS[name](tmp_path / ("a\0" + name))


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("a = " + 5000 * "[", "nests lists or tables more than 20 deep"),
        ("a = " + 5000 * "{b=", "nests lists or tables more than 20 deep"),
        (".".join(5000 * "a") + " = 1", r"m\.toml:1: nests lists or tables more than 20 deep"),
        (f"[{'.'.join(30 * 'a')}]", r"m\.toml:1: nests lists or tables more than 20 deep"),
        (f"a = {30 * '['}{30 * ']'}", "nests lists or tables more than 20 deep"),
        ("a = " + 5000 * "1", "has a value that can't be read: Exceeds the limit"),
        ("a = 0x" + 5000 * "f", "has an integer beyond 64 bits"),
        ("a = '" + 30_000 * "x" + "'", r"m\.toml:1: has 30006 characters, beyond 20000; divide the line"),
        ("\n".join(f"a{i} = {i}" for i in range(5000)), "unknown key 'a0'.*; and .* more faults"),
    ],
)
def test_settings_that_would_keep_the_parser_busy_are_refused(tmp_path, text, fault):
    path = tmp_path / "m.toml"
    path.write_text(text)
    with pytest.raises(MachineError, match=fault) as caught:
        load_machine(path)
    assert len(str(caught.value)) < 2500


def test_a_message_is_bounded_and_keeps_the_fact_and_what_to_do():
    message = str(JobError(f"unknown {1_000_000 * 'x'}; write another one", file="job.toml"))
    assert message.startswith("job.toml: unknown xxx")
    assert "1000000" not in message
    assert " characters … " in message
    assert message.endswith("xxx; write another one")
    assert len(message) < 2500


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        ("a.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\nproperty float x\n"
                  b"element face 9\nproperty list uchar int vertex_indices\nend_header\n\0", "it is damaged"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 999999999\n", "it is damaged"),
        ("a.obj", b"v 0\nv 1\nv 2\nf 1 2 3\n", "its vertices aren't X, Y and Z"),
        ("a.obj", b"mtllib /dev/zero\nusemtl a\nv nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "aren't finite"),
        ("a.off", b"OFF\n3 1 0\n0 0 0\n1e300 0 0\n0 1 0\n3 0 1 2\n", "coordinate of 1e.300 mm, beyond 1e.07"),
        ("a.stl", b"", "has no triangles|it is damaged"),
        ("a.glb", b"glTF", "is not a mesh format read here"),
    ],
)  # fmt: skip
def test_a_damaged_mesh_is_refused_without_a_traceback_from_trimesh(tmp_path, capfd, name, content, fault):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MeshError, match=fault):
        load_mesh(tmp_path / name, allow_open=True)
    assert capfd.readouterr().err == ""


def test_triangles_of_vertices_that_a_mesh_lacks_are_refused():
    mesh = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 7]], process=False)
    with pytest.raises(MeshError, match="its triangles name vertices 0 to 7, and it has 3"):
        check_mesh(mesh, name="made", allow_open=True)


def test_a_truncated_mesh_says_what_to_do(tmp_path):
    whole = trimesh.creation.box((1, 1, 1)).export(file_type="stl")
    cut, off = tmp_path / "cut.stl", tmp_path / "lies.off"
    cut.write_bytes(whole[:300])
    with pytest.raises(MeshError, match=r"its header states 12 triangles, the file has 4; copy or export it"):
        load_mesh(cut)
    off.write_text("OFF\n2000000000 1 0\n0 0 0\n3 0 1 2\n")
    with pytest.raises(MeshError, match=r"it is damaged, truncated, or of another format; export it again"):
        load_mesh(off)
