"""Words of ISO programs that switch tool centre point control on and off, control by control."""

from __future__ import annotations

from fiveaxis.nc.languages.block import Block

# Word that switches on -> words that switch off again. Fanuc and Haas count it with the tool length, whose
# words replace one another. LinuxCNC's are those of its switchable kinematics: M429 is identity.
TIP_WORDS: dict[str, frozenset[str]] = {
    "G43.4": frozenset(("G43", "G44", "G49")),
    "G43.5": frozenset(("G43", "G44", "G49")),
    "G234": frozenset(("G43", "G44", "G49")),
    "G141": frozenset(("G40", "G140", "G174")),
    "M128": frozenset(("M129",)),
    "M428": frozenset(("M429",)),
}

# These say what is so anyway where nothing was switched on.
ALWAYS_OFF = frozenset(("M129", "M429"))


class TipSwitch:
    """Whether the control places the tip, by the words so far."""

    def __init__(self) -> None:
        self.word: str | None = None

    def take(self, block: Block) -> bool | None:
        """Tell whether a block switches: on, off, or not at all (None)."""
        words = (*block.g, *block.m)
        for word in words:
            if word in TIP_WORDS:
                self.word = word
                return True
        off = ALWAYS_OFF if self.word is None else TIP_WORDS[self.word] | ALWAYS_OFF
        if off.isdisjoint(words):
            return None
        self.word = None
        return False
