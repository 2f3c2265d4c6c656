"""Forward and inverse kinematics of a chain; `symbolic` has the same equations for CasADi."""

from fiveaxis.kinematics.inverse import axis_positions, require_orienting, rotary_angles
from fiveaxis.kinematics.links import link_poses
from fiveaxis.kinematics.poses import (
    linear_positions,
    positions_about,
    require_positioning,
    tool_axes,
    tool_poses,
)

__all__ = [
    "axis_positions",
    "linear_positions",
    "link_poses",
    "positions_about",
    "require_orienting",
    "require_positioning",
    "rotary_angles",
    "tool_axes",
    "tool_poses",
]
