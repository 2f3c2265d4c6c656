"""Comments that a control can't mistake for anything else."""

from __future__ import annotations

import textwrap
import unicodedata

from fiveaxis.nc.writing.table_parts import Comments

# Brackets can't nest; the rest are signs without a plain relative in Unicode's own decompositions.
_PLAIN = str.maketrans(
    {
        "(": "[", ")": "]", "°": " deg", "·": "*", "×": "x", "−": "-", "–": "-", "—": "-", "→": "->",
        "µ": "u", "μ": "u", "ß": "ss", "ø": "o", "Ø": "d", "“": '"', "”": '"', "‘": "'", "’": "'",
    }
)  # fmt: skip


def comment_lines(text: str, form: Comments) -> list[str]:
    """Write a text as comment blocks of a control.

    Everything becomes ASCII (accents are dropped, unknown signs turn into ``?``), round brackets become
    square ones, line ends become spaces, long texts are wrapped, a text that the control would act on
    (``MSG,...``) loses its comma, and signs that end a program or go on with a line become ``_``.

    Parameters
    ----------
    text : anything
    form : of the control's comments
    """
    plain = " ".join(_ascii(text).split()).translate({ord(sign): "_" for sign in form.forbidden})
    plain = plain.upper() if form.capitals else plain
    wrapped = textwrap.wrap(plain, width=form.width, subsequent_indent="  ") or [""]
    return [form.template.format(_disarmed(line, form)) for line in wrapped]


def _ascii(text: str) -> str:
    decomposed = unicodedata.normalize("NFKD", text.translate(_PLAIN)).translate(_PLAIN)
    kept = "".join(c for c in decomposed if not unicodedata.combining(c))
    return "".join(c if " " <= c <= "~" else " " if c.isspace() else "?" for c in kept)


def _disarmed(line: str, form: Comments) -> str:
    word, comma, rest = line.partition(",")
    active = comma and word.strip().lower() in form.active
    return f"{word} {rest}" if active else line
