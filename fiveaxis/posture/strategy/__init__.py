"""The order of searches and refinements: efforts, starts, fronts, the locations of the program."""
