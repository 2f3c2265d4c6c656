"""Faults in the words of one move, in any mode: a wrong number, a wrong place of a number, a lost block."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array, normalise
from fiveaxis.kinematics import linear_positions
from planted.measure import Measure
from planted.words import DIRECTION, LINEAR, ROTARY, Text, Words, with_words, words_of

# Blocks that are tried before a fault is given up: not every block has the words that it changes.
TRIES = 40


@dataclass(frozen=True)
class Place:
    """A move whose words are changed: its own words, those in force there, and what they mean."""

    words: Words
    state: Words
    measure: Measure
    rng: np.random.Generator

    def having(self, letters: str) -> list[str]:
        return [c for c in letters if c in self.words]

    def one_of(self, letters: str) -> str:
        return str(self.rng.choice(self.having(letters)))

    @property
    def has_direction(self) -> bool:
        return set(DIRECTION) <= set(self.words)

    def turned(self, degrees: float) -> Words:
        """Turn the tool's direction about a direction across it."""
        axis = np.array([self.words[c] for c in DIRECTION])
        across = normalise(np.cross(axis, self.rng.normal(size=3))[None])[0]
        angle = np.radians(degrees)
        return dict(zip(DIRECTION, (np.cos(angle) * axis + np.sin(angle) * across).tolist(), strict=True))


# Gives the words that change; None where the block hasn't what is changed.
Change = Callable[[Place], Words | None]


def shift(place: Place) -> Words | None:
    """0.1 mm in one linear word."""
    if not place.having(LINEAR):
        return None
    letter = place.one_of(LINEAR)
    return {letter: place.words[letter] + float(place.rng.choice([-0.1, 0.1]))}


def turn(place: Place) -> Words | None:
    """Half a degree in one rotary word, or of the tool's direction."""
    if place.has_direction:
        return place.turned(0.5)
    if not place.having(ROTARY):
        return None
    letter = place.one_of(ROTARY)
    return {letter: place.words[letter] + float(place.rng.choice([-0.5, 0.5]))}


def half_turn(place: Place) -> Words | None:
    """C half a turn off, or the direction that this makes."""
    if place.has_direction:
        return {c: -place.words[c] for c in "IJ"}
    if "C" not in place.words:
        return None
    return {"C": place.words["C"] + float(place.rng.choice([-180.0, 180.0]))}


def inches(place: Place) -> Words | None:
    """Lengths in the wrong unit."""
    return {c: 25.4 * place.words[c] for c in place.having(LINEAR)} or None


def negate(place: Place) -> Words | None:
    """The sign of one word."""
    letter = str(place.rng.choice(sorted(place.words)))
    return {letter: -place.words[letter]}


def swap(place: Place) -> Words | None:
    """Two words that changed places."""
    if len(place.having(LINEAR)) < 2:
        return None
    one, two = place.rng.choice(place.having(LINEAR), 2, replace=False)
    return {str(one): place.words[two], str(two): place.words[one]}


def lean_over(place: Place) -> Words | None:
    """Some degrees of lean that the linear words follow, so that the tool's centre stays."""
    degrees = float(place.rng.choice([-50.0, -20.0, 20.0, 50.0]))
    letter = place.measure.meaning.rotary_letters[0]
    if not (place.has_direction or letter in place.words) or len(place.having(LINEAR)) < 3:
        return None
    change = place.turned(degrees) if place.has_direction else {letter: place.words[letter] + degrees}
    meaning, height = place.measure.meaning, place.measure.path.zone.height
    rows = np.array([meaning.row(state) for state in (place.state, place.state | change)])
    tip, axis = meaning.poses(rows)
    if meaning.mode == "axes":
        return change | _followed(place, rows[1], tip[0] + height * (axis[0] - axis[1]))
    return change | dict(zip(LINEAR, (tip[0] + height * (axis[0] - axis[1])).tolist(), strict=True))


def _followed(place: Place, row: Array, tip: Array) -> Words:
    """Solve the linear axes that keep a tip, in the control's sign."""
    machine = place.measure.meaning.machine
    solved = linear_positions(machine, tip[None], row[None][:, machine.rotary_columns])[0]
    return {
        a.letter: float(solved[machine.column(a.letter)]) * (-1.0 if a.reversed else 1.0)
        for a in machine.axes
        if not a.is_rotary
    }


CHANGES: tuple[Change, ...] = (shift, turn, half_turn, inches, negate, swap, lean_over)


def changed(text: Text, change: Change, measure: Measure, rng: np.random.Generator) -> Text | None:
    """Change the words of one move on the path; None where no move has what is changed."""
    for _ in range(TRIES):
        n = int(rng.choice(text.cuts))
        line = text.moves[n]
        words = words_of(text.lines[line])
        other = change(Place(words, text.states[n], measure, rng))
        if other is not None:
            return text.replaced(line, with_words(text.lines[line], words | other))
    return None


def dropped(text: Text, measure: Measure, rng: np.random.Generator) -> Text:
    """Leave out one move on the path."""
    return text.replaced(text.moves[int(rng.choice(text.cuts))])


def rewritten(text: Text) -> Text:
    """Write every move's words anew, with the numbers that they have: no fault."""
    for line in text.moves:
        text = text.replaced(line, with_words(text.lines[line], words_of(text.lines[line])))
    return text
