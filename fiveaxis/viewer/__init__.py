"""Simulation of the result in a browser: machine, part, path coloured by power; works offline."""

from fiveaxis.viewer.page import Preview as Preview
from fiveaxis.viewer.page import preview as preview
from fiveaxis.viewer.page import render_page as render_page
from fiveaxis.viewer.page import write_preview as write_preview
from fiveaxis.viewer.whole import WholeProgram as WholeProgram
