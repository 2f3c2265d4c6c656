"""The kinematic chain between workpiece and tool, as a product of exponentials, and its freedoms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from fiveaxis.base import (
    Array,
    MachineError,
    inverse_transform,
    normalise,
    product,
    rotation_matrix,
    translation,
)
from fiveaxis.model.machine.axes import LocationError
from fiveaxis.model.machine.code import FormShapingCode

UNIT_DIRECTION = {
    "X": (1.0, 0.0, 0.0),
    "Y": (0.0, 1.0, 0.0),
    "Z": (0.0, 0.0, 1.0),
    "A": (1.0, 0.0, 0.0),
    "B": (0.0, 1.0, 0.0),
    "C": (0.0, 0.0, 1.0),
}

Triple = tuple[float, float, float]

# Cosine between a location error's tilt and its axis above which the tilt turns about the axis itself. A
# measured tilt is small: a smaller component along the axis moves the line by less than this share of it.
ABOUT_ITSELF = 0.01
FLAT = 1e-9  # volume spanned by three unit directions below which they count as lying in one plane
PARALLEL = 1e-9  # |sin| of the angle between two directions below which they count as parallel


def as_triple(vector: Array) -> Triple:
    """Convert (3,) numbers to a tuple of floats."""
    x, y, z = (float(c) for c in vector)
    return x, y, z


@dataclass(frozen=True)
class Line:
    """Direction of an axis, and for a rotary axis a point on it.

    Parameters
    ----------
    direction : (3,), machine frame at home; stored as a unit vector
    point : (3,), mm, machine frame at home; without meaning for a linear axis
    """

    direction: Triple
    point: Triple = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        direction = np.asarray(self.direction, dtype=float)
        if not np.isfinite([*self.direction, *self.point]).all():
            raise MachineError(
                f"an axis line has a number that isn't finite: {self.direction} through {self.point}"
            )
        if not np.linalg.norm(direction, axis=-1) > 0.0:
            raise MachineError("an axis has a direction of length 0; write three numbers, not all zero")
        object.__setattr__(self, "direction", as_triple(normalise(direction)))
        object.__setattr__(self, "point", as_triple(np.asarray(self.point, dtype=float)))

    def moved(self, transform: Array) -> Line:
        """Move the line by a rigid transform, (4, 4) mm."""
        direction = product(transform[:3, :3], np.array(self.direction))
        return Line(
            as_triple(direction),
            as_triple(product(transform[:3, :3], np.array(self.point)) + transform[:3, 3]),
        )

    def displaced(self, error: LocationError, sign: float = 1.0) -> Line:
        """Apply a location error to the line; with the sign −1, take it back.

        The tilt turns the line about its own `point`, at which the offset was measured. `MachineError` if it
        turns about the axis itself.
        """
        tilt = np.asarray(error.tilt, dtype=float)
        angle = float(np.linalg.norm(tilt, axis=-1))
        point = as_triple(np.array(self.point) + sign * np.array(error.offset))
        if angle == 0.0:
            return Line(self.direction, point)
        if abs(product(tilt, np.array(self.direction))) > ABOUT_ITSELF * angle:
            raise MachineError(
                "the tilt of the location error turns about the axis itself, which moves only its zero "
                "position; write 0 for that component"
            )
        return Line(
            as_triple(product(rotation_matrix(tilt / angle, sign * angle), np.array(self.direction))), point
        )


@dataclass(frozen=True)
class Joint:
    """One factor of the chain: an axis letter and the axis's line."""

    letter: str
    line: Line

    @property
    def is_rotary(self) -> bool:
        """Whether the joint turns."""
        return self.letter in "ABC"

    def motions(self, values: Array) -> Array:
        """Compute the factors ``E(value)``, (n, 4, 4) mm, for (n,) values in mm or rad."""
        direction, point = np.array(self.line.direction), np.array(self.line.point)
        motions = np.broadcast_to(np.eye(4), (len(values), 4, 4)).copy()
        if not self.is_rotary:
            motions[:, :3, 3] = np.outer(values, direction)
            return motions
        # Rodrigues: a quarter turn is K + kk', half a turn 2kk' − I.
        along = np.outer(direction, direction)
        cross = rotation_matrix(direction, np.pi / 2.0) - along
        cosine, sine = np.cos(values)[:, None, None], np.sin(values)[:, None, None]
        motions[:, :3, :3] = along + cosine * (np.eye(3) - along) + sine * cross
        motions[:, :3, 3] = point - product(motions[:, :3, :3], point)
        return motions


@dataclass(frozen=True, eq=False)
class Chain:
    """``T(q) = E_1(q_1) … E_k(q_k) · M``: the tool-tip frame in the workpiece.

    Lines and M are in the workpiece frame with every axis at 0. That is the machine frame, unless the
    workpiece is set up elsewhere (`seen_from`): the product of exponentials holds in any frame.

    Parameters
    ----------
    joints : from the workpiece to the tool
    tool_home : (4, 4), mm; M, the tool-tip frame with every axis at 0
    """

    joints: tuple[Joint, ...]
    tool_home: Array = field(default_factory=lambda: np.eye(4))

    def __repr__(self) -> str:
        return f"<Chain {' '.join(joint.letter for joint in self.joints)}>"

    @classmethod
    def from_code(cls, code: FormShapingCode, lines: Mapping[str, Line] | None = None) -> Chain:
        """Build the chain of a code, with the lines of axes that aren't their letter's through zero."""
        given = lines or {}
        return cls(tuple(Joint(c, given.get(c, Line(UNIT_DIRECTION[c]))) for c in code.letters))

    @property
    def rotaries(self) -> tuple[str, ...]:
        """Letters of the rotary axes, from the workpiece to the tool."""
        return tuple(j.letter for j in self.joints if j.is_rotary)

    @property
    def linears(self) -> tuple[str, ...]:
        """Letters of the linear axes, from the workpiece to the tool."""
        return tuple(j.letter for j in self.joints if not j.is_rotary)

    @cached_property
    def linears_adjoin(self) -> bool:
        """Whether no rotary axis is between linear ones: these then span the same space in any posture."""
        kinds = "".join("r" if j.is_rotary else "l" for j in self.joints)
        return "r" not in kinds.strip("r")

    @cached_property
    def figures(self) -> tuple[Array, Array]:
        """Joints, (j, 7): 1 if it turns, direction, point in mm; and tip and tool axis at home, (2, 3)."""
        joints = [(float(j.is_rotary), *j.line.direction, *j.line.point) for j in self.joints]
        return np.array(joints).reshape(-1, 7), np.array([self.tool_home[:3, 3], self.tool_home[:3, 2]])

    def seen_from(self, frame: Array) -> Chain:
        """Express the chain in another frame of the workpiece side, (4, 4) mm in the present one.

        ``W⁻¹ E_1 … E_k M = (W⁻¹ E_1 W) … (W⁻¹ E_k W) (W⁻¹ M)``, and ``W⁻¹ E W`` is the motion about the line
        as seen from W.
        """
        back = inverse_transform(frame)
        joints = tuple(replace(j, line=j.line.moved(back)) for j in self.joints)
        return Chain(joints, product(back, self.tool_home))

    def holding(self, letter: str, value: float) -> Chain:
        """Return the chain of the other axes, with one axis held at a value in mm or rad.

        The part of the chain between the held axis and the tool moves rigidly with it.
        """
        index = next(i for i, j in enumerate(self.joints) if j.letter == letter)
        held = self.joints[index].motions(np.array([value]))[0]
        behind = tuple(replace(j, line=j.line.moved(held)) for j in self.joints[index + 1 :])
        return Chain(self.joints[:index] + behind, product(held, self.tool_home))

    def with_tool_length(self, length: float) -> Chain:
        """Return the chain with the tip a length, mm, further out along the tool axis."""
        return replace(self, tool_home=product(self.tool_home, translation((0.0, 0.0, -length))))


def directions(chain: Chain, *, rotary: bool) -> Array:
    """Return the directions of the rotary or of the linear axes, every axis at 0, (r, 3), chain order."""
    return np.array([j.line.direction for j in chain.joints if j.is_rotary is rotary]).reshape(-1, 3)


@lru_cache
def why_not_positioning(chain: Chain) -> str | None:
    """Explain why the linear axes don't reach every position; None if they do."""
    linears = chain.linears
    if len(linears) != 3:
        return (
            f"it has {len(linears)} linear axes, and a tool tip needs X, Y and Z: write all of 1, 2, 3 into "
            "the code, for example 640123"
        )
    first, second, third = directions(chain, rotary=False)
    if abs(product(np.cross(first, second), third)) < FLAT:
        return f"the directions of {', '.join(linears)} lie in one plane; they have to span space"
    return None


def spare_axes(chain: Chain) -> list[str]:
    """List the redundant rotary axes of three: without one, the others still lean the tool; tool first."""
    if len(chain.rotaries) != 3:
        return []
    return [c for c in reversed(chain.rotaries) if why_not_orienting(chain.holding(c, 0.0)) is None]


@lru_cache
def why_not_orienting(chain: Chain) -> str | None:
    """Explain why the rotary axes aren't two that lean the tool in two directions; None if they are."""
    rotaries = chain.rotaries
    if len(rotaries) != 2:
        spare = spare_axes(chain)
        hint = f"; clamp one: machine.holding({spare[0]!r}, 0.0)" if spare else ""
        return f"it has {len(rotaries)} rotary axes, and choosing a posture needs two{hint}"
    first, second = directions(chain, rotary=True)
    if np.linalg.norm(np.cross(second, chain.tool_home[:3, 2]), axis=-1) < PARALLEL:
        return (
            f"{rotaries[1]}, the rotary axis next to the tool, only spins the tool about itself and gives no "
            "second orientation freedom; make another one the last rotary axis, as in 640123"
        )
    if np.linalg.norm(np.cross(first, second), axis=-1) < PARALLEL:
        return f"{rotaries[0]} and {rotaries[1]} are parallel, so they lean the tool in one direction only"
    return None
