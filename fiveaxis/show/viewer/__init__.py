"""Simulation of the result in a browser: machine, part, path coloured by power; works offline."""
