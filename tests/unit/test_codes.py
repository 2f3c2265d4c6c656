"""The table of codes against the code that emits them."""

import ast
import re
from pathlib import Path

import pytest

from fiveaxis.base.codes import CODES, OVERRIDABLE, require_codes
from fiveaxis.base.errors import SettingError
from fiveaxis.base.findings import Severity

PACKAGE = Path(__file__).parents[2] / "fiveaxis"
# Rooms whose findings are about machine files or no findings at all.
OTHER_ROOMS = {
    "machine",
    "energy",
    "report",
    "viewer",
    "cli",
    "codes.py",
    "calibration",
    "cutting",
    "surface",
}
# Words with hyphens that are no codes.
OTHER_WORDS = {
    "as-programmed", "exact-path", "exact-stop", "hayashi-640123", "latin-1", "lead-lean",
    "head-head", "heidenhain-m128", "linuxcnc-switchkins", "machining-centre", "utf-8", "utf-8-sig",
}  # fmt: skip
# Codes that are put together from the kind of axis or body.
COMPOSED = {
    *(f"{kind}-acceleration" for kind in ("linear", "rotary")),
    *(
        f"{kind}-{what}"
        for kind in ("shank", "holder", "fixture", "machine")
        for what in ("collision", "clearance")
    ),
}


def words_in(path: Path) -> set[str]:
    """Every string of the form of a code."""
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    strings = {n.value for n in nodes if isinstance(n, ast.Constant) and isinstance(n.value, str)}
    return {s for s in strings if re.fullmatch(r"[a-z]+(-[a-z0-9]+)+", s)}


def codes_named(path: Path) -> set[str]:
    """Every string given as ``code=``."""
    nodes = [n for n in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(n, ast.Call)]
    given = [k.value for n in nodes for k in n.keywords if k.arg == "code"]
    return {v.value for v in given if isinstance(v, ast.Constant)}


SOURCES = [
    *(p for p in sorted(PACKAGE.rglob("*.py")) if OTHER_ROOMS.isdisjoint(p.relative_to(PACKAGE).parts)),
    *(PACKAGE / name for name in ("model/machine/unknown.py", "model/energy/drives.py")),
]


@pytest.fixture(scope="module")
def emitted() -> dict[str, set[str]]:
    """Codes by the file that emits them."""
    return {str(path.relative_to(PACKAGE)): words_in(path) | codes_named(path) for path in SOURCES}


def test_every_code_that_is_emitted_is_described(emitted):
    unknown = {name: words - OTHER_WORDS - set(CODES) for name, words in emitted.items()}
    assert {name: words for name, words in unknown.items() if words} == {}, (
        "describe in fiveaxis/base/codes.py"
    )


def test_every_code_that_is_described_is_emitted(emitted):
    source = "\n".join(p.read_text(encoding="utf-8") for p in SOURCES)
    assert all(f'}}-{end}"' in source for end in ("acceleration", "collision", "clearance"))
    known = COMPOSED.union(*emitted.values())
    silent = {code for code in set(CODES) - known if f'"{code}"' not in source}
    assert not silent, f"nothing emits {silent}"


def test_severities_are_those_of_findings():
    assert {code.severity for code in CODES.values()} == set(Severity)


def test_what_can_be_overridden_is_what_keeps_a_program_back():
    assert "gouge" in OVERRIDABLE
    assert "tip-deviation" in OVERRIDABLE
    assert "long-dwell" not in OVERRIDABLE
    assert require_codes(["jump", "gouge", "jump"]) == ("jump", "gouge")
    with pytest.raises(SettingError, match="unknown code 'gauge'; did you mean gouge"):
        require_codes(["gauge"])
