"""What the header of a program by this package states for its readers."""

from __future__ import annotations

import re

from fiveaxis.nc.source import Source

# Lines that are searched.
HEAD = 100
# A comment of any control; a second blank begins the continuation of a longer one.
_COMMENT = r"\s*(?:N?[0-9]+ )?[(;] ?{}: ([^)]*?)\W*"


def stated(source: Source, name: str) -> str | None:
    """Return what the header states under a name, in lower case; None if it states nothing.

    Only a comment of its own counts, not the same words in the name of a file or a machine.
    """
    pattern = re.compile(_COMMENT.format(re.escape(name)), re.IGNORECASE)
    found = (pattern.fullmatch(text[:200]) for text in source.lines[:HEAD])
    return next((match[1].lower() for match in found if match is not None), None)
