"""What is said of a program is true of its text: one price for it as it was and revised, and none is worse.

Each law holds for shop programs of five controls, and for real ones where the shared data are.
"""

import csv
import json
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.shop_programs import SHOPS

import fiveaxis as fx
from fiveaxis.base.errors import AlreadyBetter
from fiveaxis.job import RevisedProgram, make_job, resolve, revise_operations, write_revised
from fiveaxis.job.description import Job
from fiveaxis.job.in_place import RevisedOperation
from fiveaxis.job.program_choice import LONGER, MORE_OFTEN, WORTHWHILE
from fiveaxis.job.solution import Solution
from fiveaxis.model import (
    Interpolation,
    block_ends,
    block_times,
    follow,
    load_machine,
    program_energy,
    with_powers,
)
from fiveaxis.model.motion.deviation import WRITTEN_TOLERANCE, path_deviation
from fiveaxis.nc.control.feed_meaning import program_dialect
from fiveaxis.nc.own_header import CONTROL
from fiveaxis.nc.source import load_source
from fiveaxis.nc.writing.header import comment_lines
from fiveaxis.posture.solution import AS_PROGRAMMED
from fiveaxis.show import write_json
from fiveaxis.show.viewer.moves import choose_sides

SHARED = Path(__file__).parents[3] / "shared" / "data"
PROGRAMS = SHARED / "programs"
TRADES = ("slower", "rougher")


@dataclass(frozen=True)
class Case:
    """A program with its machine, and the operation that is revised.

    Parameters
    ----------
    file : under the shared data; None for a shop program, by the case's name
    """

    machine: str
    tool: str
    operation: int = 1
    file: str | None = None
    cone: float = 20.0
    tool_length: float | None = None
    rapid: float | None = None


REAL = {
    "dome": Case("hayashi-640123", "ball:8", 1, "dome_good_already.nc", tool_length=120.0, rapid=1e4),
    "three tools": Case(str(PROGRAMS / "three_tools_machine.toml"), "ball:8", 3, "three_tools.nc"),
    "fan": Case(str(PROGRAMS / "fanuc_machine.toml"), "ball:8", 1, "fan_good_already.nc", cone=15.0),
    "axis words": Case(str(PROGRAMS / "fanuc_machine.toml"), "ball:6", 1, "fanuc_mixed_axes.nc"),
    "inches": Case("dmu50ev", "ball:6", 4, "../toolpaths/nx_dmu70_840d_traori_inch.mpf", rapid=1e4),
    "ring": Case("hayashi-640123", "ball:8", 1, "traori_ring.mpf", cone=15.0, rapid=2e4),
}
CASES = {name: Case("dmu50ev", "ball:6", 3, rapid=1e4) for name in SHOPS} | REAL


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("programs")


# Those that take longest, with all searches: they are revised once, with trades, before a release.
LONG = {"inches", "fan", "three tools"}
SLOW = LONG | {"haas", "linuxcnc"}
# Shop programs that are revised without a trade, too, at each push.
TWICE = {"fanuc"}


def marked(names: Iterable[str], slow: set[str]) -> list[Any]:
    """Cases, with their marks."""
    having = {"shared": REAL, "slow": slow, "release": LONG}
    return [
        pytest.param(n, marks=[getattr(pytest.mark, mark) for mark, those in having.items() if n in those])
        for n in names
    ]


def present(name: str) -> str:
    """Return a case's name, if its program is here."""
    if CASES[name].file and not (PROGRAMS / CASES[name].file).is_file():
        pytest.skip("the programs are among the shared data, which aren't here")
    return name


@pytest.fixture(params=marked(CASES, SLOW))
def name(request: pytest.FixtureRequest) -> str:
    return present(request.param)


@pytest.fixture(params=marked([n for n in CASES if n not in LONG], SLOW | set(SHOPS) - TWICE))
def twice(request: pytest.FixtureRequest) -> str:
    """The name of a case, for tests that need another revision of each."""
    return present(request.param)


@cache
def file_of(name: str, folder: Path) -> Path:
    case = CASES[name]
    if case.file:
        return PROGRAMS / case.file
    file = folder / f"{name}{SHOPS[name].suffix}"
    file.write_text("\n".join(SHOPS[name].lines(9)) + "\n", encoding="utf-8")
    return file


def job_of(name: str, folder: Path, **changes: Any) -> Job:
    case = CASES[name]
    given = {"machine": case.machine, "tool": case.tool, "cone": case.cone, "effort": "quick"}
    reading = {"operation": (case.operation,), **({} if case.rapid is None else {"rapid": case.rapid})}
    given |= {} if case.tool_length is None else {"tool_length": case.tool_length}
    return make_job(input=file_of(name, folder), program=reading, **{**given, **changes})


@cache
def revised(name: str, folder: Path, allow: tuple[str, ...]) -> RevisedProgram:
    return revise_operations(job_of(name, folder, allow=allow))


def placed(name: str, folder: Path) -> tuple[Job, RevisedOperation]:
    found = resolve(job_of(name, folder))
    assert found.operation is not None
    return found.job, found.operation


def own_solution(job: Job, operation: RevisedOperation) -> Solution:
    """The program's own postures as if they had been found."""
    path, machine = job.constraints.zoned(operation.path), operation.machine
    assert path.rotary is not None
    motion = follow(path, machine, path.rotary)
    if operation.wording.interpolation is Interpolation.TCP:
        motion = replace(motion, time=block_times(path, machine, motion.positions, by_tip=True))
    return Solution(
        machine,
        path,
        job.constraints.lean_bounds(path),
        motion,
        operation.as_it_was.energy,
        {},
        {},
        (),
        constraints=job.constraints,
    )


def events(energy: fx.Energy) -> int:
    return energy.starts + energy.reversals


def said(energy: fx.Energy) -> tuple[float, float, int, int]:
    return energy.total, energy.time, energy.starts, energy.reversals


def test_both_texts_cost_what_the_energy_of_their_files_says(name, folder, tmp_path):
    case, made = CASES[name], revised(name, folder, TRADES)
    part = made.parts[case.operation - 1]
    machine = resolve(job_of(name, folder)).machine
    given = {"operation": case.operation, **({} if case.rapid is None else {"rapid": case.rapid})}
    assert said(part.before) == said(fx.program_energy(file_of(name, folder), machine, **given).energy)
    new = tmp_path / file_of(name, folder).name
    new.write_bytes(made.data)
    assert said(part.after) == said(fx.program_energy(new, machine, **given).energy)


def test_one_operation_is_revised_and_verified_and_every_other_line_stays(name, folder, tmp_path):
    made, machine = revised(name, folder, TRADES), resolve(job_of(name, folder)).machine
    assert made.ok
    before, after = file_of(name, folder).read_bytes().split(b"\n"), made.data.split(b"\n")
    if not made.outcomes:
        assert after == before
        return
    [outcome] = made.outcomes.values()
    revision = outcome.revision
    assert after[: revision.first - 1] == before[: revision.first - 1]
    rest = len(before) - revision.last
    assert after[-rest:] == before[-rest:]
    assert outcome.original.total > outcome.solution.energy.total
    new = tmp_path / file_of(name, folder).name
    new.write_bytes(made.data)
    again = fx.read_operations(new, machine=machine)
    assert [each.kind for each in again] == [part.operation.kind for part in made.parts]
    assert [each.tool for each in again] == [part.operation.tool for part in made.parts]


def test_the_programs_own_postures_change_no_byte_and_no_price(name, folder):
    job, operation = placed(name, folder)
    solution = own_solution(job, operation)
    fill, revision = operation.write(solution)
    assert fill.inserted == 0
    assert revision.revised.lines == operation.text.source.lines
    assert said(operation.price(revision).energy) == said(operation.as_it_was.energy)
    # What the program's own chords leave the path by is no error of it.
    _, gate = operation.verify(operation.text.source, solution)
    assert not {"off-path", "path-missed"} & set(gate.kept)


def test_what_is_delivered_is_better_in_what_counts_and_worse_in_nothing(twice, folder):
    part = revised(twice, folder, ()).parts[CASES[twice].operation - 1]
    before, after = part.before, part.after
    if part.outcome is None:
        assert part.verdict == "already better"
        assert isinstance(part.better, AlreadyBetter)
        assert said(before) == said(after)
        return
    assert part.outcome.ok
    assert after.total <= (1.0 - WORTHWHILE) * before.total
    assert after.time <= (1.0 + LONGER) * before.time
    assert events(after) <= (1.0 + MORE_OFTEN) * events(before)


def test_a_trade_is_cheaper_and_called_a_trade(name, folder):
    part = revised(name, folder, TRADES).parts[CASES[name].operation - 1]
    if part.outcome is None:
        return
    compared = part.outcome.chosen.comparison
    assert compared.saved >= WORTHWHILE
    slower = part.after.time > (1.0 + LONGER) * part.before.time
    rougher = events(part.after) > (1.0 + MORE_OFTEN) * events(part.before)
    assert compared.trades == tuple(t for t, is_so in zip(TRADES, (slower, rougher), strict=True) if is_so)
    assert part.verdict == ("trade" if compared.trades else "better")
    saved = part.outcome.report.answers.saved.text
    assert saved.startswith("A trade, as it is ") == bool(compared.trades)


def test_a_whole_program_changes_by_the_sum_of_its_operations(name, folder, tmp_path):
    """An operation that stays costs the same beside revised ones: nothing else changes."""
    case, made = CASES[name], revised(name, folder, TRADES)
    machine = resolve(job_of(name, folder)).machine
    new = tmp_path / file_of(name, folder).name
    new.write_bytes(made.data)
    rapid = {} if case.rapid is None else {"rapid": case.rapid}
    for part in made.parts:
        if part.outcome is None and part.before is not None:
            alone = fx.program_energy(new, machine, operation=part.operation.number, **rapid).energy
            assert said(part.before) == said(part.after) == said(alone)


def test_every_picture_of_a_program_shows_the_same_figures(name, folder, tmp_path):
    made = revised(name, folder, TRADES)
    outcome = made.outcomes.get(CASES[name].operation)
    if outcome is None:
        pytest.skip("the program stays")
    solution, energy = outcome.solution, outcome.solution.energy
    assert list(solution.compared) == [AS_PROGRAMMED]
    assert len(solution.compared[AS_PROGRAMMED].motion) == len(placed(name, folder)[1].path)
    # The curve of energy along the path ends at the table's total.
    for which, one in solution.energies.items():
        assert solution.spent[which][-1] == pytest.approx(one.total, rel=1e-12)
        assert (np.diff(solution.spent[which]) >= -1e-9).all()
    files = write_revised(made, tmp_path / "out")
    motion = next(file for file in files if file.name == "motion.csv")
    with motion.open(encoding="utf-8") as rows:
        assert sum(float(row["time"]) for row in csv.DictReader(rows)) == pytest.approx(energy.time, abs=1e-6)
    document = json.loads(write_json(outcome.report, tmp_path / "r.json").read_text(encoding="utf-8"))
    times = {
        document["energy"]["time"],
        document["program"]["energy"]["time"],
        document["program"]["run_time"]["seconds"],
    }
    assert times == {energy.time}
    for side in choose_sides(solution, outcome.program):
        shown = side.steadiness
        assert (sum(shown.starts.values()), sum(shown.reversals.values())) == (
            solution.energies[side.name].starts,
            solution.energies[side.name].reversals,
        )


@pytest.mark.parametrize("corners", ["control", "programmed", "exact-stop"])
def test_no_block_is_quicker_than_its_axes(name, folder, corners):
    case = CASES[name]
    machine = with_powers(load_machine(case.machine))
    given = {"operation": case.operation, "rapid": case.rapid or 1e4}
    motion = fx.program_energy(file_of(name, folder), machine, corners=corners, **given).motion
    for column, axis in enumerate(machine.axes):
        if axis.max_speed is not None:
            # A planner hands time from one part of a block that it takes whole to the other.
            ends = np.flatnonzero(block_ends(motion) | ~motion.tcp)
            lasts, travels = np.diff(np.cumsum(motion.time)[ends]), np.diff(motion.positions[ends, column])
            known = ~motion.from_unknown[ends[1:]]
            assert (lasts >= np.abs(travels) / axis.max_speed * (1.0 - 2e-3) - 1e-9)[known].all()


def test_a_program_costs_the_same_whether_or_not_a_comment_names_its_control(name, folder, tmp_path):
    case, file = CASES[name], file_of(name, folder)
    machine = with_powers(load_machine(case.machine))
    given = {"operation": case.operation, "rapid": case.rapid or 1e4}
    unnamed = fx.program_energy(file, machine, **given).energy
    dialect = program_dialect(load_source(file), machine)
    text = file.read_text(encoding="utf-8").split("\n")
    # Before the first line that isn't the begin of a program; the words behind the name are about the tip.
    begin = next(n for n, line in enumerate(text) if line.strip() not in ("", "%"))
    begin += text[begin].startswith(("O", "0 BEGIN"))
    [line] = comment_lines(CONTROL.write(dialect.name, "tip"), dialect.comment)
    text.insert(begin, f"{begin} {line}" if text[begin][:1].isdigit() else line)
    named = tmp_path / file.name
    named.write_text("\n".join(text), encoding="utf-8")
    assert load_source(named).stated("control") == f"{dialect.name} tip"
    assert said(fx.program_energy(named, machine, **given).energy) == said(unnamed)


def test_blocks_are_inserted_only_where_a_chord_would_leave_the_path_or_they_save(name, folder):
    _, operation = placed(name, folder)
    outcome = revised(name, folder, TRADES).outcomes.get(CASES[name].operation)
    if outcome is None:
        pytest.skip("the program stays")
    fill, machine, path = outcome.program.fill, operation.machine, operation.path
    row, motion = fill.row, fill.motion
    if (location := outcome.solution.motion.location) is not None:
        row = np.interp(row, np.arange(len(location)), location)
    given = motion.positions[row == np.floor(row)][:, machine.rotary_columns]
    divided = np.unique(np.floor(row[row != np.floor(row)]).astype(int))
    tcp = operation.wording.interpolation is Interpolation.TCP
    off = path_deviation(path, machine, given, divided, tcp=tcp).max(axis=0)
    needless = divided[off <= 0.8 * np.maximum(path.slack[divided + 1], WRITTEN_TOLERANCE)]
    if len(needless) == 0:
        return
    # An earlier path may have needed them; without them the program costs more.
    solution = outcome.solution
    location, rotary = solution.motion.location, solution.motion.positions[:, machine.rotary_columns]
    stays = (location == np.floor(location)) | ~np.isin(np.floor(location), needless)
    energies = []
    for rows in (np.arange(len(location)), np.flatnonzero(stays)):
        some = solution.toolpath.at(rows)
        rest = follow(some, machine, rotary[rows])
        energies.append(program_energy(machine, some, rest, solution.filling, solution.clock).total)
    assert energies[0] < energies[1]
