"""Make `part.stl`: a solid three-lobed vase on a foot, whose wall leans outward all the way up.

Above the foot the mean radius grows with a slope that increases with z, so every normal of the wall points
downward and the overhang gets stronger towards the rim; the lobes grow and turn a little on the way. The foot
leaves room for the ball between wall and table. The part stands with its flat base at z = 0 on the C axis.
The file is the same byte for byte at every run.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

HEIGHT = 36.0  # mm
FOOT_HEIGHT, FOOT_RADIUS = 6.0, 6.5  # mm
AROUND, UP = 120, 30  # facets


def wall_points() -> np.ndarray:
    """Place the wall's vertices, (`UP` + 1, `AROUND`, 3) mm, ring by ring from the base up."""
    z = np.linspace(0.0, HEIGHT, UP + 1)[:, None]
    angle = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)[None, :]
    share = np.maximum(z - FOOT_HEIGHT, 0.0) / (HEIGHT - FOOT_HEIGHT)
    mean = FOOT_RADIUS + 2.0 * share + 7.0 * share**2
    radius = mean * (1.0 + (0.04 + 0.06 * share) * np.cos(3.0 * angle + 0.5 * share))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z + 0.0 * angle], axis=2)


def make_part() -> trimesh.Trimesh:
    """Close the wall with a flat base and a flat top."""
    k = np.arange(UP * AROUND)
    right = k // AROUND * AROUND + (k + 1) % AROUND
    wall = np.concatenate(
        [np.stack([k, right, right + AROUND], 1), np.stack([k, right + AROUND, k + AROUND], 1)]
    )
    ring, after = np.arange(AROUND), (np.arange(AROUND) + 1) % AROUND
    base_centre = (UP + 1) * AROUND
    base = np.stack([np.full(AROUND, base_centre), after, ring], 1)
    top = np.stack([np.full(AROUND, base_centre + 1), ring, after], 1)
    top[:, 1:] += UP * AROUND
    vertices = np.vstack([wall_points().reshape(-1, 3), [[0.0, 0.0, 0.0], [0.0, 0.0, HEIGHT]]])
    return trimesh.Trimesh(vertices, np.concatenate([wall, base, top]), process=False)


if __name__ == "__main__":
    target = Path(__file__).with_name("part.stl")
    part = make_part()
    part.export(target)
    size = " x ".join(f"{extent:.1f}" for extent in part.extents)
    print(f"{target.name}: {len(part.faces)} triangles, {size} mm, watertight: {part.is_watertight}")
