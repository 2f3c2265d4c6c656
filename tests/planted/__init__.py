"""Faults planted in programs of every control, and an independent measure of whether each matters."""
