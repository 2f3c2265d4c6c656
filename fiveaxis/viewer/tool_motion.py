"""The tool's way as an animation of few key frames."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.kinematics import tool_poses
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion
from fiveaxis.viewer.library import load_meshcat

# Straight ways between key frames leave the path, so there are as many as a page can carry.
MOST_FRAMES = 10_000
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


def choose_frames(motion: Motion, pace: float | None = None) -> KeyFrames:
    """Choose at most `MOST_FRAMES` locations, evenly in time, first and last included.

    Parameters
    ----------
    motion : what is shown
    pace : machine seconds in one second of the show; None takes the motion's own, see `show_pace`
    """
    clock = _clock(motion)
    # One location of those at one time: a key frame has a time of its own.
    _, rows = np.unique(clock, return_index=True)
    if len(rows) > MOST_FRAMES:
        wanted = np.linspace(clock[0], clock[-1], MOST_FRAMES)
        rows = np.unique(np.searchsorted(clock, wanted).clip(0, len(motion) - 1))
    rows[-1] = len(motion) - 1
    pace = show_pace(motion) if pace is None else pace
    return KeyFrames(rows, (clock[rows] - clock[0]) / pace, pace)


def show_pace(*motions: Motion) -> float:
    """Choose the pace at which motions are shown together: machine seconds in one of the show, 1 or more."""
    longest = max(float(np.ptp(_clock(motion))) for motion in motions)
    return max(longest / LONGEST_SHOW, 1.0)


def _clock(motion: Motion) -> Array:
    """When each location is reached, (n,) s; one a second where no move takes time."""
    clock: Array = np.cumsum(motion.time)
    return clock if clock[-1] > 0.0 else np.arange(len(motion), dtype=float)


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
    turns = _smallest_turns(np.vstack([UP, axis[:-1]]), axis)
    turned = np.empty((len(axis), 4))
    x, y, z, w = 0.0, 0.0, 0.0, 1.0
    # Numbers, not arrays: one product after the other is a hundred times quicker with them.
    for i, (a, b, c, d) in enumerate(turns.tolist()):
        x, y, z, w = (
            d * x + a * w + b * z - c * y,
            d * y + b * w + c * x - a * z,
            d * z + c * w + a * y - b * x,
            d * w - a * x - b * y - c * z,
        )
        length = math.sqrt(x * x + y * y + z * z + w * w)
        x, y, z, w = x / length, y / length, z / length, w / length
        turned[i] = x, y, z, w
    return turned


def make_animation(vis: Any, moving: Mapping[str, tuple[KeyFrames, Poses]]) -> Any:
    """Make meshcat's animation of what moves, by the path of its scene node.

    All run for the time of the longest; a shorter one waits at its end, or each would start again on its own.
    """
    meshcat = load_meshcat()
    animation = meshcat.animation.Animation()
    end = max(float(frames.times[-1]) for frames, _ in moving.values())
    for name, (frames, (centre, quaternion)) in moving.items():
        # Track times count in frames of the clip; at one frame per second they are seconds.
        rows = np.arange(len(frames.times))
        times = frames.times
        if times[-1] < end:
            times, rows = np.append(times, end), np.append(rows, rows[-1])
        tracks = {
            "position": PackedTrack("position", "vector3", times, centre[rows]),
            "quaternion": PackedTrack("quaternion", "quaternion", times, quaternion[rows]),
        }
        clip = meshcat.animation.AnimationClip(tracks=tracks, fps=1, name="default")
        animation.clips[vis[name].path] = clip
    return animation


class PackedTrack:
    """One property of one node over time, as three.js keeps it: two flat arrays.

    meshcat's own tracks name every key and every time, six times as many bytes.

    Parameters
    ----------
    name, kind : property, and three.js's type of track
    times : (f,), s
    values : (f, d)
    """

    def __init__(self, name: str, kind: str, times: Array, values: Array) -> None:
        self.name, self.kind, self.times, self.values = name, kind, times, values

    def lower(self) -> dict[str, Any]:
        """Give what three.js reads."""
        pack = load_meshcat().geometry.pack_numpy_array
        times, values = (np.asarray(x, dtype=np.float32) for x in (self.times, self.values))
        return {
            "name": f".{self.name}",
            "type": self.kind,
            "times": pack(times.reshape(1, -1))["array"],
            "values": pack(values.T)["array"],
        }


def _smallest_turns(before: Array, after: Array) -> Array:
    """Give the quaternions x y z w of the smallest turns between unit vectors, (f, 3) each."""
    half = before + after
    length = np.linalg.norm(half, axis=1)
    opposite = length < 1e-9
    # Half a turn about anything across, where directions are opposite.
    across = np.cross(before, np.eye(3)[np.argmin(np.abs(before), axis=1)])
    half[opposite] = across[opposite]
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    turns = np.column_stack([np.cross(before, half), np.sum(before * half, axis=1)])
    turns[opposite] = np.column_stack([half[opposite], np.zeros(int(opposite.sum()))])
    return turns
