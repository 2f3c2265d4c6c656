"""The power surface to look at: at one location over both rotary angles, and along a path as a valley.

A tip alone is held in place (`tip_surface`); at a location of a solution the contact is, and the tip moves as
the tool leans (`location_surface`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fiveaxis.base import Array, BoolArray, SettingError, angle_between, every_pair, normalise
from fiveaxis.lab import PowerSurface, posture_costs, power_surface
from fiveaxis.model import (
    Machine,
    Motion,
    TiltBounds,
    lean_range,
    linear_positions,
    move_powers,
    require_orienting,
    require_range,
    rotary_angles,
    take_machine,
    tool_axes,
)
from fiveaxis.posture import RESULT, Optimum
from fiveaxis.show.report.landscape import (
    Admits,
    PostureMap,
    feed_mm_min,
    modulo_turn,
    posture_map,
    rotary_grid,
    shown_range,
    within_limits,
)
from fiveaxis.show.report.maps import draw_location, draw_valley
from fiveaxis.show.report.plots import Drawn

CHEAPEST = "cheapest"
# deg: usual, finest and coarsest step of a grid.
SURFACE_STEP = 1.5
STEPS = (0.1, 90.0)
# rad: postures that are nearer are one.
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class LocationSurface(Drawn):
    """The power surface at one location, with what bounds the posture and what was chosen.

    Parameters
    ----------
    title : where it is
    power : S_WL and S_WR over the grid
    admissible : (g, h), whether tilt and axis limits are kept; collisions aren't looked at
    leans : bounds on the tool axis, each with the angle over the grid, (g, h) rad; none for a tip without a
        normal
    middle : rad, the second rotary axis midway between the two branches
    postures : (b, 2), rad, chain order, by program: the posture, and that of the other branch with the same
        tool axis if it is within the range
    location : its index on the path, from 0; None of a tip alone
    """

    title: str
    power: PowerSurface
    admissible: BoolArray
    leans: tuple[tuple[TiltBounds, Array], ...]
    middle: float
    postures: Mapping[str, Array]
    location: int | None = None

    def __repr__(self) -> str:
        return f"<LocationSurface, {self.title}: {self.power!r}>"

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the postures by columns, the second angle varying fastest.

        Returns
        -------
        The rotary angles (``C_deg``, ``A_deg``), ``S_WL_J``, ``S_WR_J``, ``S_W_J``, and ``admissible`` (0 or
        1) where the tool axis is bounded
        """
        first, second = np.meshgrid(self.power.first, self.power.second, indexing="ij")
        names = (*(f"{c}_deg" for c in self.power.letters), "S_WL_J", "S_WR_J", "S_W_J")
        parts = (np.degrees(first), np.degrees(second), *_parts(self.power).values())
        found: dict[str, NDArray[Any]] = {name: part.ravel() for name, part in zip(names, parts, strict=True)}
        return found | ({"admissible": self.admissible.ravel().astype(int)} if self.leans else {})

    def figure(self) -> str:
        """Draw S_WL, S_WR and S_W side by side."""
        return draw_location(self, _parts(self.power))


@dataclass(frozen=True, eq=False)
class Valley(PostureMap, Drawn):
    """The energy of postures along a path: its floor is where cheap postures lie.

    A program is cheap if it moves little, wherever its postures lie: `spent`, not `heights`.

    Parameters
    ----------
    title : which path
    letter : of the first rotary axis
    position : (m,), mm, of the pivot along the path
    postures : (m,), rad, first rotary angle of each program
    heights : (m,), J, S_W of each program's posture, without whole turns of rotary axes
    spent : (m,), J, ∫P dt of each program's moves from the start to the row
    elsewhere : baselines with locations of their own, which can't be shown on this path
    """

    title: str
    letter: str
    position: Array
    postures: Mapping[str, Array]
    heights: Mapping[str, Array]
    spent: Mapping[str, Array]
    elsewhere: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<Valley, {self.title}: {len(self.locations)} locations × {len(self.first)} angles>"

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the map by columns, the angle varying fastest.

        Returns
        -------
        ``location``, ``position_mm``, the angle (``C_deg``), ``S_W_J`` (NaN where no posture is admissible);
        and of each program at the location its angle (``optimised_C_deg``), ``optimised_S_W_J`` and
        ``optimised_spent_J``
        """
        count = len(self.first)
        found: dict[str, NDArray[Any]] = {
            "location": np.repeat(self.locations, count),
            "position_mm": np.repeat(self.position, count),
            f"{self.letter}_deg": np.tile(np.degrees(self.first), len(self.locations)),
            "S_W_J": self.cost.ravel(),
        }
        for name, angles in self.postures.items():
            found[f"{name}_{self.letter}_deg"] = np.repeat(np.degrees(angles), count)
            found[f"{name}_S_W_J"] = np.repeat(self.heights[name], count)
            found[f"{name}_spent_J"] = np.repeat(self.spent[name], count)
        return found

    def rates(self) -> dict[str, Array]:
        """Compute what the moves to each row cost, (m,) J/mm of path, by program; NaN where unknown."""
        steps = np.diff(self.position, prepend=np.nan)
        return {
            name: np.divide(
                np.diff(joules, prepend=np.nan), steps, out=np.full_like(steps, np.nan), where=steps > 0.0
            )
            for name, joules in self.spent.items()
        }

    def figure(self) -> str:
        """Draw the valley from above with the programs in it, and what their moves cost below."""
        return draw_valley(self)


def tip_surface(
    machine: Machine | str | Path,
    tip: ArrayLike | None = None,
    feed_mm_min: float = 1000.0,
    *,
    normal: ArrayLike | None = None,
    tilt: tuple[float, float] | None = None,
    step_deg: float = SURFACE_STEP,
) -> LocationSurface:
    """Compute the power surface of a tip that is held in place, with its cheapest admissible posture.

    Parameters
    ----------
    machine : two rotary and three linear axes with drives; or its name or file
    tip : (3,), mm, workpiece frame; required
    normal : (3,), of any length, out of the material; for `tilt`
    tilt : deg, smallest and largest angle between tool axis and normal
    step_deg : step of the grid

    Raises
    ------
    MachineError
        The power of an axis isn't known.
    SettingError
        No tip; a tip or normal that isn't three numbers, a tilt without a normal or the reverse, a bound or
        the step out of its range.
    """
    if tip is None:
        raise SettingError("tip is missing; give the place of the tool's tip, (x, y, z) mm, workpiece frame")
    machine = take_machine(machine)
    require_orienting(machine)
    _require_step(step_deg)
    point = _vector("tip", tip)
    grid = rotary_grid(machine, step_deg, step_deg)
    power = power_surface(machine, point, feed_mm_min, grid)
    angles = every_pair(*grid)
    leans = _leans(_tip_bounds(normal, tilt), tool_axes(machine, angles), 0)
    admissible = within_limits(machine, linear_positions(machine, point, angles))
    for bound, angle in leans:
        admissible &= (angle >= bound.low) & (angle <= bound.high)
    postures = {}
    if admissible.any():
        place = np.unravel_index(np.where(admissible, power.total, np.inf).argmin(), admissible.shape)
        postures[CHEAPEST] = _with_other_branch(machine, angles[place])
    title = f"{machine.name}, tip at {', '.join(f'{x:g}' for x in point)} mm"
    return LocationSurface(title, power, admissible, leans, lean_range(machine).middle, postures)


def location_surface(
    solution: Optimum, location: int | None = None, *, step_deg: float = SURFACE_STEP
) -> LocationSurface:
    """Compute the power surface at a location of a solution, with the postures of result and baselines.

    The feed is the median of the path's.

    Parameters
    ----------
    location : its index, from 0; the middle of the path by default
    step_deg : step of the grid

    Raises
    ------
    SettingError
        The path has no such location, or the step is out of its range.
    """
    _require_step(step_deg)
    path, machine = solution.toolpath, solution.machine
    at = len(path) // 2 if location is None else location
    if not 0 <= at < len(path):
        raise SettingError(f"location is {at}; it must be between 0 and {len(path) - 1}, the path's last")
    grid = rotary_grid(machine, step_deg, step_deg)
    angles = every_pair(*grid)
    axes = tool_axes(machine, angles)
    rows = np.full(axes[..., 0].size, at)
    tips = path.at(rows).tips(axes.reshape(-1, 3)).reshape(axes.shape)
    columns = machine.rotary_columns
    postures = {
        name: _with_other_branch(machine, motion.positions[at, columns])
        for name, motion in _programs(solution).items()
    }
    return LocationSurface(
        title=f"{Path(path.name).name}, location {at} of {len(path)}",
        power=power_surface(machine, tips, feed_mm_min(solution), grid),
        admissible=within_limits(machine, linear_positions(machine, tips, angles))
        & solution.tilt.admits(axes[None], np.array([at]))[0],
        leans=_leans(solution.tilt, axes, at),
        middle=lean_range(machine).middle,
        postures=postures,
        location=at,
    )


def path_valley(solution: Optimum, *, admits: Admits | None = None) -> Valley:
    """Compute the energy of postures along a solution's path, with those of result and baselines in it.

    Parameters
    ----------
    admits : checks which postures are clear of collisions (`fiveaxis.show.report.landscape.posture_map`);
        None if that isn't known
    """
    machine, path = solution.machine, solution.toolpath
    found, programs = posture_map(solution, admits), _programs(solution)
    letter, rows = machine.rotaries[0], found.locations
    columns, feed = machine.rotary_columns, feed_mm_min(solution)
    postures, heights, spent = {}, {}, {}
    for name, motion in programs.items():
        positions = motion.positions[rows]
        positions[:, columns] = _without_turns(machine, positions[:, columns])
        postures[name] = positions[:, columns[0]]
        heights[name] = posture_costs(machine, positions, feed).sum(axis=-1)
        spent[name] = np.cumsum((move_powers(machine, motion) * motion.time[:, None]).sum(axis=1))[rows]
    return Valley(
        **vars(found),
        title=f"{Path(path.name).name} on {machine.name}",
        letter=letter,
        position=np.cumsum(path.lengths)[rows],
        postures=postures,
        heights=heights,
        spent=spent,
        elsewhere=tuple(name for name in solution.compared if name not in programs),
    )


def _programs(solution: Optimum) -> dict[str, Motion]:
    """Return the motions of the result and of the baselines at the same locations."""
    same = {name: b.motion for name, b in solution.compared.items() if b.toolpath is None}
    return {RESULT: solution.motion, **same}


def _without_turns(machine: Machine, rotary: Array) -> Array:
    """Bring rotary angles, (..., 2) rad, chain order, into the shown ranges by whole turns."""
    columns = [modulo_turn(rotary[..., k], machine.axis(c)) for k, c in enumerate(machine.rotaries)]
    return np.stack(columns, axis=-1)


def _parts(power: PowerSurface) -> dict[str, Array]:
    return {"S_WL": power.linear, "S_WR": power.rotary, "S_W": power.total}


def _leans(tilt: TiltBounds | None, axes: Array, row: int) -> tuple[tuple[TiltBounds, Array], ...]:
    every = () if tilt is None else tilt.all
    return tuple((bound, angle_between(axes, bound.reference[row])) for bound in every)


def _tip_bounds(normal: ArrayLike | None, tilt: tuple[float, float] | None) -> TiltBounds | None:
    if normal is None and tilt is None:
        return None
    if normal is None or tilt is None:
        missing, given = ("normal", "tilt") if normal is None else ("tilt", "normal")
        raise SettingError(f"{given} needs {missing} too: the tilt is the angle between tool axis and normal")
    direction = _vector("normal", normal)
    if not direction.any():
        raise SettingError("the normal has length 0; a direction is needed")
    require_range(*tilt)
    low, high = np.radians(tilt).tolist()
    return TiltBounds(normalise(direction)[None], low, high, "normal")


def _vector(name: str, numbers: ArrayLike) -> Array:
    vector = np.asarray(numbers, dtype=float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise SettingError(f"the {name} must be three finite numbers, X, Y, Z")
    return vector


def _require_step(step: float) -> None:
    low, high = STEPS
    if not low <= step <= high:
        raise SettingError(f"step is {step:g} deg; it must be between {low:g} and {high:g} deg")


def _with_other_branch(machine: Machine, posture: Array) -> Array:
    """Return a posture, (2,) rad, and that of the other branch with the same tool axis, (b, 2), in the range.

    Near the singular direction the branches coincide.
    """
    solved = rotary_angles(machine, tool_axes(machine, posture[None]))[:, 0]
    apart = np.abs(np.sin((solved - posture) / 2.0)).max(axis=1)
    both = _without_turns(machine, np.stack([posture, solved[int(np.argmax(apart))]]))
    low, high = np.transpose([shown_range(machine.axis(c)) for c in machine.rotaries])
    seen = np.all((both[1] >= low - SAME) & (both[1] <= high + SAME)) and apart.max() > SAME
    return both if seen else both[:1]
