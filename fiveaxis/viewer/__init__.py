"""Simulation of the result in a browser: part, path coloured by power, tool and machine; works offline."""

from fiveaxis.viewer.page import render_page, write_preview
from fiveaxis.viewer.scene import build_scene
from fiveaxis.viewer.server import Preview, preview

__all__ = ["Preview", "build_scene", "preview", "render_page", "write_preview"]
