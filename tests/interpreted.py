"""LinuxCNC's stand-alone interpreter, `rs274`, in tests.

It comes with Debian's linuxcnc-uspace: ``apt-get install -y --no-install-recommends linuxcnc-uspace``.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from patience import PATIENCE

RS274 = shutil.which("rs274")
needs_rs274 = pytest.mark.skipif(
    RS274 is None, reason="rs274 isn't installed (apt-get install linuxcnc-uspace)"
)


def canonical(program: Path, *options: str, tools: str = "T3 P3 Z0 D10\n") -> str:
    """Run a program with the files beside it; return the canonical commands that it gives.

    `tools` is the tool table, in the interpreter's own unit: inches without an ini file.
    """
    program.with_name("tool.tbl").write_text(tools, encoding="ascii")
    run = subprocess.run(
        [str(RS274), *options, "-t", "tool.tbl", "-g", program.name],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        cwd=program.parent,
        check=False,
    )
    assert run.returncode == 0, run.stdout[-600:] + run.stderr[-600:]
    return run.stdout
