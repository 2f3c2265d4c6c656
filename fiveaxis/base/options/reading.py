"""How programs are read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from fiveaxis.base.options.group import Group, option

# Frame of a program's tip positions under TCP control.
Positions = Literal["table", "machine"]
# Meaning of rotary words of axes with more than a turn: unwrapped angles, or angles from 0 to 360 with the
# shorter turn to them, or with a turn in the direction of the word's sign.
Wrap = Literal["unwound", "shorter", "signed"]
# Units of programs and lists of locations.
LengthUnit = Literal["mm", "inch"]
# Languages of programs; ISO is G-code of Fanuc, Haas, LinuxCNC and their kind.
ProgramLanguage = Literal["iso", "klartext", "millplus", "sinumerik"]


@dataclass(frozen=True, kw_only=True)
class ReadProgram(Group):
    """How an NC program is read."""

    language: ProgramLanguage | None = option(
        None,
        "language of the program; by default as its words, outside comments, or else its suffix show",
        example="klartext",
    )
    positions: Positions | None = option(
        None,
        "whether tip positions turn with the table or stay with the machine; by default as the path shows",
        example="table",
    )
    start: Mapping[str, float] | None = option(
        None,
        "axis positions before the program starts, by letter, in the control's sign",
        unit="mm and deg",
        written="X18,Y74,Z0,A0,C90",
        example={"X": 0, "Z": 100, "C": 90},
    )
    zero: Mapping[str, float] | None = option(
        None,
        "its zero (G54) in machine coordinates, by letter; by default as the path shows; of several "
        "G54X, G55X, G54.1P3X",
        unit="mm and deg",
        written="X100,Y50,Z-20",
        example={"X": 0, "Y": 0, "Z": 0},
        rank=22,
    )
    rapid: float | None = option(
        None,
        "rapid speed of axes whose highest speed isn't known; deg/min for rotary axes",
        unit="mm/min",
        above=0.0,
        example=10000,
        rank=23,
    )
    operation: int | tuple[int, ...] | None = option(
        None,
        "number of the operation to read, of an input with several tools, zeros or planes; several where "
        "each is revised, verified or priced on its own",
        least=1,
        written="3,5",
        example=[3, 5],
        rank=21,
    )
    increment: float | None = option(
        None,
        "what 1 means in an axis word without a decimal point, in the program's unit and deg; 1 by "
        "default, or the control's increment (0.001) if no axis word has a point and sizes fit only that",
        above=0.0,
        most=1.0,
        example=0.001,
    )
    block_delete: bool = option(False, "skip blocks that begin with /", flags="--block-delete")
    harmless: tuple[str, ...] = option(
        (),
        "M words of the machine's builder that move and switch nothing",
        written="M56,M120",
        example=["M56"],
    )
    wrap: Wrap | None = option(
        None,
        "how words of endless rotary axes count turns: as written, from 0 to 360 the shorter way (Fanuc "
        "with roll-over, Klartext under M126), or in the direction of the sign (LinuxCNC's "
        "WRAPPED_ROTARY); by default as the header of a program by fiveaxis says, else as written",
        example="shorter",
    )


@dataclass(frozen=True, kw_only=True)
class Reading(ReadProgram):
    """How an NC program is read, and its unit."""

    unit: LengthUnit | None = option(
        None, "unit of lengths, in place of the file's; mm where neither says it"
    )
