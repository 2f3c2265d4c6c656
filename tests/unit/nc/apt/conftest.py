"""What the tests of APT files share."""

from collections.abc import Callable
from pathlib import Path

import pytest

from fiveaxis.model import Tool, Toolpath
from fiveaxis.nc import read_toolpath


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Toolpath]:
    """Read a text for a ball of 10 mm, if the options don't give another tool."""

    def read_text(text: str, **options: object) -> Toolpath:
        path = tmp_path / "part.apt"
        path.write_text(text, encoding="utf-8")
        return read_toolpath(path, **{"tool": Tool.ball(10)} | options)  # type: ignore[arg-type]

    return read_text
