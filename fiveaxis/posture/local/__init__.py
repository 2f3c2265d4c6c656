"""Local optima: two solvers of a problem's terms, and the distance of a path from an optimum."""
