"""The chain's equations over a ``cos``/``sin`` namespace; `loops` has them for numbers, compiled.

A scalar is a numpy array (a column of a path) or a CasADi symbol; three-vectors are tuples of scalars, so
nothing in this module depends on which. CasADi omits products with constants that are exactly 0: an ideal
chain then costs no more than its hand-written equations.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from fiveaxis.model.machine.chain import Chain, Joint

Scalar = Any  # float | numpy array | casadi.SX: only arithmetic is used
Vector = tuple[Scalar, Scalar, Scalar]
Cosines = Mapping[str, tuple[Scalar, Scalar]]


class Trigonometry(Protocol):
    """The functions that the equations need from numpy or CasADi."""

    def cos(self, angle: Scalar) -> Scalar: ...  # noqa: D102
    def sin(self, angle: Scalar) -> Scalar: ...  # noqa: D102


def cosines_of(rotary: Mapping[str, Scalar], functions: Trigonometry) -> Cosines:
    """Compute cosine and sine of every rotary angle, by axis letter."""
    return {letter: (functions.cos(angle), functions.sin(angle)) for letter, angle in rotary.items()}


def tool_axis(chain: Chain, cosines: Cosines) -> Vector:
    """Compute the tool axis in the workpiece frame: ``o = T[:3, 2]`` (form-shaping Eq. 3)."""
    direction: Vector = tuple(float(c) for c in chain.tool_home[:3, 2])  # type: ignore[assignment]
    for joint in reversed(chain.joints):
        if joint.is_rotary:
            direction = turn(joint, cosines, direction)
    return direction


def tool_tip(chain: Chain, cosines: Cosines, linear: Mapping[str, Scalar]) -> Vector:
    """Compute the tool tip in the workpiece frame: ``r = T[:3, 3]`` (form-shaping Eq. 3).

    A linear axis whose value, mm, isn't given counts as 0.
    """
    point: Vector = tuple(float(c) for c in chain.tool_home[:3, 3])  # type: ignore[assignment]
    for joint in reversed(chain.joints):
        if joint.is_rotary:
            pivot = joint.line.point
            point = add(turn(joint, cosines, subtract(point, pivot)), pivot)
        elif joint.letter in linear:
            point = add(point, scale(linear[joint.letter], joint.line.direction))
    return point


def linear_directions(chain: Chain, cosines: Cosines) -> dict[str, Vector]:
    """Compute the direction in which each linear axis moves the tool, workpiece frame."""
    directions: dict[str, Vector] = {}
    for joint in reversed(chain.joints):
        if joint.is_rotary:
            directions = {letter: turn(joint, cosines, d) for letter, d in directions.items()}
        else:
            directions[joint.letter] = joint.line.direction
    return directions


def linear_axes(chain: Chain, cosines: Cosines, tip: Vector) -> dict[str, Scalar]:
    """Solve the three linear axes, mm by letter, for a tool tip, mm, and given rotary angles.

    With the rotary angles fixed the tip is ``r = r_0 + Σ s_l D_l``: linear in the axis values ``s_l``, solved
    by Cramer's rule (form-shaping Eq. 5, with the chain's offsets). Rotary axes before the first linear one
    turn everything alike and are undone at the tip: where none is between linear axes, the D are constant.
    """
    first = next(i for i, joint in enumerate(chain.joints) if not joint.is_rotary)
    for joint in chain.joints[:first]:
        cosine, sine = cosines[joint.letter]
        pivot = joint.line.point
        tip = add(turn(joint, {joint.letter: (cosine, -sine)}, subtract(tip, pivot)), pivot)
    behind = Chain(chain.joints[first:], chain.tool_home)
    (a, u), (b, v), (c, w) = linear_directions(behind, cosines).items()
    rest = subtract(tip, tool_tip(behind, cosines, {}))
    vw, wu, uv = cross(v, w), cross(w, u), cross(u, v)
    share = 1.0 / dot(u, vw)
    return {a: dot(rest, scale(share, vw)), b: dot(rest, scale(share, wu)), c: dot(rest, scale(share, uv))}


def leaning_tip(pivot: Vector, axis: Vector, height: float, offset: float, normal: Vector) -> Vector:
    """Compute the tip of a tool that leans about its contact, ``pivot − b·o + a·e`` (`toolpath.cutter`), mm.

    Height and offset are b and a of the cutter's zone. Where the normal is unknown it is zero, and the axis
    passes through the pivot.
    """
    tip = subtract(pivot, scale(height, axis))
    if offset == 0.0:
        return tip
    cosine = dot(normal, axis)
    # With the tool along the normal, e is undefined and the result infinite: no allowed posture.
    length = (1.0 - cosine * cosine) ** 0.5
    across = subtract(normal, scale(cosine, axis))
    return add(tip, scale(offset / length, across))


def turn(joint: Joint, cosines: Cosines, vector: Vector) -> Vector:
    """Turn a vector about a joint's direction ``k`` (Rodrigues): ``v c + k×v s + k (k·v)(1 − c)``."""
    cosine, sine = cosines[joint.letter]
    k = joint.line.direction
    along = scale(dot(k, vector) * (1.0 - cosine), k)
    return add(add(scale(cosine, vector), scale(sine, cross(k, vector))), along)


def add(a: Vector, b: Vector) -> Vector:
    """Add two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def subtract(a: Vector, b: Vector) -> Vector:
    """Subtract two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scale(factor: Scalar, vector: Vector) -> Vector:
    """Multiply a vector by a scalar."""
    return factor * vector[0], factor * vector[1], factor * vector[2]


def dot(a: Vector, b: Vector) -> Scalar:
    """Compute the dot product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Compute the cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
