"""Vectors, rotations and rigid transforms."""
