"""Faults in what turns, feeds and cools: feed, its unit, rapids, spindle, tool, offsets, coolant, unit."""

import re
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from planted.fault import Fault, Plant, Subject
from planted.words import IN_LIST, Text

FEED = re.compile(r"(?<= F)[\d.]+")
FEDRAT = re.compile(r"(?<=FEDRAT/)[\d.]+")
FEED_MODE = re.compile(r"\bG9[345]\b")
SENSE = re.compile(r"\bM[34]\b")
SPEED = re.compile(r"\bS8000\b")
SPEED_ALONE = re.compile(r" ?\bS8000 ?")
TOOL = re.compile(r"\bT5\b|(?<=TOOL CALL )5\b")
OTHER_TOOL = {"T5": "T6", "5": "6"}
CHANGE = re.compile(r"\bT5 .*M6\b|\bTOOL CALL 5\b")
COOLANT = re.compile(r"\bM8\b")
LENGTH = re.compile(r"\bH7\b")
LENGTH_ON = re.compile(r"\b(?:G43(?:\.[45])?|G234)(?: H7)?(?: |$)")
UNIT = re.compile(r"\bG21\b ?|\bG710\b ?|(?<=BEGIN PGM PROGRAM) MM|^UNITS/MM$")
OTHER_UNIT = {"G21": "G20", "G710": "G700", "MM": "INCH", "UNITS/MM": "UNITS/INCHES"}
WORK_OFFSET = re.compile(r"^G55$|^G505$|\bQ339=\+3\b")
OTHER_OFFSET = {"G55": "G56", "G505": "G506", "Q339=+3": "Q339=+4"}
# Blocks of a longer fault.
MANY = 20
# mm: shorter moves in the air are over before a speed matters.
FAR = 0.5


# --- feed --------------------------------------------------------------------------------------------------


def scaled(pattern: re.Pattern[str], factor: float) -> Callable[[str], str]:
    """Return the function that multiplies the number that a pattern finds."""
    return lambda line: pattern.sub(lambda m: f"{factor * float(m[0]):.6f}", line)


def listed(factor: float) -> Callable[[str], str]:
    """Return the function that multiplies the feed in a row of a list of points."""

    def change(row: str) -> str:
        *columns, value, cut, quick = row.split(",")
        return ",".join([*columns, f"{factor * float(value):.6f}", cut, quick])

    return change


def feed_of_program(*factors: float) -> Plant:
    """Every feed of the program wrong, as by a slip of units or an override that was left in."""

    def plant(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
        text = subject.text
        for factor in factors:
            if subject.control == "apt":
                yield text.rewritten(scaled(FEDRAT, factor), text.find(FEDRAT))
            elif subject.control == "points":
                yield text.rewritten(listed(factor), text.moves)
            else:
                yield text.rewritten(scaled(FEED, factor), text.find(FEED))

    return plant


def feed_of_block(factor: float) -> Plant:
    """The feed of one cut wrong, and right again in the next block."""

    def plant(subject: Subject, rng: np.random.Generator) -> Iterator[Text]:
        yield of_one_block(subject, int(rng.choice(subject.cutting)), factor)

    return plant


def feed_of_link(subject: Subject, rng: np.random.Generator) -> Iterator[Text]:
    """The feed of one link ten times as high, and right again in the next block."""
    links = sorted(set(feed_moves(subject)) - set(subject.cutting))
    if links:
        yield of_one_block(subject, int(rng.choice(links)), 10.0)


def goes_far(subject: Subject, text: Text) -> bool:
    """Check by measure whether the first move that differs is long enough to notice its speed."""
    was = subject.text.lines
    changed = next(i for i, line in enumerate(text.lines) if i >= len(was) or line != was[i])
    ways = [way for way in subject.measure.ways(text) if way.line >= changed]
    return bool(np.linalg.norm(ways[0].centre[-1] - ways[0].centre[0]) > FAR)


def of_one_block(subject: Subject, line: int, factor: float) -> Text:
    """Multiply the feed of one move: F is modal, so the next block states what was in force."""
    text = subject.text
    if subject.control == "apt":
        (stated, *_) = reversed(text.find(FEDRAT, 0, line))
        was = text.lines[stated]
        return text.inserted(line + 1, was).inserted(line, scaled(FEDRAT, factor)(was))
    if subject.control == "points":
        return text.rewritten(listed(factor), [line])
    (stated, *_) = reversed(text.find(FEED, 0, line + 1))
    (feed,) = FEED.findall(text.lines[stated])
    after = [i for i in text.moves if i > line][:1]
    if after and not text.is_rapid(after[0]) and not FEED.search(text.lines[after[0]]):
        text = text.rewritten(lambda was: f"{was} F{feed}", after)
    faulty = f"{factor * float(feed):.6f}"
    if stated == line:
        return text.rewritten(lambda was: FEED.sub(faulty, was), [line])
    return text.rewritten(lambda was: f"{was} F{faulty}", [line])


def feed_mode_wrong(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """F read as another quantity, from the first cut or from the middle: per minute, per rev, or inverse."""
    text = subject.text
    if subject.is_list:
        return
    if subject.is_klartext:
        # F in mm/rev.
        yield text.inserted(subject.cutting[0], "L M136")
        yield text.inserted(subject.middle, "L M136")
        return
    line = text.find(FEED_MODE, 0, subject.cutting[0])[-1]
    (stated,) = FEED_MODE.findall(text.lines[line])
    for other in {"G93", "G94", "G95"} - {stated}:
        yield text.rewritten(lambda was, other=other: FEED_MODE.sub(other, was), [line])
        yield text.inserted(subject.middle, other)


def feed_mode_lost(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """G93 lost, so that F, the inverse of a block's duration, is read in mm/min."""
    lines = [i for i in subject.text.find(FEED_MODE, 0, subject.cutting[0]) if subject.text.lines[i] == "G93"]
    for line in lines:
        yield subject.text.replaced(line)


# --- rapids ------------------------------------------------------------------------------------------------


def in_rapid(text: Text, lines: list[int]) -> Text:
    """Make moves rapid."""
    for line in reversed(lines):
        was = text.lines[line]
        if was.startswith("GOTO/"):
            text = text.inserted(line, "RAPID")
        elif IN_LIST.match(was):
            # The last columns: a cut or not, rapid or not.
            text = text.replaced(line, f"{was[:-3]}0,1")
        else:
            other = re.sub(r" F[\d.]+", "", was) + (" FMAX" if " R0" in was else "")
            text = text.replaced(line, other.replace("G1 ", "G0 "))
    return text


def rapid(subject: Subject, rng: np.random.Generator) -> Iterator[Text]:
    """One move at rapid: a cut, or any on the path."""
    yield in_rapid(subject.text, [int(rng.choice(subject.cutting))])
    yield in_rapid(subject.text, [int(rng.choice(feed_moves(subject)))])
    # Where there are moves in the air, one of them.
    air = sorted(set(feed_moves(subject)) - set(subject.cutting))
    if air:
        yield in_rapid(subject.text, [int(rng.choice(air))])


def rapids(subject: Subject, rng: np.random.Generator) -> Iterator[Text]:
    """A row of cuts at rapid, from anywhere, or from the first."""
    moves = feed_moves(subject)
    for begin in (0, int(rng.integers(len(moves) - MANY))):
        yield in_rapid(subject.text, moves[begin : begin + MANY])


def feed_moves(subject: Subject) -> list[int]:
    """Find the moves on the path that aren't rapid, but for the one to its first location."""
    return [line for line in subject.text.moves[1:] if not subject.text.is_rapid(line)]


def touches(subject: Subject, text: Text) -> bool:
    """Check by measure whether a rapid move touches material."""
    return subject.measure.touches_in_rapid(text)


# --- words of the head, and words where they don't belong --------------------------------------------------


def exchanged(pattern: re.Pattern[str], *others: str | Mapping[str, str]) -> Plant:
    """Put another text where a pattern finds one before the first cut; the line goes if nothing is left."""

    def plant(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
        text = subject.text
        lines = text.find(pattern, 0, subject.cutting[0])
        for other in others if lines else ():
            was = text.lines[lines[0]]
            word = pattern.search(was)
            assert word is not None
            key = word[0].strip()
            new = other if isinstance(other, str) else word[0].replace(key, other[key])
            left = pattern.sub(new, was).rstrip()
            empty = re.fullmatch(r"(?:\d+ )?(?:L|G0|TOOL CALL Z)?", left)
            yield (text.replaced(lines[0]) if empty else text.replaced(lines[0], left)).numbered()

    return plant


def lost(pattern: re.Pattern[str]) -> Plant:
    """Take out the line that a pattern finds before the first cut."""

    def plant(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
        for line in subject.text.find(pattern, 0, subject.cutting[0])[:1]:
            yield subject.text.replaced(line).numbered()

    return plant


def put(iso: tuple[str, ...], klartext: tuple[str, ...], **controls: tuple[str, ...]) -> Plant:
    """Put lines into the middle of the cuts, in the words of each control."""

    def plant(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
        usual = klartext if subject.is_klartext else iso
        texts = controls.get(subject.control.split("-")[0], usual)
        if texts and not subject.is_list:
            yield subject.text.inserted(subject.middle, *texts)

    return plant


def both(*plants: Plant) -> Plant:
    """Plant each of some variants."""

    def plant(subject: Subject, rng: np.random.Generator) -> Iterator[Text]:
        for one in plants:
            yield from one(subject, rng)

    return plant


def other_sense(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """The spindle turns in the other sense."""
    text = subject.text
    for line in text.find(SENSE, 0, subject.cutting[0])[:1]:
        yield text.rewritten(lambda was: SENSE.sub(lambda m: "M4" if m[0] == "M3" else "M3", was), [line])


def offset_lost(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """The work offset isn't set."""
    text = subject.text
    for line in text.find(WORK_OFFSET, 0, subject.cutting[0])[:1]:
        left = text.replaced(line)
        yield (left.replaced(line - 1) if subject.is_klartext else left).numbered()


def late_spindle(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """The spindle is switched on after some cuts."""
    text = subject.text
    for line in text.find(SENSE, 0, subject.cutting[0])[:1]:
        words = SENSE.findall(text.lines[line])
        word = f"L {words[0]}" if subject.is_klartext else words[0]
        left = SENSE.sub("", text.lines[line]).strip()
        late = text.inserted(subject.cutting[5], word)
        yield (late.replaced(line) if subject.is_klartext else late.replaced(line, left)).numbered()


def other_length(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """The length offset of another tool, a length with a slip, none, or one put in or cancelled in a cut."""
    text, begin = subject.text, subject.cutting[0]

    def each(change: Callable[[str], str], lines: list[int]) -> Iterator[Text]:
        if lines:
            yield text.rewritten(change, lines)

    if subject.is_klartext:
        calls = text.find(re.compile("TOOL CALL 5 Z"), 0, begin)
        yield from each(lambda was: f"{was} DL+2", calls)
    elif subject.control == "sinumerik":
        yield from each(lambda was: was.replace("D1", "D2"), text.find(re.compile(r"\bD1\b"), 0, begin))
        yield from each(lambda was: was.replace("D1", "D0"), text.find(re.compile(r"\bD1\b"), 0, begin))
        yield text.inserted(subject.middle, "D2")
        yield text.inserted(subject.middle, "D0")
    elif not subject.is_list:
        on = text.find(LENGTH_ON, 0, begin)
        for other in ("H8", "H0"):
            yield from each(lambda was, other=other: LENGTH.sub(other, was), text.find(LENGTH, 0, begin))
        yield from each(lambda was: was.replace(" H7", ""), text.find(LENGTH, 0, begin))
        word = LENGTH_ON.search(text.lines[on[0]])
        assert word is not None
        alone = word[0].split()[0]
        if LENGTH.search(text.lines[on[0]]) is None:
            yield from each(lambda was: was.replace(alone, f"{alone} H8"), on)
        if alone == "G43":
            yield from each(lambda was: LENGTH_ON.sub("", was).strip() or "G17", on)
        yield text.inserted(subject.middle, f"{alone} H8")
        yield text.inserted(subject.middle, "G49")


# The feed of a whole program always matters: slow by 25.4 or 60 is a unit's slip. In one block a tool breaks
# at ten times its feed; at a tenth it rubs, which a warning tells.
FAULTS = (
    Fault("feed of program", "feed", feed_of_program(10.0, 2.0, 1.0 / 60.0, 1.0 / 25.4)),
    Fault("feed of block, fast", "feed", feed_of_block(10.0), drawn=True),
    Fault("feed of block, slow", "feed", feed_of_block(0.1), warned=True, drawn=True),
    # In the air a speed matters where the move is long enough to reach it.
    Fault("feed of link, fast", "feed", feed_of_link, goes_far, drawn=True),
    # Always: F is then another quantity. A G94 that is lost isn't planted: it is every control's default.
    Fault("feed mode wrong", "feed", feed_mode_wrong),
    Fault("feed mode lost", "feed", feed_mode_lost),
    # A rapid matters where it lies on a cut or ends on one; in the air, and on the way off a cut, it doesn't.
    Fault("rapid, one block", "rapid", rapid, touches, drawn=True),
    Fault("rapid, 20 blocks", "rapid", rapids, touches, drawn=True),
    # Always: the job asks for a speed and a sense, and every program cuts.
    Fault("spindle not on", "spindle", both(exchanged(SENSE, ""), lost(SENSE))),
    Fault("spindle on late", "spindle", late_spindle),
    Fault("spindle off in cut", "spindle", put(("M5",), ("L M5",))),
    Fault("spindle sense", "spindle", other_sense),
    Fault("spindle speed", "spindle", exchanged(SPEED, "S0", "S16000", "S800")),
    Fault("spindle speed lost", "spindle", exchanged(SPEED_ALONE, "")),
    # Always: the job names the tool.
    Fault("other tool", "tool", exchanged(TOOL, OTHER_TOOL)),
    Fault("tool change lost", "tool", both(lost(CHANGE), exchanged(re.compile(r" (?:D1 )?M6\b"), ""))),
    Fault(
        "tool change in cut",
        "tool",
        both(
            put(("T5 M6",), ("TOOL CALL 5 Z S8000",), sinumerik=("T5 D1 M6",)),
            put(("T6 M6",), ("TOOL CALL 6 Z S8000",), sinumerik=("T6 D1 M6",)),
        ),
    ),
    # Always: another length is another depth, and tool lengths are unlike.
    Fault("tool length", "offsets", other_length),
    # Always: the job names the work offset. Without its word the default is in force, which is another.
    Fault("other work offset", "offsets", exchanged(WORK_OFFSET, OTHER_OFFSET)),
    Fault("work offset lost", "offsets", offset_lost),
    Fault(
        "work offset in cut",
        "offsets",
        put(("G54",), ("CYCL DEF 247 DATUM SETTING ~", "    Q339=+4 ; DATUM NUMBER")),
    ),
    # Always, as it was asked for; a tool's edge is lost, so a warning tells it.
    Fault("coolant not on", "coolant", lost(COOLANT), warned=True),
    Fault("coolant off in cut", "coolant", put(("M9",), ("L M9",)), warned=True),
    # A unit that isn't stated is what the control was left in: it is told. The other unit scales the part.
    Fault("unit lost", "unit", exchanged(UNIT, ""), warned=True),
    Fault("other unit", "unit", exchanged(UNIT, OTHER_UNIT)),
)
