"""The order of searches and refinements: portfolios, starts, fronts, the locations of the program."""
