"""Forward and inverse kinematics of a chain; `symbolic` has the same equations for CasADi."""

from fiveaxis.kinematics.inverse import axis_positions as axis_positions
from fiveaxis.kinematics.inverse import redundant_axis as redundant_axis
from fiveaxis.kinematics.inverse import require_orienting as require_orienting
from fiveaxis.kinematics.inverse import rotary_angles as rotary_angles
from fiveaxis.kinematics.poses import Jacobian as Jacobian
from fiveaxis.kinematics.poses import jacobian as jacobian
from fiveaxis.kinematics.poses import linear_positions as linear_positions
from fiveaxis.kinematics.poses import link_poses as link_poses
from fiveaxis.kinematics.poses import require_positioning as require_positioning
from fiveaxis.kinematics.poses import tool_axes as tool_axes
from fiveaxis.kinematics.poses import tool_poses as tool_poses
from fiveaxis.kinematics.singularity import Leaning as Leaning
from fiveaxis.kinematics.singularity import hold_singular as hold_singular
from fiveaxis.kinematics.singularity import lean_range as lean_range
from fiveaxis.kinematics.singularity import singular_angles as singular_angles
from fiveaxis.kinematics.singularity import singular_direction as singular_direction
from fiveaxis.kinematics.windings import reachable_positions as reachable_positions
from fiveaxis.kinematics.windings import within_limits as within_limits
