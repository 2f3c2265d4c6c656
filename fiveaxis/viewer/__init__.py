"""Simulation of the result in a browser: machine, part, path coloured by power; works offline."""

from fiveaxis.viewer.page import render_page, write_preview
from fiveaxis.viewer.server import Preview, preview

__all__ = ["Preview", "preview", "render_page", "write_preview"]
