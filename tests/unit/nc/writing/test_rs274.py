"""LinuxCNC's own stand-alone interpreter, `rs274`, reads what is written for it."""

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from support.rs274 import canonical, needs_rs274

from fiveaxis.model import Motion, MoveKind, load_machine, machine_names
from fiveaxis.nc import ProgramSettings, read_program
from fiveaxis.nc import compose_program as compose_with_lead_out
from fiveaxis.nc.words import control_values

# The lead-out has its own tests: here the last block is the last move.
compose_program = partial(compose_with_lead_out, settings=ProgramSettings(way_out=False))

pytestmark = needs_rs274

# The interpreter prints positions with four decimals.
PRINTED = 0.5e-4 + 1e-9
CANON_LETTERS = "XYZABC"
MOVE = re.compile(r"STRAIGHT_(TRAVERSE|FEED)\(([^)]*)\)")
OFFSET = re.compile(r"SET_G92_OFFSET\(([^)]*)\)")
SWITCHES = re.compile(r"\bM42[89]\b")
RATE = re.compile(r"SET_FEED_RATE\(([^)]*)\)")


def interpreted(text, folder, *, wrapped="", ini=()):
    """Run a program; return the end of every feed move, (n, 6) mm and deg, and its canonical rate, (n,).

    The codes that switch the kinematics are remapped by a machine's own configuration, which the stand-alone
    interpreter hasn't: they are left out.
    The axes in `wrapped` are WRAPPED_ROTARY.
    """
    file = folder / "program.ngc"
    file.write_text(SWITCHES.sub("", text), encoding="ascii")
    run = canonical(file, *(ini or _ini_of(wrapped, folder)))
    ends, rates, offset, rate = [], [], np.zeros(6), np.nan
    for line in run.splitlines():
        if found := OFFSET.search(line):
            offset = np.array([float(v) for v in found[1].split(",")])
        elif found := RATE.search(line):
            rate = float(found[1])
        elif (found := MOVE.search(line)) and found[1] == "FEED":
            ends.append(np.array([float(v) for v in found[2].split(",")]) + offset)
            rates.append(rate)
    return np.array(ends), np.array(rates)


def _ini_of(wrapped, folder):
    if not wrapped:
        return []
    ini, parameters = folder / "machine.ini", folder / "parameters.var"
    parameters.write_text("", encoding="ascii")
    tables = [f"[AXIS_{letter}]\nWRAPPED_ROTARY = 1\n" for letter in wrapped]
    ini.write_text("".join([*tables, f"[RS274NGC]\nPARAMETER_FILE = {parameters}\n"]), encoding="ascii")
    return ["-i", str(ini)]


def wandering(machine, turns):
    """Create a motion inside a machine's limits that turns its endless axes by some turns."""
    draw = np.random.default_rng(3)
    n = 60
    share = np.linspace(0.0, 1.0, n)
    columns = []
    for axis in machine.axes:
        low, high = axis.limits.low, axis.limits.high
        if axis.is_rotary and not np.isfinite([low, high]).all():
            columns.append(2.0 * np.pi * turns * share)
            continue
        low, high = max(low, -150.0), min(high, 150.0)
        columns.append(low + (high - low) * (0.5 + 0.4 * np.sin(7.0 * share + draw.uniform(0.0, 6.0))))
    kind = np.full(n, MoveKind.CUT)
    kind[25:30] = MoveKind.LINK
    return Motion(
        letters=machine.letters,
        positions=np.column_stack(columns),
        feed=np.full(n, 20.0),
        time=np.append(0.0, draw.uniform(0.02, 3.0, n - 1)),
        kind=kind,
        source=np.arange(n),
    )


GOLDEN = Path(__file__).parents[3] / "golden"
WORD = re.compile(r"([XYZABC])(-?[0-9.]+)")


@pytest.mark.parametrize("file", sorted(path.name for path in GOLDEN.glob("linuxcnc*.ngc")))
def test_rs274_takes_every_golden_program_and_goes_where_its_words_say(file, tmp_path):
    text = (GOLDEN / file).read_text(encoding="ascii")
    ends, _ = interpreted(text, tmp_path)
    if "modulo" in file or "rezero" in file:
        return  # their words aren't places on a straight count of turns
    place, wanted = dict.fromkeys(CANON_LETTERS, 0.0), []
    for line in text.splitlines():
        code = line.split("(")[0]
        if "G53" in code:
            continue
        place.update({letter: float(value) for letter, value in WORD.findall(code)})
        if re.search(r"\bG1\b", code):
            wanted.append([place[letter] for letter in CANON_LETTERS])
    assert len(wanted) > 3
    np.testing.assert_allclose(ends, wanted, atol=PRINTED)


def rotary_machines():
    return [name for name in machine_names() if "takisawa" not in name]


@pytest.mark.parametrize("name", rotary_machines())
def test_rs274_goes_where_the_motion_goes(name, tmp_path):
    machine = load_machine(name)
    motion = wandering(machine, turns=3)
    program = compose_program(motion, machine=machine)
    ends, _ = interpreted(program.text, tmp_path)
    wanted = control_values(machine, motion.positions)
    columns = [CANON_LETTERS.index(letter) for letter in machine.letters]
    # The first moves are the approach; every move after it is a row.
    np.testing.assert_allclose(ends[-(len(wanted) - 1) :, columns], wanted[1:], atol=PRINTED)


def test_rs274_keeps_counting_where_the_program_resets_turns(tmp_path):
    machine = load_machine("hayashi-640123")
    motion = wandering(machine, turns=5)
    ends, _ = interpreted(compose_program(motion, machine=machine, winding="rezero").text, tmp_path)
    wanted = control_values(machine, motion.positions)
    columns = [CANON_LETTERS.index(letter) for letter in machine.letters]
    np.testing.assert_allclose(ends[-(len(wanted) - 1) :, columns], wanted[1:], atol=PRINTED)


def test_rs274_turns_a_wrapped_axis_as_the_motion_does_and_as_the_reader_says(tmp_path):
    machine = load_machine("hayashi-640123")
    motion = wandering(machine, turns=-12)
    path = tmp_path / "part.ngc"
    path.write_text(compose_program(motion, machine=machine, winding="modulo").text, encoding="ascii")
    ends, _ = interpreted(path.read_text(encoding="ascii"), tmp_path, wrapped="C")
    count = len(motion) - 1
    columns = [CANON_LETTERS.index(letter) for letter in machine.letters]
    np.testing.assert_allclose(
        ends[-count:, columns], control_values(machine, motion.positions)[1:], atol=PRINTED
    )
    read = control_values(machine, read_program(path, machine).positions)
    np.testing.assert_allclose(read[-count:], ends[-count:, columns], atol=PRINTED)


@pytest.mark.parametrize("begin", [0.0, 350.0, -10.0, 725.0])
def test_rs274_goes_where_the_reader_says_by_the_sign_of_every_word(tmp_path, begin):
    words = ["10", "-350", "-0.001", "359.999", "-359.999", "180", "0", "-0.0", "-180", "180", "90"]
    turned = [f"G0 C{begin}" if abs(begin) < 360.0 else "G0 C350\nG0 C10\nG0 C350\nG0 C5"]
    moves = [f"G1 C{word} F1" for word in words]
    path = tmp_path / "part.ngc"
    path.write_text("\n".join(["G21 G90 G0 X0 Y0 Z0 A0", *turned, "G93", *moves, "M2"]), encoding="ascii")
    ends, _ = interpreted(path.read_text(encoding="ascii"), tmp_path, wrapped="C")
    start = {"C": 0.0}  # where rs274 begins
    read = read_program(path, load_machine("hayashi-640123"), wrap="signed", start=start, rapid=1e4)
    at_words = {int(line): row for row, line in enumerate(read.source)}
    lines = [i for i, text in enumerate(path.read_text().splitlines(), start=1) if text[:3] == "G1 "]
    rows = [max(row for n, row in at_words.items() if n <= line) for line in lines]
    np.testing.assert_allclose(np.degrees(read.positions[rows, 4]), ends[:, 5], atol=PRINTED)


def test_offsets_that_an_aborted_program_left_are_cancelled(tmp_path):
    """G92 outlives a program, and the machine's file of parameters keeps it (5210: in force, 5216: of C)."""
    machine = load_machine("hayashi-640123")
    motion = wandering(machine, turns=1)
    (tmp_path / "left.var").write_text("5210\t1.0\n5211\t10.0\n5216\t360.0\n", encoding="ascii")
    (tmp_path / "left.ini").write_text(f"[RS274NGC]\nPARAMETER_FILE = {tmp_path / 'left.var'}\n")
    text = compose_program(motion, machine=machine).text
    ends, _ = interpreted(text, tmp_path, ini=["-i", str(tmp_path / "left.ini")])
    wanted = control_values(machine, motion.positions)
    columns = [CANON_LETTERS.index(letter) for letter in machine.letters]
    np.testing.assert_allclose(ends[-(len(wanted) - 1) :, columns], wanted[1:], atol=PRINTED)
    assert "\nG92.1\n" in text


def test_rs274_gives_every_block_the_time_of_the_motion(tmp_path):
    machine = load_machine("linuxcnc-xyzac-trt")
    motion = wandering(machine, turns=2)
    ends, rates = interpreted(compose_program(motion, machine=machine).text, tmp_path)
    count = len(motion) - 1
    length = np.linalg.norm(np.diff(ends[:, :3], axis=0), axis=1)[-count:]
    # In inverse time the canonical rate is the length in X, Y, Z over the time, per minute.
    np.testing.assert_allclose(60.0 * length / rates[-count:], motion.time[1:], rtol=2e-3)


def test_a_block_that_turns_alone_takes_its_time(tmp_path):
    """In inverse time rs274 floors the rate of a move in X, Y, Z at 0.1 mm/min: a pure rotation has none."""
    machine = load_machine("linuxcnc-xyzac-trt")
    still = wandering(machine, turns=1)
    positions = np.repeat(still.positions[:1], 4, axis=0)
    positions[:, machine.column("C")] += np.radians([0.0, 10.0, 25.0, 30.0])
    turning = Motion(
        letters=machine.letters,
        positions=positions,
        feed=np.full(4, 20.0),
        time=np.array([0.0, 2.0, 5.0, 0.5]),
        kind=np.full(4, MoveKind.CUT),
        source=np.arange(4),
    )
    program = compose_program(turning, machine=machine)
    blocks = [line for line in program.lines if line.startswith("G1")][-3:]
    assert not any(letter in block for block in blocks for letter in "XYZ")
    _, rates = interpreted(program.text, tmp_path)
    # deg/min
    np.testing.assert_allclose(rates[-3:], [300.0, 180.0, 600.0], rtol=1e-3)


def test_rs274_refuses_a_word_that_isnt_one(tmp_path):
    """The interpreter checks: a deliberately broken program ends with exit code 1."""
    machine = load_machine("linuxcnc-xyzac-trt")
    program = compose_program(wandering(machine, turns=1), machine=machine)
    broken = replace(program, lines=(*program.lines[:-3], "G1 X1 A2", *program.lines[-3:]))
    with pytest.raises(AssertionError):
        interpreted(broken.text, tmp_path)
