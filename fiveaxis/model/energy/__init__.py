"""What motion costs: drives, totals, the power surface."""
