"""Drilling cycles as the way of the tip: to the level R, down at feed, and back."""

from __future__ import annotations

from dataclasses import dataclass

from fiveaxis.nc.control.modal import CYCLES
from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.source import Source


@dataclass
class DrillingCycle:
    """Cycles in force, one after the other, at as many places as the program names.

    They end with G80 or a straight or round move. Up to there R and Z hold on, also from one word to the next
    (LinuxCNC wants them again with another word, Fanuc doesn't), and G98 leads back to where the first began.

    Parameters
    ----------
    source : the program
    word : key of `CYCLES`
    initial : mm, the level that the tool had before the first of them; None where the program hasn't said
    level, depth : mm, R and Z

    References
    ----------
    Kramer, Proctor, Messina: The NIST RS274/NGC Interpreter, Version 3 (2000), 3.5.16 and 3.5.20.
    """

    source: Source
    word: str
    initial: float | None
    level: float | None = None
    depth: float | None = None

    def take(self, block: Block, scale: float, *, incremental: bool) -> None:
        """Take what a block says about levels; R counts from where the tool came, Z from R, under G91.

        Raises
        ------
        ToolpathError
            Repetitions; an increment from nowhere.
        """
        for letter in "KL":
            if block.words.get(letter, 1.0) != 1.0:
                raise self.source.error(
                    f"{self.word} {letter}{block.words[letter]:g} repeats the cycle, which isn't run; write "
                    "one block for each place",
                    block.line,
                )
        if "R" in block.words:
            self.level = self._level(block.words["R"] * scale, self.initial, block, incremental=incremental)
        if "Z" in block.words:
            self.depth = self._level(block.words["Z"] * scale, self.level, block, incremental=incremental)

    def levels(self, now: float | None, *, to_initial: bool, line: int) -> list[tuple[float, bool]]:
        """List where Z goes, mm, and whether at feed; the first move leads over the place.

        Parameters
        ----------
        now : where it is; None where the program hasn't said
        to_initial : G98, and not G99
        """
        if self.level is None or self.depth is None:
            raise self.source.error(
                f"{self.word} needs Z and R, the depth and the level to begin at; give both", line
            )
        if to_initial and self.initial is None:
            raise self.source.error(
                f"{self.word} under G98 goes back to where it came from, which isn't in the program; move Z "
                "before, or write G99",
                line,
            )
        # From below R the tool isn't led back down there.
        back = max(self.initial, self.level) if to_initial and self.initial is not None else self.level
        over = self.level if now is None else max(now, self.level)
        ways = [(over, False), (self.level, False), (self.depth, True), (self.level, CYCLES[self.word])]
        ways += [(back, False)]
        return [way for i, way in enumerate(ways) if i == 0 or way[0] != ways[i - 1][0]]

    def _level(self, value: float, begin: float | None, block: Block, *, incremental: bool) -> float:
        if not incremental:
            return value
        if begin is None:
            raise self.source.error(
                f"{self.word} by increments (G91), and where they begin isn't in the program; write G90",
                block.line,
            )
        return begin + value
