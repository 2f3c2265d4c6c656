"""Why a word of a program doesn't belong where it stands."""

from __future__ import annotations

from fiveaxis.errors import ToolpathError
from fiveaxis.machine import Machine
from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.source import Source


def unknown_word(
    source: Source, machine: Machine, letter: str, block: Block, *, stand_in: bool
) -> ToolpathError:
    """Make the error for a letter that is no axis and belongs to nothing in its block.

    Parameters
    ----------
    source, machine : the program, and whose axes its words are
    letter, block : the word and where it stands
    stand_in : whether the machine only stands in for one that nobody has given
    """
    shown = f"{letter}{block.words[letter]:g}"
    if letter in "ABC" and stand_in:
        fact = (
            "is the angle of a rotary axis, and how the axis lies isn't known; give the machine that the "
            "program was written for (--machine)"
        )
    elif letter in "ABCUVWXYZ":
        fact = (
            f"machine {machine.name!r} has the axes {', '.join(machine.letters)} and no {letter}; read "
            "the program with the machine that it was written for, or name its axis so in its file"
        )
    elif letter in "IJKR":
        fact = "belongs to an arc, and neither G2 nor G3 is in force; take it out or give the arc"
    elif letter == "E":
        fact = "isn't an axis, and numbers of G-code have no exponent; write it out"
    else:
        fact = "doesn't belong to anything in its block; take it out if it moves nothing"
    return source.error(f"{shown}: {fact}", block.line)
