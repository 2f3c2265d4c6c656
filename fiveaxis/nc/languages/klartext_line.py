"""Common to all Klartext blocks: values, axis words, TCP and tilting."""

from __future__ import annotations

import re

from fiveaxis.nc.languages.block import Block, BlockError
from fiveaxis.nc.languages.draft import NUMBER, Draft, put_word
from fiveaxis.nc.languages.expressions import evaluate
from fiveaxis.nc.languages.klartext_state import State
from fiveaxis.nc.languages.planes import forget_position
from fiveaxis.nc.source import Source

VALUE = rf"(?:{NUMBER}|[+-]?Q[LR]?[0-9]+)(?![0-9.])"

_AXIS = re.compile(rf"\s*(I?)([XYZABCUVW]) ?({VALUE})")


class Line:
    """One block with its continuation lines; `before` and `after` are blocks inserted around it.

    Its readers raise BlockError.

    Parameters
    ----------
    source, line : file and first line of the block
    code : upper case, single blanks, decimal points; without block number and comment
    state : modal state, updated by reading
    """

    def __init__(self, source: Source, line: int, code: str, state: State) -> None:
        self.code, self.state, self.draft = code, state, Draft(source, line)
        self.before: Block | None = None
        self.after: Block | None = None

    def value(self, text: str) -> float:
        """Evaluate a number, a Q parameter or arithmetic."""
        return evaluate(text, self.state.parameters.__getitem__)

    def stand_upright(self, word: str, *, follows: bool = False) -> None:
        """Point the tool along the plane's Z, whatever angles the machine takes for it.

        Parameters
        ----------
        word : the word that turns the axes
        follows : whether the control holds the tip meanwhile
        """
        if not follows and not self.state.tip_control:
            self.before = forget_position(self.draft.line, word)
        self.draft.frame = self.state.frame(word)
        self.draft.tip_control, self.draft.vector = True, {"Z": 1.0}
        self.state.positioned = True

    def switch_tcp(self, *, on: bool) -> None:
        """Switch TCP."""
        self.state.tip_control = self.draft.tip_control = on
        self.state.spatial, self.state.positioned = None, False

    def axes_of(self, text: str) -> tuple[dict[str, float], str]:
        """Read a text of axis words only; return their values and the letters of increments."""
        words: dict[str, float] = {}
        increments, at = "", 0
        while at < len(text.rstrip()):
            found = _AXIS.match(text, at)
            if found is None:
                raise BlockError(f"{text[at:].strip()[:20]!r} isn't a word of an axis; correct it")
            increments += found[2] if found[1] else ""
            put_word(words, found[2], self.value(found[3]))
            at = found.end()
        return words, increments
