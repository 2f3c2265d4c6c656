"""LinuxCNC's stand-alone interpreter, `rs274`, in tests.

It comes with Debian's linuxcnc-uspace: ``apt-get install -y --no-install-recommends linuxcnc-uspace``.
"""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from support.patience import PATIENCE

RS274 = shutil.which("rs274")
needs_rs274 = pytest.mark.skipif(
    RS274 is None, reason="rs274 isn't installed (apt-get install linuxcnc-uspace)"
)

# The tools 1 to 99, of no length.
TOOLS = "".join(f"T{n} P{n} Z0 D{n + 1}\n" for n in range(1, 100))


def interpret(
    program: Path, *options: str, tools: str = TOOLS, timeout: float = PATIENCE
) -> subprocess.CompletedProcess[str]:
    """Run a program with the files beside it.

    `tools` is the tool table, in the interpreter's own unit: inches without an ini file.
    """
    program.with_name("tool.tbl").write_text(tools, encoding="ascii")
    return subprocess.run(
        [str(RS274), *options, "-t", "tool.tbl", "-g", program.name],
        capture_output=True,
        text=True,
        errors="replace",
        timeout=timeout,
        cwd=program.parent,
        # It keeps its tools in a file of the home folder, which two that run at a time would share.
        env=os.environ | {"HOME": str(program.parent)},
        check=False,
    )


def canonical(program: Path, *options: str, tools: str = TOOLS) -> str:
    """Run a program as `interpret` does; return the canonical commands that it gives."""
    run = interpret(program, *options, tools=tools)
    assert run.returncode == 0, run.stdout[-600:] + run.stderr[-600:]
    return run.stdout
