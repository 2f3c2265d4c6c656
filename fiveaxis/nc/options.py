"""What a caller says about a toolpath's file, beside its name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from fiveaxis.errors import SettingError, ToolError
from fiveaxis.machine import Machine
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.source import Source
from fiveaxis.toolpath import Tool

# Where the positions of a program count from while the control places the tool's tip.
Positions = Literal["table", "machine"]
# How rotary words of axes with more than a turn count: as they stand, or from 0 to 360 and the shorter way,
# or the way that the word's sign says.
Wrap = Literal["unwound", "shorter", "signed"]


@dataclass(frozen=True)
class ReadOptions:
    """What is taken where a file doesn't say it, or in place of what it says.

    Parameters
    ----------
    tool : the cutter; None for the one that the file states
    feed_mm_min : one feed for all locations, in place of the file's
    unit : ``mm`` or ``inch``, of lengths in a file that doesn't state it
    machine : that a program was written for: its rotary words are angles of this machine
    positions : whether a program's tip positions turn with the table (``table``, as LinuxCNC and most others
        mean them) or keep to a frame that stays with the machine (``machine``, as some Fanuc controls do)
    start, program_zero, rapid_mm_min, block_delete, wrap : as for `read_program`
    columns : of a list of points without header
    """

    tool: Tool | None = None
    feed_mm_min: float | None = None
    unit: str | None = None
    machine: Machine | None = None
    positions: Positions = "table"
    start: Mapping[str, float] = field(default_factory=dict)
    program_zero: Mapping[str, float] | None = None
    rapid_mm_min: float | None = None
    block_delete: bool = False
    wrap: Wrap | None = None
    columns: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        for name in ("feed_mm_min", "rapid_mm_min"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0.0):
                what = name.removesuffix("_mm_min")
                raise SettingError(f"{what} {value:g} mm/min must be a positive number")
        if self.unit is not None and self.unit not in MILLIMETRES:
            raise SettingError(f"unknown unit {self.unit!r}; known: {', '.join(MILLIMETRES)}")
        for name, known in (("positions", get_args(Positions)), ("wrap", (None, *get_args(Wrap)))):
            if getattr(self, name) not in known:
                words = ", ".join(word for word in known if word is not None)
                raise SettingError(f"unknown {name} {getattr(self, name)!r}; known: {words}")

    def tool_or(self, stated: Tool | None, source: Source) -> Tool:
        """Take the caller's tool, or else the one that a file states.

        Raises
        ------
        ToolError
            Neither names one.
        """
        tool = self.tool or stated
        if tool is None:
            raise ToolError("the file states no tool; say which with tool (--tool ball:10)", file=source.name)
        return tool
