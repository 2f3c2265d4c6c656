"""The blocks around the moves, and what they put in force: modes, tool, spindle, coolant, approach, end."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from fiveaxis.base import SettingError
from fiveaxis.model import Phase, ProgramMotion
from fiveaxis.nc.control.technology import Technology, read_technology
from fiveaxis.nc.control.words_in_force import PLANES, TCP
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.source import Source
from fiveaxis.nc.words import control_value, feed_text
from fiveaxis.nc.writing.feeds import SECONDS, feed_form, feed_millimetres
from fiveaxis.nc.writing.header import contains_length
from fiveaxis.nc.writing.program_settings import ProgramSettings, spindle_text
from fiveaxis.nc.writing.tables import DIALECTS, Dialect
from fiveaxis.nc.writing.turns import TURN, first_words, modulo_templates
from fiveaxis.nc.writing.word_writer import WordWriter

# Lines without block number: ends of the tape, and the program number.
_UNNUMBERED = re.compile(r"%|O[0-9]")

# A line of a program, and the row of its motion at which its move ends.
Line = tuple[str, int]
NO_ROW = -1

# Defaults for a number or name that a control needs.
ASSUMED_NUMBER, ASSUMED_NAME = 1, "PROGRAM"


@dataclass(frozen=True, eq=False)
class StartAndEnd:
    """Writes the blocks around the moves of a program."""

    writer: WordWriter
    settings: ProgramSettings
    winding: str

    @property
    def rotary(self) -> str:
        """Letters of the rotary axes."""
        return "".join(c for c in self.writer.machine.letters if c in "ABC")

    @property
    def offset(self) -> int:
        """Number of the tool's length offset."""
        given = (self.settings.length_offset, self.settings.tool_number, ASSUMED_NUMBER)
        return next(number for number in given if number is not None)

    def head(self) -> list[str]:
        """Lines before the comments."""
        return self._fill(self.writer.dialect.head)

    def modes(self) -> list[str]:
        """Modes, work offset, retract, tool, spindle, coolant: all before the first move on the workpiece."""
        dialect, settings = self.writer.dialect, self.settings
        lines = [*self.reset(), *self._fill((*dialect.safe_start, *dialect.smoothing))]
        offset = self.work_offset
        lines += dialect.work_offset.format(offset=offset).splitlines() if offset else []
        lines += self._retract()
        if settings.tool_number is not None:
            lines += dialect.tool_change.format(tool=settings.tool_number).splitlines()
        lines += self._fill(dialect.unclamp)
        if settings.spindle_rpm is not None:
            left = settings.spindle_direction == "left"
            template = dialect.spindle_left if left else dialect.spindle
            lines += template.format(rpm=spindle_text(settings.spindle_rpm, dialect)).splitlines()
        if settings.coolant is not None:
            lines += dialect.coolant[settings.coolant].splitlines()
        if self.winding == "rezero" and dialect.reset is not None and dialect.reset.clear not in lines:
            lines.append(dialect.reset.clear)
        if self.winding == "modulo" and dialect.modulo is not None:
            lines += dialect.modulo.on
        return lines

    def reset(self) -> list[str]:
        """Switch off the mode of the coordinates first, where the control's safe start doesn't.

        Under TCP, which an earlier program or LinuxCNC's start may have left on, G53 moves the tip there.
        """
        dialect, off = self.writer.dialect, self._fill(self.writer.mode.off)
        known = cancelled_by(dialect)[1]
        return off if _switched_off(dialect, off, off)[1].keys() - known.keys() else []

    def before_cuts(self) -> list[str]:
        """Lines that put in force what is needed in the cuts, without their positions."""
        form = feed_form(self.writer).word
        return [*self.head(), *self.modes(), *self._on(), self._first("X0"), *([form] if form else [])]

    def in_force(self) -> list[str]:
        """Lines that set modes, offsets, tool, spindle and coolant, without moves on the workpiece."""
        first, form = self._first_template(), feed_form(self.writer).word
        length = [] if first is None else [first.format(words="", offset=self.offset).strip()]
        return [*self.modes(), *self._on(), *length, *([form] if form else [])]

    @property
    def work_offset(self) -> str:
        """The control's word for the work offset; empty if it has none."""
        return self.settings.work_offset or self.writer.dialect.default_offset or ""

    def start(self, program: ProgramMotion) -> tuple[tuple[str, float], ...]:
        """Return where the approach leads, in the control's words and in the order in which the axes move.

        Returns
        -------
        Letter and value, deg, and mm or inch
        """
        at = program.first - (program.phase[program.first] == Phase.LEAD_IN)
        begin = program.motion.positions[at : at + 1]
        by_axes = self._by_axes
        turned = by_axes.rounded(first_words(by_axes.values(begin), by_axes, self.winding))[0]
        placed = self.writer.rounded(self.writer.values(begin))[0]
        angles = dict(zip(by_axes.names, turned.tolist(), strict=True))
        values = dict(zip(self.writer.names, placed.tolist(), strict=True))
        return tuple((c, angles[c]) for c in self.rotary) + tuple(
            (c, values[c]) for c in by_axes.names if c in "XYZ"
        )

    @property
    def _by_axes(self) -> WordWriter:
        """The words of axis positions, which rotary axes have before TCP is on."""
        return WordWriter(self.writer.dialect, "axes", self.writer.machine, self.writer.unit)

    def approach(self, program: ProgramMotion) -> Iterator[Line]:
        """Write the rapid approach to the first location, and the lead-in to a first cut."""
        writer, machine, first = self.writer, self.writer.machine, program.first
        has_lead_in = program.phase[first] == Phase.LEAD_IN
        at = first - has_lead_in
        positions = program.motion.positions
        begin = positions[at : at + 1]
        by_axes = self._by_axes
        start = first_words(by_axes.values(begin), by_axes, self.winding)[0]
        yield from ((line, NO_ROW) for line in (() if writer.coordinates != "axes" else self._on()))
        for axis, value in machine.clamped:
            words = f"{axis.letter}{control_value(axis, value):.{writer.dialect.number.rotary}f}"
            yield self._rapid(words), NO_ROW
        if turn := by_axes.words(start, only=self.rotary):
            yield self._rapid(turn), NO_ROW
        if writer.coordinates == "axes":
            above, *down = [w for w in (by_axes.words(start, only=group) for group in ("XY", "Z")) if w]
            yield (self._rapid(above), 0) if down else (self._first(above), at)
            yield from ((self._first(words), at) for words in down)
        else:
            yield from ((line, NO_ROW) for line in self._on())
            # To straight above the first location, then down along Z of the machine.
            ends = writer.values(positions[[0, at]])
            yield self._first(writer.words(ends[0], only="XYZ")), 0
            yield self._rapid(writer.words(ends[1], only="XYZ")), at
        if word := feed_form(writer).word:
            yield word, NO_ROW
        if has_lead_in:
            yield self._lead_in(program), first

    def _lead_in(self, program: ProgramMotion) -> str:
        writer, first = self.writer, program.first
        # A signed word of the angle at which an axis already is might be a whole turn.
        modulo = writer.dialect.modulo if self.winding == "modulo" else None
        omitted = self.rotary if modulo is not None and (modulo.way == "signed" or modulo.word) else ""
        moved = "".join(c for c in writer.machine.letters if c not in omitted)
        position = program.motion.positions[first : first + 1]
        target = first_words(writer.values(position), writer, self.winding)[0]
        words = writer.words(target, only="XYZ" if writer.coordinates != "axes" else moved)
        return self._lead(words, program, first)

    def lead_out(self, program: ProgramMotion) -> Iterator[Line]:
        """Write the lead-out of a last cut, at its feed, with the rotary axes at rest."""
        row = program.last + 1
        if row == len(program) or program.phase[row] != Phase.LEAD_OUT:
            return
        position = program.motion.positions[row : row + 1]
        # Tool directions are repeated: not every control keeps them.
        only = None if self.writer.coordinates == "vector" else "XYZ"
        words = self.writer.words(self.writer.values(position)[0], only=only)
        yield self._lead(words, program, row), row

    def end(self) -> list[str]:
        """Reset modes, retract, switch off spindle and coolant, and go home.

        Rotary words from 0 to 360 turn an axis home the way that they turn it in the cuts.
        """
        writer, dialect, settings = self.writer, self.writer.dialect, self.settings
        lines = [dialect.reset.clear] if self.winding == "rezero" and dialect.reset is not None else []
        normal = dialect.feed.get("per_minute")
        lines += [normal.word] if writer.mode.feed == "inverse_time" and normal and normal.word else []
        lines += self._fill(writer.mode.off)
        lines += self._fill(dialect.after_tcp) if writer.coordinates != "axes" else []
        home = [self._machine_move(dict.fromkeys(group, 0.0)) for group in settings.home.split()]
        clear = self._retract() or (home[:1] if settings.goes_clear else [])
        lines += [*clear, *(self._fill(writer.mode.off_clear) if clear else [])]
        # The spindle stops once the tool is clear.
        lines += [block for block in (dialect.spindle_off, dialect.coolant_off) if block]
        lines += home if settings.retract is not None else home[1:]
        if self.winding == "modulo" and dialect.modulo is not None:
            lines += dialect.modulo.off
        return lines + self._fill(dialect.end)

    def wound(self, program: ProgramMotion) -> list[str]:
        """Return notes on rotary axes that end more than a turn from zero, and turn all of it back."""
        machine, ends = self.writer.machine, program.motion.positions[-1:]
        if self.winding != "unwound" or self.writer.coordinates == "vector":
            return []
        degrees = self._by_axes.values(ends)[0]
        return [
            f"ends with {machine.letters[c]} at {degrees[c]:.0f} deg, from where "
            f"{'home' if machine.letters[c] in self.settings.home else 'the next move'} turns it back"
            for c in machine.rotary_columns
            if abs(degrees[c]) > TURN
        ]

    def assumptions(self) -> list[str]:
        """Return notes on numbers that the control needs and that are assumed."""
        notes = []
        dialect, settings = self.writer.dialect, self.settings
        on = (*self._on_templates(), self._first_template() or "")
        if any("{offset}" in block for block in on) and (
            settings.length_offset is None and settings.tool_number is None
        ):
            notes.append(f"no tool number was given: H{self.offset} is written")
        if any("{number}" in line for line in dialect.head) and settings.number is None:
            notes.append(f"no program number was given: {ASSUMED_NUMBER} is written")
        rpm = settings.spindle_rpm
        if rpm is not None and float(spindle := spindle_text(rpm, dialect)) != rpm:
            notes.append(
                f"the spindle speed {rpm:.9g} has decimals that S has none of: S{spindle} is written"
            )
        return notes

    @property
    def _contains_length(self) -> bool:
        contained = self.writer.coordinates == "axes" and contains_length(self.writer.machine)
        return contained and self.writer.mode.on_contained is not None

    def _on_templates(self) -> tuple[str, ...]:
        mode = self.writer.mode
        return (mode.on_contained or ()) if self._contains_length else mode.on

    def _first_template(self) -> str | None:
        return None if self._contains_length else self.writer.mode.first

    def _on(self) -> list[str]:
        return self._fill(self._on_templates())

    def _fill(self, templates: Iterable[str]) -> list[str]:
        settings, dialect = self.settings, self.writer.dialect
        number = settings.number if settings.number is not None else ASSUMED_NUMBER
        values = {
            "unit": dialect.unit[settings.unit],
            "name": name_word(settings.name or ""),
            "number": f"{number:04d}",
            "offset": self.offset,
        }
        return [line for template in templates for line in template.format(**values).splitlines()]

    def _first(self, words: str) -> str:
        template = self._first_template()
        return self._rapid(words) if template is None else template.format(words=words, offset=self.offset)

    def _rapid(self, words: str) -> str:
        return self.writer.dialect.rapid.format(words=words)

    def _retract(self) -> list[str]:
        return [] if self.settings.retract is None else [self._machine_move({"Z": self.settings.retract})]

    def _machine_move(self, targets: dict[str, float]) -> str:
        number = self.writer.dialect.number
        sign = "+" if number.plus else ""
        scale = MILLIMETRES[self.writer.unit]
        by_axes = self._by_axes
        templates = dict(zip(by_axes.names, modulo_templates(by_axes, self.winding), strict=True))
        words = (
            (templates.get(letter) or "{letter}{value}").format(
                letter=letter, value=f"{value / (scale if letter in 'XYZ' else 1.0):{sign}.{number.linear}f}"
            )
            for letter, value in targets.items()
        )
        return self.writer.dialect.machine_move.format(words=" ".join(words))

    def _lead(self, words: str, program: ProgramMotion, row: int) -> str:
        """Write a lead-in or lead-out, the linear move to a row."""
        writer, form = self.writer, feed_form(self.writer)
        per_minute = float(program.motion.feed[row]) * SECONDS / feed_millimetres(writer)
        inverse = SECONDS / float(program.motion.time[row])
        feed = inverse if writer.mode.feed == "inverse_time" else per_minute
        # Clamped to the control's range, as a lead must not make the program fail.
        feed = min(max(feed, form.least or 0.0), form.most or np.inf)
        return writer.linear.format(words=words, feed=feed_text(feed, form))


def name_word(name: str) -> str:
    """Convert to a name that every control accepts: capitals, digits and ``_``, a letter first."""
    kept = "".join(c if c.isascii() and c.isalnum() else "_" for c in name.upper())[:24]
    return kept if kept[:1].isalpha() else f"P{kept}" if kept else ASSUMED_NAME


def numbered(lines: list[str], writer: WordWriter, step: int | None) -> Iterator[str]:
    """Put block numbers before lines: before those that aren't comments, or all, depending on the control.

    `SettingError` if the control numbers all lines, and there are more than its largest number.
    """
    dialect = writer.dialect
    if step is None and not dialect.numbered:
        yield from lines
        return
    template, most = dialect.line_number, dialect.most_number
    begin, end = template.split("{n}")
    if dialect.numbered and len(lines) > most:
        raise SettingError(
            f"{len(lines)} lines, and control {dialect.name!r} numbers at most {most}; write several programs"
        )
    opening = dialect.comment.template.partition("{}")[0].strip()
    number = 0 if dialect.numbered else (step or 1)
    goes_on = False
    for line in lines:
        bare = not dialect.numbered and (line.startswith(opening) or _UNNUMBERED.match(line))
        continues, goes_on = goes_on, bool(dialect.continuation) and line.endswith(dialect.continuation)
        if bare or continues:
            yield line
            continue
        yield f"{begin}{number}{end}{line}"
        # Numbers start again after the largest.
        number = number + (1 if dialect.numbered else step or 1)
        number = number if number <= most else (step or 1)


def cancelled_by(dialect: Dialect) -> tuple[str, dict[str, str]]:
    """Return the language of a control, and what its safe start switches off: mode -> the block that does."""
    fields = {"unit": next(iter(dialect.unit.values())), "name": ASSUMED_NAME, "number": "1"}
    templates = (*dialect.head, *dialect.safe_start, *dialect.smoothing, *dialect.unclamp)
    lines = [line for template in templates for line in template.format(**fields).splitlines()]
    texts = [line for template in templates for line in template.format(**fields | {"unit": ""}).splitlines()]
    return _switched_off(dialect, lines, texts)


def _switched_off(dialect: Dialect, lines: list[str], texts: list[str]) -> tuple[str, dict[str, str]]:
    """Return a control's language, and what lines switch off: mode -> the text of the line that does."""
    reader = read_technology(Source(f"program{dialect.suffix}", lines))
    return reader.language.name, {mode: texts[at - 1].strip() for mode, at in reader.cancelled.items()}


@cache
def usually_cancelled(language: str) -> dict[str, str]:
    """Return what the safe starts of all controls of a language switch off: mode -> the block that does."""
    programs = (dialect for dialect in DIALECTS.values() if dialect.language == "blocks")
    tables = [modes for spoken, modes in map(cancelled_by, programs) if spoken == language]
    return (
        {mode: text for mode, text in tables[0].items() if all(mode in t for t in tables)} if tables else {}
    )


@dataclass(frozen=True)
class RequiredTechnology:
    """What has to be in force in every cut.

    Parameters
    ----------
    control, language : of its programs
    technology : spindle and tool as in the settings, offsets and coolant as the control's words for the
        settings put them in force
    cancelled : modes that the start of its programs switches off, with the block that does
    ended : modes that its end switches off, likewise
    spindle, tool, coolant : whether the settings give them; what they don't give isn't checked
    before, after : mm, where Z may go in machine coordinates before the cuts, and after them; none if
        nobody asked for a retract there
    harmless : patterns of words that are no fault in a cut, beside those of `Technology.words`
    """

    control: str
    language: str
    technology: Technology
    spindle: bool
    tool: bool
    coolant: bool
    cancelled: Mapping[str, str]
    ended: Mapping[str, str]
    before: tuple[float, ...] = ()
    after: tuple[float, ...] = ()
    harmless: tuple[str, ...] = ()

    @classmethod
    def of(cls, writer: WordWriter, settings: ProgramSettings) -> RequiredTechnology | None:
        """Read what the head of a control's program puts in force; None for a list of cutter locations."""
        dialect = writer.dialect
        if dialect.language != "blocks":
            return None
        around = StartAndEnd(writer, settings, "unwound")
        reset, end = around.reset(), [*around.head(), *around.end()]
        reader = read_technology(Source(f"program{dialect.suffix}", around.before_cuts()))
        technology = reader.now
        retract = () if settings.retract is None else (settings.retract,)
        # Numbers are those of the settings, whatever the table makes of them.
        if settings.spindle_rpm is not None:
            sense = -1.0 if settings.spindle_direction == "left" else 1.0
            technology = technology._replace(speed=settings.spindle_rpm, sense=sense)
        if settings.tool_number is not None:
            technology = technology._replace(tool=str(settings.tool_number))
        return cls(
            control=dialect.name,
            language=reader.language.name,
            technology=technology,
            spindle=settings.spindle_rpm is not None,
            tool=settings.tool_number is not None,
            coolant=settings.coolant is not None,
            cancelled=_switched_off(dialect, reset, reset)[1] | cancelled_by(dialect)[1],
            ended=_switched_off(dialect, end, end)[1],
            before=retract,
            after=(*retract, *((0.0,) if "Z" in settings.home else ())),
            harmless=dialect.harmless,
        )


@cache
def usual_words(language: str, control: str = "") -> tuple[frozenset[str], tuple[str, ...]]:
    """Return the words that tables put in force, and their patterns of harmless ones.

    Parameters
    ----------
    language : of the tables
    control : name of the only one; by default all of the language
    """
    words: set[str] = set()
    harmless: list[str] = []
    for dialect in [DIALECTS[control]] if control in DIALECTS else DIALECTS.values():
        for mode in dialect.modes.values() if dialect.language == "blocks" else ():
            lines = [*dialect.head, *dialect.safe_start, *dialect.smoothing, *mode.on]
            texts = [
                line.format(unit=dialect.unit["mm"], name=ASSUMED_NAME, number=1, offset=1) for line in lines
            ]
            reader = read_technology(Source(f"program{dialect.suffix}", texts))
            if reader.language.name == language:
                words.update(reader.now.words)
                harmless += dialect.harmless
    # Arcs are followed in any plane, and TCP by all of its words.
    followed = (*PLANES, *TCP)
    return frozenset(words), tuple(dict.fromkeys((*harmless, *map(re.escape, followed))))
