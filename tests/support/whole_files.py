"""All operations of a program or CL file: tests of its reading look at every block."""

from pathlib import Path
from typing import Any

import fiveaxis as fx


def each_path(file: Path, **options: Any) -> list[fx.Toolpath]:
    """Read each operation of a file as a path."""
    reading = {name: value for name, value in options.items() if name != "tool"}
    numbers = [operation.number for operation in fx.read_operations(file, **reading)]
    return [fx.read_toolpath(file, operation=number, **options) for number in numbers]
