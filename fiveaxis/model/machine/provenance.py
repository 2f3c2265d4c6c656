"""What is known of a machine's figures: where each comes from, and how large the machine is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Provenance:
    """Origin of a figure of a machine: a source, or an assumption and its reason.

    Parameters
    ----------
    figure : as in a machine file: ``A limits``, ``spindle``
    value : as in the file
    source : where it is printed or was measured; empty if nowhere
    assumed : no source; then `note` says why this value
    note : a sentence
    fitted : computed from measurements, not measured directly
    band : of an estimate, (2,): lowest and highest plausible value, as shares of it; None for other figures
    borrowed : of a borrowed drive, the axis and machine that it belongs to: ``A of hayashi-640123``
    """

    figure: str
    value: str
    source: str
    assumed: bool
    note: str = ""
    fitted: bool = False
    band: tuple[float, float] | None = None
    borrowed: str = ""

    @property
    def text(self) -> str:
        """The source and the note."""
        return "; ".join(part for part in (self.source, self.note) if part)

    @property
    def origin(self) -> str:
        """The source and the note, marked if it is an assumption or an estimate."""
        if self.band is not None:
            return f"estimated, {self.band[0]:g} to {self.band[1]:g} times: {self.text}"
        return f"assumed: {self.text}" if self.assumed else self.text

    def as_dict(self) -> dict[str, Any]:
        """Return the figure and its origin as plain data for JSON."""
        plain = {"figure": self.figure, "value": self.value, "source": self.text, "assumed": self.assumed}
        return plain if self.band is None else plain | {"band": list(self.band)}


@dataclass(frozen=True)
class Size:
    """What is known of a machine's size; None where unknown.

    Its kind is ``desktop``, ``machining-centre`` or ``portal``; its mass, kg, that of the whole machine.
    """

    kind: str | None = None
    mass: float | None = None

    def explain_share(self, moved: float | None) -> str | None:
        """Say that an axis moves more, in kg, than the whole machine has; None if it doesn't."""
        if moved is None or self.mass is None or moved < self.mass:
            return None
        return f"moves {moved:g} kg, and the whole machine has {self.mass:g} kg; correct one of them"
