"""Global search: lattices of postures, and the cheapest path through them."""
