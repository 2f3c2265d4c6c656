"""LinuxCNC's interpreter and this package's reader on one program: their moves, and how they differ.

`canonical_moves` reads what `rs274 -g` prints; `read_moves` runs our reader on the same file. Both are lists
of `Move` in mm and deg from the machine's zero, in the order in which they run. Arcs of the interpreter are
formulas (centre, turns), and every chord of ours has to lie on them.
"""

import math
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fiveaxis.base.errors import FiveAxisError
from fiveaxis.model import Machine, MoveKind
from fiveaxis.nc.control.axis_track import travel_of
from fiveaxis.nc.control.running import at_least_speed, run_program
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.source import load_source
from support.patience import PATIENCE
from support.rs274 import interpret

LETTERS = "XYZABC"
# Units, deg: the interpreter prints four decimals. Share of a time.
PRINTED, TIMED = 1.1e-4, 2e-3
INCH = 25.4
# Rapid moves take as long as the machine needs: only where they end is compared.
RAPID, CUT, DWELL = "rapid", "cut", "dwell"
_LINE = re.compile(r"\s*\d+ N(\S*)\s+(\w+)\((.*)\)")
# First and second axis of an arc, and the one across.
_PLANES = {"XY": (0, 1, 2), "XZ": (2, 0, 1), "YZ": (1, 2, 0)}
_SWITCHES = re.compile(rb"\bM42[89]\b", re.IGNORECASE)
# Cycles, whose pecks and dwells the reader leaves out.
_CYCLES = re.compile(r"\bG(?:7[346]|8[1-9])\b", re.IGNORECASE)


@dataclass(frozen=True)
class Turn:
    """An arc: its centre in the plane, mm; the plane's axes and the one across; rad, negative clockwise."""

    centre: np.ndarray
    plane: tuple[int, int, int]
    sweep: float


@dataclass(frozen=True)
class Move:
    """A move: kind, end (6,) mm and deg, s of a cut (NaN unknown), line or N word, arc, the last decimal."""

    kind: str
    end: np.ndarray
    time: float = math.nan
    line: str = ""
    arc: Turn | None = None
    digit: float = PRINTED


@dataclass(frozen=True)
class Run:
    """What one of the two makes of a program: moves; why it stops, empty at the end, and on which line."""

    moves: list[Move]
    fault: str = ""
    line: int = 0


def canonical_moves(program: Path, *options: str) -> Run:
    """Run a program through `rs274`."""
    if "-i" not in options:
        variables, ini = program.with_name("empty.var"), program.with_name("plain.ini")
        variables.write_text("", encoding="ascii")
        folder = f"SUBROUTINE_PATH = {program.parent}\n"
        ini.write_text(f"[RS274NGC]\nPARAMETER_FILE = {variables}\n{folder}", encoding="utf-8")
        options = ("-i", str(ini), *options)
    try:
        run = interpret(program, *options, "-v", "empty.var", timeout=PATIENCE / 10.0)
    except subprocess.TimeoutExpired:
        return Run([], "doesn't end")
    said = [line for line in run.stderr.splitlines() if line.strip() not in ("", "executing")]
    # A file may end without M2: nothing moves behind its end.
    ended = run.returncode == 0 or "no percent sign" in run.stderr
    moves = list(_canonical(run.stdout))
    if ended:
        return Run(moves)
    # The block that it refuses is the last thing that it says.
    lines = program.read_text(encoding="utf-8", errors="replace").splitlines()
    refused = next(
        (i for i, text in enumerate(lines, start=1) if said and text.strip() == said[-1].strip()), 0
    )
    return Run(moves, " | ".join(said) or "stops", refused)


def _canonical(text: str) -> Iterator[Move]:
    scale, rate, plane, rotated = 1.0, 0.0, _PLANES["XY"], 0.0
    per_turn, speed = False, 0.0
    g5x, g92, here = np.zeros(6), np.zeros(6), np.zeros(6)

    def placed(words: np.ndarray) -> np.ndarray:
        end = words * ([scale] * 3 + [1.0] * 3) + g92
        c, s = math.cos(math.radians(rotated)), math.sin(math.radians(rotated))
        end[:2] = c * end[0] - s * end[1], s * end[0] + c * end[1]
        return end + g5x

    def paced(length: float, turned: float) -> float:
        of = length / scale if length > 1e-6 else turned  # G92 leaves rounding
        per_minute = rate * (speed if per_turn else 1.0)
        return 60.0 * of / per_minute if per_minute > 0.0 else math.nan

    for found in filter(None, map(_LINE.match, text.splitlines())):
        line, word, rest = found.groups()
        if word == "USE_LENGTH_UNITS":
            scale = INCH if "INCH" in rest else 1.0
        elif word == "SELECT_PLANE":
            plane = _PLANES.get(rest.removeprefix("CANON_PLANE_"), plane)
        elif word == "SET_FEED_MODE":
            per_turn = float(rest.split(",")[-1]) != 0.0
        elif word == "SET_SPINDLE_SPEED":
            speed = abs(float(rest.split(",")[-1].split()[-1]))
        elif word in ("SET_FEED_RATE", "SET_XY_ROTATION", "DWELL"):
            value = float(rest)
            rate = value if word == "SET_FEED_RATE" else rate
            rotated = value if word == "SET_XY_ROTATION" else rotated
            if word == "DWELL" and value > 0.0:
                yield Move(DWELL, here, value, line, digit=PRINTED * scale)
        elif word in ("SET_G5X_OFFSET", "SET_G92_OFFSET"):
            values = np.array([float(v) for v in rest.split(",")][-6:]) * ([scale] * 3 + [1.0] * 3)
            g5x, g92 = (values, g92) if word == "SET_G5X_OFFSET" else (g5x, values)
        elif word in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED"):
            end = placed(np.array([float(v) for v in rest.split(",")]))
            length, turned = np.linalg.norm((end - here)[:3]), np.linalg.norm((end - here)[3:])
            cut = word == "STRAIGHT_FEED"
            if length > PRINTED or turned > PRINTED:
                time = paced(float(length), float(turned)) if cut else math.nan
                yield Move(CUT if cut else RAPID, end, time, line, digit=PRINTED * scale)
            here = end
        elif word == "ARC_FEED":
            values = [float(v) for v in rest.split(",")]
            first, second, across = plane
            words, centre = np.zeros(6), np.zeros(6)
            words[[first, second, across]] = values[0], values[1], values[5]
            words[3:] = values[6:9]
            centre[[first, second]] = values[2], values[3]
            end, middle = placed(words), placed(centre)[[first, second]]
            turn = _turn(here, end, middle, plane, int(values[4]))
            radius = (
                np.linalg.norm(here[[first, second]] - middle),
                np.linalg.norm(end[[first, second]] - middle),
            )
            length = math.hypot(abs(turn.sweep) * sum(radius) / 2.0, end[across] - here[across])
            yield Move(CUT, end, paced(length, 0.0), line, turn, PRINTED * scale)
            here = end


def _turn(
    here: np.ndarray, end: np.ndarray, centre: np.ndarray, plane: tuple[int, int, int], turns: int
) -> Turn:
    axes = list(plane[:2])
    a, b = (math.atan2(*(point[axes] - centre)[::-1]) for point in (here, end))
    clockwise = turns < 0
    sweep = (a - b if clockwise else b - a) % (2.0 * math.pi)
    # Equal ends are a full circle.
    same = np.linalg.norm((end - here)[axes]) < PRINTED
    sweep = 2.0 * math.pi if same else sweep
    sweep += 2.0 * math.pi * (abs(turns) - 1)
    return Turn(centre, plane, -sweep if clockwise else sweep)


def read_moves(program: Path, machine: Machine, **options: object) -> Run:
    """Run a program through our reader, from zero, with every work offset there."""
    zeros = {
        f"{offset}X": 0.0 for offset in ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")
    }
    start = dict.fromkeys(machine.letters, 0.0)
    try:
        given = ReadOptions(machine=machine, **{"start": start, "zero": zeros, **options})  # type: ignore[arg-type]
        interpreter = run_program(load_source(program), machine, given)
    except FiveAxisError as fault:
        return Run([], str(fault), getattr(fault, "line", None) or 0)
    if not interpreter.track.rows:
        return Run([])
    columns = at_least_speed(interpreter.track.columns(), interpreter)
    times = travel_of(columns, interpreter.modes.feed_scale).time
    at = [LETTERS.index(letter) for letter in machine.letters]
    moves, here = [], np.zeros(6)
    for values, kind, time, line in zip(columns.values, columns.kinds, times, columns.lines, strict=True):
        end = here.copy()
        end[at] = values
        name = CUT if kind == MoveKind.CUT else RAPID
        if np.abs(end - here).max() > 1e-9:
            moves.append(Move(name, end, float(time) if name == CUT else math.nan, str(line)))
        elif np.isfinite(time) and time > 0.0:
            moves.append(Move(DWELL, end, float(time), str(line)))
        here = end
    return Run(moves)


def difference(canonical: list[Move], ours: list[Move], *, cycles: bool = False) -> str:
    """Say where two runs differ first; empty if they don't."""
    canonical, ours = (_without_pecks(moves) if cycles else moves for moves in (canonical, ours))
    here, row = np.zeros(6), 0
    for move in canonical:
        while move.arc is None and row < len(ours) and np.abs(ours[row].end - here).max() < move.digit / 2.0:
            if ours[row].kind == DWELL:
                break
            row += 1  # too short to be printed
        if row == len(ours):
            return f"line {move.line}: the interpreter goes to {_told(move)}, and we are at the end"
        if move.arc is None:
            own, count = ours[row], 1
        else:
            own, count = _chords(here, move, ours[row:])
        row += count
        if own.kind != move.kind or np.abs(own.end - move.end).max() > 3.0 * move.digit:
            return f"line {move.line or own.line}: {_told(move)}, and we {_told(own)}"
        length, share = _timed(here, move)
        long = length > 1e4 * move.digit or move.kind == DWELL
        if (
            long
            and not cycles
            and not math.isclose(own.time, move.time, rel_tol=share)
            and move.kind != RAPID
        ):
            times = f"{move.kind} of {move.time:.6g} s, and of {own.time:.6g} s by us"
            return f"line {move.line or own.line}: {times}"
        here = move.end
    rest = ours[row:]
    return f"line {rest[0].line}: we go on to {_told(rest[0])}" if rest else ""


def _timed(here: np.ndarray, move: Move) -> tuple[float, float]:
    """Return the length of a move, mm or deg, and the share by which its time may be another one.

    The interpreter's rate under G93 is that of a circle of the first radius.
    """
    if move.arc is None:
        return float(np.abs(move.end - here).max()), TIMED
    radii = [float(np.linalg.norm(p[list(move.arc.plane[:2])] - move.arc.centre)) for p in (here, move.end)]
    return abs(move.arc.sweep) * radii[0], TIMED + abs(radii[1] - radii[0]) / sum(radii)


def _chords(here: np.ndarray, move: Move, ours: list[Move]) -> tuple[Move, int]:
    """Take our chords of an arc; one that leaves it ends them."""
    assert move.arc is not None
    axes, across = list(move.arc.plane[:2]), move.arc.plane[2]
    begin = here[axes] - move.arc.centre
    radius = np.linalg.norm(begin), np.linalg.norm(move.end[axes] - move.arc.centre)
    angle, swept, time = math.atan2(begin[1], begin[0]), 0.0, 0.0
    for count, own in enumerate(ours, start=1):
        spoke = own.end[axes] - move.arc.centre
        now = math.atan2(spoke[1], spoke[0])
        swept += (now - angle + math.pi) % (2.0 * math.pi) - math.pi
        angle, time = now, time + own.time
        share = swept / move.arc.sweep
        wanted = radius[0] + (radius[1] - radius[0]) * share
        # Four decimals of centre and ends.
        off = (
            abs(np.linalg.norm(spoke) - wanted),
            abs(own.end[across] - here[across] - share * (move.end - here)[across]),
        )
        if own.kind != CUT or max(off) > 10.0 * move.digit:
            return replace(own, time=time), count
        rest = 10.0 * move.digit / (abs(move.arc.sweep) * min(radius))
        at_end = np.abs(own.end - move.end).max() <= 3.0 * move.digit
        if share > 1.0 + rest or (share > 1.0 - rest and at_end):
            return replace(own, time=time), count
    return replace(ours[-1], time=time), len(ours)


def _without_pecks(moves: list[Move]) -> list[Move]:
    """Leave out dwells, and of successive moves along Z all but the lowest and the last."""
    kept: list[Move] = []
    here = np.zeros(6)
    run: list[Move] = []

    def flush() -> None:
        if run:
            low = min(range(len(run)), key=lambda i: (round(run[i].end[2], 4), -i))
            kept.extend(run[low:] if low == len(run) - 1 else [run[low], run[-1]])
            run.clear()

    for move in moves:
        if move.kind == DWELL:
            continue
        alone = move.arc is None and np.abs(np.delete(move.end - here, 2)).max() < PRINTED
        if not alone:
            flush()
            kept.append(move)
        elif np.abs(move.end - here).max() > PRINTED:
            run.append(move)
        here = move.end
    flush()
    return kept


def _told(move: Move) -> str:
    words = " ".join(f"{c}{v:.4f}" for c, v in zip(LETTERS, move.end, strict=True) if abs(v) > 1e-9)
    return f"{move.kind} to {words or 'zero'}" + (
        f" by {math.degrees(move.arc.sweep):.4g} deg" if move.arc else ""
    )


@dataclass(frozen=True)
class Comparison:
    """One program by both: ``same``, ``differs``, ``refused by us``, ``refused by it``, ``refused by both``.

    Parameters
    ----------
    fact : the first difference, or the reason of the refusal
    line : that is refused; 0 if none is named
    """

    verdict: str
    fact: str = ""
    line: int = 0


def compare(program: Path, machine: Machine, *options: str, **reading: object) -> Comparison:
    """Compare the two on a program, without words that only configurations with switched kinematics have."""
    text = program.read_bytes()
    if _SWITCHES.search(text):
        program = program.with_name(f"plain_{program.name}")
        program.write_bytes(_SWITCHES.sub(b"", text))
    theirs, ours = canonical_moves(program, *options), read_moves(program, machine, **reading)
    if theirs.fault and ours.fault:
        line = min((run.line for run in (theirs, ours) if run.line), default=0)
        both = "refused by both" if theirs.line == ours.line else ""
        first = "refused by it" if line == theirs.line else "refused by us"
        return Comparison(both or first, f"{theirs.fault} || {ours.fault}", line)
    if ours.fault:
        return Comparison("refused by us", ours.fault, ours.line)
    if theirs.fault:
        return Comparison("refused by it", theirs.fault, theirs.line)
    cycles = _CYCLES.search(text.decode("utf-8", errors="replace")) is not None
    fact = difference(theirs.moves, ours.moves, cycles=cycles)
    return Comparison("differs" if fact else "same", fact)


def compare_lines(text: str, file: Path, machine: Machine) -> list[Comparison]:
    """Compare the two on a program, and again without the line that is refused, until both run all of it.

    The last comparison is ``same`` or ``differs``, unless what is refused can't be left out.
    """
    found: list[Comparison] = []
    lines = text.splitlines()
    while True:
        file.write_text("\n".join([*lines, ""]), encoding="ascii")
        found.append(compare(file, machine))
        line = found[-1].line
        if not line or "o" in lines[line - 1][:1].lower():
            return found
        del lines[line - 1]
