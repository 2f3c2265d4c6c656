"""Faults in the words of one move, in any mode: a wrong number, swapped numbers, a lost block."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import normalise
from planted.fault import Fault, Plant, Subject, leaves_path
from planted.measure import Measure
from planted.words import DIRECTION, LINEAR, ROTARY, Text, Words, with_words, words_of

# Blocks that are tried per fault: not every block has the words that it changes.
TRIES = 40


@dataclass(frozen=True)
class Target:
    """A move whose words are changed: its own words, those in force there, and their meaning."""

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


# Returns the changed words; None if the block hasn't got them.
Change = Callable[[Target], Words | None]


def shift(target: Target) -> Words | None:
    """0.1 mm in one linear word."""
    if not target.having(LINEAR):
        return None
    letter = target.one_of(LINEAR)
    return {letter: target.words[letter] + float(target.rng.choice([-0.1, 0.1]))}


def turn(target: Target) -> Words | None:
    """Half a degree in one rotary word, or of the tool's direction."""
    if target.has_direction:
        return target.turned(0.5)
    if not target.having(ROTARY):
        return None
    letter = target.one_of(ROTARY)
    return {letter: target.words[letter] + float(target.rng.choice([-0.5, 0.5]))}


def half_turn(target: Target) -> Words | None:
    """C half a turn off, or the direction that this makes."""
    if target.has_direction:
        return {c: -target.words[c] for c in "IJ"}
    if "C" not in target.words:
        return None
    return {"C": target.words["C"] + float(target.rng.choice([-180.0, 180.0]))}


def inches(target: Target) -> Words | None:
    """Lengths in the wrong unit."""
    return {c: 25.4 * target.words[c] for c in target.having(LINEAR)} or None


def negate(target: Target) -> Words | None:
    """The sign of one word."""
    letter = str(target.rng.choice(sorted(target.words)))
    return {letter: -target.words[letter]}


def swap(target: Target) -> Words | None:
    """Two words swapped."""
    if len(target.having(LINEAR)) < 2:
        return None
    one, two = target.rng.choice(target.having(LINEAR), 2, replace=False)
    return {str(one): target.words[two], str(two): target.words[one]}


def lean_over(target: Target) -> Words | None:
    """Some degrees of lean, with linear words that keep the tool's centre."""
    degrees = float(target.rng.choice([-50.0, -20.0, 20.0, 50.0]))
    letter = target.measure.meaning.rotary_letters[0]
    if not (target.has_direction or letter in target.words) or len(target.having(LINEAR)) < 3:
        return None
    change = target.turned(degrees) if target.has_direction else {letter: target.words[letter] + degrees}
    meaning, height = target.measure.meaning, target.measure.path.zone.height
    rows = np.array([meaning.row(state) for state in (target.state, target.state | change)])
    tip, axis = meaning.poses(rows)
    return change | meaning.linear_words(rows[1], tip[0] + height * (axis[0] - axis[1]))


CHANGES: tuple[Change, ...] = (shift, turn, half_turn, inches, negate, swap, lean_over)


def in_words(change: Change) -> Plant:
    """Change the words of one block that cuts."""

    def plant(subject: Subject, rng: np.random.Generator) -> Iterator[Text]:
        text = subject.text
        for _ in range(TRIES):
            line = int(rng.choice(subject.cutting))
            words = words_of(text.lines[line])
            other = change(Target(words, text.states[line], subject.measure, rng))
            if other is not None:
                yield text.replaced(line, with_words(text.lines[line], words | other))
                return

    return plant


def drop(subject: Subject, rng: np.random.Generator) -> Iterator[Text]:
    """One block that cuts is lost."""
    yield subject.text.replaced(int(rng.choice(subject.cutting)))


# What a changed word or a lost block means is measured: the tool leaves its path, passes a location by, leans
# too far, or an axis leaves its travel. A sign of a word near 0 doesn't.
FAULTS = (
    *(
        Fault(change.__name__, "geometry", in_words(change), matters=leaves_path, drawn=True)
        for change in CHANGES
    ),
    Fault("drop", "geometry", drop, matters=leaves_path, drawn=True),
)
