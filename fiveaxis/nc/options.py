"""Options for reading a toolpath."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, get_args

from fiveaxis.errors import SettingError, ToolError
from fiveaxis.findings import Finding
from fiveaxis.machine import Machine
from fiveaxis.nc.source import Source
from fiveaxis.nc.stated_tools import tool_of
from fiveaxis.options import HIGHEST_FEED, Positions, ProgramLanguage, Reading, Wrap, completed
from fiveaxis.toolpath import Operation, PathShape, Tool


@dataclass(frozen=True)
class ReadOptions:
    """Values that supplement or replace those of a file.

    Parameters
    ----------
    tool : the cutter; None for the file's
    stand_in : cutter where neither the caller nor the file states one; None if that is an error
    feed_mm_min : one feed for all locations, in place of the file's
    unit : ``mm`` or ``inch``, of lengths, in place of the file's
    machine : that a program was written for: its rotary words are angles of this machine
    positions : frame of a program's tip positions: it turns with the table (``table``, LinuxCNC and most
        others) or is fixed to the machine (``machine``, some Fanuc controls); None to tell it from the path
    start, zero, rapid, block_delete, wrap, increment : as for `read_program`
    columns : of a list of points without header
    operation : number of the one to read, of several; None for the only one
    around : whether what can't be read, from one tool change to the next, is left out, as it is round an
        operation
    harmless : M words of the machine's builder that move and switch nothing
    path_shape : what lies between locations, ``smooth`` curves or chords; None as the file states it
    language : of a program; None as its words show
    """

    tool: Tool | None = None
    stand_in: Tool | None = None
    feed_mm_min: float | None = None
    unit: str | None = None
    machine: Machine | None = None
    positions: Positions | None = None
    start: Mapping[str, float] = field(default_factory=dict)
    zero: Mapping[str, float] | None = None
    rapid: float | None = None
    block_delete: bool = False
    wrap: Wrap | None = None
    columns: tuple[str, ...] | None = None
    operation: int | None = None
    around: bool = False
    increment: float | None = None
    harmless: tuple[str, ...] = ()
    path_shape: PathShape | None = None
    language: ProgramLanguage | None = None

    def __post_init__(self) -> None:
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

    @classmethod
    def of(cls, reading: Reading, **others: Any) -> ReadOptions:
        """Add to the options of a program's reading their defaults, and what else is known.

        Raises
        ------
        SettingError
            An unknown word; a speed that isn't positive; a word that isn't an M word; several operations.
        """
        given = completed(Reading, reading)
        chosen = given["operation"]
        if isinstance(chosen, list | tuple):
            if len(chosen) > 1:
                listed = ",".join(map(str, chosen))
                raise SettingError(
                    f"operation = {listed}: operations are never merged into one path; give one number here "
                    "(`optimise` in the program's own lines, `verify` and `energy` take several, each on its "
                    "own)"
                )
            [given["operation"]] = chosen
        return cls(**given | {"start": given["start"] or {}, "harmless": tuple(given["harmless"])}, **others)

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
