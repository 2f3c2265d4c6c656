"""Options for reading a toolpath."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import get_args

from fiveaxis.base import HIGHEST_FEED, Finding, Reading, SettingError, ToolError
from fiveaxis.model import Machine, Operation, PathShape, Tool
from fiveaxis.nc.source import Source
from fiveaxis.nc.tool_words import tool_of


@dataclass(frozen=True, kw_only=True)
class ProgramReading(Reading):
    """How a program is read, and the machine that it was written for.

    Parameters
    ----------
    machine : the rotary words of a program are angles of this machine
    """

    machine: Machine | None = None


@dataclass(frozen=True, kw_only=True)
class PathReading(ProgramReading):
    """All that `read_toolpath` takes as keywords: what supplements or replaces values of a file.

    Parameters
    ----------
    tool : the cutter; None for the file's
    feed_mm_min : one feed for all locations, in place of the file's
    columns : of a list of points without header
    path_shape : what lies between locations, ``smooth`` curves or chords; None as the file states it

    Raises
    ------
    SettingError
        A value out of its range, an unknown word, a word that isn't an M word, several operations.
    """

    tool: Tool | None = None
    feed_mm_min: float | None = None
    columns: tuple[str, ...] | None = None
    path_shape: PathShape | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        chosen = self.operation
        if not isinstance(chosen, int | None) and len(chosen) > 1:
            listed = ",".join(map(str, chosen))
            raise SettingError(
                f"operation = {listed}: operations are never merged into one path; give one number here "
                "(`optimise` in the program's own lines, `verify` and `energy` take several, each on its "
                "own)"
            )
        feed = self.feed_mm_min
        if feed is not None and not 0.0 < feed <= HIGHEST_FEED:
            raise SettingError(f"feed {feed:g} mm/min must be above 0, and at most {HIGHEST_FEED:g} mm/min")
        for word in self.harmless:
            if re.fullmatch("M[1-9][0-9]*", word) is None:
                raise SettingError(f"harmless: {word!r} isn't an M word; write them like M56")
        shapes = (None, *get_args(PathShape))
        if self.path_shape not in shapes:
            words = ", ".join(shape for shape in shapes if shape is not None)
            raise SettingError(f"unknown path_shape {self.path_shape!r}; known: {words}")

    @property
    def number(self) -> int | None:
        """Number of the operation to read, of several; None for the only one."""
        return self.operation if isinstance(self.operation, int | None) else self.operation[0]


@dataclass(frozen=True, kw_only=True)
class ReadOptions(PathReading):
    """How a file is read, with what only code can say.

    Parameters
    ----------
    stand_in : cutter where neither the caller nor the file states one; None if that is an error
    around : whether what can't be read, from one tool change to the next, is left out, as it is round an
        operation
    """

    stand_in: Tool | None = None
    around: bool = False

    def of_language(self, source: Source) -> Source:
        """Return a file as a program in the caller's language, if there is one."""
        return source if self.language is None else replace(source, language=self.language)

    def stated_tool(
        self, source: Source, unit: str, operation: Operation
    ) -> tuple[Tool | None, tuple[Finding, ...]]:
        """Return the cutter that a program's comments state for an operation, unless the caller gives one."""
        return (None, ()) if self.tool is not None else tool_of(source, unit, operation.tool)

    def tool_or(self, stated: Tool | None, source: Source) -> Tool:
        """Return the caller's tool, or else the one that a file states.

        Raises
        ------
        ToolError
            Neither is known.
        """
        tool = self.tool or stated or self.stand_in
        if tool is None:
            raise ToolError("the file states no tool; say which with tool (--tool ball:10)", file=source.name)
        return tool
