"""Vectors, rotations and rigid transforms."""

from fiveaxis.geometry.vectors import Array as Array
from fiveaxis.geometry.vectors import BoolArray as BoolArray
from fiveaxis.geometry.vectors import IntArray as IntArray
from fiveaxis.geometry.vectors import angle_between as angle_between
from fiveaxis.geometry.vectors import arccos as arccos
from fiveaxis.geometry.vectors import arcsin as arcsin
from fiveaxis.geometry.vectors import arctan2 as arctan2
from fiveaxis.geometry.vectors import cross as cross
from fiveaxis.geometry.vectors import every_pair as every_pair
from fiveaxis.geometry.vectors import frame_along as frame_along
from fiveaxis.geometry.vectors import inverse_transform as inverse_transform
from fiveaxis.geometry.vectors import line_rotation as line_rotation
from fiveaxis.geometry.vectors import normalise as normalise
from fiveaxis.geometry.vectors import perpendicular as perpendicular
from fiveaxis.geometry.vectors import product as product
from fiveaxis.geometry.vectors import rotation_matrix as rotation_matrix
from fiveaxis.geometry.vectors import translation as translation
