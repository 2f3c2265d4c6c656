"""A case of the open benchmark: a plain file that names a path, its machine and the bounds on postures."""

from __future__ import annotations

import sys
import tomllib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

sys.path.insert(0, str(Path(__file__).parents[1]))
from paths import DATA, PATHS

import fiveaxis as fx
from fiveaxis.check import Fixture
from fiveaxis.model import Constraints, TiltBounds
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.strategy.rotary_bounds import turn_bounds

FOLDER = Path(__file__).with_name("cases")
KEYS = {"path", "tilt", "cone", "max_turn"}


@dataclass(frozen=True, eq=False)
class Case:
    """What every method is asked to solve.

    Parameters
    ----------
    name : of its file
    toolpath, machine : with the powers of its axes
    options : bounds on postures, degrees
    part, fixtures : what the tool keeps clear of; None and empty for nothing
    """

    name: str
    toolpath: fx.Toolpath
    machine: fx.Machine
    options: dict[str, Any]
    part: trimesh.Trimesh | None = None
    fixtures: tuple[Fixture, ...] = ()

    @classmethod
    def read(cls, name: str) -> Case:
        """Read a case and make its path.

        Raises
        ------
        FileNotFoundError
            Its path is read from ../shared, which isn't there.
        ValueError
            An unknown key, or no path of that name.
        """
        table = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
        if unknown := table.keys() - KEYS:
            raise ValueError(f"{name}.toml: unknown {', '.join(sorted(unknown))}; keys are {', '.join(KEYS)}")
        path = PATHS.get(table.pop("path"))
        if path is None:
            raise ValueError(f"{name}.toml: no path of that name; paths.py has {', '.join(PATHS)}")
        if path.shared and not DATA.exists():
            raise FileNotFoundError(f"{name}: needs {DATA}")
        toolpath, machine = path.make()
        options = {key: tuple(v) if isinstance(v, list) else v for key, v in table.items()}
        zoned = Constraints.of_degrees(**options).zoned(toolpath)
        part, fixtures = path.around() if path.around else (None, ())
        return cls(name, zoned, machine, options, part, fixtures)

    @property
    def constraints(self) -> Constraints:
        """The bounds, in radians."""
        return Constraints.of_degrees(**self.options)

    @cached_property
    def tilt(self) -> TiltBounds:
        """Bounds on the lean at each location."""
        return self.constraints.lean_bounds(self.toolpath)

    @cached_property
    def turns(self) -> np.ndarray:
        """(n − 1,), rad, largest turn of each rotary axis in each move."""
        return turn_bounds(self.toolpath, self.constraints)

    @cached_property
    def problem(self) -> Problem:
        """Travel metric and bounds, as functions of the rotary angles."""
        return Problem.build(self.toolpath, self.machine, self.tilt, max_turn=self.turns)


def case_names() -> list[str]:
    """Names of all cases."""
    return sorted(file.stem for file in FOLDER.glob("*.toml"))
