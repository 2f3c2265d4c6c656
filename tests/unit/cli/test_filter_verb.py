"""A program goes through `fiveaxis filter` before LinuxCNC loads it."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from support.patience import PATIENCE
from support.rs274 import canonical, needs_rs274
from support.wavering_pass import wavering
from typer.testing import CliRunner

from fiveaxis.cli.commands import app

MACHINE = "linuxcnc-xyzac-trt"
OPTIONS = "(fiveaxis: --tool ball:6 --cone 15 --objective time --effort quick)"
# As `axis` of linuxcnc-uspace 2.9 reads them, line by line.
PROGRESS = re.compile(r"^FILTER_PROGRESS=(\d*)$")
CONFIGURATION = Path(
    "/usr/share/doc/linuxcnc/examples/sample-configs/sim/axis/vismach/5axis/table-rotary-tilting"
)
needs_configuration = pytest.mark.skipif(
    not (CONFIGURATION / "xyzac-trt.ini").is_file(),
    reason="linuxcnc-uspace's configurations aren't installed",
)


def wavy(count: int = 40) -> list[str]:
    """A pass whose tool axis wavers, with TCP, up to the end of the program."""
    rows = wavering(count)
    x, y, z, a, c = rows[0]
    start = [f"G0 A{a:.3f} C{c:.3f}", "M428", f"G0 X{x:.3f} Y{y:.3f}", "G0 Z40.", f"G1 Z{z:.3f} F600"]
    cuts = ["X{:.3f} Y{:.3f} Z{:.3f} A{:.3f} C{:.3f}".format(*row) for row in rows[1:]]
    begin = ["(finish)", "G21 G90 G94 G17 G40 G49 G80 G54 G64 P0.01", "T1 M6", "S5000 M3", "G43 H1"]
    return [*begin, *start, *cuts, "G0 Z40.", "M429", "G0 A0. C0.", "M5"]


def write(folder: Path, lines: list[str], end: str = "\n") -> Path:
    file = folder / "part.5ax"
    file.write_bytes("".join(line + end for line in lines).encode("latin-1"))
    return file


def filtered(file: Path, *words: str, ini: str | None = MACHINE) -> Any:
    """Run the command as LinuxCNC does, of which the INI file is in the environment."""
    return CliRunner(env={"INI_FILE_NAME": ini}).invoke(app, ["filter", *words, str(file)])


def progress_of(text: str) -> tuple[list[int], list[str]]:
    """Return the numbers for the bar, and the other lines."""
    found = [(PROGRESS.match(line), line) for line in text.splitlines()]
    return [int(match[1]) for match, _ in found if match], [line for match, line in found if not match]


@pytest.fixture(scope="module")
def better(tmp_path_factory) -> tuple[Path, Any]:
    file = write(tmp_path_factory.mktemp("better"), ["%", OPTIONS, *wavy(), "M2", "%"])
    return file, filtered(file)


@pytest.mark.slow
def test_a_better_program_comes_out_with_what_it_gained_below_its_options(better):
    file, run = better
    assert run.exit_code == 0, run.stderr
    before, after = file.read_text().splitlines(), run.stdout.splitlines()
    assert after[:2] == ["%", OPTIONS]
    assert re.fullmatch(
        r"\(operation 1, postures by fiveaxis: [\d.]+ -> [\d.]+ s, \d+ -> \d+ starts and reversals, .* J\)",
        after[2],
    )
    assert after[3].startswith("(operation 1, safe to run? ")
    rest = [line for line in after[2:] if not line.startswith("(")]
    changed = [line for line in rest if line not in before]
    assert changed
    assert all(re.match("(G1 )?[XYZAC]", line) for line in changed)
    assert rest[-6:] == before[-6:]


@pytest.mark.slow
def test_the_bar_rises_and_nothing_is_written(better):
    file, run = better
    numbers, others = progress_of(run.stderr)
    assert numbers == sorted(set(numbers))
    assert 0 <= numbers[0] < 20
    assert 80 < numbers[-1] < 100
    assert [line[:11] for line in others] == ["operation 1"] * 2
    assert [path.name for path in file.parent.iterdir()] == [file.name]


@pytest.mark.slow
def test_a_program_of_which_nothing_better_is_found_comes_out_as_it_is(better, tmp_path):
    file = tmp_path / "part.5ax"
    file.write_bytes(better[1].stdout_bytes)
    run = filtered(file)
    assert run.exit_code == 0
    assert run.stdout_bytes == file.read_bytes()
    assert "already better than all that was found" in progress_of(run.stderr)[1][0]


@pytest.mark.slow
@needs_rs274
@needs_configuration
def test_linuxcnc_s_interpreter_runs_what_comes_out_with_the_ini_of_a_configuration(tmp_path):
    folder = tmp_path / "trunnion"
    shutil.copytree(CONFIGURATION, folder)
    (folder / "xyzac.var").touch()
    for code in ("428", "429"):  # without a running machine its kinematics can't be switched
        empty = f"o<{code}remap>sub\no<{code}remap>endsub\n"
        (folder / "remap_subs" / f"{code}remap.ngc").write_text(empty)
    programs = tmp_path / "my programs"
    programs.mkdir()
    file = write(programs, [*wavy(), "M2"])
    words = [sys.executable, "-m", "fiveaxis.cli", "filter", "-q", *shlex.split(OPTIONS[1:-1])[1:]]
    run = subprocess.run(
        ["sh", "-c", f"{shlex.join(words)} '{file}'"],
        capture_output=True,
        check=False,
        timeout=PATIENCE,
        env=os.environ | {"INI_FILE_NAME": str(folder / "xyzac-trt.ini")},
    )
    assert (run.returncode, run.stderr) == (0, b"")
    assert run.stdout.startswith(b"(operation 1, postures by fiveaxis: ")
    ends = {}
    for name, data in (("as-it-was.ngc", file.read_bytes()), ("better.ngc", run.stdout)):
        (folder / name).write_bytes(data)
        moves = re.findall(r"STRAIGHT_FEED\((.*)\)", canonical(folder / name, "-i", "xyzac-trt.ini"))
        ends[name] = [[float(v) for v in move.split(",")] for move in moves]
    before, after = ends["as-it-was.ngc"], ends["better.ngc"]
    assert len(after) >= len(before) == 40
    for end in (0, -1):
        assert after[end] == pytest.approx(before[end], abs=0.3)
    assert after != before


def refused(run: Any, code: int = 2) -> str:
    """Return the only line of an error, with which LinuxCNC loads nothing."""
    assert (run.exit_code, run.stdout) == (code, "")
    _, others = progress_of(run.stderr)
    assert others[0].startswith("error: ")
    return others[0]


@pytest.mark.parametrize(
    ("comment", "message"),
    [
        ("(fiveaxis: --con 15)", "No such option: --con"),
        ("(FIVEAXIS: --cone)", "--cone"),
        ("(fiveaxis: --tool 'ball:6)", "No closing quotation"),
        ("(fiveaxis: -o out)", "No such option: -o"),
        ("(fiveaxis: --help)", "help isn't for a comment"),
        ("(fiveaxis: other.ngc)", "unexpected extra argument"),
    ],
)
def test_a_wrong_option_in_the_comment_is_one_error_with_its_line(comment, message, tmp_path):
    run = filtered(write(tmp_path, ["(finish)", comment, *wavy(), "M2"]))
    told = refused(run)
    assert "part.5ax:2: options in the comment: " in told
    assert message in told
    assert len(run.stderr.splitlines()) == 1


def test_the_values_of_options_are_judged_as_those_of_optimise(tmp_path):
    file = write(tmp_path, ["(fiveaxis: --tool ball:6 --cone 400)", *wavy(), "M2"])
    told = refused(filtered(file))
    other = CliRunner().invoke(
        app, ["optimise", str(file), "-m", MACHINE, "--tool", "ball:6", "--cone", "400"]
    )
    assert told == other.stderr.splitlines()[0]


def test_without_a_machine_the_variable_that_linuxcnc_sets_is_named(tmp_path):
    assert "INI_FILE_NAME" in refused(filtered(write(tmp_path, [*wavy(), "M2"]), ini=None))


def test_an_unknown_tool_is_an_error_that_says_how_to_name_it(tmp_path):
    file = write(tmp_path, [*wavy(), "M2"])
    run = filtered(file, "--effort", "quick")
    assert (run.exit_code, run.stdout) == (2, "")
    assert "--tool 1=ball:10" in run.stderr


def test_bounds_without_a_posture_end_as_they_do_for_optimise(tmp_path):
    file = write(tmp_path, ["(fiveaxis: --tool ball:6 --hold C=1000 --effort quick)", *wavy(4), "M2"])
    run = filtered(file)
    assert (run.exit_code, run.stdout) == (3, "")
    assert "no-posture" in run.stderr


@pytest.mark.parametrize("words", [("--setup", "auto"), ("--written-for", "dmu50ev")])
def test_what_takes_a_program_of_its_own_is_refused(words, tmp_path):
    file = write(tmp_path, [*wavy(), "M2"])
    assert "use `fiveaxis optimise`" in refused(filtered(file, "--tool", "ball:6", *words))


def test_a_program_that_never_turns_the_tool_in_a_cut_comes_out_byte_by_byte(tmp_path):
    lines = [
        "(Fr\xe4sen)",
        "G21 G90 G94",
        "T1 M6",
        "S900 M3",
        "G0 X0 Y0",
        "G0 Z5",
        "G1 Z-1 F100",
        "X20",
        "Y10",
        "M2",
    ]
    file = write(tmp_path, lines, end="\r\n")
    run = filtered(file)
    assert run.exit_code == 0, run.stderr
    assert run.stdout_bytes == file.read_bytes()
