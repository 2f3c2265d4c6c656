"""The report document: the facts of a run, which the page, the terminal and the JSON tell.

Every fact is a field, or a property computed from fields; `as_dict` gives the keys of ``report.json``.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fiveaxis.base import Array, Cause, Finding, count_codes, group_findings, without_folder, write_atomically
from fiveaxis.check import Report
from fiveaxis.lab import Budget
from fiveaxis.model import EdgeUse, Machine, axis_uses, peak_rates
from fiveaxis.posture import AS_PROGRAMMED, RESULT, Optimum
from fiveaxis.show.report.facts import FrontPrograms, InputFile, Overriding, ProgramFigures, SetupSearched
from fiveaxis.show.report.questions import Answers, answers
from fiveaxis.show.report.words import describe_tool

# Attribute of `Energy` by which two programs are compared.
Measure = Literal["total", "travel", "with_base", "time"]
MEASURES: tuple[Measure, ...] = ("total", "travel", "with_base", "time")

UNITS = {
    "energy": "J",
    "time": "s",
    "savings_range": "shares, least and most on machines drawn from the bands of estimated powers, with base "
    "power where it is known",
    "limited": "s, for how long each cause limits the speed; together the time",
    "savings": "share of the baseline, 1 is everything; negative is a loss",
    "speed_changes": "mm/s or deg/s; `block` counts the program's moves from its first location, and `line` "
    "is that of its text",
    "tilt": "deg",
    "residuals.tilt": "rad",
    "residuals.limit": "mm for linear axes, rad for rotary axes",
    "residuals.contact": "mm",
    "inputs.size": "byte",
}


@dataclass(frozen=True, eq=False)
class ReportDocument:
    """The facts of a run.

    It has no clock time, no run time and no folder of the computer: the same inputs give the same document.

    Parameters
    ----------
    solution : the result with its baselines
    verdict : what verification found in the program's text
    inputs : the files that the run read, each from `describe_input`
    program : the NC program, if there is one
    budget : the electricity of the whole job by consumer, if it was computed
    lines : by axis letter, the line of the program's text at the axis's largest change of speed; None where
        no line has it
    kept_back : number of errors by code that keep the program back
    overriding : errors that were accepted by name; None where the job accepts none
    part_size : (3,), mm, extents of the part, if there is one
    scallop : mm, highest ridge between passes that was asked for, and as the cutter leans; None where none
        was asked for, or the lean has no influence on it
    setup_search, front, edge_use : where the job asks for them
    trades : what a program that replaces another one is worse in, ``slower`` and ``rougher``
    replaced_for : codes of errors of the program as it was, for which it is no candidate
    reached : (m, k), mm and rad, axis values of the whole program with leads and retract, if there is one
    """

    solution: Optimum
    verdict: Report
    inputs: Sequence[InputFile] = ()
    program: ProgramFigures | None = None
    budget: Budget | None = None
    lines: Mapping[str, int | None] = field(default_factory=dict)
    kept_back: Mapping[str, int] = field(default_factory=dict)
    overriding: Overriding | None = None
    part_size: tuple[float, float, float] | None = None
    scallop: tuple[float, float] | None = None
    setup_search: SetupSearched | None = None
    front: FrontPrograms | None = None
    edge_use: EdgeUse | None = None
    trades: Sequence[str] = ()
    replaced_for: Sequence[str] = ()
    reached: Array | None = None

    @property
    def name(self) -> str:
        """Name of the path, without its folder."""
        return without_folder(self.solution.toolpath.name)

    @property
    def locations(self) -> int:
        """Number of locations that the path was given with."""
        return self.solution.toolpath.count_given

    @property
    def machine(self) -> Machine:
        """The machine of the program."""
        return self.solution.machine

    @property
    def tool(self) -> str:
        """The tool in words."""
        return describe_tool(self.solution.toolpath.tool)

    @property
    def tilt(self) -> tuple[float, float]:
        """Bounds on the tool axis, deg."""
        # A bound given as 15 deg comes back as 15, not as 14.999999999999998.
        low, high = (round(math.degrees(end), 9) for end in (self.solution.tilt.low, self.solution.tilt.high))
        return low, high

    @property
    def curved_moves(self) -> int:
        """Number of moves between given locations that follow a curve."""
        path = self.solution.toolpath
        return len(np.unique(path.numbered[path.curved]))

    @property
    def accelerations_unknown(self) -> list[str]:
        """Letters of the axes whose highest acceleration the machine doesn't state."""
        return [axis.letter for axis in self.machine.axes if axis.max_acceleration is None]

    @property
    def moved_baselines(self) -> dict[str, str]:
        """How baselines deviate from what their names say, by name."""
        return {name: baseline.note for name, baseline in self.solution.compared.items() if baseline.note}

    def saved(self, baseline: str, measure: Measure) -> float | None:
        """Compute the saved share; None if a measure is unknown or there was nothing to save."""
        after = getattr(self.solution.energy, measure)
        before = getattr(self.solution.baselines[baseline], measure)
        return None if after is None or before is None or not before > 0.0 else 1.0 - after / before

    @cached_property
    def savings_range(self) -> dict[str, tuple[float, float]]:
        """Between which shares the savings lie if drives are estimated; empty if none is."""
        return self.solution.savings_ranges(with_base=self.measure == "with_base")

    @property
    def measure(self) -> Measure:
        """By which programs are compared: with base power where that is known."""
        return "total" if self.solution.energy.with_base is None else "with_base"

    @cached_property
    def baseline(self) -> str | None:
        """Name of the cheapest baseline by `measure`; None without one."""
        return self.solution.cheapest(self.measure)

    @property
    def timed_against(self) -> str | None:
        """Name of the baseline whose run time is compared: the program as it was, or else `baseline`."""
        return AS_PROGRAMMED if AS_PROGRAMMED in self.solution.baselines else self.baseline

    @cached_property
    def findings(self) -> tuple[Finding, ...]:
        """Findings of planning, optimising and verification, without the folders of their files."""
        own = (f for f in self.solution.toolpath.findings if f not in self.verdict.findings)
        return tuple(finding.portable() for finding in (*own, *self.verdict.findings))

    @cached_property
    def summary(self) -> tuple[Cause, ...]:
        """The findings by cause; those that optimiser and verification both report count once."""
        total = Counter(count_codes(self.solution.toolpath.findings)) | Counter(self.verdict.counts)
        return group_findings(self.findings, total)

    @cached_property
    def answers(self) -> Answers:
        """Whether the program is safe to run, what it saves, what to do now."""
        return answers(self)

    @property
    def accepted(self) -> Mapping[str, int]:
        """Number of errors by code that was accepted by name."""
        return {} if self.overriding is None else self.overriding.accepted

    def as_dict(self) -> dict[str, Any]:
        """Return the document as plain data for JSON.

        Returns
        -------
        Keys in fixed order; energies in J, times in s, angles of ``tilt`` in degrees, the rest as in
        ``units``. A figure that isn't a finite number is None.
        """
        solution, verdict = self.solution, self.verdict.as_dict()
        energy = solution.energy.as_dict()
        for letter, change in energy["speed_changes"].items():
            change |= {"line": self.lines[letter]} if letter in self.lines else {}
        document = {
            "answers": self.answers.as_dict(),
            "toolpath": self.name,
            "locations": self.locations,
            "path_shape": solution.toolpath.shape,
            "curved_moves": self.curved_moves,
            "energy": energy,
            "baselines": {name: baseline.as_dict() for name, baseline in solution.baselines.items()},
            "missing_baselines": solution.missing,
            "moved_baselines": self.moved_baselines,
            "rates": self._rates(),
            "axes": axis_uses(self.machine, solution.motion, self.reached),
            "savings": {
                name: {measure: self.saved(name, measure) for measure in MEASURES}
                for name in solution.baselines
            },
            "savings_range": self.savings_range,
            "bound": solution.bound
            and {**solution.bound.as_dict(), "gap": solution.gap, "in_words": solution.left},
            "summary": [cause.as_dict() for cause in self.summary],
            "findings": [finding.as_dict() for finding in self.findings],
            "verification": {k: v for k, v in verdict.items() if k not in ("summary", "findings")},
            "program": self.program and self.program.as_dict(),
            "budget": self.budget and self.budget.as_dict(),
            "solver": [stage.as_dict() for stage in solution.stages],
            "kkt": solution.kkt and solution.kkt.as_dict(),
            "machine": self._machine(),
            "tool": str(solution.toolpath.tool),
            "tool_in_words": self.tool,
            "tilt": {"low": self.tilt[0], "high": self.tilt[1], "reference": solution.tilt.name},
            "residuals": solution.residuals(),
            "inputs": self.inputs,
            "units": UNITS,
            "kept_back": self.kept_back,
        }
        scallop = self.scallop and {"asked": self.scallop[0], "largest": self.scallop[1]}
        asked: dict[str, Any] = {"part_size_mm": self.part_size, "scallop_mm": scallop}
        if (over := self.overriding) is not None:
            unused = [finding.as_dict() for finding in over.unused]
            asked |= {"overridden": over.accepted, "overridden_by": over.by, "override_unused": unused}
        for name in ("front", "edge_use", "setup_search"):
            told = getattr(self, name)
            asked[name] = told and told.as_dict()
        document |= {name: told for name, told in asked.items() if told is not None}
        return {key: _plain(value) for key, value in document.items()}

    def _rates(self) -> dict[str, Any]:
        motions = {RESULT: self.solution.motion}
        motions |= {name: baseline.motion for name, baseline in self.solution.compared.items()}
        return {
            name: {c: rate.as_dict() for c, rate in peak_rates(self.machine, motion).items()}
            for name, motion in motions.items()
        }

    def _machine(self) -> dict[str, Any]:
        machine = self.machine
        return {
            "name": machine.name,
            "code": str(machine.code),
            "description": machine.description,
            "axes": machine.letters,
            "base_power": machine.base_power,
            "bands": machine.bands,
            "setup": asdict(machine.setup),
            "tool_length": machine.tool_length,
            "acceleration_unknown": self.accelerations_unknown,
            "figures": [p.as_dict() for p in machine.provenance],
        }


def _plain(value: Any) -> Any:
    """Convert to types that JSON has: numpy numbers to Python's, numbers that aren't finite to None."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, str):
        return str(value)
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return [_plain(item) for item in value] if isinstance(value, Iterable) else value


def write_json(document: ReportDocument, path: str | Path) -> Path:
    """Write a document as JSON: keys in their order, indented, with a newline at the end."""
    text = json.dumps(document.as_dict(), indent=2, ensure_ascii=False, allow_nan=False)
    return write_atomically(path, text + "\n")
