"""Faults planted in a verified program, one block each: those that matter are found, on the clean one none.

What matters is measured apart from the verification: with the equations of `fiveaxis.kinematics` instead of
pinocchio, a parser of a dozen lines instead of the readers, and distances to dense samples instead of walks
along chords.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from fiveaxis.geometry import Array, angle_between
from fiveaxis.job import Outcome, read_job, run_job, verify_program, write_outcome
from fiveaxis.kinematics import linear_positions, tool_poses
from fiveaxis.machine import Machine
from fiveaxis.mesh import load_mesh
from fiveaxis.motion import Motion
from fiveaxis.toolpath import Toolpath
from fiveaxis.verification import Report, verify

JOB = Path(__file__).parents[2] / "examples" / "overhang" / "job.toml"
PART = JOB.parent / "part.stl"
TILT = (15.0, 75.0)
FAULTS = 21
FOUND = 0.99
# mm: a tool off its path by more matters. At a location, what a gouge may be; along blocks, that and as much
# again, since inserted locations and the test of the way have 5 µm and 10 µm of their own.
AT_LOCATION, ALONG_BLOCKS = 0.01, 0.02
# mm: spacing of the samples along ways.
SAMPLE = 0.01


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    plan = {"stepdown": 12.0, "spacing": 1.5}
    found = run_job(read_job(JOB, effort="quick", plan=plan))
    assert found.ok
    return found


@pytest.fixture(scope="module")
def program(outcome, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("job")
    write_outcome(outcome, folder)
    return folder / "program.ngc"


@pytest.fixture(scope="module")
def part() -> trimesh.Trimesh:
    return load_mesh(PART)


# --- faults in axis values ---------------------------------------------------------------------------------

Change = Callable[[Array, Machine, np.random.Generator], Array]


def columns(machine: Machine, letters: str) -> list[int]:
    return [machine.column(c) for c in letters if c in machine.letters]


def shift(row: Array, machine: Machine, rng: np.random.Generator) -> Array:
    """0.1 mm in one linear axis."""
    row[rng.choice(columns(machine, "XYZ"))] += rng.choice([-0.1, 0.1])
    return row


def turn(row: Array, machine: Machine, rng: np.random.Generator) -> Array:
    """Half a degree in one rotary axis."""
    row[rng.choice(columns(machine, "ABC"))] += np.radians(rng.choice([-0.5, 0.5]))
    return row


def flip(row: Array, machine: Machine, rng: np.random.Generator) -> Array:
    """C half a turn off."""
    row[machine.column("C")] += rng.choice([-np.pi, np.pi])
    return row


def inches(row: Array, machine: Machine, _: np.random.Generator) -> Array:
    """Lengths in the wrong unit."""
    row[columns(machine, "XYZ")] *= 25.4
    return row


def negate(row: Array, machine: Machine, rng: np.random.Generator) -> Array:
    """The sign of one axis."""
    row[rng.integers(len(row))] *= -1.0
    return row


def swap(row: Array, machine: Machine, rng: np.random.Generator) -> Array:
    """Two words that changed places."""
    one, two = rng.choice(columns(machine, "XYZ"), 2, replace=False)
    row[[one, two]] = row[[two, one]]
    return row


def lean_over(row: Array, machine: Machine, rng: np.random.Generator) -> Array:
    """Some degrees of lean that the linear axes follow, so that the tip stays."""
    tip, _ = tool_poses(machine, row[None])
    row[machine.column("A")] += np.radians(rng.choice([-10.0, -3.0, 3.0, 10.0]))
    return np.asarray(linear_positions(machine, tip, row[None][:, machine.rotary_columns])[0])


CHANGES: tuple[Change, ...] = (shift, turn, flip, inches, negate, swap, lean_over)


@dataclass(frozen=True)
class Tally:
    """How many faults of a kind mattered, and which of those weren't found."""

    mattered: Counter[str]
    missed: list[str]

    def hold(self, least: int) -> None:
        """Hold the share of faults found to its bound."""
        total = sum(self.mattered.values())
        assert total >= least, f"only {total} faults mattered: {self.mattered}"
        assert len(self.missed) <= (1.0 - FOUND) * total, (
            f"{len(self.missed)} of {total} missed: {self.missed}"
        )


def off_location(row: Array, i: int, machine: Machine, path: Toolpath) -> bool:
    """Whether axis values at location i miss its contact, their limits or the lean that was asked for."""
    if ((row > machine.high + 1e-9) | (row < machine.low - 1e-9)).any():
        return True
    tip, axis = tool_poses(machine, row[None])
    centre = tip + path.zone.height * axis
    if np.linalg.norm(centre - path.pivot[i]) > AT_LOCATION:
        return True
    lean = np.degrees(angle_between(axis, path.normal[i : i + 1]))[0]
    return bool(not TILT[0] - 1e-3 <= lean <= TILT[1] + 1e-3) if np.isfinite(lean) else False


def test_a_fault_in_one_location_of_a_motion_is_found(outcome, part):
    def judge(motion: Motion) -> Report:
        return verify(motion, machine, path, tilt=TILT, part=part)

    motion, machine, path = outcome.solution.motion, outcome.solution.machine, outcome.solution.toolpath
    assert judge(motion).ok
    assert set(judge(motion).counts) <= {"tip-deviation"}
    assert not any(off_location(row, i, machine, path) for i, row in enumerate(motion.positions))
    rng = np.random.default_rng(20261121)
    tally = Tally(Counter(), [])
    for number in range(FAULTS):
        change = CHANGES[number % len(CHANGES)]
        i = int(rng.integers(len(motion)))
        positions = motion.positions.copy()
        positions[i] = change(positions[i].copy(), machine, rng)
        if not off_location(positions[i], i, machine, path):
            continue
        tally.mattered[change.__name__] += 1
        report = judge(replace(motion, positions=positions))
        found = {f.place.location for f in report.findings if f.severity == "error"}
        if path.place(i).location not in found:
            tally.missed.append(f"{change.__name__} at {i}: {report.counts}")
    tally.hold(FAULTS // 2)
    assert len(tally.mattered) == len(CHANGES), tally.mattered


# --- faults in the text ------------------------------------------------------------------------------------

WORD = re.compile(r"([XYZAC])(-?[\d.]+)")


def read_block(line: str, before: Array, machine: Machine) -> Array:
    """Take the words of a block, mm and deg, over where the axes were."""
    row = before.copy()
    for letter, number in WORD.findall(line):
        value = float(number)
        row[machine.column(letter)] = np.radians(value) if letter in "AC" else value
    return row


def write_block(line: str, row: Array, machine: Machine) -> str:
    """Put other numbers into the words of a block."""

    def word(found: re.Match[str]) -> str:
        value = row[machine.column(found[1])]
        return f"{found[1]}{np.degrees(value) if found[1] in 'AC' else value:.6f}"

    return WORD.sub(word, line)


@dataclass(frozen=True)
class Text:
    """A program's lines; which of them are its approach's last and its moves, and where these end."""

    lines: list[str]
    moves: list[int]
    rows: Array

    @classmethod
    def of(cls, lines: list[str], machine: Machine) -> Text:
        row, moves, rows = np.zeros(len(machine.axes)), [], []
        for i, line in enumerate(lines):
            if line[:3] in ("G0 ", "G1 "):
                row = read_block(line, row, machine)
                moves, rows = ([*moves, i], [*rows, row]) if line.startswith("G1 ") else ([i], [row])
        return cls(lines, moves, np.array(rows))


def samples(rows: Array, machine: Machine, path: Toolpath) -> list[Array]:
    """The tool's centre along each move, all axes linear in time, every `SAMPLE` mm or nearer."""
    ways = []
    for before, after in pairwise(rows):
        tip, axis = tool_poses(machine, np.array([before, after]))
        ends = tip + path.zone.height * axis
        parts = int(np.ceil(np.linalg.norm(ends[1] - ends[0]) / SAMPLE)) + 1
        parts = max(
            min(parts, 4000), 8 + int(np.degrees(np.abs(after - before)[machine.rotary_columns].max()))
        )
        share = np.linspace(0.0, 1.0, parts + 1)[:, None]
        tip, axis = tool_poses(machine, before + share * (after - before))
        ways.append(tip + path.zone.height * axis)
    return ways


@dataclass(frozen=True)
class Measure:
    """The path as dense samples, and the clean program's ways."""

    machine: Machine
    path: Toolpath
    tree: cKDTree
    clean: list[Array]

    @classmethod
    def of(cls, text: Text, machine: Machine, path: Toolpath) -> Measure:
        chords = [
            a + np.linspace(0.0, 1.0, int(np.linalg.norm(b - a) / SAMPLE) + 2)[:, None] * (b - a)
            for a, b in pairwise(path.pivot)
        ]
        return cls(machine, path, cKDTree(np.concatenate(chords)), samples(text.rows, machine, path))

    def matters(self, rows: Array, first: int, kept: int) -> bool:
        """Whether a changed program leaves the path, misses a location or breaks a limit.

        Parameters
        ----------
        rows : axis values of all moves, changed from number `first` on, the last `kept` as before
        """
        machine = self.machine
        if ((rows > machine.high + 1e-9) | (rows < machine.low - 1e-9)).any():
            return True
        begin, stop = max(first - 1, 0), len(rows) - kept
        changed = samples(rows[begin : stop + 1], machine, self.path)
        if changed and self.tree.query(np.concatenate(changed))[0].max() > ALONG_BLOCKS:
            return True
        ways = [*self.clean[:begin], *changed, *self.clean[len(self.clean) - kept + 1 :]]
        return bool(cKDTree(np.concatenate(ways)).query(self.path.pivot)[0].max() > ALONG_BLOCKS)


def dropped(text: Text, k: int) -> tuple[list[str], Array]:
    lines = [line for i, line in enumerate(text.lines) if i != text.moves[k]]
    return lines, np.delete(text.rows, k, axis=0)


def changed(text: Text, k: int, change: Change, machine: Machine, rng) -> tuple[list[str], Array]:
    row = change(text.rows[k].copy(), machine, rng)
    lines = list(text.lines)
    lines[text.moves[k]] = write_block(lines[text.moves[k]], row, machine)
    # Words are modal: what a block doesn't name stays as it was.
    return lines, Text.of(lines, machine).rows


TEXT_FAULTS = 28
TEXT_CHANGES: tuple[Change | None, ...] = (shift, turn, flip, inches, negate, swap, None)


def test_a_fault_in_one_block_of_a_program_is_found(outcome, program, part, tmp_path):
    machine, path = outcome.solution.machine, outcome.solution.toolpath
    report = verify_program(program, machine, toolpath=path, part=part, tilt=TILT)
    # Where the machine stands before is nobody's fault.
    assert report.ok
    assert set(report.counts) <= {"approach-unknown"}
    text = Text.of(program.read_text().splitlines(), machine)
    measure = Measure.of(text, machine, path)
    assert not measure.matters(text.rows, 1, len(text.rows) - 2)
    rng = np.random.default_rng(20261122)
    tally = Tally(Counter(), [])
    file = tmp_path / "faulty.ngc"
    for number in range(TEXT_FAULTS):
        change = TEXT_CHANGES[number % len(TEXT_CHANGES)]
        name = "drop" if change is None else change.__name__
        k = int(rng.integers(1, len(text.rows) - 2))
        lines, rows = dropped(text, k) if change is None else changed(text, k, change, machine, rng)
        if not measure.matters(rows, k, len(text.rows) - k - 2):
            continue
        tally.mattered[name] += 1
        file.write_text("\n".join(lines) + "\n")
        found = verify_program(file, machine, toolpath=path, part=part, tilt=TILT)
        if found.ok:
            tally.missed.append(f"{name} in line {text.moves[k] + 1}: {found.counts}")
    tally.hold(TEXT_FAULTS // 2)
