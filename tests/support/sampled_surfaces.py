"""Surfaces that tests and benchmarks sample, and problems that are the same, told another way."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

import fiveaxis as fx
from fiveaxis.model import Body, Box, DirectionalDrive, Machine, divided_rows, refined

# Computes x, y, z of places u along a pass, 0 to 1, at the place v across, 0 to 1.
Surface = Callable[[np.ndarray, float], tuple[np.ndarray, ...]]
TURN = 2.0 * np.pi
# A described head, out of the way of everything: no spindle nose is assumed.
FAR_HEAD = Body("Z", Box((1.0, 1.0, 1.0), (0.0, 0.0, 1e4)))


def without_nose(machine: Machine) -> Machine:
    return replace(machine, bodies=(*machine.bodies, FAR_HEAD))


def cone(u: np.ndarray, v: float) -> tuple[np.ndarray, ...]:
    r = 15.0 + 18.0 * v
    return r * np.cos(TURN * u), r * np.sin(TURN * u), r


def dome(u: np.ndarray, v: float) -> tuple[np.ndarray, ...]:
    r = 30.0 * np.cos(0.3 + 0.8 * v)
    return r * np.cos(TURN * u), r * np.sin(TURN * u), 30.0 * np.sin(0.3 + 0.8 * v)


def ellipse(u: np.ndarray, v: float) -> tuple[np.ndarray, ...]:
    s = 1.0 + 0.3 * v
    return 30.0 * s * np.cos(TURN * u), 20.0 * s * np.sin(TURN * u), 10.0 * v


def wave(u: np.ndarray, v: float) -> tuple[np.ndarray, ...]:
    return 80.0 * u, 8.0 * np.sin(TURN * u) + 6.0 * v, 12.0 * v + 2.0 * np.cos(TURN * u)


def torus(u: np.ndarray, v: float) -> tuple[np.ndarray, ...]:
    r = 25.0 + 8.0 * np.cos(0.5 + v)
    return r * np.cos(TURN * u), r * np.sin(TURN * u), 8.0 * np.sin(0.5 + v)


def blade(u: np.ndarray, v: float) -> tuple[np.ndarray, ...]:
    """A ruled surface whose rulings twist by 70 deg along the pass."""
    twist = np.radians(70.0) * (u - 0.5)
    across = 25.0 * (v - 0.5)
    return 70.0 * u, across * np.sin(twist) + 10.0 * np.sin(np.pi * u), 30.0 + across * np.cos(twist)


def bowl(u: np.ndarray, v: float) -> tuple[np.ndarray, ...]:
    """The inside of a sphere, its normals upwards and inwards."""
    r = 10.0 + 15.0 * v
    return r * np.cos(-TURN * u), r * np.sin(-TURN * u), 40.0 - np.sqrt(40.0**2 - r**2)


def saddle(u: np.ndarray, v: float) -> tuple[np.ndarray, ...]:
    x, y = 60.0 * (u - 0.5), 40.0 * (v - 0.5)
    return x, y + 0.0 * u, 20.0 + x**2 / 90.0 - y**2 / 60.0


def flutes(u: np.ndarray, v: float) -> tuple[np.ndarray, ...]:
    """Half of a wall with three flutes that leans outwards."""
    r = 28.0 + 5.0 * v + 2.0 * np.sin(3.0 * np.pi * u)
    return r * np.cos(np.pi * u), r * np.sin(np.pi * u), 10.0 + 10.0 * v


def roof(u: np.ndarray, v: float) -> tuple[np.ndarray, ...]:
    """A ridge along the pass that sinks and rises."""
    return (
        60.0 * u,
        30.0 * (v - 0.5) + 0.0 * u,
        20.0 - 0.02 * (30.0 * (v - 0.5)) ** 2 + 3.0 * np.sin(TURN * u),
    )


SHAPES: dict[str, Surface] = {
    surface.__name__: surface
    for surface in (cone, dome, ellipse, wave, torus, blade, bowl, saddle, flutes, roof)
}


def sampled(surface: Surface, n: int, rings: int = 4) -> fx.Toolpath:
    """Sample passes of a surface at n + 1 places each, with its normals from differences."""
    u, e = np.linspace(0.0, 1.0, n + 1), 1e-5

    def at(u: np.ndarray, v: float) -> np.ndarray:
        return np.column_stack([np.broadcast_to(c, u.shape) for c in surface(u, v)])

    lines = np.linspace(0.0, 1.0, rings)
    contact = np.vstack([at(u, v) for v in lines])
    slopes = [((at(u + e, v) - at(u - e, v)) / e, (at(u, v + e) - at(u, v - e)) / e) for v in lines]
    normal = np.vstack([np.cross(*slope) for slope in slopes])
    return fx.Toolpath.from_contacts(contact, normal, fx.Tool.ball(8), name=surface.__name__)


def turned(path: fx.Toolpath, degrees: float) -> fx.Toolpath:
    """Turn a path about the table's axis."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return replace(path, pivot=path.pivot @ turn, contact=path.contact @ turn, normal=path.normal @ turn)


def denser(path: fx.Toolpath, times: int) -> fx.Toolpath:
    """Give a path with so many times its locations."""
    path = refined(path, divided_rows(np.full(len(path) - 1, times)))
    return replace(path, numbers=None, given=None, inserted_on=None)


def backwards(path: fx.Toolpath, machine: fx.Machine) -> tuple[fx.Toolpath, fx.Machine]:
    """Reverse a path, on a machine whose drives take as much power the other way round."""
    there = fx.Toolpath.from_contacts(path.contact[::-1], path.normal[::-1], path.tool, name=path.name)
    # A row has the feed of the move to it.
    there = replace(there, feed=np.append(path.feed[-1], path.feed[:0:-1]))

    def swapped(drive: DirectionalDrive) -> DirectionalDrive:
        return replace(drive, plus=drive.minus, minus=drive.plus)

    return there, replace(machine, axes=tuple(replace(a, drive=swapped(a.drive)) for a in machine.axes))
