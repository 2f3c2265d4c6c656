"""Options for reading a toolpath."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from fiveaxis.errors import SettingError, ToolError
from fiveaxis.machine import Machine
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.source import Source
from fiveaxis.toolpath import PathShape, Tool

# Frame of a program's tip positions under TCP control.
Positions = Literal["table", "machine"]
# Meaning of rotary words of axes with more than a turn: unwrapped angles, or angles from 0 to 360 with the
# shorter turn to them, or with a turn in the direction of the word's sign.
Wrap = Literal["unwound", "shorter", "signed"]


@dataclass(frozen=True)
class ReadOptions:
    """Values that supplement or replace those of a file.

    Parameters
    ----------
    tool : the cutter; None for the file's
    feed_mm_min : one feed for all locations, in place of the file's
    unit : ``mm`` or ``inch``, of lengths, in place of the file's
    machine : that a program was written for: its rotary words are angles of this machine
    positions : frame of a program's tip positions: it turns with the table (``table``, LinuxCNC and most
        others) or is fixed to the machine (``machine``, some Fanuc controls); None to tell it from the path
    start, program_zero, rapid_mm_min, block_delete, wrap : as for `read_program`
    columns : of a list of points without header
    assume_zero : whether moves in machine coordinates (G53, G28) count from the program's zero where
        `program_zero` isn't given; else where they end is unknown
    harmless : M words of the machine's builder that move and switch nothing
    path_shape : what lies between locations, ``smooth`` curves or chords; None as the file states it
    """

    tool: Tool | None = None
    feed_mm_min: float | None = None
    unit: str | None = None
    machine: Machine | None = None
    positions: Positions | None = None
    start: Mapping[str, float] = field(default_factory=dict)
    program_zero: Mapping[str, float] | None = None
    rapid_mm_min: float | None = None
    block_delete: bool = False
    wrap: Wrap | None = None
    columns: tuple[str, ...] | None = None
    assume_zero: bool = True
    harmless: tuple[str, ...] = ()
    path_shape: PathShape | None = None

    def __post_init__(self) -> None:
        for name in ("feed_mm_min", "rapid_mm_min"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0.0):
                what = name.removesuffix("_mm_min")
                raise SettingError(f"{what} {value:g} mm/min must be a positive number")
        for word in self.harmless:
            if re.fullmatch("M[1-9][0-9]*", word) is None:
                raise SettingError(f"harmless: {word!r} isn't an M word; write them like M56")
        if self.unit is not None and self.unit not in MILLIMETRES:
            raise SettingError(f"unknown unit {self.unit!r}; known: {', '.join(MILLIMETRES)}")
        choices = {"positions": Positions, "wrap": Wrap, "path_shape": PathShape}
        for name, known in ((name, (None, *get_args(choice))) for name, choice in choices.items()):
            if getattr(self, name) not in known:
                words = ", ".join(word for word in known if word is not None)
                raise SettingError(f"unknown {name} {getattr(self, name)!r}; known: {words}")

    def tool_or(self, stated: Tool | None, source: Source) -> Tool:
        """Return the caller's tool, or else the one that a file states.

        Raises
        ------
        ToolError
            Neither is known.
        """
        tool = self.tool or stated
        if tool is None:
            raise ToolError("the file states no tool; say which with tool (--tool ball:10)", file=source.name)
        return tool
