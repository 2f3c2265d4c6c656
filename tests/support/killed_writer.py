"""A run that is killed while it writes."""

import signal
import subprocess
import sys
from pathlib import Path

# Killed within the folder that it would rename, when the content of a file is on its way to the disk.
RUN = """
import os, signal, sys
from pathlib import Path
from fiveaxis.base.files import temporary_folder, write_atomically
os.fsync = lambda _: os.kill(os.getpid(), signal.SIGKILL)
with temporary_folder(Path(sys.argv[1])):
    write_atomically(Path(sys.argv[1], "part.ngc"), "half")
"""


def leave_behind(folder: Path) -> list[Path]:
    """Let a process be killed while it writes into a folder; return what it leaves there."""
    before = set(folder.iterdir())
    ended = subprocess.run([sys.executable, "-c", RUN, str(folder)], check=False)
    assert ended.returncode == -signal.SIGKILL
    left = sorted(set(folder.iterdir()) - before)
    assert [path.is_dir() for path in left].count(True) == 1
    assert len(left) == 2
    return left
