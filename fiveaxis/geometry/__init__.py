"""Vectors, rotations and rigid transforms."""

from fiveaxis.geometry.arithmetic import arccos, arcsin, arctan2, every_pair, product
from fiveaxis.geometry.rotations import (
    frame_along,
    inverse_transform,
    line_rotation,
    rotation_matrix,
    translation,
)
from fiveaxis.geometry.vectors import Array, BoolArray, IntArray, angle_between, normalise, perpendicular

__all__ = [
    "Array",
    "BoolArray",
    "IntArray",
    "angle_between",
    "arccos",
    "arcsin",
    "arctan2",
    "every_pair",
    "frame_along",
    "inverse_transform",
    "line_rotation",
    "normalise",
    "perpendicular",
    "product",
    "rotation_matrix",
    "translation",
]
