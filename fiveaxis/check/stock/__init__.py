"""The stock as it is cut: rays of material, what a cutter sweeps of them, and the result beside the part."""
