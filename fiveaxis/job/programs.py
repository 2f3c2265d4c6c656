"""What NC programs cost: block by block and by axis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fiveaxis.energy import Energy, law_energies, motion_energy, move_powers
from fiveaxis.errors import SettingError
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.machine import Machine
from fiveaxis.motion import TimeLaw, time_motion
from fiveaxis.nc import ProgramMotion, read_program
from fiveaxis.nc.options import Wrap
from fiveaxis.nc.source import load_source
from fiveaxis.toolpath import MoveKind

# Findings and text shown of a block are cut at this length.
BLOCK_TEXT = 60
# Share of an axis's highest speed that rounding of a program's words may exceed.
OVER = 1e-3


@dataclass(frozen=True, eq=False)
class ProgramEnergy:
    """The energy of one program.

    Parameters
    ----------
    machine : on which it runs
    motion : its blocks as a motion, with the times that the energies belong to
    by_block : (n, k), J: ∫P dt of the move that ends at the row, by axis
    energy : totals
    law : how the motion runs under the axes' accelerations; None where the programmed times are taken
    texts : (n,) the blocks as written
    findings : what reading assumed or left out
    """

    machine: Machine
    motion: ProgramMotion
    by_block: Array
    energy: Energy
    law: TimeLaw | None
    texts: tuple[str, ...]
    findings: tuple[Finding, ...]

    @property
    def rows(self) -> list[dict[str, Any]]:
        """One row a block, as plain data: line, text, kind, s, mm/min, J by axis and of the base power.

        An arc's chords are one block.
        """
        base = self.machine.base_power
        rows = []
        for first, last in _runs(self.motion.source[1:]):
            block = slice(first + 1, last + 1)
            time = float(self.motion.time[block].sum())
            spent = self.by_block[block].sum(axis=0)
            axes = {c: float(j) for c, j in zip(self.machine.letters, spent, strict=True)}
            rows.append(
                {
                    "line": int(self.motion.source[first + 1]),
                    "block": self.texts[first + 1],
                    "kind": MoveKind(int(self.motion.kind[first + 1])).name.lower(),
                    "time": time,
                    "feed_mm_min": float(self.motion.feed[first + 1]) * 60.0,
                    "energy": sum(axes.values()),
                    **axes,
                    "base": None if base is None else base * time,
                }
            )
        return rows

    def as_dict(self) -> dict[str, Any]:
        """Return totals and blocks as plain data for JSON."""
        return {
            "program": self.motion.name,
            "machine": self.machine.name,
            "timing": "programmed" if self.law is None else "axis limits",
            "energy": self.energy.as_dict(),
            "blocks": self.rows,
            "ignored": dict(self.motion.ignored),
            "findings": [f.as_dict() for f in self.findings],
        }


def program_energy(
    path: str | Path,
    machine: Machine,
    *,
    corners: Literal["programmed", "exact-stop"] | float = "programmed",
    unit: Literal["mm", "inch"] | None = None,
    start: Mapping[str, float] | None = None,
    program_zero: Mapping[str, float] | None = None,
    rapid_mm_min: float | None = None,
    block_delete: bool = False,
    wrap: Wrap | None = None,
) -> ProgramEnergy:
    """Work out what an NC program costs the feed drives, block by block and by axis.

    Parameters
    ----------
    path : a program of machine-axis words
    machine : every axis with a drive; its load stands on the table
    corners : ``programmed`` takes the times that the program says, without acceleration; ``exact-stop`` and a
        tolerance in mm run it under the axes' accelerations (`time_motion`)
    unit, start, program_zero, rapid_mm_min, block_delete, wrap : as for `read_program`

    Raises
    ------
    FiveAxisError
        As `read_program` and `time_motion`; an axis without known power.

    References
    ----------
    Edem & Balogun (2018), Eq. (1), for weight drives; Hayashi et al. (2018) for tables of power.
    """
    motion = read_program(
        path,
        machine,
        unit=unit,
        start=start,
        program_zero=program_zero,
        rapid_mm_min=rapid_mm_min,
        block_delete=block_delete,
        wrap=wrap,
    )
    law = None
    if corners == "programmed":
        by_block = move_powers(machine, motion) * motion.time[:, None]
    elif isinstance(corners, str) and corners != "exact-stop":
        raise SettingError(f"corners {corners!r}: write programmed, exact-stop, or a tolerance in mm")
    else:
        law = time_motion(motion, machine, corners=corners)
        motion, by_block = replace(motion, time=law.motion.time), law_energies(machine, law)
    lines = load_source(path).lines
    texts = tuple(lines[line - 1].strip()[:BLOCK_TEXT] if line > 0 else "" for line in motion.source)
    energy = motion_energy(machine, motion, by_block)
    findings = (*motion.findings, *_speeding(machine, motion), *_unlimited(machine, law))
    return ProgramEnergy(machine, motion, by_block, energy, law, texts, findings)


def _runs(source: IntArray) -> list[tuple[int, int]]:
    """Give first and last + 1 of runs of rows that come from one line."""
    ends = np.flatnonzero(np.diff(source)) + 1
    return list(pairwise([0, *ends.tolist(), len(source)])) if len(source) else []


def _speeding(machine: Machine, motion: ProgramMotion) -> Iterator[Finding]:
    """Find blocks that ask more of an axis than its highest speed: the machine would be slower."""
    moving = motion.time > 0.0
    for column, axis in enumerate(machine.axes):
        if axis.max_speed is None:
            continue
        speed = np.zeros(len(motion))
        speed[moving] = np.abs(motion.moves[moving, column]) / motion.time[moving]
        over = speed > axis.max_speed * (1.0 + OVER)
        if over.any():
            worst = int(np.argmax(speed))
            asked, most = axis.shown(float(speed[worst])), axis.shown(axis.max_speed)
            yield Finding(
                Severity.WARNING,
                "feed-over",
                f"{int(over.sum())} blocks move {axis.letter} faster than its {most:g} {axis.unit}/s, up to "
                f"{asked:.5g}: the machine takes longer than told here; --corners counts that",
                Place(line=int(motion.source[worst]), file=motion.name),
                asked,
            )


def _unlimited(machine: Machine, law: TimeLaw | None) -> Iterator[Finding]:
    """Say which axes change their speed at once in a time law, since nobody knows better."""
    unknown = [a.letter for a in machine.axes if a.max_acceleration is None]
    if law is not None and unknown:
        yield Finding(
            Severity.WARNING,
            "no-acceleration",
            f"machine {machine.name!r} states no max_acceleration of {', '.join(unknown)}: they change "
            "speed at once here, and stops cost no time",
        )
