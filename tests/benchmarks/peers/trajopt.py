"""TrajOpt on a case: run by `methods.trajopt` with the Python of an environment that has tesseract-robotics.

Usage: python trajopt.py PROBLEM.json RESULT.json

The machine is a URDF from the workpiece to the tool, with two virtual joints behind the cutter's centre: a
turn about the tool axis and the lean. So the end of the chain has a fixed pose, the surface normal at the
location, and the lean is free within its range. The cost is that of joint velocities, absolute, weighted by
J/mm and J/rad, the mean of both directions.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
from tesseract_robotics.tesseract_common import GeneralResourceLocator, Isometry3d
from tesseract_robotics.tesseract_environment import Environment
from tesseract_robotics.tesseract_motion_planners_trajopt import (
    CartPoseTermInfo,
    ConstructProblem,
    InitInfo,
    JointVelTermInfo,
    ProblemConstructionInfo,
    TermInfoPtr_vector,
)
from tesseract_robotics.tesseract_motion_planners_trajopt import (
    _tesseract_motion_planners_trajopt_python as native,
)

# TrajOpt's own bits for a cost and a constraint.
COST, CONSTRAINT = 0x1, 0x2
# rad or dm: no absolute cost below; with none at all TrajOpt takes squares.
LEAST = 1e-6
# dm: with them lengths are about as large as angles, on which the trust region depends.
DM = 0.01
# rad or dm: a round that moves nothing by more was the last one.
SAME = 1e-4
# Unit of the cost, J.
UNIT = 0.1


def urdf_of(problem: dict) -> str:
    """Write the chain as URDF, links in the workpiece's frame at home."""
    parts, before, parent = ["<link name='workpiece'/>"], np.zeros(3), "workpiece"
    for joint in problem["joints"]:
        point = DM * np.array(joint["point"])
        kind = joint["kind"]
        low, high = np.array(joint["limits"]) * (DM if kind == "prismatic" else 1.0)
        parts.append(
            f"<link name='{joint['name']}'/><joint name='j{joint['name']}' type='{kind}'>"
            f"<parent link='{parent}'/><child link='{joint['name']}'/>"
            f"<origin xyz='{' '.join(map(str, point - before))}'/>"
            f"<axis xyz='{' '.join(map(str, joint['direction']))}'/>"
            f"<limit lower='{low}' upper='{high}' velocity='1000' effort='1000'/></joint>"
        )
        before, parent = point, joint["name"]
    return f"<robot name='machine'>{''.join(parts)}</robot>"


def srdf_of(problem: dict) -> str:
    last = problem["joints"][-1]["name"]
    return (
        "<robot name='machine' version='1.0.0'><group name='all'>"
        f"<chain base_link='workpiece' tip_link='{last}'/></group></robot>"
    )


def frame(point: list[float], normal: list[float]) -> Isometry3d:
    """Pose whose z is the normal."""
    z = np.array(normal)
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    pose[:3, 3] = DM * np.array(point)
    return Isometry3d(pose)


def solve(problem: dict) -> np.ndarray:
    """Axis values with both virtual joints, (n, 7)."""
    environment = Environment()
    if not environment.init(urdf_of(problem), srdf_of(problem), GeneralResourceLocator()):
        raise SystemExit("tesseract doesn't take the machine")
    scale = np.array([DM if joint["kind"] == "prismatic" else 1.0 for joint in problem["joints"]])
    start = np.array(problem["start"]) * scale
    count, last = len(start), problem["joints"][-1]["name"]
    info = ProblemConstructionInfo(environment)
    info.kin = environment.getJointGroup("all")
    info.basic_info.n_steps = count
    info.basic_info.manip = "all"
    info.basic_info.use_time = False
    info.init_info.type = InitInfo.GIVEN_TRAJ
    free = len(problem["joints"]) - 2
    prices = np.array([*problem["prices"], 0.0, 0.0]) / scale / UNIT
    costs, constraints = TermInfoPtr_vector(), TermInfoPtr_vector()
    travel = JointVelTermInfo()
    travel.name, travel.term_type = "travel", COST
    travel.coeffs, travel.targets = prices, np.zeros(free + 2)
    travel.upper_tols, travel.lower_tols = np.full(free + 2, LEAST), np.full(free + 2, -LEAST)
    travel.first_step, travel.last_step = 0, count - 1
    costs.append(travel)
    for row, (point, normal) in enumerate(zip(problem["points"], problem["normals"], strict=True)):
        pose = CartPoseTermInfo()
        pose.name, pose.term_type, pose.timestep = f"pose {row}", CONSTRAINT, row
        pose.source_frame, pose.target_frame = last, "workpiece"
        pose.target_frame_offset = frame(point, normal)
        pose.pos_coeffs, pose.rot_coeffs = np.full(3, 1.0), np.array([10.0, 10.0, 0.0])
        constraints.append(pose)
    info.cost_infos, info.cnt_infos = costs, constraints
    trajectory = start
    begun = time.process_time()
    while time.process_time() - begun < problem["seconds"]:
        info.init_info.data = trajectory
        # The wheel's own wrapper passes a plotter that its library refuses. One call is 40 iterations.
        found = np.array(native.OptimizeProblem(ConstructProblem(info)).traj)
        moved = np.abs(found - trajectory).max()
        trajectory = found
        if moved < SAME:
            break
    return trajectory / scale


def main() -> None:
    problem = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    Path(sys.argv[2]).write_text(json.dumps(solve(problem).tolist()), encoding="utf-8")


if __name__ == "__main__":
    main()
