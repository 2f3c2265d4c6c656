"""Comments that a control can't mistake for anything else."""

from __future__ import annotations

import textwrap
import unicodedata

from fiveaxis.nc.dialects import Dialect

# Brackets can't nest; the rest are signs without a plain relative in Unicode's own decompositions.
_PLAIN = str.maketrans(
    {
        "(": "[", ")": "]", "°": " deg", "·": "*", "×": "x", "−": "-", "–": "-", "—": "-", "→": "->",
        "µ": "u", "μ": "u", "ß": "ss", "ø": "o", "Ø": "d", "“": '"', "”": '"', "‘": "'", "’": "'",
    }
)  # fmt: skip


def comment_lines(text: str, dialect: Dialect) -> list[str]:
    """Write a text as comment blocks of a control.

    Everything becomes ASCII (accents are dropped, unknown signs turn into ``?``), round brackets become
    square ones, line ends become spaces, long texts are wrapped, and a text that the control would act on
    (``MSG,...``) loses its comma.

    Parameters
    ----------
    text : anything
    """
    plain = " ".join(_ascii(text).split())
    wrapped = textwrap.wrap(plain, width=dialect.comment_width, subsequent_indent="  ") or [""]
    return [dialect.comment.format(_disarmed(line, dialect)) for line in wrapped]


def _ascii(text: str) -> str:
    decomposed = unicodedata.normalize("NFKD", text.translate(_PLAIN)).translate(_PLAIN)
    kept = "".join(c for c in decomposed if not unicodedata.combining(c))
    return "".join(c if " " <= c <= "~" else " " if c.isspace() else "?" for c in kept)


def _disarmed(line: str, dialect: Dialect) -> str:
    word, comma, rest = line.partition(",")
    active = comma and word.strip().lower() in dialect.active_comments
    return f"{word} {rest}" if active else line
