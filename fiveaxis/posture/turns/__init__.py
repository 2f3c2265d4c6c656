"""Axes with limits: angles counted on beyond a turn, and brought back."""
