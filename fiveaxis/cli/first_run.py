"""What the first run on a computer says: that it takes longer, and why."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

NOTE = "compiling, once per installation: this first run takes about a quarter of a minute longer"


def tell_first_run(kernel: Any, console: Console) -> None:
    """Say once that loops are being compiled, where none has been kept from an earlier run.

    Parameters
    ----------
    kernel : a function that numba compiles and keeps; one stands for all
    console : where it is said
    """
    folder = kernel.stats.cache_path
    name = f"{kernel.py_func.__module__.rpartition('.')[2]}.{kernel.py_func.__qualname__}-*.nbi"
    if folder is not None and not any(Path(folder).glob(name)):
        console.print(NOTE)
