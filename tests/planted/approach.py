"""Faults on the way to the path and off it: order, depth, a plunge at the end, a retract that is lost."""

from collections.abc import Iterator

import numpy as np

from planted.fault import Fault, Subject
from planted.technology import FEED
from planted.words import IN_LIST, IN_MACHINE, LINEAR, ROTARY, Text, Words, with_words, words_of

# mm, along the tool into the material.
DEEP = 30.0


def sunk(subject: Subject, state: Words) -> Words:
    """Return the linear words of the tip deeper along the tool's axis, at the rotary words in force."""
    meaning = subject.measure.meaning
    row = meaning.row(state)
    tip, axis = meaning.poses(row[None])
    return meaning.linear_words(row, tip[0] - DEEP * axis[0])


def moved(text: Text, line: int, to: int) -> Text:
    """Move a line behind a later one, or before an earlier one."""
    order = list(range(len(text.lines)))
    order.insert(to, order.pop(line))
    return Text(tuple(text.lines[i] for i in order), tuple(text.rows[i] for i in order), text.path).numbered()


def order(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """The tool goes down before the rotary axes have turned, or before it is above the part."""
    text = subject.text
    if len(text.approach) < 2:
        return
    down = max(i for i in text.approach if "Z" in words_of(text.lines[i]))
    for line in text.approach:
        if line < down and set(words_of(text.lines[line])) & set(LINEAR + ROTARY):
            yield moved(text, line, down)


def diagonal(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """Under TCP X, Y and Z move together to the first location, past the part."""
    if subject.mode != "axes" and len(subject.text.approach) > 2:
        high, down = subject.text.approach[-2:]
        words = words_of(subject.text.lines[down])
        yield subject.text.replaced(high, with_words(subject.text.lines[high], words)).replaced(down)


def deep(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """The approach ends inside the material."""
    text = subject.text
    for line in [i for i in text.approach if "Z" in words_of(text.lines[i])][-1:]:
        words = words_of(text.lines[line])
        below = sunk(subject, text.states[line])
        changed = with_words(text.lines[line], words | {c: below[c] for c in words if c in below})
        yield text.replaced(line, changed)


def plunge(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """After the last cut the tool goes into the part, at feed or at rapid."""
    text = subject.text
    below = sunk(subject, text.states[text.moves[-1]])
    for quick in (False, True):
        yield text.inserted(text.last + 1, *moves_to(text, below, quick))


def moves_to(text: Text, words: Words, quick: bool) -> list[str]:
    """Write a move to other linear words, after the last one."""
    was = text.lines[text.last]
    if IN_LIST.match(was):
        there = with_words(was, words_of(was) | words)
        if was.startswith("GOTO/"):
            return ["RAPID"] * quick + [there]
        return [f"{there[:-3]}0,1" if quick else there]
    feed = FEED.findall("\n".join(text.lines))[-1]
    if text.is_klartext:
        numbers = " ".join(f"{c}{words[c]:+.4f}" for c in LINEAR)
        return [f"L {numbers} R0 {'FMAX' if quick else f'F{feed}'}"]
    numbers = " ".join(f"{c}{words[c]:.4f}" for c in LINEAR)
    return [f"G0 {numbers}" if quick else f"G1 {numbers} F{feed}"]


def retract_lost(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """The retract at the start or at the end is lost."""
    for line in subject.text.find(IN_MACHINE):
        yield subject.text.replaced(line).numbered()


# Always: the tool comes down beside where it should, with another direction, or ends in the part. A retract
# that was asked for is the only thing that keeps a turning table clear of the tool.
FAULTS = (
    Fault("approach order", "approach", order),
    Fault("approach diagonal", "approach", diagonal),
    Fault("approach too deep", "approach", deep),
    Fault("plunge at the end", "approach", plunge),
    Fault("retract lost", "approach", retract_lost),
)
