"""Descartes on a case: run by `methods.descartes` with the Python of an environment that has the wheel.

Usage: python descartes.py PROBLEM.json RESULT.json

At one lean after the other, Descartes samples the turn about the surface normal at every location, solves
each sample by KDL's numerical inverse kinematics, and takes the shortest way through all of them, by the
Euclidean distance of the joints. The chain is that of `trajopt`, without the lean; the turn about the tool
axis is a joint, as KDL solves for whole poses.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import tesseract_robotics
from tesseract_robotics import tesseract_command_language as language
from tesseract_robotics.tesseract_common import GeneralResourceLocator, Isometry3d, ManipulatorInfo
from tesseract_robotics.tesseract_environment import Environment
from tesseract_robotics.tesseract_motion_planners import PlannerRequest
from tesseract_robotics.tesseract_motion_planners_descartes import (
    DescartesDefaultPlanProfileD,
    DescartesMotionPlannerD,
    cast_DescartesPlanProfileD,
)
from trajopt import DM, frame, srdf_of, urdf_of

# rad, between samples about the normal.
STEP = np.radians(6.0)
PLUGINS = """kinematic_plugins:
  search_paths: ["{folder}"]
  search_libraries: ["{library}"]
  inv_kin_plugins:
    all:
      default: KDL
      plugins:
        KDL: {{class: KDLInvKinChainLMAFactory, config: {{base_link: workpiece, tip_link: "{last}"}}}}
"""


def environment_of(problem: dict, folder: str) -> Environment:
    """Load the machine, with KDL's inverse kinematics of its chain."""
    libraries = Path(tesseract_robotics.__file__).parents[1] / "tesseract_robotics.libs"
    kdl = next(libraries.glob("libtesseract_kinematics_kdl_factories*")).stem.removeprefix("lib")
    file = Path(folder) / "plugins.yaml"
    last = problem["joints"][-1]["name"]
    file.write_text(PLUGINS.format(folder=libraries, library=kdl, last=last), encoding="utf-8")
    plugins = f"<kinematics_plugin_config filename='file://{file}'/></robot>"
    environment = Environment()
    srdf = srdf_of(problem).replace("</robot>", plugins)
    if not environment.init(urdf_of(problem), srdf, GeneralResourceLocator()):
        raise SystemExit("tesseract doesn't take the machine")
    return environment


def program_of(problem: dict, lean: float) -> language.CompositeInstruction:
    """Ask for all locations, with the tool leaned by one angle from the normal."""
    leaned = np.eye(4)
    leaned[1:3, 1:3] = [[np.cos(lean), -np.sin(lean)], [np.sin(lean), np.cos(lean)]]
    tool = ManipulatorInfo("all", "workpiece", problem["joints"][-1]["name"])
    tool.tcp_offset = Isometry3d(leaned)
    program = language.CompositeInstruction("path")
    program.setManipulatorInfo(tool)
    for point, normal in zip(problem["points"], problem["normals"], strict=True):
        place = language.CartesianWaypointPoly_wrap_CartesianWaypoint(
            language.CartesianWaypoint(frame(point, normal))
        )
        move = language.MoveInstruction(place, language.MoveInstructionType_LINEAR, "path")
        program.appendMoveInstruction(language.MoveInstructionPoly_wrap_MoveInstruction(move))
    return program


def profiles() -> language.ProfileDictionary:
    """Sample the whole turn about the normal; nothing is there to collide with."""
    sampled = DescartesDefaultPlanProfileD()
    sampled.target_pose_fixed = False
    sampled.target_pose_sample_axis = np.array([0.0, 0.0, 1.0])
    sampled.target_pose_sample_resolution = STEP
    sampled.target_pose_sample_min, sampled.target_pose_sample_max = -np.pi, np.pi - STEP
    sampled.allow_collision, sampled.enable_collision, sampled.enable_edge_collision = True, False, False
    found = language.ProfileDictionary()
    found.addProfile("Descartes", "path", cast_DescartesPlanProfileD(sampled))
    return found


def solve(environment: Environment, problem: dict, lean: float) -> list[list[float]] | None:
    """Joint values at all locations, (n, 6) dm and rad; None where Descartes finds no way."""
    request = PlannerRequest()
    request.env, request.profiles = environment, profiles()
    request.instructions = program_of(problem, lean)
    answer = DescartesMotionPlannerD("Descartes").solve(request)
    if not answer.successful:
        return None
    rows = []
    for row in range(len(answer.results)):
        move = language.InstructionPoly_as_MoveInstructionPoly(answer.results[row])
        state = language.WaypointPoly_as_StateWaypointPoly(move.getWaypoint())
        rows.append(np.array(state.getPosition()).ravel())
    scale = np.array([DM if joint["kind"] == "prismatic" else 1.0 for joint in problem["joints"]])
    return (np.array(rows) / scale).tolist()


def main() -> None:
    problem = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    begun, found = time.process_time(), []
    with tempfile.TemporaryDirectory() as folder:
        environment = environment_of(problem, folder)
        for number, lean in enumerate(problem["leans"], start=1):
            found.append(solve(environment, problem, lean))
            if (time.process_time() - begun) * (number + 1) / number > problem["seconds"]:
                break
    Path(sys.argv[2]).write_text(json.dumps([rows for rows in found if rows]), encoding="utf-8")


if __name__ == "__main__":
    main()
