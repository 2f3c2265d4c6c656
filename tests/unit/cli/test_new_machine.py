"""`fiveaxis machine new`: the dialogue on a pseudo terminal, and the same file from options."""

import os
import select
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from support.patience import PATIENCE
from typer.testing import CliRunner

from fiveaxis.cli.commands import app
from fiveaxis.model import load_machine
from fiveaxis.model.machine.answers import QUESTIONS

pty = pytest.importorskip("pty", reason="there are no pseudo terminals on this system")

# Beginning of a question -> answer; Enter, the default, for all others.
ANSWERS = {
    "structure": "trunnion-ac",
    "X: travel": "-300:300",
    "Y: travel": "-250:250",
    "Z: travel": "0:450",
    "A: travel": "-30:120",
    "C: travel": "endless",
    "A: what turns": "table",
    "C: what turns": "table",
    "A: a point": "0,5,50",
    "gauge point": "0,0,500",
    "X: highest speed": "40",
    "A: highest speed": "20",
    "X: highest acceleration": "5",
    "X: mass": "900",
    "Z: nameplate": "3.1",
    "mass of": "8 t",
    "control": "heidenhain",
}
OPTIONS = {
    "name": "mill",
    "structure": "trunnion-ac",
    "vertical": "Z",
    "limits": "X=-300:300,Y=-250:250,Z=0:450,A=-30:120,C=endless",
    "counts": "A=table,C=table",
    "points": "A=0,5,50,C=0,0,0",
    "spindle": "0,0,500",
    "speeds": "X=40,Y=40,Z=40,A=20,C=20",
    "accelerations": "X=5,Y=5,Z=5",
    "masses": "X=900",
    "motors": "Z=3.1",
    "mass": "8 t",
    "control": "heidenhain",
}


class Terminal:
    """A command on a pseudo terminal, whose questions are answered as they come."""

    def __init__(self, folder: Path, words: Sequence[str]) -> None:
        ours, theirs = pty.openpty()
        self.ours = ours
        command = [sys.executable, "-m", "fiveaxis.cli", "machine", "new", *words]
        environment = os.environ | {"COLUMNS": "200", "TERM": "dumb"}
        self.process = subprocess.Popen(
            command,
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            cwd=folder,
            env=environment,
            start_new_session=True,
            # Tests that run in the background ignore Ctrl-C, and so would the command.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        os.close(theirs)
        self.text = ""

    def question(self) -> str | None:
        """Read up to the next question; None when the command has ended."""
        start = len(self.text)
        while not self.text[start:].endswith(("]: ", "CODE): ")):
            assert select.select([self.ours], [], [], PATIENCE)[0], f"nothing after: {self.text}"
            try:
                chunk = os.read(self.ours, 4096)
            except OSError:  # Linux: nobody has the other side any more
                chunk = b""
            if not chunk:
                return None
            self.text += chunk.decode("utf-8", errors="replace")
        return self.text[start:].splitlines()[-1]

    def write(self, text: str | bytes) -> None:
        os.write(self.ours, text.encode() if isinstance(text, str) else text)

    def answer(self, answers: dict[str, str]) -> list[str]:
        """Answer all questions; return them."""
        asked = []
        while (question := self.question()) is not None:
            asked.append(question)
            self.write(next((a for q, a in answers.items() if question.startswith(q)), "") + "\n")
        return asked

    def end(self) -> int:
        code = self.process.wait(PATIENCE)
        os.close(self.ours)
        return code


def options(given: dict[str, str]) -> list[str]:
    return [word for name, text in given.items() for word in (f"--{name}", text)]


def run(folder: Path, *words: str):
    return CliRunner().invoke(app, ["machine", "new", *words, "-o", str(folder / "mill.toml")])


def test_the_dialogue_and_the_options_write_the_same_bytes(tmp_path):
    terminal = Terminal(tmp_path, ["-o", "mill.toml"])
    asked = terminal.answer(ANSWERS)
    assert terminal.end() == 0, terminal.text
    assert "[40]: " in next(q for q in asked if q.startswith("Y: highest speed"))
    # What is asked next depends on what is known: the mass of X is stated, so its motor isn't asked for.
    assert not any(q.startswith(("X: nameplate", "size")) for q in asked)
    assert "o - - - -+- A's line" in terminal.text
    typed = (tmp_path / "mill.toml").read_bytes()
    (tmp_path / "mill.toml").unlink()
    done = run(tmp_path, *options(OPTIONS))
    assert done.exit_code == 0, done.output
    assert (tmp_path / "mill.toml").read_bytes() == typed
    machine = load_machine(tmp_path / "mill.toml")
    assert machine.axis("X").moved_mass == 900.0
    assert [a.letter for a in machine.axes if a.reversed] == ["A", "C"]
    assert machine.control == "heidenhain"


def test_a_control_table_is_named_relative_to_the_machine_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text('based_on = "fanuc"\n')
    (tmp_path / "shop").mkdir()
    done = run(tmp_path / "shop", "--structure", "trunnion-ac", "--control", "mine.toml")
    assert done.exit_code == 0, done.output
    assert Path(load_machine("shop/mill.toml").control).samefile("mine.toml")
    assert str(tmp_path) not in (tmp_path / "shop" / "mill.toml").read_text()


def test_a_wrong_answer_is_explained_and_asked_for_again(tmp_path):
    terminal = Terminal(tmp_path, ["-o", "mill.toml", *options(OPTIONS | {"mass": "8 t"})[:-2]])
    # Everything else is answered by options: only what they leave out is asked.
    questions = []
    wrong = {"control": ["hydenhein", "heidenhain"], "power at": [b"\xff\xfe", "2", "1500"]}
    while (question := terminal.question()) is not None:
        questions.append(question)
        replies = next((r for q, r in wrong.items() if question.startswith(q)), [])
        terminal.write(replies.pop(0) if replies else "")
        terminal.write("\n")
    assert terminal.end() == 0, terminal.text
    assert "base-power: 2 W is implausible; machines have 20 to 200000 W" in terminal.text
    assert "heidenhain" in terminal.text.partition("hydenhein")[2]
    assert sum(q.startswith("power at") for q in questions) == 3
    assert not any("travel" in q for q in questions)
    assert load_machine(tmp_path / "mill.toml").base_power == 1500.0


def test_a_structure_is_asked_for_until_there_is_one(tmp_path):
    terminal = Terminal(tmp_path, ["-o", "mill.toml", *options({"name": "mill"})])
    replies = ["", "?", "30", "trunnion-ac"]
    while "structure" in (terminal.question() or ""):
        terminal.write(replies.pop(0) + "\n")
    assert replies == [], terminal.text
    assert terminal.text.count("the structure can't be left out") == 2
    assert "'30' as a form-shaping code has no axis X and no Y" in terminal.text
    terminal.write("\x04")
    assert terminal.question() is None
    assert terminal.end() == 2


@pytest.mark.parametrize("way", ["ctrl-c", "ctrl-d"])
def test_a_dialogue_that_is_left_writes_nothing(way, tmp_path):
    terminal = Terminal(tmp_path, ["-o", "mill.toml"])
    while not (terminal.question() or "").startswith("X: travel"):
        terminal.write("trunnion-ac\n" if "structure:" in terminal.text.splitlines()[-1] else "\n")
    if way == "ctrl-c":
        # The test's process has no controlling terminal to send the signal by a key.
        # Python takes one that comes just before a read only after it: it is sent until it is answered.
        os.kill(terminal.process.pid, signal.SIGINT)
        while not select.select([terminal.ours], [], [], 5.0)[0]:
            os.kill(terminal.process.pid, signal.SIGINT)
    else:
        terminal.write("\x04")
    assert terminal.question() is None
    assert terminal.end() == (130 if way == "ctrl-c" else 2)
    assert "nothing was written" in terminal.text
    assert list(tmp_path.iterdir()) == []


def test_without_a_terminal_nothing_is_asked_and_gaps_are_said(tmp_path):
    done = run(tmp_path, "--structure", "650123", "--limits", "X=-200:200")
    assert done.exit_code == 0
    assert "vertical is assumed" in done.stderr
    text = (tmp_path / "mill.toml").read_text()
    assert "# Pivots: not all given" in text
    assert 'name = "mill"' in text


def test_without_a_file_the_text_is_on_stdout():
    done = CliRunner().invoke(app, ["machine", "new", *options(OPTIONS), "-q"])
    assert done.exit_code == 0
    assert done.stdout.startswith("# Written by `fiveaxis machine new`")
    assert done.stderr == ""


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        ([], "structure is missing"),
        (["--structure", "trunnion"], "none of trunnion-ac"),
        (["--structure", "640123", "--vertical", "Y,Z"], "one is vertical"),
        (["--structure", "640123", "--masses", "X=900000000"], "machines have 0.1 to 100000 kg"),
        (["--structure", "640123", "--limits", "B=-30:30"], "the machine has the axes X, Y, Z, A, C"),
        (["--structure", "640123", "--limits", "-300:300"], "isn't of the form AXIS=ANSWER"),
        (["--structure", "640123", "--control", "hydenhein"], "hydenhein"),
        (["--from", "no-such.urdf"], "no such file"),
        (["--from", "variaxis-630", "--structure", "640123"], "leave the structure out"),
        (["--from", "variaxis-630", "--counts", "A=tool"], "change it in the file"),
    ],
)
def test_wrong_options_are_one_message_and_no_file(words, fault, tmp_path):
    done = run(tmp_path, *words)
    assert done.exit_code == 2
    assert fault in done.stderr
    assert done.stderr.count("error:") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_there_is_kept(tmp_path):
    path = tmp_path / "mill.toml"
    path.write_text("mine")
    done = run(tmp_path, *options(OPTIONS))
    assert done.exit_code == 2
    assert "exists already" in done.stderr
    assert path.read_text() == "mine"


def test_a_name_that_is_no_machine_file_is_refused_before_any_question(tmp_path):
    done = CliRunner().invoke(app, ["machine", "new", "-o", str(tmp_path / "mill.txt")])
    assert done.exit_code == 2
    assert "end in .toml" in done.stderr


def test_every_question_is_an_option_that_says_how_it_is_answered():
    shown = " ".join(
        CliRunner().invoke(app, ["machine", "new", "--help-all"], env={"COLUMNS": "300"}).stdout.split()
    )
    for question in QUESTIONS:
        assert f"--{question.name} <str> " in shown
        assert question.help in shown


@pytest.mark.parametrize("suffix", ["urdf", "toml"])
def test_figures_of_another_file_are_completed(suffix, tmp_path):
    known = load_machine("variaxis-630")
    source = tmp_path / f"known.{suffix}"
    verb = ["urdf", "variaxis-630", "-o", str(source)] if suffix == "urdf" else None
    if verb:
        assert CliRunner().invoke(app, verb).exit_code == 0
    else:
        source.write_bytes((Path(__file__).parents[3] / "machines/variaxis-630.toml").read_bytes())
    done = run(tmp_path, "--from", str(source), "--masses", "X=900", "--base-power", "1500")
    assert done.exit_code == 0, done.output
    machine = load_machine(tmp_path / "mill.toml")
    assert machine.axis("Y").limits.ends == pytest.approx(known.axis("Y").limits.ends)
    assert (machine.axis("X").moved_mass, machine.base_power) == (900.0, 1500.0)


def test_info_of_a_machine_without_pivots_draws_what_to_measure():
    shown = CliRunner().invoke(app, ["info", "umc-750"]).stdout
    assert "not every pivot is known: measure from the centre of the table's surface" in shown
    assert "b: height of B's line above zero, negative below (axes.B.line.point[2])" in shown
    assert "not every pivot" not in CliRunner().invoke(app, ["info", "variaxis-630"]).stdout
