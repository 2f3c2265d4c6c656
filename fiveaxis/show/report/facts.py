"""Facts of a report that come from other rooms: its inputs, program, accepted errors, setups and front."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NotRequired, TypedDict

from fiveaxis.base import Finding, InputError, hash_input, require_file
from fiveaxis.model import Energy, PredictedTime
from fiveaxis.nc import Preparation
from fiveaxis.posture import FrontPoint


class InputFile(TypedDict):
    """A file that was read: ``size`` in bytes, and what it was used as where that is known."""

    name: str
    sha256: str
    size: int
    used_as: NotRequired[str]


def describe_input(path: str | Path) -> InputFile:
    """Describe an input file so that it can be recognised; `InputError` for one that can't be read."""
    digest = hash_input(path, InputError)
    return {"name": Path(path).name, "sha256": digest, "size": require_file(path, InputError).st_size}


@dataclass(frozen=True)
class ProgramFigures:
    """The figures of an NC program.

    Parameters
    ----------
    control, coordinates, language : how it is written
    preparation : what it needs at the machine
    blocks, lines : number of blocks, without approach and retract, and of lines of its text
    blocks_before, inserted, removed : number of the path's locations, of inserted blocks, of redundant ones
    axis_held_in_plane, axis_left_plane : number of moves whose tool axis stays in the plane of its
        directions, and of those that leave it
    redundant_kept_for : codes of the errors because of which redundant blocks stay
    interpolation : of the control
    run_time : how long the control takes
    energy : of the whole text, approach and retract included; None where its words don't say it
    path_tolerance_mm, axis_tolerance_deg : of inserted and removed blocks
    revises : what of another program was revised in place; empty for a program of its own
    """

    control: str
    coordinates: str
    language: str
    preparation: Preparation
    blocks: int
    lines: int
    blocks_before: int
    inserted: int
    removed: int
    axis_held_in_plane: int
    axis_left_plane: int
    redundant_kept_for: tuple[str, ...]
    interpolation: str
    run_time: PredictedTime
    energy: Energy | None
    path_tolerance_mm: float
    axis_tolerance_deg: float
    revises: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        time = self.run_time
        return {
            **vars(self),
            "preparation": self.preparation.as_dict(),
            "run_time": {
                "seconds": time.total,
                "basis": time.basis,
                "missing": time.missing,
                "assumed": time.assumed,
            },
            "energy": None if self.energy is None else self.energy.as_dict(),
        }


@dataclass(frozen=True)
class Overriding:
    """Errors that were accepted by name.

    Parameters
    ----------
    accepted : number of errors by accepted code
    by : who accepts them
    unused : findings about accepted codes that didn't occur
    """

    accepted: Mapping[str, int]
    by: str
    unused: tuple[Finding, ...] = ()


@dataclass(frozen=True)
class TriedSetup:
    """A setup of the workpiece that was tried.

    Parameters
    ----------
    offset, rotation_deg : mm and deg, as in a machine's `Setup`
    rough : J, cost of the thinned path; None where no path exists
    kept_clear : J, the same with the tool kept clear; None where that wasn't tried, or isn't possible
    energy : J, of the feed drives in the whole program; None where the job wasn't run in full there
    why : why the setup can't be used; else empty
    """

    offset: tuple[float, float, float]
    rotation_deg: tuple[float, float, float]
    rough: float | None = None
    kept_clear: float | None = None
    energy: float | None = None
    why: str = ""


@dataclass(frozen=True)
class SetupSearched:
    """A setup that was searched for.

    Parameters
    ----------
    ranges : mm and deg, lowest and highest value by ``x``, ``y``, ``z`` and ``angle``
    given, chosen : the setup of the job, and the one that was taken
    saved : share of the given setup's energy; None where that isn't known
    tried : all setups, cheapest first
    least_saving : share of the cost that another setup has to save
    keeps_clear : whether the cheapest setups were evaluated again with the tool kept clear
    """

    ranges: Mapping[str, tuple[float, float]]
    given: TriedSetup
    chosen: TriedSetup
    saved: float | None
    tried: tuple[TriedSetup, ...]
    least_saving: float
    keeps_clear: bool

    def as_dict(self) -> dict[str, Any]:
        """Return the setups as plain data for JSON."""
        return {key: value for key, value in asdict(self).items() if key != "keeps_clear"}


@dataclass(frozen=True)
class FrontProgram:
    """The program of a solution of a front.

    Parameters
    ----------
    point : the solution, with the energy of the program
    number : in the front, from 1
    released : whether nothing kept it back
    """

    point: FrontPoint
    number: int
    released: bool

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        own = {"number": self.number, "program_time_s": self.point.energy.time, "released": self.released}
        return self.point.as_dict() | own


@dataclass(frozen=True)
class FrontPrograms:
    """The programs of a front.

    Parameters
    ----------
    points : from the cheapest program to the fastest or steadiest one
    dominated : how many were left out because one of these beats them in every figure, or as kept back
    picked : number of the one that the report is about
    """

    points: tuple[FrontProgram, ...]
    dominated: int
    picked: int

    @property
    def by_time(self) -> bool:
        """Whether the control's clock is known, so that time is what the programs are compared by."""
        return all(each.point.energy.timing == "accelerations" for each in self.points)

    @property
    def costs(self) -> str:
        """What costs energy."""
        return "time" if self.by_time else "steadiness"

    @property
    def with_base(self) -> bool:
        """Whether energies with base power are known."""
        return any(each.point.energy.with_base is not None for each in self.points)

    def as_dict(self) -> dict[str, Any]:
        """Return the programs as plain data for JSON."""
        points = [point.as_dict() for point in self.points]
        return {"points": points, "dominated": self.dominated, "picked": self.picked}
