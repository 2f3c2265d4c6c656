"""Vectors, rotations and rigid transforms."""

from fiveaxis.geometry.vectors import (
    Array,
    BoolArray,
    IntArray,
    angle_between,
    arccos,
    arcsin,
    arctan2,
    every_pair,
    frame_along,
    inverse_transform,
    line_rotation,
    normalise,
    perpendicular,
    product,
    rotation_matrix,
    translation,
)

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
