"""Heidenhain's drilling cycles as holes: CYCL DEF 200 and so on, whose parameters are Q200 and so on.

After the *User's Manual Cycle Programming* of the TNC 640 (Heidenhain 892905-xx), drilling and tapping
cycles. Pecks, chip breaking and the disengagement in boring are left out; planes, depth and feeds count.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from fiveaxis.nc.languages.block import BlockError, Hole


@dataclass(frozen=True)
class DrillKind:
    """How a cycle differs from plunging at Q206 and retracting in rapid.

    Parameters
    ----------
    back : parameter of the feed back, at which the tool leaves the hole up to the set-up clearance; empty for
        rapid
    plain : parameters that change where the hole ends unless they are 0: depths that refer to the tool's
        shoulder or to a diameter
    dwell : parameter of the dwell at the bottom
    """

    back: str = ""
    plain: tuple[str, ...] = ()
    dwell: str = "Q211"


DRILLS = {
    200: DrillKind(plain=("Q395",)),
    201: DrillKind("Q208"),
    202: DrillKind("Q208"),
    203: DrillKind("Q208", ("Q395",)),
    205: DrillKind("Q208", ("Q395",)),
    206: DrillKind("Q206"),
    207: DrillKind("Q239", dwell=""),
    209: DrillKind("Q239", dwell=""),
    240: DrillKind(plain=("Q343",)),
    241: DrillKind("Q208", ("Q395",)),
}

# Signs may stand apart from the number; FMAX, AUTO and PREDEF are words in place of it.
_PARAMETER = re.compile(r"(Q[0-9]+) ?= ?([^=]*?) ?(?=Q[0-9]+ ?=|$)")
_RAPID = ("FMAX", "F MAX")


@dataclass(frozen=True)
class Cycle:
    """A drilling cycle in force.

    Parameters
    ----------
    number : of its definition
    values : its parameters; infinite for FMAX
    """

    number: int
    values: Mapping[str, float]

    @classmethod
    def read(cls, number: int, text: str, value: Callable[[str], float], auto: float | None) -> Cycle:
        """Read what follows ``CYCL DEF 200``: a title, and parameters.

        `value` evaluates a number, a parameter or arithmetic; `auto` is the feed of the last TOOL CALL, for
        AUTO. `BlockError` for text that isn't a parameter's value.
        """
        values = {}
        for name, written in _PARAMETER.findall(text):
            if name in values:
                raise BlockError(f"{name} has two values; write one of them")
            if written in _RAPID:
                values[name] = math.inf
            elif written in ("AUTO", "F AUTO", "FAUTO"):
                if auto is None:
                    raise BlockError(f"{name}=AUTO is the feed of TOOL CALL, and none was given; write it")
                values[name] = auto
            else:
                values[name] = value(written)
        return cls(number, values)

    def hole(self, speed: float | None, minute: float) -> Hole | None:
        """Return the hole at the present position; None for a depth of 0, at which the cycle does nothing.

        The speed, rev/min, is for the feed of a tap; `minute` is feed units of a unit of length per minute.
        `BlockError` if a parameter is missing, or has a meaning that isn't supported.
        """
        kind, name = DRILLS[self.number], f"cycle {self.number}"
        for key in kind.plain:
            if self.values.get(key):
                raise BlockError(
                    f"{name} with {key}={self.values[key]:g} reaches a depth that depends on the tool's "
                    f"tip; write the depth of the tip in Q201, with {key}=0"
                )
        near, depth, surface = (self._need(key) for key in ("Q200", "Q201", "Q203"))
        back = surface + max(near, self._need("Q204"))
        if depth > 0.0 or near < 0.0:
            raise BlockError(
                f"{name} with Q201={depth:g} and Q200={near:g}: a depth is below 0 and a clearance isn't; "
                "correct the sign"
            )
        if not depth:
            return None
        down = self._feed(kind, speed, minute)
        out = self.values.get(kind.back, math.inf) or down
        out = down if kind.back == "Q239" else out
        rapid = math.isinf(out)
        dwell = self.values.get(kind.dwell, 0.0)
        near += surface
        clear = None if rapid else near
        feed = 0.0 if rapid else out
        return Hole(
            name, back, near, surface + depth, dwell, down, feed, "G0" if rapid else "G1", clear=clear
        )

    def _need(self, key: str) -> float:
        value = self.values.get(key)
        if value is None or not math.isfinite(value):
            raise BlockError(f"cycle {self.number} needs a number for {key}; write it in its CYCL DEF")
        return value

    def _feed(self, kind: DrillKind, speed: float | None, minute: float) -> float:
        """Return the feed down; that of a tap is pitch times speed."""
        if kind.back != "Q239":
            return self._need("Q206")
        if not speed:
            raise BlockError(f"cycle {self.number} feeds at pitch times speed, and S isn't known; write S")
        return abs(self._need("Q239")) * speed * minute
