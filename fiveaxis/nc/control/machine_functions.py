"""M words: functions of the machine, and words that could change what positions mean.

An M word that is documented for the program's language moves no axis (`HARMLESS`). One that switches tool
centre point control, mirrors axes or restores modal words on another control (`SWITCHING`) is refused, as is
any unknown one where it could have switched TCP: in ISO text, where M words do so, if the rotary axes turn
and no word that is known has switched it. Elsewhere unknown words are one finding.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.base import Finding, Severity
from fiveaxis.nc.control.axis_track import AxisTrack
from fiveaxis.nc.languages.block import Block, BlockError
from fiveaxis.nc.languages.choice import ISO, KLARTEXT, MILLPLUS, SINUMERIK, Language
from fiveaxis.nc.languages.iso import ALWAYS_OFF, TIP_WORDS
from fiveaxis.nc.source import Source


def _words(*numbers: int | range) -> frozenset[str]:
    each = (n for number in numbers for n in (number if isinstance(number, range) else (number,)))
    return frozenset(f"M{n}" for n in each)


# Stops, ends, spindle, tool change, coolant, clamps, orientation, gears, overrides, pallets: ISO 6983-1, and
# the same in every language.
_USUAL = _words(range(12), 13, 14, 17, 19, 30, range(40, 46), 48, 49, 60, 99)

# Language -> M words that are documented for it and move no axis.
HARMLESS: dict[str, frozenset[str]] = {
    # Haas mill operator's manual (brakes, conveyor, coolant, doors, relays, probes), LinuxCNC's G-code pages
    # (M48 to M68), and M29 (rigid tapping), M135 of machines with a Fanuc control.
    ISO.name: _USUAL
    | _words(12, 15, 16, 18, 29, range(31, 40), 46, range(50, 60), range(61, 70), 75, 76, range(78, 87))
    | _words(88, 89, 95, 104, 105, 109, 130, 131, 135),
    # Heidenhain 892903-29, 9 Miscellaneous functions; those that act are read by the language itself.
    KLARTEXT.name: _USUAL
    | _words(91, 92, 94, 97, 98, 101, 102, range(107, 112), 116, 117, 120, 124, range(126, 130))
    | _words(range(134, 144), 145, 148, 149, 150, 197),
    MILLPLUS.name: _USUAL | _words(12, 15, 16, 53, 54, range(55, 58)),
    SINUMERIK.name: _USUAL | _words(2, 70),
}

_TCP_ON = "switches tool centre point control (TCP) on:"
_TCP_OFF = "switches tool centre point control (TCP) off:"
# Word -> what it does, and where.
SWITCHING = {
    "M128": f"{_TCP_ON} Heidenhain and Hurco",
    "M129": f"{_TCP_OFF} Heidenhain and Hurco",
    "M428": f"{_TCP_ON} LinuxCNC",
    "M429": f"{_TCP_OFF} LinuxCNC",
    "M430": "switches to other kinematics: LinuxCNC",
    "M450": f"{_TCP_OFF} some machines with grblHAL",
    "M451": f"{_TCP_ON} some machines with grblHAL",
    "M144": "contains the tilted axes in the positions on Heidenhain",
    **dict.fromkeys(("M91", "M92"), "means machine coordinates (Heidenhain), or mirrors an axis (Mazak)"),
    **dict.fromkeys(("M21", "M22", "M23"), "mirrors axes: machines with a Fanuc control"),
    **dict.fromkeys(("M72", "M73"), "restores modal words: LinuxCNC"),
    **dict.fromkeys(("M126", "M127"), "changes the direction of rotary axes: Heidenhain"),
}
# On a Sinumerik these numbers are the machine builder's, and TRANS, MIRROR and SUPA do what they do
# elsewhere.
_BUILDERS = {SINUMERIK.name: _words(21, 22, 23, 72, 73, 91, 92, 126, 127)}

_M = re.compile("M[0-9]+")
# Unknown words that a message names.
MOST_NAMED = 6


@dataclass
class MachineFunctions:
    """M words of a program that is read.

    Parameters
    ----------
    language : of the program
    accepted : words that the caller takes for harmless
    unknown : word -> first line and its step, and count of those that aren't known
    """

    language: Language = ISO
    accepted: Collection[str] = ()
    unknown: dict[str, tuple[int, int, int]] = field(default_factory=dict)

    def take(self, block: Block) -> None:
        """Look at the M words of a block; `BlockError` for one that could change what positions mean."""
        for word in (*block.m, *block.ignored):
            if word in HARMLESS[self.language.name] or word in self.accepted or not _M.fullmatch(word):
                continue
            if block.tip_control is not None and (word in TIP_WORDS or word in ALWAYS_OFF):
                continue
            if word in SWITCHING and word not in _BUILDERS.get(self.language.name, ()):
                raise BlockError(
                    f"{word} {SWITCHING[word]}; it isn't a word of {self.language.name} as it is read "
                    f"here, so write that in its own words, or say that it does nothing here (harmless, "
                    f"--harmless {word})"
                )
            line, step, count = self.unknown.get(word, (block.line, block.step or block.line, 0))
            self.unknown[word] = line, step, count + 1

    def settle(self, source: Source, track: AxisTrack) -> list[Finding]:
        """Return the finding on unknown words.

        `ToolpathError` if one of them could have switched TCP: positions after it depend on that.
        """
        if not self.unknown:
            return []
        word, (line, step, _) = next(iter(self.unknown.items()))
        turned = self._turned_line(track, step)
        if turned:
            raise source.error(
                f"{word} isn't a known M word, and could switch tool centre point control on: line {turned} "
                "has rotary axes off 0, and no known word switches it; write G43.4, M128 or M428 if it does, "
                f"or say that it does nothing (harmless, --harmless {','.join(self.unknown)})",
                line,
            )
        named = [f"{each} ({count})" for each, (*_, count) in self.unknown.items()]
        more = f" and {len(named) - MOST_NAMED} more" if len(named) > MOST_NAMED else ""
        return [
            source.finding(
                Severity.WARNING,
                "unknown-codes",
                f"{', '.join(named[:MOST_NAMED])}{more}: M words that aren't known in {self.language.name}; "
                "they are taken to move and switch nothing, name them with harmless (--harmless) if so",
                line,
                float(sum(count for *_, count in self.unknown.values())),
            )
        ]

    def _turned_line(self, track: AxisTrack, since: int) -> int:
        """Return the first line since a step where the meaning of X, Y, Z depends on TCP; else 0."""
        if self.language != ISO or not track.rows:
            return 0
        columns = track.columns()
        turned = (np.nan_to_num(columns.values[:, track.rotary]) != 0.0).any(axis=1) & (
            columns.steps >= since
        )
        return 0 if columns.of_tip.any() or not turned.any() else int(columns.lines[np.argmax(turned)])
