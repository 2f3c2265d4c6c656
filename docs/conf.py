"""Sphinx's settings for this site; `build.py` puts it beside the pages that it gathers."""

from __future__ import annotations

import re
from importlib.metadata import version as installed_version
from typing import Any

project = "fiveaxis"
version = release = installed_version("fiveaxis")
project_copyright = "the fiveaxis authors, BSD-3-Clause"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_generated"]
# Two rooms have a class of the same name (Solution, Budget); an annotation that is only a name fits both.
suppress_warnings = ["ref.python"]
# `name` in a docstring is code.
default_role = "code"
myst_heading_anchors = 3
myst_enable_extensions = ["colon_fence", "deflist"]

html_theme = "furo"
html_title = "fiveaxis"
html_static_path: list[str] = []
html_copy_source = False
html_show_sphinx = False

autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
# Said by name; what numpy makes of the first fills lines.
autodoc_type_aliases = {name: name for name in ("ArrayLike", "Array", "BoolArray", "IntArray")}
# The source of an option (`fiveaxis.base.options`) has more than its default.
autodoc_preserve_defaults = False
autodoc_member_order = "bysource"
autodoc_default_options = {
    "members": True,
    # pydantic's own
    "exclude-members": "model_config, model_post_init, model_fields, model_computed_fields",
}
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

_UNDERLINE = re.compile(r"\s*-{3,}\s*")
# Literals, bold and emphasised words stay as they are.
_MARKUP = re.compile(r"(``.+?``|`.+?`|\*\*.+?\*\*|(?<![\w*])\*[^\s*](?:[^*]*[^\s*])?\*(?![\w*]))")
_PARAMETERS = ("Parameters", "Attributes")


def join_entries(lines: list[str]) -> list[str]:
    """Put the text of each parameter under its name, where numpydoc has its description.

    The package writes `name : shape, unit, what it is` and goes on in the next, indented line; numpydoc reads
    the first line as the type, and types come from the annotations here.
    """
    joined: list[str] = []
    inside = False
    for number, line in enumerate(lines):
        following = lines[number + 1] if number + 1 < len(lines) else ""
        if _UNDERLINE.fullmatch(following) and line.strip():
            inside = line.strip() in _PARAMETERS
        names, separator, text = line.partition(" : ")
        if inside and separator and not line.startswith(" "):
            joined += [names, f"    {text}"]
        else:
            joined.append(line)
    return joined


def escape_signs(line: str) -> str:
    r"""Escape what reStructuredText would read as markup: |Δq|, 2*x, W_."""
    pieces = _MARKUP.split(line)
    for index in range(0, len(pieces), 2):
        pieces[index] = re.sub(r"([|*])", r"\\\1", pieces[index])
        pieces[index] = re.sub(r"(\w)_(?=\W|$)", r"\1\\_", pieces[index])
    return "".join(pieces)


def mend_docstring(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Make plain docstrings readable for Sphinx, before napoleon sees them."""
    literal: int | None = None
    made: list[str] = []
    for line in join_entries(lines):
        indent = len(line) - len(line.lstrip())
        if literal is not None and line.strip() and indent <= literal:
            literal = None
        if literal is None and not line.lstrip().startswith(">>>"):
            line = escape_signs(line)
        if literal is None and line.rstrip().endswith("::"):
            literal = indent
        made.append(line)
    lines[:] = made


def setup(app: Any) -> dict[str, bool]:
    """Mend docstrings before napoleon reads them."""
    app.connect("autodoc-process-docstring", mend_docstring, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
