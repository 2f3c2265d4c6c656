"""A command ends with a line and an exit code, whatever happens to its process; never with a traceback."""

import os
import signal
import subprocess
import sys

import pytest
from support.patience import PATIENCE

posix = pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals and devices there")

START = "from fiveaxis.cli import main; main()"
# Stands for a library that takes long to import and catches what is raised meanwhile.
DEAF_LIBRARY = """
import sys, time
print("importing", file=sys.stderr, flush=True)
try:
    time.sleep(600)
except BaseException:
    raise ImportError("not installed")
"""
# A fault of the program, as nobody has found it yet.
FAULTY = """
import fiveaxis.model.machine
def faulty():
    raise ZeroDivisionError("of nothing" + 10_000 * "!")
fiveaxis.model.machine_names = faulty
from fiveaxis.cli import main
main()
"""


# A pipe that its reader has closed, as Windows tells it.
CLOSED_ON_WINDOWS = """
import errno, io, sys
class Closed(io.TextIOWrapper):
    def write(self, text):
        raise OSError(errno.EINVAL, "Invalid argument")
sys.stdout = Closed(io.BytesIO(), encoding="utf-8")
from fiveaxis.cli import main
main()
"""


def start(*words, script=START, **options):
    return subprocess.Popen(
        [sys.executable, "-c", script, *words],
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


@posix
def test_ctrl_c_while_libraries_are_imported_ends_the_command_at_once(tmp_path, monkeypatch):
    (tmp_path / "typer.py").write_text(DEAF_LIBRARY)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, sys.path)]))
    with start("machines", preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)) as process:
        assert process.stderr.readline() == "importing\n"
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=PATIENCE)[1] == "interrupted\n"
    assert process.returncode == 130


@posix
@pytest.mark.parametrize("words", [["machines"], ["machines", "--json"], ["urdf", "dmu50ev"]])
def test_a_reader_that_closes_the_pipe_ends_the_command_quietly(words):
    read, write = os.pipe()
    os.close(read)
    with start(*words, stdout=write) as process:
        assert process.communicate(timeout=PATIENCE)[1] == ""
    os.close(write)
    assert process.returncode == 141


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="a device of Linux")  # noqa: PTH110
def test_a_full_disk_under_the_output_is_an_error():
    with open("/dev/full", "w") as full, start("machines", "--json", stdout=full) as process:  # noqa: PTH123
        said = process.communicate(timeout=PATIENCE)[1]
    assert said == "error: the output can't be written: No space left on device\n"
    assert process.returncode == 4


@posix
def test_output_closed_before_the_start_is_no_fault():
    with start("machines", preexec_fn=lambda: os.close(1)) as process:
        assert process.communicate(timeout=PATIENCE)[1] == ""
    assert process.returncode == 0


def test_a_fault_of_the_program_is_one_line_and_its_traceback_is_for_who_asks():
    with start("machines", script=FAULTY) as process:
        said = process.communicate(timeout=PATIENCE)[1]
    assert process.returncode == 4
    assert said.startswith(
        "error: a fault of fiveaxis itself, not of the input: ZeroDivisionError: of nothing!!!"
    )
    assert said.endswith("(<string>:4); please report it with the output of -vv\n")
    assert len(said) < 3000
    with start("machines", "-vv", script=FAULTY) as process:
        assert "Traceback (most recent call last)" in process.communicate(timeout=PATIENCE)[1]


@pytest.mark.parametrize("words", [["machines"], ["machines", "--json"]])
def test_a_closed_pipe_is_one_too_where_it_is_called_an_invalid_argument(words):
    with start(*words, script=CLOSED_ON_WINDOWS) as process:
        assert process.communicate(timeout=PATIENCE)[1] == ""
    assert process.returncode == 141


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_a_terminal_that_lacks_characters_gets_question_marks(tmp_path, encoding):
    env = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    for words in (["machines"], ["info", "hayashi-640123"]):
        done = subprocess.run(
            [sys.executable, "-m", "fiveaxis.cli", *words],
            capture_output=True,
            text=True,
            encoding=encoding,
            env=env,
            cwd=tmp_path,
        )
        assert (done.returncode, done.stderr) == (0, "")
    assert "?" in done.stdout or encoding != "ascii"
