"""How programs are written, and what is in them beside their moves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from fiveaxis.base.options.group import Group, option

# What the words of a program are: positions of the axes; the tool's tip and the rotary angles (TCP); or the
# tip and the tool's direction.
Coordinates = Literal["axes", "tip", "vector"]
# How turns of rotary axes of more than one turn are written: unwrapped; from 0 to 360, with moves of half a
# turn or more divided; or reset by whole turns where a link begins.
Winding = Literal["unwound", "modulo", "rezero"]
# Control of programs for which neither caller nor machine names one.
USUAL_CONTROL = "linuxcnc"


@dataclass(frozen=True, kw_only=True)
class Writing(Group):
    """How a motion becomes a program."""

    control: str | Path | None = option(
        None,
        "control that the program is for (`fiveaxis controls`), or a control table; by default that of "
        f"the machine's file, or else {USUAL_CONTROL}",
        written="NAME or FILE.toml",
        flags="--control -c",
        example=USUAL_CONTROL,
        rank=5,
    )
    coordinates: Coordinates | None = option(
        None,
        "axis positions, tool tip with rotary angles (TCP), or tip with tool direction, where the "
        "control chooses the angles; by default the first that the control has",
        example="axes",
        rank=13,
    )
    winding: Winding = option("unwound", "how the program counts turns of endless rotary axes")
    thin: bool = option(True, "remove redundant blocks, or keep all", flags="--thin/--keep-blocks")
    override: tuple[str, ...] = option(
        (),
        "codes of errors that are accepted: the program is written despite them, and its header names each",
        written="CODE,CODE",
        example=["axis-limit"],
    )


@dataclass(frozen=True, kw_only=True)
class Framing(Group):
    """Settings of a program besides its moves; what isn't set isn't written.

    `fiveaxis.nc.ProgramSettings` is the record that is made of it.
    """

    name: str | None = option(
        None,
        "name of the program, for controls that name it; by default the file's",
        flags="--program-name",
        example="PART",
    )
    number: int | None = option(
        None,
        "number of the program (O), for controls that number it",
        least=1,
        most=99999999,
        flags="--program-number",
        example=1,
    )
    tool_number: int | None = option(
        None, "number of the tool to change to", least=0, most=99999999, example=1
    )
    length_offset: int | None = option(
        None,
        "number of the tool's length offset (H); by default the tool number",
        least=0,
        most=99999999,
        example=1,
    )
    spindle_rpm: float | None = option(
        None, "spindle speed", unit="rev/min", above=0.0, most=200000.0, example=8000, rank=26
    )
    spindle_direction: Literal["right", "left"] = option(
        "right", "sense of the spindle, seen along the tool from the spindle"
    )
    coolant: str | None = option(
        None, "coolant to switch on, by its name in the control's table", example="flood"
    )
    work_offset: str | None = option(
        None,
        "word of the work offset to select; by default the control's own",
        flags="--zero-word",
        example="G54",
    )
    line_numbers: int | None = option(None, "step of block numbers", least=1, most=1000, example=10)
    retract: float | None = option(
        None, "Z in machine coordinates to retract to at start and end", unit="mm", example=0
    )
    way_out: bool = option(
        True, "lead the tool out of the last cut, or end in it", flags="--way-out/--end-in-cut"
    )
    home: str = option(
        "",
        "axes to send to the machine's zero at the end, in groups: `Z XY AC`; without a retract the "
        "first group must be Z alone",
        example="Z XY",
    )
    unit: Literal["mm", "inch"] = option("mm", "unit of lengths in the program", flags="--nc-unit")
