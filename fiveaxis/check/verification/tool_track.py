"""The track of a program's tool between its rows, as points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, angle_between
from fiveaxis.check.verification.check_context import CheckContext
from fiveaxis.check.verification.model import tool_poses
from fiveaxis.model import PATH_TOLERANCE, MoveKind, Toolpath, divided_rows, turned

# Points per block at which it is compared: with joint interpolation at least 4, under TCP at least its end;
# more if it passes several of the path's shortest chords (longer than SHORTEST_CHORD, mm), or if the tool
# turns so far that its centre swings out beside the tip.
LEAST_POINTS, MOST_POINTS = 4, 400
SHORTEST_CHORD = 1e-2


@dataclass(frozen=True, eq=False)
class Track:
    """The track of a program's tool, as points.

    Parameters
    ----------
    centre, axis : (m, 3), mm and unit vectors
    row : (m,), of the program, where the block ends
    place : (m,), fractional row of the program: 3.25 lies in the block to row 4
    linking, rapid : (m,), whether the block is a link, which leaves the path on purpose, or a rapid move
    """

    centre: Array
    axis: Array
    row: IntArray
    place: Array
    linking: BoolArray
    rapid: BoolArray

    @classmethod
    def of(
        cls, context: CheckContext, path: Toolpath, *, tcp_height: float | None, in_planes: bool = False
    ) -> Track:
        """Sample a program's moves, with all axes linear in time or a point of the tool moving straight.

        Parameters
        ----------
        tcp_height : height of that point above the tip, mm; None with joint interpolation
        in_planes : whether the tool turns in the plane of its two directions meanwhile, instead of with the
            rotary axes in proportion
        """
        tip, axis = context.tip, context.axis
        height = context.toolpath.zone.height
        length = np.nan_to_num(np.linalg.norm(np.diff(tip + height * axis, axis=0), axis=1))
        chords = path.lengths[path.lengths > SHORTEST_CHORD]
        passed = length / (chords.min() if len(chords) else np.inf)
        # A pivot off the axis swings about the centre, and the centre about a tip that moves straight.
        arm = abs(path.zone.offset) + (abs(height - tcp_height) if tcp_height is not None else 0.0)
        turn = np.nan_to_num(angle_between(axis[:-1], axis[1:]))
        swings = np.ceil(turn * np.sqrt(arm / (8.0 * PATH_TOLERANCE)))
        least, points = (LEAST_POINTS, np.ceil(2.0 * passed)) if tcp_height is None else (1, np.round(passed))
        parts = np.clip(np.maximum(points, swings), least, MOST_POINTS)
        place = divided_rows(parts.astype(np.int64))
        row = np.ceil(place).astype(np.int64)
        before, share = np.maximum(row - 1, 0), (place - row + 1.0)[:, None]
        positions = context.positions[before] + share * (context.positions[row] - context.positions[before])
        point, axes = tool_poses(context.machine, positions)
        if tcp_height is not None:
            axes = turned(axis, place) if in_planes else axes
            ends = tip + tcp_height * axis
            point = ends[before] + share * (ends[row] - ends[before]) - tcp_height * axes
        kind = context.toolpath.kind[row]
        linking, rapid = np.asarray(kind == MoveKind.LINK), np.asarray(kind == MoveKind.RAPID)
        return cls(point + height * axes, axes, row, place, linking, rapid)
