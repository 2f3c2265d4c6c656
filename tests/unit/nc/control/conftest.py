"""What the tests of reading programs share."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support import haas_trunnion as haas

from fiveaxis.model import Machine, load_machine
from fiveaxis.nc import ReadMotion, read_program


@pytest.fixture(scope="session")
def haas_trunnion() -> Machine:
    """Return the Haas trunnion."""
    return haas.haas_trunnion()


@pytest.fixture
def read_of(tmp_path: Path) -> Callable[..., ReadMotion]:
    """Read a text as a program of a control, from zero, on LinuxCNC's trunnion."""

    def read_text(text: str, control: str = "", name: str = "part.nc", **options: Any) -> ReadMotion:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        machine = load_machine("linuxcnc-xyzac-trt").with_control(control)
        given: dict[str, Any] = {"start": dict.fromkeys(machine.letters, 0.0), "rapid": 6e3} | options
        return read_program(path, machine, **given)

    return read_text
