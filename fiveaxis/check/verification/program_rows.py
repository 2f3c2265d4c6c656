"""The rows of a program, which aren't the locations of a path, and what they are checked against."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from fiveaxis.base import CREASE, JOB, SURFACE_TOLERANCE, Array, Coordinates, Gap, SettingError, Unit, risk
from fiveaxis.cam import Mesh, find_contacts
from fiveaxis.check.collision.surroundings import Surroundings
from fiveaxis.check.verification.check_context import (
    DEFAULT_TOLERANCES,
    CheckContext,
    PathConstraints,
    Tolerances,
    make_context,
)
from fiveaxis.check.verification.checks import check_tilt, check_tilt_between
from fiveaxis.check.verification.feeds import check_feeds, check_feeds_along, check_stated_feeds
from fiveaxis.check.verification.following import Match, passed_numbers
from fiveaxis.check.verification.model import tool_poses
from fiveaxis.check.verification.report import Result, left_out
from fiveaxis.model import Constraints, Machine, Motion, Tool, Toolpath, interpolate, turned
from fiveaxis.nc import ProgramOptions, ReadMotion, RequiredTechnology, TracedProgram


@dataclass(frozen=True, eq=False)
class Against:
    """What a program is verified against; with none of it there is nothing to verify.

    Parameters
    ----------
    toolpath : that the program should follow
    tool : the cutter; by default that of `toolpath`
    surroundings : part, stock and fixtures
    constraints : on postures and turns
    tolerances : bounds beyond which a difference is a finding
    program : control and settings of the program that was asked for: its spindle, tool, offsets, coolant
    surface_tolerance : mm, gap between cutter and part that counts as touching
    crease : deg; facets of the part that meet at a smaller angle are one smooth surface
    part_unit : of the part's file, for the finding on its size
    """

    toolpath: Toolpath | None = None
    tool: Tool | None = None
    surroundings: Surroundings | None = None
    constraints: Constraints = field(default_factory=Constraints)
    tolerances: Tolerances = DEFAULT_TOLERANCES
    program: ProgramOptions | None = None
    surface_tolerance: float = SURFACE_TOLERANCE
    crease: float = CREASE
    part_unit: Unit = "mm"

    @property
    def is_nothing(self) -> bool:
        """Whether there is nothing to verify against."""
        return self.toolpath is None and self.tool is None and self.surroundings is None

    @property
    def cutter(self) -> Tool | None:
        """The tool, or that of the path."""
        return self.tool or (None if self.toolpath is None else self.toolpath.tool)

    def of_program(self, motion: ReadMotion) -> Against:
        """Return it with the cutter that a program's comments state, where none is given.

        `SettingError` if there is a part, a stock or fixtures, and no cutter.
        """
        cutter, around = self.cutter or motion.tool, self.surroundings
        if cutter is None and around is not None and (around.meshes or around.fixtures or around.blank):
            raise SettingError(
                "a part is checked against a cutter; name the tool (--tool ball:10)", file=motion.name
            )
        return replace(self, tool=cutter)

    @property
    def zoned_path(self) -> Toolpath | None:
        """The path with the zone of the cutter that touches within the bounds on tilt, lead and lean."""
        return None if self.toolpath is None else self.constraints.zoned(self.toolpath)


NOTHING = Against()


@dataclass(frozen=True, eq=False)
class ProgramRows:
    """A program that was read, and where on its path its rows are.

    Parameters
    ----------
    read : the program
    against : path, tool, surroundings and constraints
    match : the path's locations among the rows; None without a path
    """

    read: TracedProgram
    against: Against
    match: Match | None = None

    @property
    def coordinates(self) -> Coordinates:
        """Meaning of the words: positions of axes where any cut isn't under TCP."""
        if self.read.by_control:
            return "vector"
        under = self.read.motion.tcp[self.read.motion.cutting]
        return "tip" if under.size and under.all() else "axes"

    def required(self, machine: Machine) -> RequiredTechnology | None:
        """Return what has to be in force in the cuts; None if nobody said."""
        if self.against.program is None:
            return None
        tip: Coordinates = "tip" if self.read.motion.tcp.any() else "axes"
        return self.against.program.required(machine, "vector" if self.read.by_direction else tip)


def check_program_feeds(context: CheckContext, rows: ProgramRows) -> Iterator[Result]:
    """Check durations, and the feeds that a table or a list of locations states, against those of the path.

    Without a path, the durations of a table are checked against its own feeds.
    """
    read, match = rows.read, rows.match
    if match is not None:
        yield check_feeds_along(context, match, knows_axes=not read.by_control)
        if not match.path.feed_is_assumed and read.motion.technology is None:
            yield check_stated_feeds(context, match)
    elif read.is_table and rows.against.cutter is not None and not context.toolpath.zone.offset:
        yield check_feeds(context)
    else:
        yield left_out(
            "feed-differs", {"feed_off_share": None}, Gap("feed: no path was given", "path (--path)", JOB)
        )


def check_program_lean(context: CheckContext, rows: ProgramRows, part: Mesh | None) -> Iterator[Result]:
    """Check the tool's lean where the directions that it refers to are known.

    These are the path's at its locations or, without a path, the normals of the part where the cutter touches
    it. `SettingError` for a bound whose direction neither a path nor a part gives.
    """
    given, match = rows.against.constraints, rows.match
    if not given.bounds_lean:
        yield check_tilt(context)
        return
    path, positions, at = context.toolpath, context.motion.positions, np.arange(len(context.positions))
    if match is not None:
        known = match.passed
        if not len(known):
            none = dict.fromkeys(("tilt_min_deg", "tilt_max_deg"))
            yield left_out("tilt", none, risk("lean: the program passes no location of the path"))
            return
        path, at = match.path.at(known), match.row[known]
        # A program needs no block at every location; between blocks the axes are interpolated.
        positions = interpolate(positions, match.place[known])
    elif given.cone is not None:
        raise SettingError("a cone stands about the axes of a path; give the path (--path)")
    elif any(bound is not None for bound in (given.tilt, given.lead, given.lean)):
        if part is None:
            raise SettingError("tilt refers to surface normals; give the part (--part) or the path (--path)")
        against = rows.against
        path = find_contacts(path, part, tolerance=against.surface_tolerance, crease=against.crease)
    if match is None:
        path = given.zoned(path)
    applied = PathConstraints.of(path, context.machine, given.of_lean)
    if match is None:
        # Off the part a move is a feed move all the same, but without a normal its lean isn't known.
        path = replace(path, kind=context.toolpath.kind)
    motion = context.motion
    columns = ("feed", "time", "kind", "source")
    some = Motion(motion.letters, positions, *(getattr(motion, name)[at] for name in columns))
    there = make_context(some, context.machine, path, applied, context.tolerances)
    results = [check_tilt(there)]
    if match is not None:
        places = np.append(match.place[known], np.arange(len(context.positions), dtype=float))
        numbers = np.append(np.arange(len(known), dtype=float), passed_numbers(context, match))
        order = np.argsort(places, kind="stable")
        places, numbers = places[order], np.maximum.accumulate(numbers[order])

        def axes(row: Array) -> Array:
            place = np.interp(row, numbers, places)
            if rows.read.by_control:
                return turned(context.axis, place)
            return tool_poses(context.machine, interpolate(context.positions, place))[1]

        results.append(check_tilt_between(there, axes))
    yield from (replace(one, rows=at[one.rows]) for one in results)
