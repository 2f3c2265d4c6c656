"""What is searched and refined in which order: portfolios, starts, fronts, the locations of the program."""
