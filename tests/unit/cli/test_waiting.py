"""Whoever waits for a command sees it work: a terminal changes at least every two seconds.

Seconds of the command's processor time: whatever else the machine does meanwhile doesn't count.
"""

import os
import re
import select
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import psutil
import pytest
from support.patience import PATIENCE

pty = pytest.importorskip("pty", reason="there are no pseudo terminals on this system")

PART = Path(__file__).parents[3] / "examples" / "overhang" / "part.stl"
LONGEST = 2.0  # s without a change on screen
CONTROLS = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
LOOK = ("--tool", "ball:8", "--stepdown", "6", "--overhang")
OPTIMISE = ("optimise", PART, *LOOK, "--machine", "hayashi-640123", "--tilt", "15:75", "--effort", "quick")


def run(folder: Path, *words: object) -> tuple[list[float], str]:
    """Run a command on a terminal; return its processor time, s, whenever it wrote, and what it wrote."""
    ours, theirs = pty.openpty()
    told = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "COLUMNS", "LINES")}
    command = [sys.executable, "-m", "fiveaxis.cli", *map(str, words)]
    times, written = [0.0], b""
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=theirs,
        cwd=folder,
        env=told | {"TERM": "xterm-256color"},
    ) as process:
        os.close(theirs)
        command_itself = psutil.Process(process.pid)
        try:
            while select.select([ours], [], [], PATIENCE)[0]:
                try:
                    chunk = os.read(ours, 65536)
                except OSError:  # Linux: the command has closed its side
                    break
                written += chunk
                spent = command_itself.cpu_times()
                times.append(spent.user + spent.system)
            assert process.wait(PATIENCE) == 0
        finally:
            process.kill()
            os.close(ours)
    return times, CONTROLS.sub("", written.decode(errors="replace"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "stages"),
    [
        (
            (*OPTIMISE, "-o", "out"),
            ("searching postures", "verifying the program", "writing the report"),
        ),
        (("plan", PART, *LOOK, "-o", "path.csv"), ("starting", "planning passes")),
    ],
)
def test_no_two_seconds_pass_without_a_change_on_screen(tmp_path, words, stages):
    times, screen = run(tmp_path, *words)
    assert max(after - before for before, after in pairwise(times)) < LONGEST, screen[-500:]
    assert [stage for stage in stages if stage not in screen] == []


@pytest.mark.slow
@pytest.mark.parametrize("words", [("-q",), ("--json",)])
def test_who_asks_for_quiet_or_for_json_sees_no_progress(tmp_path, words):
    _, screen = run(tmp_path, "plan", PART, *LOOK, *words)
    assert "planning passes" not in screen
