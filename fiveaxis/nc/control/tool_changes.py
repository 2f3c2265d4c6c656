"""The tools of a program, in order."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.nc.control.technology import CHANGES
from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.source import Source

# An empty spindle.
EMPTY = ("T0", "TOOL CALL 0")

# Line, name of the tool, word.
_Change = tuple[int, str | None, str]


@dataclass
class Tools:
    """The tools of a program, in order.

    T selects a tool and M6 loads it. In a program without M6, as for turrets and some Sinumerik machines, T
    changes the tool. TOOL CALL does both.

    Parameters
    ----------
    selected : lines and names of selected tools
    changed : lines, names and words of changes; the name is None if the program doesn't give it
    """

    selected: list[tuple[int, str]] = field(default_factory=list)
    changed: list[_Change] = field(default_factory=list)

    def take(self, block: Block) -> None:
        """Read the tool words of a block."""
        name = block.tool or (f"T{block.words['T']:g}" if "T" in block.words else None)
        if name is not None:
            self.selected.append((block.line, name))
        for word in CHANGES:
            if word in block.m or word in block.ignored:
                # The tool is that of the last T; without T it is unknown.
                latest = self.selected[-1][1] if self.selected else None
                self.changed.append((block.line, latest, word))
        if block.tool and "T" in block.words:
            self.selected.append((block.line, f"T{block.words['T']:g}"))

    def findings(self, source: Source, last: int) -> list[Finding]:
        """Return a warning at the first change to a second tool: a path has one tool only.

        Parameters
        ----------
        last : line of the last move; later tools and an empty spindle don't count
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
                f"{what} loads another tool{more}, and the whole program is read with one tool; split it "
                "into one program per tool",
                Place(line=line, file=source.name),
            )
        ]
