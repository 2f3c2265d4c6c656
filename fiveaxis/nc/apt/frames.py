"""Coordinate frames of an APT file.

Each operation of a file may state a frame, all in one base: ``MSYS`` (NX) has the origin and the first two
axes, ``MCS`` three axes and the origin, ``CSYS`` (Creo, SolidWorks) and CATIA's ``$$*CATIA0`` the rows of a
matrix with the origin as last column. Coordinates and tool vectors are in the frame stated last. The path is
in the first frame; locations in another one are mapped into it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fiveaxis.base import Array, Finding, Severity, inverse_transform, product
from fiveaxis.nc.apt.statements import CATIA_FRAME, CREO, LONGEST_SHOWN, Statement, numbers_and_words
from fiveaxis.nc.rows import LARGEST_POSITION

# Tolerance of unit length and right angles of a frame's axes: files write at least 4 decimals.
FRAME_TOLERANCE = 1e-3
# Steps that take an error of it below rounding.
ORTHONORMAL = 4

# Frames closer than this, in their own unit, are the same.
SAME_FRAME = 1e-9

FRAME_WORDS = ("MSYS", "MCS", "CSYS", f"{CREO}CSYS", CATIA_FRAME, "ORIGIN", "TRANS")


@dataclass
class Frames:
    """The frames stated so far.

    Parameters
    ----------
    world : whether coordinates stay in the base, whatever frame is stated (``TRNTYP/WORLD`` of SolidWorks)
    first, last : by word, the statement and its transform, None for an unknown form
    changes : row and transform, from that row's frame to the first one
    """

    world: bool = False
    first: dict[str, tuple[Statement, Array | None]] = field(default_factory=dict)
    last: dict[str, tuple[Statement, Array | None]] = field(default_factory=dict)
    changes: list[tuple[int, Array]] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def set_type(self, statement: Statement) -> None:
        """Process ``TRNTYP``: SolidWorks writes world coordinates after ``TRNTYP/WORLD``."""
        self.world = statement.minors[:1] == ["WORLD"]

    def state(self, statement: Statement, rows: int) -> None:
        """Process a frame after `rows` locations.

        `ToolpathError` if it differs from the previous one, and one of them has an unknown form.
        """
        word = statement.word
        now = (statement, _transform(statement))
        before = self.last.get(word)
        self.last[word] = now
        if rows == 0:
            self.first[word] = now
            self._note_shift(statement)
        elif before is None or word not in self.first:
            raise statement.error("gives a frame after locations without one; write one file for each frame")
        elif not _same(before, now):
            self._change(now, rows)

    def _note_shift(self, statement: Statement) -> None:
        """Warn of a shift by which a post moves all locations: the path stays in the frame of the file."""
        if statement.word == "TRANS" and any(minor.strip("+-0.") for minor in statement.minors):
            text = (
                f"TRANS/{','.join(statement.minors)[:LONGEST_SHOWN]} shifts what a post writes; the path is "
                "read as written, without it"
            )
            self.findings.append(statement.note("frame-unused", text, Severity.WARNING))

    def _change(self, now: tuple[Statement, Array | None], rows: int) -> None:
        statement, transform = now
        first, base = self.first[statement.word]
        if self.world:
            text = (
                f"{statement.word} differs from the one on line {first.line}; it is ignored, because "
                "TRNTYP/WORLD keeps coordinates in one frame"
            )
            self.findings.append(statement.note("frame-unused", text))
            return
        if transform is None or base is None or len(self.last) > 1:
            raise statement.error(
                f"changes the frame given on line {first.line}; write one file for each frame"
            )
        self.changes.append((rows, product(inverse_transform(base), transform)))
        text = (
            f"{statement.word} changes the frame; locations after it are mapped to that of line {first.line}"
        )
        self.findings.append(statement.note("frame-mapped", text))

    def apply(self, positions: Array, vectors: Array) -> None:
        """Map locations after a change into the first frame, in place.

        Positions, in the unit of the file, and tool vectors are (n, 3).
        """
        begins = [row for row, _ in self.changes]
        for (row, transform), end in zip(self.changes, [*begins[1:], len(positions)], strict=False):
            rotation = transform[:3, :3].T
            positions[row:end] = product(positions[row:end], rotation) + transform[:3, 3]
            vectors[row:end] = product(vectors[row:end], rotation)


def _same(a: tuple[Statement, Array | None], b: tuple[Statement, Array | None]) -> bool:
    if a[1] is None or b[1] is None:
        return a[0].minors == b[0].minors
    return bool(np.abs(a[1] - b[1]).max() <= SAME_FRAME)


def _transform(statement: Statement) -> Array | None:
    """Return a frame as a transform to the base, (4, 4); None for an unknown form."""
    found, words = numbers_and_words(statement.minors)
    numbers = np.array(found)
    if words or not np.all(np.abs(numbers) <= LARGEST_POSITION):
        return None
    frame = np.eye(4)
    if statement.word == "MSYS" and len(numbers) == 9:
        frame[:3, 3] = numbers[:3]
        frame[:3, 0], frame[:3, 1] = numbers[3:6], numbers[6:]
        frame[:3, 2] = np.cross(numbers[3:6], numbers[6:])
    elif statement.word == "MCS" and len(numbers) == 12:
        frame[:3, :] = numbers.reshape(4, 3).T
    elif statement.word in ("CSYS", f"{CREO}CSYS", CATIA_FRAME) and len(numbers) == 12:
        frame[:3, :] = numbers.reshape(3, 4)
    else:
        return None
    return frame if _is_rigid(frame) else None


def _is_rigid(frame: Array) -> bool:
    """Check whether a transform is rigid, and orthonormalise its axes in place if it is."""
    rotation = frame[:3, :3]
    # By hand: numpy's determinant warns of singular matrices with tiny elements.
    if not (np.abs(rotation).max() < 2.0 and product(np.cross(rotation[0], rotation[1]), rotation[2]) > 0.0):
        return False
    if np.abs(product(rotation, rotation.T) - np.eye(3)).max() > FRAME_TOLERANCE:
        return False
    # Newton's iteration for the nearest rotation: each step squares what is left of the tolerance.
    for _ in range(ORTHONORMAL):
        rotation = 1.5 * rotation - 0.5 * product(rotation, rotation.T, rotation)
    frame[:3, :3] = rotation
    return True
