"""Forward and inverse kinematics of a chain; `symbolic` has the same equations for CasADi."""

from fiveaxis.kinematics.inverse import axis_positions, redundant_axis, require_orienting, rotary_angles
from fiveaxis.kinematics.poses import (
    Jacobian,
    jacobian,
    linear_positions,
    link_poses,
    require_positioning,
    tool_axes,
    tool_poses,
)
from fiveaxis.kinematics.singularity import (
    Leaning,
    hold_singular,
    lean_range,
    singular_angles,
    singular_direction,
)
from fiveaxis.kinematics.windings import reachable_positions, within_limits

__all__ = [
    "Jacobian",
    "Leaning",
    "axis_positions",
    "hold_singular",
    "jacobian",
    "lean_range",
    "linear_positions",
    "link_poses",
    "reachable_positions",
    "redundant_axis",
    "require_orienting",
    "require_positioning",
    "rotary_angles",
    "singular_angles",
    "singular_direction",
    "tool_axes",
    "tool_poses",
    "within_limits",
]
