"""Turns: unwrapped paths brought into the axis limits, and the rewinds that they need."""
