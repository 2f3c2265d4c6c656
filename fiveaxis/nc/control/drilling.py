"""Drilling cycles as moves of the tip: to the level R, down at feed, and back."""

from __future__ import annotations

from dataclasses import dataclass

from fiveaxis.nc.control.modal import CYCLES
from fiveaxis.nc.languages.block import Block, BlockError


@dataclass
class DrillingCycle:
    """A series of cycles at successive positions, until G80 or a straight or circular move.

    R and Z stay in force throughout, even if the cycle word changes (LinuxCNC requires them again then, Fanuc
    doesn't), and G98 returns to the level before the first cycle.

    Parameters
    ----------
    word : key of `CYCLES`
    initial : mm, level before the first cycle; None if unknown
    level, depth : mm, R and Z

    References
    ----------
    Kramer, Proctor, Messina: The NIST RS274/NGC Interpreter, Version 3 (2000), 3.5.16 and 3.5.20.
    """

    word: str
    initial: float | None
    level: float | None = None
    depth: float | None = None

    def take(self, block: Block, scale: float, *, incremental: bool) -> None:
        """Read the levels of a block; under G91, R is relative to the initial level, and Z to R.

        Raises
        ------
        BlockError
            Repetitions; an increment from an unknown level.
        """
        for letter in "KL":
            if block.words.get(letter, 1.0) != 1.0:
                raise BlockError(
                    f"{self.word} {letter}{block.words[letter]:g} repeats the cycle, which isn't supported; "
                    "write one block for each hole"
                )
        if "R" in block.words:
            self.level = self._level(block.words["R"] * scale, self.initial, incremental=incremental)
        if "Z" in block.words:
            self.depth = self._level(block.words["Z"] * scale, self.level, incremental=incremental)

    def levels(self, now: float | None, *, to_initial: bool) -> list[tuple[float, bool]]:
        """Return the levels of Z, mm, and whether each is reached at feed; the first move positions X and Y.

        Parameters
        ----------
        now : Z, mm; None if unknown
        to_initial : G98, not G99
        """
        if self.level is None or self.depth is None:
            raise BlockError(f"{self.word} needs depth Z and level R; write both")
        if to_initial and self.initial is None:
            raise BlockError(
                f"{self.word} under G98 returns to the initial level, which isn't in the program; move Z "
                "before, or write G99"
            )
        # A tool that started below R doesn't return below it.
        back = max(self.initial, self.level) if to_initial and self.initial is not None else self.level
        over = self.level if now is None else max(now, self.level)
        moves = [(over, False), (self.level, False), (self.depth, True), (self.level, CYCLES[self.word])]
        moves += [(back, False)]
        return [move for i, move in enumerate(moves) if i == 0 or move[0] != moves[i - 1][0]]

    def _level(self, value: float, begin: float | None, *, incremental: bool) -> float:
        if not incremental:
            return value
        if begin is None:
            raise BlockError(f"{self.word} under G91 from a level that isn't in the program; write G90")
        return begin + value
