"""Which tools a program takes, and where it changes from one to another."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.source import Source

# Words that put the selected tool into the spindle, however a language writes them.
CHANGES = ("M6", "TOOL CALL")
# Putting the last tool away.
EMPTY = ("T0", "TOOL CALL 0")

# Line, name of the tool, word.
_Change = tuple[int, str | None, str]


@dataclass
class Tools:
    """The tools that a program names, in order.

    T selects a tool and M6 puts it in; a program without M6, as for turrets and where T alone changes the
    tool on Sinumerik, changes it by T. TOOL CALL does both.

    Parameters
    ----------
    selected : lines and names of tools, as far as the program writes T
    changed : the same for changes; the name is None where the program doesn't say which
    """

    selected: list[tuple[int, str]] = field(default_factory=list)
    changed: list[_Change] = field(default_factory=list)

    def take(self, block: Block) -> None:
        """Take what a block says of tools."""
        name = block.tool or (f"T{block.words['T']:g}" if "T" in block.words else None)
        if name is not None:
            self.selected.append((block.line, name))
        for word in CHANGES:
            if word in block.m or word in block.ignored:
                # A change by name is done by T before; without T nobody knows which tool it is.
                latest = self.selected[-1][1] if self.selected else None
                self.changed.append((block.line, latest, word))

    def findings(self, source: Source, last: int) -> list[Finding]:
        """Say where the program takes its second tool; a path and a machine have one.

        Parameters
        ----------
        last : line of the last move; a tool that nothing is done with doesn't count, nor does none
        """
        found: list[_Change] = self.changed or [(line, name, name) for line, name in self.selected]
        found = [new for new in found if new[0] <= last and new[1] not in EMPTY]
        others = [new for old, new in pairwise(found) if new[1] is None or new[1] != old[1]]
        if not others:
            return []
        line, name, word = others[0]
        what = word if name is None else name if word in name else f"{name} {word}"
        more = f", the first of {len(others)} changes" if len(others) > 1 else ""
        return [
            Finding(
                Severity.WARNING,
                "several-tools",
                f"{what} takes another tool{more}, and all of the program is read with one; write one "
                "program for each tool",
                Place(line=line, file=source.name),
            )
        ]
