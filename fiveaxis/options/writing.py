"""How programs are written, and what is in them beside their moves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from fiveaxis.options.option import Group, Option

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

    control: Annotated[
        str | Path | None,
        Option(
            "control that the program is for (`fiveaxis controls`), or a control table; by default that of "
            f"the machine's file, or else {USUAL_CONTROL}",
            written="NAME or FILE.toml",
            flags="--control -c",
            example=USUAL_CONTROL,
            rank=5,
        ),
    ] = None
    coordinates: Annotated[
        Coordinates | None,
        Option(
            "axis positions, tool tip with rotary angles (TCP), or tip with tool direction, where the "
            "control chooses the angles; by default the first that the control has",
            example="axes",
            rank=13,
        ),
    ] = None
    winding: Annotated[Winding, Option("how the program counts turns of endless rotary axes")] = "unwound"
    thin: Annotated[bool, Option("remove redundant blocks, or keep all", flags="--thin/--keep-blocks")] = True
    override: Annotated[
        tuple[str, ...],
        Option(
            "codes of errors that are accepted: the program is written despite them, and its header "
            "names each",
            written="CODE,CODE",
            example=["axis-limit"],
        ),
    ] = ()


@dataclass(frozen=True, kw_only=True)
class Framing(Group):
    """Settings of a program besides its moves; what isn't set isn't written.

    `fiveaxis.nc.ProgramSettings` is the record that is made of it.
    """

    name: Annotated[
        str | None,
        Option(
            "name of the program, for controls that name it; by default the file's",
            flags="--program-name",
            example="PART",
        ),
    ] = None
    number: Annotated[
        int | None,
        Option(
            "number of the program (O), for controls that number it",
            least=1,
            most=99999999,
            flags="--program-number",
            example=1,
        ),
    ] = None
    tool_number: Annotated[
        int | None, Option("number of the tool to change to", least=0, most=99999999, example=1)
    ] = None
    length_offset: Annotated[
        int | None,
        Option(
            "number of the tool's length offset (H); by default the tool number",
            least=0,
            most=99999999,
            example=1,
        ),
    ] = None
    spindle_rpm: Annotated[
        float | None, Option("spindle speed", unit="rev/min", above=0.0, most=200000.0, example=8000, rank=26)
    ] = None
    spindle_direction: Annotated[
        Literal["right", "left"], Option("sense of the spindle, seen along the tool from the spindle")
    ] = "right"
    coolant: Annotated[
        str | None, Option("coolant to switch on, by its name in the control's table", example="flood")
    ] = None
    work_offset: Annotated[
        str | None,
        Option(
            "word of the work offset to select; by default the control's own",
            flags="--zero-word",
            example="G54",
        ),
    ] = None
    line_numbers: Annotated[int | None, Option("step of block numbers", least=1, most=1000, example=10)] = (
        None
    )
    retract: Annotated[
        float | None, Option("Z in machine coordinates to retract to at start and end", unit="mm", example=0)
    ] = None
    way_out: Annotated[
        bool, Option("lead the tool out of the last cut, or end in it", flags="--way-out/--end-in-cut")
    ] = True
    home: Annotated[
        str,
        Option(
            "axes to send to the machine's zero at the end, in groups: `Z XY AC`; without a retract the "
            "first group must be Z alone",
            example="Z XY",
        ),
    ] = ""
    unit: Annotated[Literal["mm", "inch"], Option("unit of lengths in the program", flags="--nc-unit")] = "mm"
