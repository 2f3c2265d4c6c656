"""APT cutter locations: the CLSF files of NX, NCL of Creo, APT of SolidWorks and CAMWorks, and of CATIA.

Supported are ``GOTO``, ``FROM`` and ``GOHOME`` (3 numbers, or 6 with a tool vector), ``GODLTA``, ``RAPID``
(for the next move only), arcs (`fiveaxis.nc.apt.arcs`), drilling cycles (`fiveaxis.nc.apt.cycles`), frames
(`fiveaxis.nc.apt.frames`), tools (`fiveaxis.nc.apt.tools`), ``FEDRAT``, ``SPINDL`` (for feeds per
revolution), ``UNITS``. A tool vector is modal until the next one, ``TLAXIS`` or ``MULTAX/OFF``; before the
first it is 0, 0, 1. In files of Creo a ``GOTO`` of 3 numbers always means 0, 0, 1. Unsupported words that may
move the tool are refused, all others are counted.
"""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from fiveaxis.base import Array, Finding, IntArray, Severity
from fiveaxis.model import MoveKind, Toolpath
from fiveaxis.nc.apt.feedrate import Feeds
from fiveaxis.nc.apt.frames import FRAME_WORDS, Frames
from fiveaxis.nc.apt.moves import Moves
from fiveaxis.nc.apt.statements import CREO, LONGEST_SHOWN, Statement, statements
from fiveaxis.nc.apt.tools import Tools
from fiveaxis.nc.operations import Work
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.rows import DEFAULT_FEED, MILLIMETRES, require_finite, scale_positions, unit_axes
from fiveaxis.nc.source import Source
from fiveaxis.nc.units import Size, Units


def read_apt(source: Source, options: ReadOptions) -> Toolpath:
    """Read a toolpath from APT statements, with the options' tool, feed and unit.

    A location before the first ``FEDRAT`` has the feed of that one, a rapid move the feed in force; without
    any feed in the file it is 1000 mm/min. Assumptions are among the path's findings.

    `ToolpathError`, with file and line, for no ``GOTO``, an invalid statement, an unsupported one that may
    move the tool, mixed units, or arcs that don't fit; `ToolError` if neither the caller nor the file
    specifies a supported tool.
    """
    units = Units(source, options.unit)
    reader = _Reader(source, units, Feeds(units, options.feed_mm_min))
    for statement in statements(source):
        if reader.ended:
            reader.ignored["statements after FINI"] += 1
        else:
            reader.process(statement)
    unit, doubts = units.judge(reader.size(), options.machine)
    path = reader.finish(options) if unit == units.now else read_apt(source, replace(options, unit=unit))
    return replace(path, findings=(*path.findings, *doubts))


@dataclass
class _Reader:
    """State of the file while it is read, statement by statement."""

    source: Source
    units: Units
    feeds: Feeds
    ignored: Counter[str] = field(default_factory=Counter)
    findings: list[Finding] = field(default_factory=list)
    compensated: bool = False
    ended: bool = False

    def __post_init__(self) -> None:
        self.frames = Frames()
        self.tools = Tools(self.source)
        self.moves = Moves(self.units, self.feeds, self.frames)

    def process(self, statement: Statement) -> None:
        """Act on a statement; one without an action is counted, unless that would lose a move."""
        word = statement.word
        if word == "GOTO":
            self.moves.go(statement)
            return
        self.moves.end_arc()
        if word.startswith(CREO):
            self.moves.creo = True
        action = ACTIONS.get(word)
        if action is None:
            _require_harmless(statement)
        else:
            action(self, statement)
        if action is None or word in COUNTED:
            self.ignored[word[:LONGEST_SHOWN]] += 1

    def set_axis(self, statement: Statement) -> None:
        """Process ``TLAXIS``, the tool vector of moves that aren't multi-axis."""
        numbers = statement.numbers()
        if len(numbers) != 3:
            raise statement.error("needs a tool vector of 3 numbers")
        self.moves.upright = numbers
        self.moves.set_vector(numbers)

    def set_multiaxis(self, statement: Statement) -> None:
        """Process ``MULTAX``."""
        if statement.minors == ["OFF"]:
            self.moves.vector = self.moves.upright

    def go_home(self, statement: Statement) -> None:
        """Process ``GOHOME``, which moves if it has a position."""
        if statement.minors:
            self.moves.jump(statement)
        else:
            self.ignored[statement.word] += 1

    def set_spindle(self, statement: Statement) -> None:
        """Process ``SPINDL``."""
        self.feeds.set_spindle(statement.minors)
        self.tools.run_spindle(statement, self.feeds.spindle, len(self.moves.rows))

    def set_compensation(self, statement: Statement) -> None:
        """Process ``CUTCOM``: note its first use."""
        if statement.minors[:1] not in ([], ["OFF"]) and not self.compensated:
            self.compensated = True
            text = "CUTCOM is on; positions are read as written"
            self.findings.append(statement.note("cutter-compensation", text))

    @property
    def _begun(self) -> bool:
        return len(self.moves.rows) > 0

    def size(self) -> Size:
        """Return the sizes that show the unit."""
        positions, _, kinds, _, _ = self.moves.rows.columns()
        cuts = positions[kinds == MoveKind.CUT]
        self.tools.use(int(np.argmax(kinds == MoveKind.CUT)) if len(cuts) else 0)
        spread = float(np.ptp(cuts, axis=0).max()) if len(cuts) and np.isfinite(cuts).all() else 0.0
        return Size(spread, self.feeds.highest, self.tools.diameter())

    def finish(self, options: ReadOptions) -> Toolpath:
        """Return the path of all locations read."""
        moves = self.moves
        moves.end_arc()
        if not moves.moved:
            raise self.source.error("no GOTO: the file holds no cutter locations")
        if moves.arc is not None:
            raise moves.arc.statement.error("has no GOTO to end at")
        positions, vectors, kinds, feeds, lines = moves.rows.columns()
        require_finite(positions, ["x", "y", "z"], lines, self.source)
        axes = unit_axes(vectors, lines, self.source)
        self.frames.apply(positions, axes)
        unit = self.units.settle()
        states, state = self.tools.states(len(lines))
        drilled = np.isin(lines, list(moves.drilled))
        work = Work(self.source, "APT", lines, kinds, axes, states, state, drilled, unit=unit)
        operation, rows = work.take(options.number)
        positions, axes, feeds = positions[rows], axes[rows], feeds[rows]
        kinds, lines = kinds[rows], lines[rows]
        self.tools.use(rows.start + int(np.argmax(kinds == MoveKind.CUT)))
        tool, findings = self.tools.settle(options, MILLIMETRES[unit])
        path = Toolpath.from_tips(
            scale_positions(positions, unit, lines, self.source),
            axes,
            tool,
            feed_mm_min=self.feeds.fill(feeds),
            kind=kinds,
            source=lines,
            name=self.source.name,
            ignored=self.ignored,
            findings=(
                *findings,
                *self.frames.findings,
                *moves.findings,
                *self.findings,
                *self._assumed(kinds, feeds, lines),
            ),
        )
        return replace(path, operation=operation)

    def _assumed(self, kinds: IntArray, feeds: Array, lines: IntArray) -> list[Finding]:
        """Return findings on what a file leaves open; feeds, (n,) mm/min, are NaN where none is known."""
        moves, source, found = self.moves, self.source, []
        if self.units.stated is None and self.units.given is None:
            found.append(self.units.assumed(self.size(), Severity.NOTE, " (UNITS)"))
        unknown = np.flatnonzero(np.isnan(feeds) & (kinds == MoveKind.CUT))
        if len(unknown) and self.feeds.override is None:
            used = self.feeds.first or DEFAULT_FEED
            text = f"{len(unknown)} cuts have no FEDRAT before them; {used:g} mm/min is used"
            found.append(source.finding(Severity.NOTE, "feed-assumed", text, int(lines[unknown[0]])))
        if moves.vector_row and not moves.creo:
            text = f"{moves.vector_row} locations come before the first tool vector; 0, 0, 1 is used"
            found.append(source.finding(Severity.NOTE, "axis-assumed", text, int(lines[0])))
        if moves.against > moves.along:
            text = (
                f"{moves.against} arcs begin against the direction of the move before them, {moves.along} "
                "along it: the file may mean the opposite direction of arcs; let the CAM system write GOTO "
                "points"
            )
            found.append(source.finding(Severity.WARNING, "arc-direction", text, None, float(moves.against)))
        return found


Action = Callable[[_Reader, Statement], object]
ACTIONS: dict[str, Action] = {
    "FROM": lambda r, s: r.moves.jump(s),
    "GOHOME": _Reader.go_home,
    "GODLTA": lambda r, s: r.moves.go_by(s),
    "RAPID": lambda r, s: setattr(r.moves, "rapid", s.minors != ["OFF"]),
    "CIRCLE": lambda r, s: r.moves.start_arc(s),
    "MOVARC": lambda r, s: r.moves.start_arc(s),
    "INDIRV": lambda r, s: r.moves.set_direction(s),
    "TLON,GOFWD": lambda r, s: r.moves.follow(s),
    "CYCLE": lambda r, s: r.moves.set_cycle(s),
    "TLAXIS": _Reader.set_axis,
    "MULTAX": _Reader.set_multiaxis,
    "FEDRAT": lambda r, s: r.feeds.state(s.minors, s.line),
    "SPINDL": _Reader.set_spindle,
    "COOLNT": lambda r, s: r.tools.cool(s, len(r.moves.rows)),
    "CUTCOM": _Reader.set_compensation,
    # No post reads on.
    "FINI": lambda r, _: setattr(r, "ended", r._begun),
    "TRNTYP": lambda r, s: r.frames.set_type(s),
    **dict.fromkeys(("UNIT", "UNITS"), lambda r, s: r.units.state(s.minors, s.line)),
    **dict.fromkeys(("CUTTER", "TLDATA", f"{CREO}CUTTER"), lambda r, s: r.tools.state(s, len(r.moves.rows))),
    **dict.fromkeys(("LOAD", "LOADTL"), lambda r, s: r.tools.load(s, len(r.moves.rows))),
    **dict.fromkeys(FRAME_WORDS, lambda r, s: r.frames.state(s, len(r.moves.rows))),
}

# Words that are used only in part are counted too.
COUNTED = {"FINI", "SPINDL", "COOLNT", "MULTAX", "CUTCOM", "TRNTYP", "LOAD", "LOADTL", *FRAME_WORDS}

# Words that move the tool or the coordinate system and aren't supported.
_CURVE = "is a curve that isn't supported; let the CAM system write GOTO points"
_COPY = "repeats or moves other statements, which isn't supported; let the CAM system write GOTO points"
_TABLE = "turns or moves the coordinate system, which isn't supported; let the CAM system write tool vectors"
_STEPS = "makes coordinates incremental, which isn't supported; let the CAM system write absolute ones"
_PLANE = "moves the tool to a height that isn't stated; let the CAM system write GOTO points"

_CURVES = """
ARC HELIX HELICAL GOFWD GOBACK GOLFT GORGT GOUP GODOWN TLON TLLFT TLRGT NURBS SPLINE BSPLIN BSPLINE POLYNOMIAL
POCKET SCURV THREAD
"""
REFUSED = {
    **dict.fromkeys(_CURVES.split(), _CURVE),
    **dict.fromkeys(
        ["COPY", "TRACUT", "CALL", "CALSUB", "DEFSUB", "MACRO", "LOOPST", "INDEX", "MIRROR"], _COPY
    ),
    **dict.fromkeys(("ROTATE", "ROTABL", "ROTHED"), _TABLE),
    **dict.fromkeys(("SET", "MODE"), _STEPS),
    "DNTCUT": "hides the moves that follow from the machine; let the CAM system leave them out",
    **dict.fromkeys(("RETRCT", "GOCLER", "PROBE"), _PLANE),
}

# A word this similar to one of these, by difflib's ratio, may be a typing error that loses a move.
MOTIONS = ("GOTO", "FROM", "CIRCLE", "CYCLE", "GODLTA", "GOHOME", "MOVARC", "RAPID")
NEAR, LONGEST_WORD = 0.8, 10


def _require_harmless(statement: Statement) -> None:
    """Raise `ToolpathError` if ignoring a statement would lose or change a move."""
    word = statement.word
    if word.startswith(CREO):
        return
    if word[:1] in set("0123456789+-."):
        raise statement.error("has no word; continue a statement with $ at the end of the line before")
    for part in word.split(","):
        reason = REFUSED.get(part)
        if reason is not None and not _is_usual(part, statement):
            raise statement.error(reason)
    if "GOTO" in word or word.startswith(("GO", "MOVE", "MOVARC")) or "CIRCLE" in word:
        raise statement.error("isn't understood; write GOTO/x,y,z or GOTO/x,y,z,i,j,k")
    near = _like_motion(word[:LONGEST_WORD])
    if near is not None:
        raise statement.error(f"isn't known, and {near} would move the tool; correct the word")


@lru_cache(maxsize=1000)
def _like_motion(word: str) -> str | None:
    """Find the motion word that a word resembles; cached, as a file repeats few words many times."""
    return next(iter(difflib.get_close_matches(word, MOTIONS, n=1, cutoff=NEAR)), None)


def _is_usual(word: str, statement: Statement) -> bool:
    """Check whether a word that could change moves has no effect here."""
    minors = statement.minors
    if word in ("SET", "MODE"):
        # SET/HOLDER, MODE/MILL and others of their kind only name things.
        return "INCR" not in minors
    return minors in (["OFF"], ["NOMORE"])
