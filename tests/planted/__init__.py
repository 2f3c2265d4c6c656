"""Faults planted in programs of every control, and a measure of its own of whether each matters."""
