"""A certified lower bound of the cost."""
