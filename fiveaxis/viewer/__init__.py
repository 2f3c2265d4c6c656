"""See the result: part, path coloured by energy, and the tool at work, in a browser and offline."""

from fiveaxis.viewer.page import render_page, write_preview
from fiveaxis.viewer.scene import build_scene
from fiveaxis.viewer.server import Preview, preview

__all__ = ["Preview", "build_scene", "preview", "render_page", "write_preview"]
