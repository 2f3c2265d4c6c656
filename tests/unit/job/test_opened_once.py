"""A run opens each of its input files once: what was checked, hashed and used is the same content."""

import numpy as np
import pytest
import trimesh
from support.opened_files import command, count_opened

from fiveaxis.model import load_machine, machine_text

JOB = """input = "{input}"
machine = "mill.toml"
tool = "cutter.toml"
feed = 1000
effort = "quick"
{more}
"""
BODY = """
[[bodies]]
link = "C"
shape = "mesh"
file = "table.stl"
source = "drawing"
"""
CLAMP = '[[fixture]]\nname = "clamp"\nmesh = "clamp.stl"\n'
TILT, BESIDE = "tilt = [15, 75]\n", 'part = "part.stl"\nstock = "stock.stl"\n'
SURROUNDING = ("part.stl", "clamp.stl", "table.stl")
FILES = ("job.toml", "mill.toml", "cutter.toml", *SURROUNDING)
# mm and rad: a cone that stands on its tip, and the slope of its side.
RADIUS, HEIGHT, LEVEL = 12.0, 30.0, 20.0
SIDES = 720
SLOPE = np.arctan2(RADIUS, HEIGHT)


@pytest.fixture
def folder(tmp_path):
    """Files of a job: machine with a body of its own, tool, part, stock, clamp, a path and a program."""
    part = trimesh.creation.cone(RADIUS, HEIGHT, sections=SIDES)
    part.apply_transform(trimesh.transformations.rotation_matrix(np.pi, [1, 0, 0], [0, 0, HEIGHT / 2.0]))
    part.export(tmp_path / "part.stl")
    for name, bounds in {
        "stock": [[-14, -14, -1], [14, 14, 31]],
        "clamp": [[40, 40, 0], [50, 50, 5]],
        "plate": [[-20, -20, -10], [40, 40, 0]],
        "table": [[-80, -80, -40], [80, 80, -20]],
    }.items():
        trimesh.creation.box(bounds=bounds).export(tmp_path / f"{name}.stl")
    machine = 'control = "linuxcnc"\n' + machine_text(load_machine("hayashi-640123")) + BODY
    (tmp_path / "mill.toml").write_text(machine, encoding="utf-8")
    cutter = 'shape = "ball"\ndiameter = 6\nlength = 16\nshank_diameter = 6\n'
    (tmp_path / "cutter.toml").write_text(cutter, encoding="utf-8")
    turn = 2.0 * np.pi / SIDES * (6.0 * np.arange(61) + 0.5)  # amid the sides
    outside = np.stack([np.cos(turn), np.sin(turn), np.zeros(len(turn))], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    normal = np.cos(SLOPE) * outside - np.sin(SLOPE) * up
    contact = RADIUS * LEVEL / HEIGHT * outside + LEVEL * up
    head = {"delimiter": ",", "comments": "", "fmt": "%.6f"}
    np.savetxt(tmp_path / "path.csv", np.hstack([contact, normal]), header="x,y,z,nx,ny,nz", **head)
    lines = ["%", "G21 G90 G94 G54", "T1 M6", "S8000 M3", "G0 A10 C0", "G0 X0 Y0 Z60"]
    # Along the plate; the table tilts to and fro, which nobody needs.
    hayashi, row = load_machine("hayashi-640123"), np.arange(20.0)
    turned = np.radians(np.column_stack([10.0 + 8.0 * (row % 2.0), 5.0 * row]))
    _, axis = hayashi.forward(np.hstack([np.zeros((20, 3)), turned]))
    centre = np.column_stack([row, 0.5 * row, np.full(20, 3.0)])
    words = " ".join(f"{letter}{{:.4f}}" for letter in hayashi.letters)
    for values in hayashi.inverse(centre - 3.0 * axis, axis)[0]:
        lines.append(f"G1 {words} F800".format(*values[:3], *np.degrees(values[3:])))
    lines += ["G0 Z60", "M30", "%"]
    (tmp_path / "program.ngc").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return tmp_path


def write_job(folder, name="job.toml", source="path.csv", more=TILT):
    (folder / name).write_text(JOB.format(input=source, more=more), encoding="utf-8")


def once(*names):
    return dict.fromkeys(names, 1)


def test_a_job_that_plans_on_its_part_opens_each_file_once(folder):
    write_job(folder, source="part.stl", more=f"{TILT}[plan]\nstepdown = 12\nspacing = 6\n{CLAMP}")
    assert count_opened(folder, command("optimise", "job.toml", "-o", "out", "-q")) == once(*FILES)


def test_a_job_with_a_path_beside_its_part_and_stock_opens_each_file_once(folder):
    write_job(folder, more=TILT + BESIDE + CLAMP)
    opened = count_opened(folder, command("optimise", "job.toml", "-o", "out", "-q"))
    assert opened == once(*FILES, "path.csv", "stock.stl")


def test_a_job_whose_setup_is_searched_opens_each_file_once(folder):
    search = "[setup.search]\nx = [-20, 20]\ntries = 2\n"
    write_job(folder, more=TILT + 'part = "part.stl"\n' + CLAMP + search)
    opened = count_opened(folder, command("optimise", "job.toml", "-o", "out", "-q"))
    assert opened == once(*FILES, "path.csv")


def test_a_program_that_is_revised_in_its_lines_is_opened_once(folder):
    act = """
from pathlib import Path
from fiveaxis.base import AlreadyBetter
from fiveaxis.job import make_job, revise_operations
given = {"machine": "mill.toml", "part": Path("plate.stl"), "tool": "cutter.toml"}
given |= {"effort": "quick", "cone": 20}
try:
    revise_operations(make_job(input=Path("program.ngc"), **given))
except AlreadyBetter:
    pass
"""
    opened = count_opened(folder, act)
    assert opened == once("mill.toml", "cutter.toml", "program.ngc", "plate.stl", "table.stl")


def test_the_call_of_python_opens_each_file_once(folder):
    act = """
import fiveaxis as fx
given = {"part": "part.stl", "stock": "stock.stl", "tilt": (15, 75), "effort": "quick"}
found = fx.optimise("path.csv", "mill.toml", tool="cutter.toml", **given)
found.verify()
found.program()
"""
    opened = count_opened(folder, act)
    assert opened == once("path.csv", "mill.toml", "cutter.toml", "part.stl", "stock.stl", "table.stl")


def test_a_batch_opens_each_file_once_in_the_process_that_runs_its_jobs(folder):
    write_job(folder, more=TILT + 'part = "part.stl"\n' + CLAMP)
    act = """
from pathlib import Path
from fiveaxis.job.batch.tasks import QueuedJob
from fiveaxis.job.batch.worker import run_queued
row = run_queued(QueuedJob("job", Path("job.toml")), Path("out"), lambda *_: None)
assert row.digest, row
"""
    assert count_opened(folder, act) == once(*FILES, "path.csv")
