"""The table of jobs on a terminal: a pseudo terminal, and jobs that end when they are told to."""

import json
import os
import re
import select
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.patience import PATIENCE

if sys.platform == "win32":
    pytest.skip("no pseudo terminals there", allow_module_level=True)

import fcntl
import pty
import struct
import termios

# The command line, with threads that pretend to optimise: they tell a stage, and wait until a file is there.
COMMAND = """
import importlib.util, sys, time
from pathlib import Path
spec = importlib.util.spec_from_file_location("pretending", sys.argv.pop(1))
pretending = importlib.util.module_from_spec(spec)
spec.loader.exec_module(pretending)
go = Path(sys.argv.pop(1))
with pretending.pretend() as stand_in:
    import fiveaxis.job.batch.worker as worker
    def run(job, tell, checkpoint):
        tell("search 1", 1, 2)
        while not go.exists():
            time.sleep(0.01)
        return stand_in.run(job)
    worker.run_task = run
    from fiveaxis.cli import main
    main()
"""
CONTROLS = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


class Screen:
    """What a terminal has shown, without colours and movements."""

    def __init__(self, terminal: int) -> None:
        self.terminal, self.raw = terminal, b""

    @property
    def text(self) -> str:
        return CONTROLS.sub("", self.raw.decode(errors="replace"))

    def read(self, text: str | None) -> str:
        """Read until a text has been seen; None: until the other side is closed."""
        end = time.monotonic() + PATIENCE
        while text is None or text not in self.text:
            ready, _, _ = select.select([self.terminal], [], [], max(0.0, end - time.monotonic()))
            if not ready:
                pytest.fail(f"after {PATIENCE:g} s not seen: {text or 'the end'!r}, but\n{self.text}")
            try:
                read = os.read(self.terminal, 65536)
            except OSError:  # so Linux says that the other side is closed
                read = b""
            if not read and text is None:
                break
            if not read:
                pytest.fail(f"closed before {text!r} was seen, but\n{self.text}")
            self.raw += read
        return self.text


def test_a_terminal_shows_names_stages_and_the_end_and_stdout_the_json_alone(jobs, tmp_path):
    terminal, other = pty.openpty()
    screen = Screen(terminal)
    fcntl.ioctl(other, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 100, 0, 0))
    go, conftest = tmp_path / "go", Path(__file__).with_name("conftest.py")
    words = ["batch", *map(str, jobs[:3]), "-o", str(tmp_path / "out"), "--workers", "1", "--json"]
    told = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "COLUMNS", "LINES")}
    told["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
    with subprocess.Popen(
        [sys.executable, "-c", COMMAND, str(conftest), str(go), *words],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=other,
        env=told | {"TERM": "xterm-256color"},
        text=True,
    ) as process:
        os.close(other)
        try:
            running = screen.read("search 1 50 %")
            go.touch()
            ended = screen.read(None)
            out, _ = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
            os.close(terminal)
    assert "0 done, 1 running, 2 waiting" in running
    assert re.search(r" a +running +1 \(pid \d+\) +search 1 50 % ", running)
    assert all(re.search(rf" {name} +waiting", running) for name in "bc")
    assert "3 done, 0 running, 0 waiting" in ended
    final = ended[ended.rindex("3 done, 0 running, 0 waiting") :]
    assert re.search(r" a +fine +1000", final)
    assert [job["status"] for job in json.loads(out)["jobs"]] == ["fine"] * 3
    assert process.returncode == 0
