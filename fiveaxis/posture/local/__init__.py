"""Local optima: two solvers of the problem's terms, and how far a path is from an optimum."""
