"""How far a tool strays from the path it should follow."""

import numpy as np
from scipy.spatial import cKDTree

from fiveaxis.model import Machine, tool_poses

# mm: pieces into which a path is cut to be searched, and how much farther than the nearest another may be
# whose direction still counts: a path may stand while the tool turns.
PIECE, AS_NEAR = 0.25, 1e-4
# Pieces looked at for each point: those with the nearest middle, directions counted on a lever of so many mm,
# so that where a path crosses itself the right strand is found.
CANDIDATES, LEVER = 24, 20.0


def deviations(
    tip: np.ndarray, axis: np.ndarray, path: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Measure how far points are from a path, and directions from those that belong there.

    Parameters
    ----------
    tip, axis : (s, 3), mm and unit vectors, where the tool was
    path, directions : (n, 3), mm and unit vectors, corners of the path, straight and evenly turning between

    Returns
    -------
    distance : (s,), mm, from the path
    angle : (s,), rad, from the direction there
    """
    corners, axes = _divided(path, directions)
    start, move = corners[:-1], np.diff(corners, axis=0)
    squares = np.einsum("ij,ij->i", move, move)
    near = min(CANDIDATES, len(start))
    middles = np.hstack([start + move / 2.0, LEVER * (axes[1:] + axes[:-1]) / 2.0])
    _, piece = cKDTree(middles).query(np.hstack([tip, LEVER * axis]), k=near)
    piece = piece.reshape(len(tip), near)
    ahead = tip[:, None, :] - start[piece]
    along = np.einsum("ijk,ijk->ij", ahead, move[piece])
    lengths = squares[piece]
    share = np.clip(np.divide(along, lengths, out=np.zeros_like(along), where=lengths > 0.0), 0.0, 1.0)
    distance = np.linalg.norm(ahead - share[..., None] * move[piece], axis=2)
    meant = axes[piece] + share[..., None] * (axes[piece + 1] - axes[piece])
    meant /= np.linalg.norm(meant, axis=2, keepdims=True)
    # The chord's length tells small angles better than the cosine.
    angle = 2.0 * np.arcsin(np.clip(np.linalg.norm(axis[:, None, :] - meant, axis=2) / 2.0, 0.0, 1.0))
    nearest = distance.min(axis=1)
    angle = np.where(distance <= nearest[:, None] + AS_NEAR, angle, np.inf).min(axis=1)
    return nearest, angle


def joint_path(machine: Machine, positions: np.ndarray, parts: int = 16) -> tuple[np.ndarray, np.ndarray]:
    """Poses along blocks in which all axes run linearly, (m, 3) mm and (m, 3).

    Parameters
    ----------
    positions : (n, k), mm and rad, ends of the blocks
    parts : into which each block is cut
    """
    share = np.linspace(0.0, 1.0, parts, endpoint=False)[:, None]
    between = positions[:-1, None, :] + share * np.diff(positions, axis=0)[:, None, :]
    return tool_poses(machine, np.vstack([between.reshape(-1, positions.shape[1]), positions[-1:]]))


def _divided(path: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut a path into pieces of `PIECE` at most."""
    lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
    parts = np.maximum(np.ceil(lengths / PIECE), 1).astype(int)
    before = np.repeat(np.cumsum(parts) - parts, parts)
    within = (np.arange(parts.sum()) - before) / np.repeat(parts, parts)
    row = np.append(np.repeat(np.arange(len(parts)), parts) + within, len(parts))
    rows = np.arange(len(path))
    corners, axes = (
        np.column_stack([np.interp(row, rows, column) for column in table.T]) for table in (path, directions)
    )
    return corners, axes / np.linalg.norm(axes, axis=1, keepdims=True)
