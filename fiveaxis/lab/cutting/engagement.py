"""Engagement of an end mill in the material: cutter, cut, removal rate, surface, and what moves remove.

Feed axes: x along the feed F, y to its left L = N × F, z along the surface normal N. The spindle turns
clockwise seen from above (M3), so material on the left is up-milled (conventional), on the right down-milled
(climb).

The material left to cut lies below ``depth`` (along N, from the lowest point of the cutter) and beside the
groove of the previous pass, which the same cutter made ``width`` further to the free side. At one height the
cutter's section is a disc of half-chord c: R for a flat end, ``√(R² - (R - height)²)`` for a ball. Its points
are engaged where they face the feed and lie at most ``width - c`` towards the free side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.base import Array, InputError, IntArray, SettingError, ToolError, arcsin, normalise, product

# s over which rates are means: what single short moves remove is known to a few rays only.
STEP = 0.1
WATT = 1e3  # N·mm/s, the unit of force times velocity, and of torque times angular velocity
# Grid lines in each direction on the engaged surface, to find its highest point and to integrate its area.
SURFACE_LINES = 97
TOUCHING = 1e-9  # sine of the angle by which rounding may lift the engaged surface above the ball's equator


@dataclass(frozen=True)
class EndMill:
    """A cylindrical or ball end mill that turns clockwise seen from above.

    Parameters
    ----------
    shape : ``flat`` or ``ball``
    diameter : mm
    teeth : number of cutting edges, equally spaced
    helix : rad, right-hand positive; a ball has the constant lead of its shank

    Raises
    ------
    ToolError
        The shape is unknown, the diameter or the number of teeth isn't positive, or the helix is 90 degrees
        or more.
    """

    shape: Literal["flat", "ball"]
    diameter: float
    teeth: int = 2
    helix: float = 0.0

    def __post_init__(self) -> None:
        if self.shape not in ("flat", "ball"):
            raise ToolError(f"end mill shape is {self.shape!r}; take flat or ball")
        require("tool diameter", self.diameter, "mm", error=ToolError, above=0.0)
        if not (isinstance(self.teeth, int) and self.teeth >= 1):
            raise ToolError(f"number of teeth is {self.teeth!r}; give a whole number, at least 1")
        require("helix angle", self.helix, "rad", error=ToolError)
        if abs(self.helix) >= np.pi / 2.0:
            shown = np.degrees(self.helix)
            raise ToolError(f"helix angle is {shown:g} deg; it must lie between -90 and 90 deg")

    @property
    def radius(self) -> float:
        """Half the diameter, mm."""
        return self.diameter / 2.0


@dataclass(frozen=True)
class Cut:
    """One steady cut: an end mill's posture and motion in the material.

    Parameters
    ----------
    mill : the cutter
    depth : mm, along the surface normal from the cutter's lowest point
    width : mm, distance from the previous pass; the diameter is a full slot
    feed : mm/s
    spindle : rad/s, magnitude
    milling : ``up``, material on the left of the feed, or ``down``, on its right
    lead : rad, inclination from the normal towards the feed; ball ends only
    lean : rad, then sideways to the right of the feed; ball ends only

    Raises
    ------
    SettingError
        A figure is out of its range; a flat end leans; the feed per tooth is above the cutter's radius,
        likely a wrong unit.
    ToolError
        A ball would cut with its shank: the engaged surface passes the equator.
    """

    mill: EndMill
    depth: float
    width: float
    feed: float
    spindle: float
    milling: Literal["up", "down"] = "down"
    lead: float = 0.0
    lean: float = 0.0

    def __post_init__(self) -> None:
        require("depth of cut", self.depth, "mm", least=0.0)
        require("width of cut", self.width, "mm", least=0.0)
        require_at_most(
            "width of cut", self.width, self.mill.diameter, "mm", "a full slot is one diameter wide"
        )
        require("feed", self.feed, "mm/s", above=0.0)
        require("spindle speed", self.spindle, "rad/s", above=0.0)
        bite, radius = self.feed_per_tooth, self.mill.radius
        require_at_most(
            "feed per tooth", bite, radius, "mm", "check the units of feed (mm/s) and spindle (rad/s)"
        )
        if self.milling not in ("up", "down"):
            raise SettingError(f"milling is {self.milling!r}; take up or down")
        for name, angle in (("lead", self.lead), ("lean", self.lean)):
            require(name, angle, "rad")
            if abs(angle) >= np.pi / 2.0:
                shown = np.degrees(angle)
                raise SettingError(f"{name} is {shown:g} deg; it must lie between -90 and 90 deg")
        if self.mill.shape == "ball":
            require_at_most("depth of cut", self.depth, radius, "mm", "a ball cuts one radius deep at most")
            self._refuse_shank()
        elif self.lead or self.lean:
            shown = f"lead {np.degrees(self.lead):g} and lean {np.degrees(self.lean):g} deg"
            raise SettingError(f"a flat end mill has {shown}; only a ball end may lean, set both to 0")

    @property
    def feed_per_tooth(self) -> float:
        """Advance from one tooth to the next, mm: ``f_z = 2π v_f / (Z ω)``."""
        return 2.0 * np.pi * self.feed / (self.mill.teeth * self.spindle)

    @property
    def tool_axes(self) -> Array:
        """(3, 3), rows: x, y, z of the tool in feed axes.

        z is the tool axis from tip to holder, x the component of the feed across z.
        """
        axis = np.array(
            [np.cos(self.lean) * np.sin(self.lead), -np.sin(self.lean), np.cos(self.lean) * np.cos(self.lead)]
        )
        x = normalise(np.array([1.0, 0.0, 0.0]) - axis[0] * axis)
        return np.stack([x, np.cross(axis, x), axis])

    @property
    def free_side(self) -> float:
        """+1 if the previous pass lies on the left of the feed (down milling), -1 on its right."""
        return 1.0 if self.milling == "down" else -1.0

    @property
    def cap_angle(self) -> float:
        """Half the opening angle of the ball's cap below the depth, rad."""
        return math.acos(min(max(1.0 - self.depth / self.mill.radius, -1.0), 1.0))

    def _refuse_shank(self) -> None:
        polar = np.linspace(0.0, self.cap_angle, SURFACE_LINES)[:, None]
        last = _last_azimuth(self, self.mill.radius * np.sin(polar))
        azimuth = -np.pi / 2.0 + (last + np.pi / 2.0) * np.linspace(0.0, 1.0, SURFACE_LINES)
        across = np.sin(polar)
        normals = np.stack(
            [
                across * np.cos(azimuth),
                self.free_side * across * np.sin(azimuth),
                -np.cos(polar) + 0.0 * azimuth,
            ],
            axis=-1,
        )
        highest = float(product(normals, self.tool_axes[2]).max())
        if highest > TOUCHING and self.depth > 0.0 and self.width > 0.0:
            above = math.degrees(math.asin(highest))
            raise ToolError(
                f"the cut reaches {above:.3g} deg above the ball's equator, where its shank begins, at depth "
                f"{self.depth:g} mm, lead {np.degrees(self.lead):g} and lean {np.degrees(self.lean):g} deg; "
                "lean less, lean back or to the free side, or cut less deep"
            )


def removal_rate(cut: Cut) -> float:
    """Compute the material removal rate, mm³/s: feed times the cut's section across the feed.

    The section is ``depth·width`` for a flat end (Olteanu, Bîșu, Tănase, Eq. 1) and ``∫ min(2c, width) dz``
    over the depth for a ball, a segment of the circle up to the height where the chord reaches the width and
    a strip above it, by elementary geometry. It doesn't depend on how a ball leans.
    """
    if cut.mill.shape == "flat":
        return cut.depth * cut.width * cut.feed
    radius = cut.mill.radius
    meeting = radius - np.sqrt(radius**2 - (cut.width / 2.0) ** 2)
    low = min(cut.depth, meeting)
    segment = radius**2 * math.acos(1.0 - low / radius) - (radius - low) * np.sqrt(low * (2.0 * radius - low))
    return float(segment + cut.width * (cut.depth - low)) * cut.feed


def swept_surface(cut: Cut) -> float:
    """Compute the surface that one tooth's edge sweeps in the material in one turn, mm²: path by chip width.

    ``R·depth·(arc of engagement)`` for a flat end; on a ball ``R² ∫ sinθ (ψ(θ) + π/2) dθ`` over the polar
    angle θ from the surface normal, with the azimuth ψ where the previous pass's groove begins. It doesn't
    depend on how a ball leans. Own derivation for `mean_cutting_power`; Olteanu et al., Eq. (1), has the
    removal rate only.
    """
    radius = cut.mill.radius
    if cut.mill.shape == "flat":
        return float(_last_azimuth(cut, np.array(radius)) + np.pi / 2.0) * radius * cut.depth
    # The groove begins where the chord equals the width: a kink between two smooth pieces.
    kink = min(cut.cap_angle, math.asin(cut.width / cut.mill.diameter))
    return sum(_zone(cut, low, high) for low, high in ((0.0, kink), (kink, cut.cap_angle)))


def _zone(cut: Cut, low: float, high: float) -> float:
    nodes, weights = _gauss()
    # θ = low + (high - low) u² removes the square root with which the azimuth starts at the kink.
    share = (nodes + 1.0) / 2.0
    polar = low + (high - low) * share**2
    chord = cut.mill.radius * np.sin(polar)
    strip = chord * cut.mill.radius * (_last_azimuth(cut, chord) + np.pi / 2.0)
    return float(np.sum(weights * strip * share)) * (high - low)


@cache
def _gauss() -> tuple[Array, Array]:
    """Compute the rule's nodes once: that takes longer than a cut's integrals."""
    return np.polynomial.legendre.leggauss(SURFACE_LINES)


def _last_azimuth(cut: Cut, chord: Array) -> Array:
    """Compute the angle from the feed towards the free side where engagement ends, rad; it starts at -π/2."""
    beyond = np.divide(cut.width, chord, out=np.full_like(chord, np.inf), where=chord > 0.0)
    return arcsin(np.minimum(beyond - 1.0, 1.0))


@dataclass(frozen=True, eq=False)
class Engaged:
    """What the moves of a motion take away of a stock: the engagement as it is, instead of one for all.

    Parameters
    ----------
    volume : (n,), mm³ that each move removes
    contact : (n,), mm² of the cutter's surface in the material, mean over the move
    """

    volume: Array
    contact: Array

    @classmethod
    def of_rows(cls, volume: Array, contact: Array, ends: IntArray) -> Engaged:
        """Join the rows of a motion that was cut to moves.

        Parameters
        ----------
        volume : (m,), mm³ that the move to each row removes
        contact : (m,), mm², of the cutter at each row
        ends : (n,), ascending, the row at which each move ends
        """
        cuts = volume > 0.0
        mean = np.where(cuts, (contact + np.roll(contact, 1) * np.roll(cuts, 1)) / 2.0, 0.0)
        volumes, means = (np.diff(np.cumsum(c)[ends], prepend=0.0) for c in (volume, mean))
        return cls(volumes, means / np.maximum(np.diff(ends, prepend=-1), 1))


@dataclass(frozen=True, eq=False)
class CutCourse:
    """What is removed over a program's time, and the power that it takes.

    Parameters
    ----------
    time : (n,), s, of each move
    volume : (n,), mm³ that each move removes
    energy : (n,), J that the cut takes in each move; None without figures of the process
    """

    time: Array
    volume: Array
    energy: Array | None

    @property
    def ends(self) -> Array:
        """Ends of steps of `STEP`, (m,) s, up to the program's."""
        return STEP * np.arange(1.0, np.ceil(float(self.time.sum()) / STEP) + 1.0)

    @property
    def rate(self) -> Array:
        """Material removal rate, mean over each step, (m,) mm³/s."""
        return self._mean(self.volume)

    @property
    def power(self) -> Array | None:
        """Power of the cut, mean over each step, (m,) W."""
        return None if self.energy is None else self._mean(self.energy)

    def _mean(self, amounts: Array) -> Array:
        sums = np.interp(self.ends, np.cumsum(self.time), np.cumsum(amounts))
        return np.diff(sums, prepend=0.0) / STEP

    def as_dict(self) -> dict[str, float | None]:
        """Return its figures as plain data for JSON."""
        power = self.power
        return {
            "volume_mm3": float(self.volume.sum()),
            "largest_rate_mm3_s": float(self.rate.max(initial=0.0)),
            "largest_power_W": None if power is None else float(power.max(initial=0.0)),
        }


def require(
    name: str,
    values: ArrayLike,
    unit: str,
    *,
    above: float = -np.inf,
    least: float = -np.inf,
    error: type[InputError] = SettingError,
) -> Array:
    """Return figures as an array; raise if one isn't finite, or not in its range: its open or closed end."""
    figures = np.asarray(values, dtype=float)
    _refuse(name, figures, ~np.isfinite(figures), unit, "it must be a finite number", error)
    _refuse(name, figures, figures <= above, unit, f"give a number above {above:g} {unit}", error)
    _refuse(name, figures, figures < least, unit, f"give {least:g} {unit} or more", error)
    return figures


def require_at_most(name: str, value: float, bound: float, unit: str, remedy: str) -> None:
    """Raise if a figure is above a bound that other figures set; `remedy` says what to change."""
    if value > bound:
        raise SettingError(f"{name} is {value:g} {unit}, above {bound:g} {unit}; {remedy}")


def _refuse(
    name: str, figures: Array, wrong: ArrayLike, unit: str, remedy: str, error: type[InputError]
) -> None:
    at = np.flatnonzero(wrong)
    if not len(at):
        return
    which = f" (value {at[0] + 1} of {figures.size})" if figures.ndim else ""
    raise error(f"{name} is {figures.flat[at[0]]:g} {unit}{which}; {remedy}")
