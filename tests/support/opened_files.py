"""Count how often a run opens each file of a folder; a process of its own, as nobody can take a hook back."""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

SCRIPT = """
import json, os, sys
from collections import Counter
folder, out = (os.path.realpath(text) for text in sys.argv[1:3])
opened = Counter()

def count(event, given):
    if event == "open" and isinstance(given[0], (str, bytes, os.PathLike)):
        path = os.path.realpath(os.fsdecode(given[0]))
        written = given[2] & (os.O_WRONLY | os.O_RDWR | os.O_DIRECTORY)
        if os.path.dirname(path) == folder and not written and os.path.isfile(path):
            opened[os.path.basename(path)] += 1

sys.addaudithook(count)
os.chdir(folder)
try:
    exec(sys.argv[3])
except SystemExit as ended:
    if ended.code:
        sys.exit(f"ended with {ended.code}")
with open(out, "w") as file:
    json.dump(opened, file)
"""


def count_opened(folder: Path, act: str) -> dict[str, int]:
    """Run Python text in a folder, and count how often each of its files is opened to be read."""
    out = folder / "counts" / "opened.json"
    out.parent.mkdir()
    command = [sys.executable, "-c", SCRIPT, str(folder), str(out), act]
    done = subprocess.run(command, check=False, capture_output=True, text=True, env=dict(os.environ))
    assert done.returncode == 0, done.stdout + done.stderr
    counts: dict[str, int] = json.loads(out.read_text(encoding="utf-8"))
    return counts


def command(*words: Any) -> str:
    """Return the Python text that runs a command of fiveaxis."""
    given: Sequence[str] = [str(word) for word in words]
    return f"import sys; sys.argv = ['fiveaxis', *{given!r}]; from fiveaxis.cli import main; main()"
