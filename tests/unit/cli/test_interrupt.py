"""Ctrl-C: a command ends soon, says so, and leaves no half-written file, whatever runs inside."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from support.patience import PATIENCE

from fiveaxis.base.files import undisturbed
from fiveaxis.cli.work import NAME, Work

posix = pytest.mark.skipif(sys.platform == "win32", reason="a process is sent no SIGINT there")

# Runs the command line, and says when the optimiser begins.
TELLING = """
import sys
import fiveaxis.job.stages as stages
def told(*args, solve=stages.solve):
    print("solving", file=sys.stderr, flush=True)
    return solve(*args)
stages.solve = told
from fiveaxis.cli import main
main()
"""
# Stands for a compiled step: it gives the lock back, hears nothing, and would take minutes.
DEAF = """
import sys, time
import fiveaxis.job
def deaf(task, progress, checkpoint):
    print("solving", file=sys.stderr, flush=True)
    time.sleep(600)
fiveaxis.job.run_task = deaf
from fiveaxis.cli import main
main()
"""


# Stands for what a verb does, and says in which thread.
DEAF_VERB = """
import sys, time, threading
from importlib import import_module
def deaf(*_, **__):
    print(threading.current_thread().name, file=sys.stderr, flush=True)
    time.sleep(600)
home, name = sys.argv.pop(1).split(":")
setattr(import_module(home), name, deaf)
from fiveaxis.cli import main
main()
"""


def write_wall(path: Path, n: int) -> Path:
    """A lobed wall of many turns that overhangs."""
    angle = np.linspace(0.0, 40.0 * np.pi, n)
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(n, -0.3)], axis=1)
    r = 30.0 + 3.0 * np.cos(3.0 * angle)
    contact = np.stack([r * np.cos(angle), r * np.sin(angle), 0.1 * angle], axis=1)
    rows = np.hstack([contact, normal / np.linalg.norm(normal, axis=1, keepdims=True)])
    np.savetxt(path, rows, delimiter=",", header="x,y,z,nx,ny,nz", comments="", fmt="%.9f")
    return path


def interrupted(script: str, folder: Path, n: int, after: float) -> tuple[int, str, str]:
    """Run `optimise` in a process of its own and press Ctrl-C some time after it began to work."""
    path = write_wall(folder / "wall.csv", n)
    words = ["optimise", path, "--machine", "hayashi-640123", "--tool", "ball:6", "--tilt", "15:75"]
    words += ["--effort", "thorough", "-o", folder / "out"]
    with subprocess.Popen(
        [sys.executable, "-c", script, *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell that starts the tests in the background lets them, and their children, ignore it.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        try:
            assert process.stderr.readline() == "solving\n"
            time.sleep(after)
            os.kill(process.pid, signal.SIGINT)
            out, err = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
    return process.returncode, out, err


@posix
@pytest.mark.slow
def test_ctrl_c_in_the_middle_of_the_optimiser_ends_the_command_and_leaves_nothing(tmp_path):
    code, out, err = interrupted(TELLING, tmp_path, n=20_000, after=2.0)
    assert code == 130
    assert out == ""
    assert err == "interrupted; nothing was written\n"
    assert [p.name for p in tmp_path.iterdir()] == ["wall.csv"]


@posix
def test_ctrl_c_doesnt_wait_for_a_step_that_hears_nothing(tmp_path):
    code, out, err = interrupted(DEAF, tmp_path, n=10, after=0.1)
    assert (code, out) == (130, "")
    assert err == "interrupted; nothing was written\n"
    assert [p.name for p in tmp_path.iterdir()] == ["wall.csv"]


@posix
@pytest.mark.parametrize(
    ("work", "words"),
    [
        ("fiveaxis.lab:price_program", "energy part.ngc --machine hayashi-640123"),
        (
            "fiveaxis.lab:calibrate_drive",
            "calibrate log.csv --axis X --model affine --power p --power-unit W",
        ),
        ("fiveaxis.check:check_program", "verify part.ngc --machine hayashi-640123"),
    ],
)
def test_other_verbs_work_in_the_thread_too_and_dont_wait_for_it(tmp_path, work, words):
    (tmp_path / "log.csv").touch()
    (tmp_path / "part.ngc").write_text("G21 G90 G94 F100\nG0 X0 Y0 Z0 A0 C0\nG1 X1\nM2\n")
    with subprocess.Popen(
        [sys.executable, "-c", DEAF_VERB, work, *words.split()],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        try:
            assert process.stderr.readline() == f"{NAME}\n"
            os.kill(process.pid, signal.SIGINT)
            out, err = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
    assert (process.returncode, out, err) == (130, "", "interrupted; nothing was written\n")


@posix
def test_files_that_are_being_moved_in_place_are_moved_all():
    before = signal.getsignal(signal.SIGINT)
    with undisturbed():
        os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


def test_work_is_done_in_a_thread_and_its_answer_handed_on():
    names = []

    def work(step):
        names.append(threading.current_thread().name)
        step("refine", 1, 2)
        return 7

    assert Work().run(work) == 7
    assert names == [NAME]


@pytest.mark.parametrize("fault", [ValueError("bad"), KeyboardInterrupt()])
def test_what_work_raises_is_raised(fault):
    def work(_step):
        raise fault

    with pytest.raises(type(fault)) as raised:
        Work().run(work)
    assert raised.value is fault


def test_work_that_was_given_up_ends_at_its_next_step(monkeypatch):
    ended = threading.Event()

    def work(step):
        try:
            while True:
                step("refine", 0, 1)
                time.sleep(0.001)
        finally:
            ended.set()

    def pressed(*_):
        monkeypatch.undo()
        raise KeyboardInterrupt

    monkeypatch.setattr("fiveaxis.cli.work.wait", pressed)
    with pytest.raises(KeyboardInterrupt):
        Work().run(work)
    assert ended.wait(PATIENCE)
