"""A machine's chain for the scripts that run with the wheel's Python, where the package isn't installed.

The cutter's centre has to be at a location's point, so the rotary angles settle the linear axes. All arrays
may have any shape before their last axis; axes are in the order of the chain.
"""

from __future__ import annotations

import numpy as np

# rad, of the differences that make the derivatives.
STEP = 1e-5


class Chain:
    """Joints from the workpiece to the cutter's centre: two rotary and three linear ones, in any order."""

    def __init__(self, joints: list[dict], centre: list[float]) -> None:
        self.rotary = [joint for joint in joints if joint["kind"] == "revolute"]
        self.linear = [joint for joint in joints if joint["kind"] == "prismatic"]
        self.joints, self.centre = joints, np.array(centre)
        self.columns = [joints.index(joint) for joint in self.rotary]
        self.rest = [joints.index(joint) for joint in self.linear]

    def values(self, rotary: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """All axis values, (..., 5) mm and rad, and the direction of the tool on the workpiece, (..., 3)."""
        shape = np.broadcast_shapes(rotary.shape[:-1], points.shape[:-1])
        centre = np.broadcast_to(self.centre, (*shape, 3))
        axis = np.broadcast_to([0.0, 0.0, 1.0], (*shape, 3))
        slides: list[np.ndarray] = []
        for joint in reversed(self.joints):
            if joint["kind"] == "prismatic":
                slides.append(np.broadcast_to(joint["direction"], (*shape, 3)))
                continue
            angle = np.broadcast_to(rotary[..., self.rotary.index(joint)], shape)
            point = np.array(joint["point"])
            centre = turned(centre - point, joint["direction"], angle) + point
            axis = turned(axis, joint["direction"], angle)
            slides = [turned(slide, joint["direction"], angle) for slide in slides]
        spans = np.stack(slides[::-1], axis=-1)
        found = np.empty((*shape, len(self.joints)))
        found[..., self.columns] = rotary
        found[..., self.rest] = np.linalg.solve(spans, (points - centre)[..., None])[..., 0]
        return found, axis

    def derivatives(self, rotary: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives by both angles of axis values, (..., 5, 2), and of the direction, (..., 3, 2)."""
        sides = [
            [self.values(rotary + sign * STEP * unit, points) for sign in (1.0, -1.0)] for unit in np.eye(2)
        ]
        values, axes = (
            np.stack([(up[which] - down[which]) / (2.0 * STEP) for up, down in sides], axis=-1)
            for which in (0, 1)
        )
        return values, axes


def turned(vectors: np.ndarray, line: list[float], angle: np.ndarray) -> np.ndarray:
    """Turn vectors, (..., 3), about a unit line by angles, (...), by Rodrigues' formula."""
    line, cos, sin = np.array(line), np.cos(angle)[..., None], np.sin(angle)[..., None]
    return vectors * cos + np.cross(line, vectors) * sin + line * (vectors @ line)[..., None] * (1.0 - cos)


def limits_of(problem: dict) -> np.ndarray:
    """Limits of all axes, (5, 2) mm and rad, in the order of the chain."""
    return np.array([joint["limits"] for joint in problem["joints"]])


def urdf_of(problem: dict) -> tuple[str, str]:
    """Write the chain as URDF, links in the workpiece's frame at home, in mm; and its SRDF."""
    parts, before, parent = ["<link name='workpiece'/>"], np.zeros(3), "workpiece"
    for joint in problem["joints"]:
        point, (low, high) = np.array(joint["point"]), np.clip(joint["limits"], -1e6, 1e6)
        name = "tool" if joint is problem["joints"][-1] else joint["name"]
        parts.append(
            f"<link name='{name}'/><joint name='{joint['name']}' type='{joint['kind']}'>"
            f"<parent link='{parent}'/><child link='{name}'/>"
            f"<origin xyz='{' '.join(map(str, point - before))}'/>"
            f"<axis xyz='{' '.join(map(str, joint['direction']))}'/>"
            f"<limit lower='{low}' upper='{high}' velocity='1000' effort='1000'/></joint>"
        )
        before, parent = point, name
    space = "xmlns:tesseract='http://ros.org/wiki/tesseract' tesseract:make_convex='true'"
    group = "<group name='all'><chain base_link='workpiece' tip_link='tool'/></group>"
    urdf = f"<robot name='machine' {space}>{''.join(parts)}</robot>"
    return urdf, f"<robot name='machine' version='1.0.0'>{group}</robot>"
