"""The words of an operation with other positions of its axes, in its own lines.

The words of positions change, and the durations of inverse time; lines are added where the path needs more
locations, and before and after the cuts, where the rotary axes turn. All other text stays as it is.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, ToolpathError
from fiveaxis.model import MoveKind, Toolpath, linear_positions, tool_axes, tool_poses
from fiveaxis.nc.control.axis_track import travel_of
from fiveaxis.nc.languages.choice import KLARTEXT, find_language
from fiveaxis.nc.operation_text import OperationText, Placement, Revision
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.words import control_values, format_number

# A word and its number, outside comments and texts.
_WORD = re.compile(
    r"\([^)]*\)|;.*|\"[^\"]*\""
    r"|(?<![A-Z#$_<])(?P<name>[NT][XYZ]|CR(?=\s*=)|[A-Z][0-9](?=\s*=)|[A-Z])"
    r"(?P<gap>\s*=?\s*)(?P<number>[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))",
    re.IGNORECASE,
)
# G words of straight moves and arcs, and of what F means.
_MOTIONS, _FEED_MODES = (0.0, 1.0, 2.0, 3.0), (93.0, 94.0, 95.0)
# Words of a tool direction, one triple for each control.
_DIRECTIONS = (("A3", "B3", "C3"), ("TX", "TY", "TZ"), ("I", "J", "K"))
# mm or deg: rounding of the sums that lead from words to positions.
SAME = 1e-6
# Fewest decimals of a word that is written anew: mm, inches, angles, components of a direction, feeds.
LEAST_DECIMALS = {"mm": 3, "inch": 4, "angle": 3, "direction": 6, "feed": 4}
# deg: a turn in the air by axis words is divided, so that the tool's tip stays about where it is.
TURN_STEP = 2.0
# s in a minute, as inverse time counts.
MINUTE = 60.0


@dataclass(frozen=True)
class Style:
    """How the numbers of a word are written.

    Parameters
    ----------
    gap : between name and number: empty, blanks or ``=``
    decimals : of the number
    bare : whether zeros at its end are left out
    plus : whether a positive number has its sign
    short : whether a zero before the point is left out
    whole : whether a whole number has no point
    """

    gap: str = ""
    decimals: int = 3
    bare: bool = False
    plus: bool = False
    short: bool = False
    whole: bool = False

    def text(self, value: float) -> str:
        """Write a number, never as ``-0.``."""
        number = format_number(value, self.decimals)
        if self.bare:
            number = number.rstrip("0")
        if self.whole:
            number = number.removesuffix(".")
        if self.short and number.rstrip("0.-"):
            number = number.replace("0.", ".", 1) if number.lstrip("-").startswith("0.") else number
        return f"+{number}" if self.plus and not number.startswith("-") else number


def words_of(line: str) -> Iterator[re.Match[str]]:
    """Yield the words of a line that have a number, outside comments and texts."""
    return (match for match in _WORD.finditer(line) if match["name"] is not None)


def g_word(line: str, numbers: tuple[float, ...]) -> re.Match[str] | None:
    """Return the first G word of a line with one of some numbers."""
    found = (match for match in words_of(line) if match["name"].upper() == "G")
    return next((match for match in found if float(match["number"]) in numbers), None)


@dataclass(eq=False)
class Reviser:
    """Writes other positions into an operation's lines.

    Parameters
    ----------
    text : the operation
    path : of `OperationText.path_of`
    placement : where its axes are to be

    Raises
    ------
    ToolpathError
        With file and line: positions that words alone don't say (loops, increments, expressions), several
        frames in one operation, tips that don't turn with the table, a start that isn't known.
    """

    text: OperationText
    path: Toolpath
    placement: Placement
    styles: dict[str, Style] = field(init=False)
    shifts: Array = field(init=False)

    def __post_init__(self) -> None:
        self.machine, self.source = self.text.machine, self.text.source
        self.rows = self.text.columns.at(self.text.cuts)
        self.klartext = find_language(self.source) == KLARTEXT
        self.letters = tuple(self.machine.letters)
        self.is_linear = np.array([not a.is_rotary for a in self.machine.axes])
        self.scale = np.where(self.is_linear, MILLIMETRES[self.text.unit], 1.0)
        self.by_tip = bool(self.rows.of_tip[0])
        self._require_one_frame()
        self.directions = self._directions()
        self.styles = dict(self._styles())
        self.shifts = self._shifts()

    def revision(self) -> Revision:
        """Write the new lines."""
        rows, place = self.rows, self.placement
        words = self._words(self._values(), place.rotary)
        feeds = self._feeds(words)
        lines: dict[int, list[str]] = {}
        order: list[tuple[int, int]] = []
        now = self._state_before()
        turn_in, now = self._turn_in(now, words[0])
        first = int(rows.lines[0])
        lines[first] = list(turn_in)
        for number, at in enumerate(place.row.tolist()):
            line = int(rows.lines[int(np.ceil(at))])
            own = lines.setdefault(line, [])
            given = at == int(at)
            template = self.source.lines[line - 1]
            arc = bool(self.arcs[int(np.ceil(at))])
            template = self._without_arc(template) if arc else template
            given = given and (not arc or bool(self.first[int(at)]))
            text, now = self._line(template, words[number], now, feeds[number], given=given)
            if number == 0 and turn_in and not self.klartext and g_word(template, _MOTIONS) is None:
                own.append("G1")
            if text:
                own.append(text)
            order.append((line, len(own) - 1))
        last_row, turn_out = self._turn_out(now)
        last = int(self.text.columns.lines[last_row])
        lines.setdefault(last, [self.source.lines[last - 1]]).extend(turn_out)
        replaced = {line: tuple(own) for line, own in lines.items()}
        return Revision(self.source, replaced, np.array(order), first, last)

    # What the words say now.

    def _require_one_frame(self) -> None:
        lines, own = self.rows.lines, self.text.columns.lines
        again = np.flatnonzero(np.diff(lines, append=lines[-1]) < 0) + 1
        if again.size or np.isin(self.text.whole.lines, own).sum() > len(own):
            raise self._error("its lines run several times (a loop, a subprogram)", int(again[:1].sum()))
        self.last = np.append(np.diff(lines) != 0, True)
        self.first = np.append(True, np.diff(lines) != 0)
        self.arcs = self._arcs()
        if (several := np.flatnonzero(~self.last & ~self.arcs)).size:
            raise self._error("a block is several moves (a cycle)", int(several[0]))
        if (other := np.flatnonzero(self.rows.counting != self.rows.counting[0])).size:
            raise self._error(
                "TCP or the tool's length is switched within the operation's cuts", int(other[0])
            )
        if self.by_tip:
            off = self.rows.values[:, self._xyz] - self.path.tips(self.path.axis)
            if (moved := np.flatnonzero(np.abs(off - off[0]).max(axis=1) > SAME)).size:
                raise self._error("its tips don't turn with the table, or its zero changes", int(moved[0]))

    def _arcs(self) -> BoolArray:
        """Mark the rows of arcs, (n,), which become chords; those of Klartext aren't known."""
        found, modal = np.zeros(len(self.rows.lines), dtype=bool), False
        if self.klartext:
            return found
        for row in np.flatnonzero(self.first).tolist():
            motion = g_word(self._text(row), _MOTIONS)
            modal = modal if motion is None else float(motion["number"]) in _MOTIONS[2:]
            found[row] = modal
        return np.asarray(found[np.maximum.accumulate(np.where(self.first, np.arange(len(found)), 0))])

    def _text(self, row: int) -> str:
        return self.source.lines[int(self.rows.lines[row]) - 1]

    @property
    def _xyz(self) -> list[int]:
        return [self.letters.index(c) for c in "XYZ"]

    def _directions(self) -> tuple[str, ...]:
        """Return the words of the tool direction; none where the program states rotary angles."""
        given = np.isfinite(self.rows.vectors[:, 0])
        if not given.any():
            return ()
        row = int(np.argmax(given))
        found = self._found(row)
        for names in _DIRECTIONS:
            if all(name in found for name in names):
                return names
        raise self._error("the tool's direction isn't in words with numbers", row)

    def _found(self, row: int) -> dict[str, re.Match[str]]:
        """Return the words of a row's line by name."""
        words: dict[str, re.Match[str]] = {}
        for match in words_of(self._text(row)):
            name = match["name"].upper()
            if name in words and (name in self.letters):
                raise self._error(f"the word {name} stands twice in a block", row)
            words[name] = match
        return words

    def _styles(self) -> Iterator[tuple[str, Style]]:
        """Find how the words of each name are written in the operation."""
        seen: dict[str, list[re.Match[str]]] = {}
        for row in np.flatnonzero(self.last).tolist():
            for name, match in self._found(row).items():
                seen.setdefault(name, []).append(match)
        plain = seen.get("X", seen.get("Y", []))
        for name in (*self.letters, *self.directions, "F"):
            own = seen.get(name, plain)
            linear = name in "XYZ"
            kind = "direction" if name in self.directions else self.text.unit if linear else "angle"
            numbers = [match["number"] for match in own]
            lengths = {len(n.partition(".")[2]) for n in numbers}
            decimals = max(lengths, default=0)
            bare = any(n.endswith(".") for n in numbers) or len(lengths) > 1
            plus = any(n.startswith("+") for n in numbers)
            short = any(n.lstrip("+-").startswith(".") for n in numbers)
            gap = own[0]["gap"] if own else ""
            whole = name == "F" and not decimals
            least = LEAST_DECIMALS["feed" if name == "F" else kind]
            yield name, Style(gap, max(decimals, least), bare or whole, plus, short, whole)

    def _shifts(self) -> Array:
        """Find what lies between words and positions, (k,), from the words of all rows.

        `ToolpathError` if it isn't one for all: words are increments, expressions or of several frames.
        """
        shifts = np.full(len(self.letters), np.nan)
        last: Array | None = None
        for row in np.flatnonzero(self.last).tolist():
            words = self._found(row)
            values = self.rows.values[row]
            for column, letter in enumerate(self.letters):
                value = float(values[column])
                if not np.isfinite(value):
                    continue
                if letter in words and letter not in self.directions:
                    shift = value - float(words[letter]["number"]) * self.scale[column]
                    if np.isnan(shifts[column]):
                        shifts[column] = shift
                    off = shift - shifts[column]
                    off -= 0.0 if self.is_linear[column] else 360.0 * round(off / 360.0)
                    wrong = abs(off) > SAME
                else:
                    wrong = last is not None and abs(value - float(last[column])) > SAME
                if wrong:
                    raise self._error(
                        f"{letter} isn't a plain position (an increment, an expression, another zero)", row
                    )
            last = values
        # An axis that no cut names has no words yet; those that it gets count from the same zero.
        return np.nan_to_num(shifts)

    def _error(self, why: str, row: int) -> ToolpathError:
        return self.source.error(
            f"operation {self.text.operation.number} can't be revised in place: {why}; write it anew for its "
            "control (--control), or post it with plain moves",
            int(self.rows.lines[row]),
        )

    # What they are to say.

    def _values(self) -> Array:
        """Compute the positions as the control counts them, (m, k) mm and deg."""
        place = self.placement
        positions = np.zeros((len(place.row), len(self.letters)))
        columns = self.machine.rotary_columns
        positions[:, columns] = place.rotary
        if not self.by_tip:
            positions = linear_positions(self.machine, place.tip, place.rotary)
        values = control_values(self.machine, positions)
        if self.by_tip:
            off = self.rows.values[0, self._xyz] - self.path.tips(self.path.axis)[0]
            values[:, self._xyz] = place.tip + off
        return values

    def _words(self, values: Array, rotary: Array) -> list[dict[str, str]]:
        """Write the words of positions, (m, k) mm and deg, and of the tool at the angles, rad."""
        axes = tool_axes(self.machine, rotary)
        return [self._words_at(value, axis) for value, axis in zip(values, axes, strict=True)]

    def _words_at(self, values: Array, direction: Array) -> dict[str, str]:
        """Write the words of a position, (k,) mm and deg, NaN where unknown, and of the tool's direction."""
        numbers = zip(self.letters, (values - self.shifts) / self.scale, strict=True)
        named = ((c, n) for c, n in numbers if np.isfinite(n) and (c in "XYZ" or not self.directions))
        return {
            name: self.styles[name].text(float(number))
            for name, number in (*named, *zip(self.directions, direction, strict=False))
        }

    def _feeds(self, words: Sequence[Mapping[str, str]]) -> list[str | None]:
        """Write F of each move; None where the word, or its absence, stays.

        Under TCP F is the feed of the tip. Inverse time, and F along axes, follow the durations.
        """
        row = self.placement.row
        owner = np.ceil(row).astype(np.int64)
        time = self._durations(owner)
        # A line that changes the mode does so for itself, not for lines that are added before it.
        switches = np.array([g_word(self._text(at), _FEED_MODES) is not None for at in owner.tolist()])
        mode = np.where(switches & (row < owner), owner - 1, owner)
        # The chords of an arc have durations in any mode.
        told = np.maximum.accumulate(np.where(self.arcs, 0, np.arange(len(self.arcs))))
        inverse = np.isfinite(self.rows.times[told])[mode]
        stays = (self.rows.kinds[owner] != MoveKind.CUT) | (~inverse & self.by_tip)
        with np.errstate(divide="ignore", invalid="ignore"):
            counted = np.where(inverse, 1.0, self._travel(words))
            feeds = MINUTE * counted / time
        # The way down to the first location is as long as it was.
        stays[0] = True
        if (unknown := np.flatnonzero(~stays & np.isnan(counted))).size:
            why = "nobody says what its F counts where rotary axes turn, too (`feed-meaning`)"
            raise self._error(why, int(owner[unknown[0]]))
        written = ~stays & np.isfinite(feeds) & (feeds > 0.0)
        style = self.styles["F"]
        return [style.text(f) if w else None for f, w in zip(feeds.tolist(), written.tolist(), strict=True)]

    def _durations(self, owner: IntArray) -> Array:
        """Return how long each move lasts, (m,) s: as long as it did, where the program tells that."""
        time, own = self.placement.time, self.rows.times[owner]
        if not self.by_tip and not self.directions:
            own = travel_of(self.rows, MILLIMETRES[self.text.unit]).time[owner]
        with np.errstate(divide="ignore", invalid="ignore"):
            kept = own * time / np.bincount(owner, time)[owner]
        return np.where(np.isfinite(kept), kept, time)

    def _travel(self, words: Sequence[Mapping[str, str]]) -> Array:
        """Return the lengths that F counts, (m,), in the program's unit or deg; NaN where nobody says it."""
        if self.directions:
            return np.ones(len(words))
        numbers = np.array([[float(row[c]) for c in self.letters] for row in words])
        some = self.rows.at(np.ceil(self.placement.row).astype(np.int64))
        moved = replace(some, values=numbers * self.scale, times=np.full(len(numbers), np.nan))
        travel = travel_of(moved, 1.0)
        units = np.where(travel.along, travel.length / MILLIMETRES[self.text.unit], travel.length)
        return np.where(travel.unknown, np.nan, units)

    def _line(
        self, template: str, words: Mapping[str, str], now: dict[str, str], feed: str | None, *, given: bool
    ) -> tuple[str, dict[str, str]]:
        """Write a row into its own line, or into a new one like it; empty where nothing moves."""
        found = {m["name"].upper(): m for m in words_of(template)}
        after = now | dict(words)
        if not given:
            changed = self._whole([name for name in words if now.get(name) != words[name]])
            return self._block(changed, after, feed, template), after
        wanted = dict(words) | ({} if feed is None else {"F": feed})
        changed = self._whole([n for n in words if now.get(n) != words[n]])
        missing = [n for n in changed if n not in found]
        missing += ["F"] if feed is not None and "F" not in found else []
        pieces, at = [], 0
        end = 0
        for name, match in sorted(found.items(), key=lambda item: item[1].start()):
            if name not in wanted:
                continue
            pieces += [template[at : match.start("number")], self._number(match, wanted[name])]
            at = match.end("number")
            if name in words:
                end = sum(map(len, pieces))
        line = "".join(pieces) + template[at:]
        if missing:
            motion = g_word(line, _MOTIONS)
            end = end or (len(self._head_of(template)) if motion is None else motion.end())
            added = "".join(f" {self._word(n, wanted[n])}" for n in missing)
            line = line[:end].rstrip() + (added if end else added.lstrip() + " ") + line[end:]
        return line, after

    def _without_arc(self, template: str) -> str:
        """Return an arc's line without the arc: a straight move that names no axis."""

        def kept(match: re.Match[str]) -> str:
            name = (match["name"] or "").upper()
            return "" if name in ("I", "J", "K", "R", "CR") or name in self.letters else match[0]

        motion = g_word(template, _MOTIONS)
        begin, end = (0, 0) if motion is None else motion.span()
        straight = f"{template[:begin]}G1{' ' * (motion is None)}{template[end:]}"
        return re.sub(r"(?<=\S) {2,}(?=\S)", " ", _WORD.sub(kept, straight)).rstrip()

    def _number(self, match: re.Match[str], number: str) -> str:
        """Return the number to write in place of a word's: its own text where it says the same."""
        own, decimals = match["number"], self.styles[match["name"].upper()].decimals
        if abs(float(own) - float(number)) <= 0.5001 * 10.0**-decimals:
            return own
        return number.rjust(len(own)) if match["gap"].isspace() else number

    def _head_of(self, template: str) -> str:
        """Return what stands before the first word of an axis in a line without one: all of its code."""
        comment = next((m for m in _WORD.finditer(template) if m["name"] is None), None)
        return template if comment is None else template[: comment.start()]

    def _word(self, name: str, number: str) -> str:
        return f"{name}{self.styles[name].gap}{number}"

    def _block(self, names: Sequence[str], words: Mapping[str, str], feed: str | None, template: str) -> str:
        """Write a block of its own; empty where no word changes."""
        if not names:
            return ""
        motion = g_word(template, _MOTIONS)
        head = ["L"] if self.klartext else [] if motion is None else [motion[0]]
        tail = [] if feed is None else [self._word("F", feed)]
        return " ".join([*head, *(self._word(n, words[n]) for n in names), *tail])

    # How the rotary axes turn before the cuts and after them.

    def _state_before(self) -> dict[str, str]:
        """Return the words in force before the first cut."""
        columns, row = self.text.columns, self.text.cuts.start - 1
        if row < 0:
            return self._words_at(np.full(len(self.letters), np.nan), self.rows.vectors[0])
        vector = columns.vectors[row]
        known = bool(np.isfinite(vector).all())
        return self._words_at(columns.values[row], vector if known else self.rows.vectors[0])

    @property
    def _turning(self) -> tuple[str, ...]:
        return self.directions or tuple(
            c for c, linear in zip(self.letters, self.is_linear, strict=True) if not linear
        )

    def _turn_in(self, now: dict[str, str], words: Mapping[str, str]) -> tuple[list[str], dict[str, str]]:
        """Turn the tool above the first cut, its tip where it is."""
        unknown = [c for c in self._turning if c not in now]
        if unknown:
            raise self._error(f"where {', '.join(unknown)} stands before the first cut isn't known", 0)
        if all(now[c] == words[c] for c in self._turning):
            return [], now
        if self.by_tip:
            # A ball that leans about its centre has its tip elsewhere: the way down stays straight.
            named = self._found(0)
            aside = [c for c in "XY" if c in now and c not in named and now[c] != words[c]]
            names = (*aside, *self._turning)
            return [self._rapid(names, words)], now | {c: words[c] for c in names}
        return self._turn_of_axes(now, words)

    def _turn_of_axes(
        self, now: dict[str, str], words: Mapping[str, str]
    ) -> tuple[list[str], dict[str, str]]:
        """Turn by axis words, in steps in which the linear axes follow the tip."""
        row = self.text.cuts.start - 1
        before = self.text.columns.at(slice(row, row + 1))
        if row < 0 or before.counting[0] != self.rows.counting[0] or not np.isfinite(before.values).all():
            raise self._error("where the tool stands before the first cut isn't known", 0)
        columns = self.machine.rotary_columns
        positions = before.positions()
        tip, _ = tool_poses(self.machine, positions)
        begin, end = positions[0, columns], self.placement.rotary[0]
        count = max(1, int(np.ceil(np.degrees(np.abs(end - begin)).max() / TURN_STEP)))
        share = np.linspace(0.0, 1.0, count + 1)[1:, None]
        rotary = begin + share * (end - begin)
        turned = linear_positions(self.machine, np.repeat(tip, count, axis=0), rotary)
        values = control_values(self.machine, turned)
        lines = []
        for row_words in self._words(values, rotary):
            names = [c for c in self.letters if row_words[c] != now.get(c)]
            lines.append(self._rapid(names, row_words))
            now = now | row_words
        return lines, now

    def _whole(self, names: list[str]) -> list[str]:
        """Return names of words with all components of the tool direction, if one is among them."""
        turns = any(name in self.directions for name in names)
        return [n for n in names if n not in self.directions] + list(self.directions) * turns

    def _rapid(self, names: Sequence[str], words: Mapping[str, str]) -> str:
        blocks = " ".join(self._word(n, words[n]) for n in names)
        return f"L {blocks} FMAX" if self.klartext else f"G0 {blocks}"

    def _turn_out(self, now: dict[str, str]) -> tuple[int, list[str]]:
        """Turn back after the operation's last retract, to where the program goes on from.

        Returned are the row of the operation after which it turns, and the lines.
        """
        columns, last = self.text.columns, self.text.cuts.stop - 1
        row, named = last, set[str]()
        for at in range(last + 1, len(columns.lines)):
            text = self.source.lines[int(columns.lines[at]) - 1]
            own = {match["name"].upper() for match in words_of(text)}
            same = columns.counting[at] == self.rows.counting[0] and columns.kinds[at] == MoveKind.RAPID
            if not same or own.intersection(self._turning) or columns.lines[at] == columns.lines[at - 1]:
                break
            row = at
            named |= own
        if row == last:
            return last, []
        back = self._words_at(columns.values[row], columns.vectors[row])
        # Without TCP the retract has its own words; what it doesn't name is still where the last cut was.
        wanted = self._turning if self.by_tip else [c for c in self.letters if c not in named]
        moved = [c for c in wanted if c in back and back[c] != now.get(c)]
        return row, [self._rapid(self._whole(moved), back)] if moved else []
