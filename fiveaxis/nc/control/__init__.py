"""Interpretation of blocks: positions of axes and tips, row by row."""
