"""The tool's way as an animation of few key frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.kinematics import tool_poses
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion
from fiveaxis.viewer.library import load_meshcat

MOST_FRAMES = 600
# A longer motion is shown as a time lapse of this length, s.
LONGEST_SHOW = 60.0
UP = np.array([0.0, 0.0, 1.0])
# Where a node of the scene is, key frame by key frame: (f, 3) mm, and quaternions x y z w, (f, 4).
Poses = tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class KeyFrames:
    """Which locations are shown, and when.

    Parameters
    ----------
    rows : (f,), locations
    times : (f,), s, in the show
    pace : machine seconds in one second of the show
    """

    rows: IntArray
    times: Array
    pace: float


def choose_frames(motion: Motion) -> KeyFrames:
    """Choose at most `MOST_FRAMES` locations, evenly in time, first and last included."""
    clock = np.cumsum(motion.time)
    if not clock[-1] > 0.0:
        clock = np.arange(len(motion), dtype=float)
    wanted = np.linspace(clock[0], clock[-1], min(MOST_FRAMES, len(motion)))
    rows = np.unique(np.searchsorted(clock, wanted).clip(0, len(motion) - 1))
    duration = float(clock[-1] - clock[0])
    pace = max(duration / LONGEST_SHOW, 1.0)
    return KeyFrames(rows, (clock[rows] - clock[0]) / pace, pace)


def tool_frames(machine: Machine, motion: Motion, rows: IntArray) -> Poses:
    """Place the tip and turn the tool at some locations, relative to the workpiece.

    Returns
    -------
    tip : (f, 3), mm, workpiece frame
    quaternion : (f, 4), x y z w, turns +z into the tool axis; each the shortest way from the one before
    """
    tip, axis = tool_poses(machine, motion.positions[rows])
    return tip, transport(axis)


def transport(axis: Array) -> Array:
    """Turn a tool along a sequence of axes without spin: (f, 3) unit vectors → (f, 4) quaternions x y z w.

    Every turn is the smallest one from the axis before, so there is no direction in which the sequence
    breaks, as the smallest turn from +z alone would at −z.
    """
    turned = np.empty((len(axis), 4))
    before, quaternion = UP, np.array([0.0, 0.0, 0.0, 1.0])
    for i, after in enumerate(axis):
        quaternion = _multiply(_smallest_turn(before, after), quaternion)
        quaternion /= np.linalg.norm(quaternion)
        turned[i], before = quaternion, after
    return turned


def make_animation(vis: Any, frames: KeyFrames, moving: dict[str, Poses]) -> Any:
    """Make meshcat's animation of what moves, by the path of its scene node."""
    meshcat = load_meshcat()
    animation = meshcat.animation.Animation()
    # Track times count in frames of the clip; at one frame per second they are seconds.
    times = [float(t) for t in frames.times]
    for name, (centre, quaternion) in moving.items():
        tracks = {
            "position": _track("position", "vector3", times, centre),
            "quaternion": _track("quaternion", "quaternion", times, quaternion),
        }
        clip = meshcat.animation.AnimationClip(tracks=tracks, fps=1, name="default")
        animation.clips[vis[name].path] = clip
    return animation


def _track(name: str, kind: str, times: list[float], values: Array) -> Any:
    track = load_meshcat().animation.AnimationTrack
    return track(name, kind, frames=times, values=[[float(v) for v in row] for row in values])


def _smallest_turn(before: Array, after: Array) -> Array:
    """Give the quaternion x y z w of the smallest turn between two unit vectors."""
    half = before + after
    length = np.linalg.norm(half)
    if length < 1e-9:
        # Opposite directions: half a turn about anything across.
        across = np.cross(before, np.eye(3)[np.argmin(np.abs(before))])
        return np.append(across / np.linalg.norm(across), 0.0)
    half = half / length
    return np.append(np.cross(before, half), before @ half)


def _multiply(a: Array, b: Array) -> Array:
    """Multiply quaternions x y z w: first b, then a."""
    vector = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])
    return np.append(vector, a[3] * b[3] - a[:3] @ b[:3])
