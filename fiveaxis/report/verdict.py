"""The verdict: what stands first on the page, and never claims more than was checked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from fiveaxis.findings import Severity
from fiveaxis.report.tables import number


def verdict_section(document: Mapping[str, Any]) -> dict[str, str]:
    """Say whether the path may go to a machine, as far as it was checked.

    Returns
    -------
    ``look`` (class), ``verdict`` (headline) and ``verdict_text`` (HTML) for the page's template
    """
    verification = document["verification"]
    look, headline = _judge(verification, document)
    parts = (
        _overridden(document),
        f"<p>{escape(_consequence(look, document))}</p>",
        '<div class="columns">',
        _listed("Not checked", verification["not_checked"]),
        _listed("Checked", verification["checked"]),
        "</div>",
    )
    return {"look": look, "verdict": escape(headline), "verdict_text": "\n".join(parts)}


def _judge(verification: Mapping[str, Any], document: Mapping[str, Any]) -> tuple[str, str]:
    if document.get("overridden"):
        return "overridden", "✗ Not safe: errors were found and overridden"
    if not verification["ok"]:
        return "unsafe", "✗ Not safe: don’t run this program"
    if not verification["checked"]:
        return "partial", "! Nothing was checked"
    if verification["not_checked"]:
        return "partial", "✓ No error found, but not everything was checked"
    return "safe", "✓ Safe: every check passed"


def _overridden(document: Mapping[str, Any]) -> str:
    """Name, as large as the headline, each error that somebody accepts, and who does."""
    codes = document.get("overridden")
    if not codes:
        return ""
    who = document.get("overridden_by") or "somebody who isn’t known"
    named = ", ".join(f"{code} ({number(n)})" for code, n in codes.items())
    written = "" if _kept_back(document) else " The NC program was written with them; its header names each."
    return f'<p class="override">Overridden: {escape(named)}</p>\n<p>By {escape(who)}.{written}</p>'


def _kept_back(document: Mapping[str, Any]) -> str:
    """Say what keeps the program back."""
    return ", ".join(f"{code} ({number(n)})" for code, n in document.get("kept_back", {}).items())


def _consequence(look: str, document: Mapping[str, Any]) -> str:
    found = _found(document["summary"])
    kept = _kept_back(document)
    program = f" No NC program was written, because of {kept}." if kept else ""
    if look in ("unsafe", "overridden"):
        until = "The savings below don’t count until the errors are mended."
        return f"Verification found {found}.{program} {until}"
    return f"Verification found {found or 'nothing to report'}.{program}"


def _found(summary: Sequence[Mapping[str, Any]]) -> str:
    """Write counts by severity: ``6 errors (axis-limit 4, tilt 2), 1 warning (tip-deviation 1)``."""
    parts = []
    for wanted in Severity:
        codes: Counter[str] = Counter()
        for cause in summary:
            if cause["severity"] == wanted:
                codes[cause["code"]] += cause["count"]
        if codes:
            total = codes.total()
            each = ", ".join(f"{code} {number(n)}" for code, n in codes.items())
            parts.append(f"{number(total)} {wanted}{'' if total == 1 else 's'} ({each})")
    return ", ".join(parts)


def _listed(head: str, sentences: Sequence[str]) -> str:
    if not sentences:
        return ""
    items = "\n".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    return f'<div><b>{head}</b>\n<ul class="small">\n{items}\n</ul></div>'
