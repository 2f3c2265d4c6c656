"""Many jobs: sweeps that make many of one file, workers that run them, and one table of the results."""
