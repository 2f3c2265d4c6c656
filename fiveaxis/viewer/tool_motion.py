"""The motions shown, a result and a baseline, as animations of few key frames."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.findings import Finding
from fiveaxis.geometry import Array, IntArray
from fiveaxis.kinematics import tool_poses
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion
from fiveaxis.toolpath import Toolpath
from fiveaxis.viewer.library import load_meshcat

if TYPE_CHECKING:
    from fiveaxis.posture.solution import Solution

# Straight moves between key frames leave the path, so there are as many as a page can hold.
MOST_FRAMES = 10_000
# s: a longer motion is shown as a time lapse of this length.
LONGEST_SHOW = 60.0
PREFERRED_BASELINES = ("as-programmed", "normal")
UP = np.array([0.0, 0.0, 1.0])
# Poses of a node at the key frames: (f, 3) mm, and quaternions x y z w, (f, 4).
Poses = tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class KeyFrames:
    """The locations shown, and their times.

    Parameters
    ----------
    rows : (f,), locations
    times : (f,), s, in the show
    pace : machine seconds per second of the show
    """

    rows: IntArray
    times: Array
    pace: float


def choose_frames(motion: Motion, pace: float | None = None) -> KeyFrames:
    """Choose at most `MOST_FRAMES` locations, evenly in time, first and last included.

    Parameters
    ----------
    motion : to show
    pace : machine seconds per second of the show; None takes that of `show_pace`
    """
    clock = _clock(motion)
    # Of locations at the same time only one can be a key frame.
    _, rows = np.unique(clock, return_index=True)
    if len(rows) > MOST_FRAMES:
        wanted = np.linspace(clock[0], clock[-1], MOST_FRAMES)
        rows = np.unique(np.searchsorted(clock, wanted).clip(0, len(motion) - 1))
    rows[-1] = len(motion) - 1
    pace = show_pace(motion) if pace is None else pace
    return KeyFrames(rows, (clock[rows] - clock[0]) / pace, pace)


def show_pace(*motions: Motion) -> float:
    """Choose the pace for motions shown together: machine seconds per second of the show, at least 1."""
    longest = max(float(np.ptp(_clock(motion))) for motion in motions)
    return max(longest / LONGEST_SHOW, 1.0)


def _clock(motion: Motion) -> Array:
    """Return the time of each location, (n,) s; one per second if no move takes time."""
    clock: Array = np.cumsum(motion.time)
    return clock if clock[-1] > 0.0 else np.arange(len(motion), dtype=float)


@dataclass(frozen=True, eq=False)
class Side:
    """A motion to show.

    Parameters
    ----------
    node : of the scene: ``after`` for the result, ``before`` for a baseline
    name : shown to the user
    motion, toolpath : row by row; a baseline with rewinds has its own locations
    frames : key frames, on the clock of both sides
    energy : J, of the feed drives
    """

    node: str
    name: str
    motion: Motion
    toolpath: Toolpath
    frames: KeyFrames
    energy: float

    def when_shown(self, finding: Finding) -> float | None:
        """Return when the show passes a finding's location, s; None if it has none."""
        row = finding.place.location
        if row is None or not 0 <= row < len(self.motion):
            return None
        return float(np.interp(row, self.frames.rows, self.frames.times))


def choose_sides(solution: Solution) -> tuple[Side, ...]:
    """Return the result and one baseline, if there is one; both start together and run at one pace."""
    path = solution.toolpath
    chosen = [("after", "result", solution.motion, path, solution.energy)]
    name = next((name for name in PREFERRED_BASELINES if name in solution.compared), None)
    if name is not None:
        baseline = solution.compared[name]
        chosen.append(("before", name, baseline.motion, baseline.toolpath or path, baseline.energy))
    pace = show_pace(*(motion for _, _, motion, _, _ in chosen))
    return tuple(
        Side(node, name, motion, path, choose_frames(motion, pace), energy.total)
        for node, name, motion, path, energy in chosen
    )


def tool_frames(machine: Machine, motion: Motion, rows: IntArray) -> Poses:
    """Compute the tool's poses at some rows of a motion.

    Returns
    -------
    tip : (f, 3), mm, workpiece frame
    quaternion : (f, 4), x y z w, turns +z into the tool axis, without spin (`transport`)
    """
    tip, axis = tool_poses(machine, motion.positions[rows])
    return tip, transport(axis)


def transport(axis: Array) -> Array:
    """Turn a tool along a sequence of axes without spin: (f, 3) unit vectors → (f, 4) quaternions x y z w.

    Every turn is the smallest one from the previous axis, so the sequence is continuous everywhere, while the
    smallest turn from +z would jump at −z.
    """
    turns = _smallest_turns(np.vstack([UP, axis[:-1]]), axis)
    turned = np.empty((len(axis), 4))
    x, y, z, w = 0.0, 0.0, 0.0, 1.0
    # Plain numbers: successive products are a hundred times faster than with arrays.
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
    """Make meshcat's animation of the moving scene nodes, by path.

    A shorter motion waits at its end for the longest, or it would restart on its own.
    """
    meshcat = load_meshcat()
    animation = meshcat.animation.Animation()
    end = max(float(frames.times[-1]) for frames, _ in moving.values())
    for name, (frames, (centre, quaternion)) in moving.items():
        # Track times are in frames of the clip; at one frame per second they are seconds.
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
    """One property of one node over time as two flat arrays, as in three.js.

    meshcat's own tracks label every value and time, which takes six times the bytes.

    Parameters
    ----------
    name, kind : property, and three.js's type of track
    times : (f,), s
    values : (f, d)
    """

    def __init__(self, name: str, kind: str, times: Array, values: Array) -> None:
        self.name, self.kind, self.times, self.values = name, kind, times, values

    def lower(self) -> dict[str, Any]:
        """Return the data for three.js."""
        pack = load_meshcat().geometry.pack_numpy_array
        times, values = (np.asarray(x, dtype=np.float32) for x in (self.times, self.values))
        return {
            "name": f".{self.name}",
            "type": self.kind,
            "times": pack(times.reshape(1, -1))["array"],
            "values": pack(values.T)["array"],
        }


def _smallest_turns(before: Array, after: Array) -> Array:
    """Compute the quaternions x y z w of the smallest turns between unit vectors, (f, 3) each."""
    half = before + after
    length = np.linalg.norm(half, axis=1)
    opposite = length < 1e-9
    # Between opposite directions: half a turn about any perpendicular.
    across = np.cross(before, np.eye(3)[np.argmin(np.abs(before), axis=1)])
    half[opposite] = across[opposite]
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    turns = np.column_stack([np.cross(before, half), np.sum(before * half, axis=1)])
    turns[opposite] = np.column_stack([half[opposite], np.zeros(int(opposite.sum()))])
    return turns
