"""Axis motion along a path, and its timing."""
