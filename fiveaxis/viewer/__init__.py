"""Simulation of the result in a browser: machine, part, path coloured by power; works offline."""

from fiveaxis.viewer.page import Preview, preview, render_page, write_preview
from fiveaxis.viewer.whole import WholeProgram

__all__ = ["Preview", "WholeProgram", "preview", "render_page", "write_preview"]
