"""What all blocks of a Klartext program share: values, words of axes, errors."""

from __future__ import annotations

import re

from fiveaxis.errors import ToolpathError
from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.languages.draft import Draft
from fiveaxis.nc.languages.expressions import evaluate
from fiveaxis.nc.languages.klartext_state import State
from fiveaxis.nc.languages.planes import forget_place
from fiveaxis.nc.source import Source

NUMBER = r"[+-]?(?:[0-9]{1,20}\.?[0-9]{0,20}|\.[0-9]{1,20})"
VALUE = rf"(?:{NUMBER}|[+-]?Q[LR]?[0-9]+)(?![0-9.])"

_AXIS = re.compile(rf"\s*(I?)([XYZABCUVW]) ?({VALUE})")
_LONGEST_SHOWN = 60


class Line:
    """One block, with the lines that continue it joined; `before` and `after` are blocks around it.

    Parameters
    ----------
    source, line : where it begins
    code : in capitals, without block number and comment, with single blanks and decimal points
    state : what is in force before it, and after it was read
    """

    def __init__(self, source: Source, line: int, code: str, state: State) -> None:
        self.code, self.state, self.draft = code, state, Draft(source, line)
        self.before: Block | None = None
        self.after: Block | None = None

    def fail(self, fact: str) -> ToolpathError:
        """Make an error that shows the line."""
        source, line = self.draft.source, self.draft.line
        return source.error(f"{source.lines[line - 1].strip()[:_LONGEST_SHOWN]!r}: {fact}", line)

    def value(self, text: str) -> float:
        """Evaluate a number, a Q parameter or arithmetic."""
        return evaluate(text, self.state.parameters.__getitem__)

    def stand_upright(self, word: str, *, follows: bool = False) -> None:
        """Let the tool stand along the plane's Z, by whatever angles the machine gets there.

        Parameters
        ----------
        word : what asks for it
        follows : whether the control keeps the tip where it is
        """
        if not follows and not self.state.tip_control:
            self.before = forget_place(self.draft.line, word)
        self.draft.frame = self.state.frame(word)
        self.draft.tip_control, self.draft.vector = True, {"Z": 1.0}
        self.state.positioned = True

    def follow_tip(self, *, on: bool) -> None:
        """Switch tool centre point control."""
        self.state.tip_control = self.draft.tip_control = on
        self.state.spatial, self.state.positioned = None, False

    def axes_of(self, text: str) -> tuple[dict[str, float], str]:
        """Read words of axes and nothing else; give their values, and the letters of increments."""
        words: dict[str, float] = {}
        increments, at = "", 0
        while at < len(text.rstrip()):
            found = _AXIS.match(text, at)
            if found is None:
                raise self.fail(f"{text[at:].strip()[:20]!r} isn't a word of an axis; correct it")
            increments += found[2] if found[1] else ""
            self.draft.put(words, found[2], self.value(found[3]))
            at = found.end()
        return words, increments
