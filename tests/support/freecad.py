"""FreeCAD without a window, with the dress-up of `examples/freecad`.

It comes with Debian's freecad: ``apt-get install -y --no-install-recommends freecad``.
"""

import json
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from support.patience import PATIENCE
from support.wavering_pass import wavering

FREECAD = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
needs_freecad = pytest.mark.skipif(
    FREECAD is None, reason="freecadcmd isn't installed (apt-get install --no-install-recommends freecad)"
)

EXAMPLE = Path(__file__).parents[2] / "examples" / "freecad"
FIVEAXIS = shlex.join([sys.executable, "-m", "fiveaxis.cli"])
OPTIONS = "-m linuxcnc-xyzac-trt --tool ball:6 --cone 15 --objective time --effort quick"
FEED = 10.0  # mm/s

BEFORE = """
import json, sys
sys.path.insert(0, {example!r})
import FreeCAD, Path
import fiveaxis_dressup as dressup
given = json.loads({given!r})
document = FreeCAD.newDocument("test")
document.UndoMode = 1
def plain(obj):
    return [[command.Name, command.Parameters] for command in obj.Path.Commands]
def answer(value):
    with open({answer!r}, "w", encoding="utf-8") as file:
        json.dump(value, file)
base = document.addObject("Path::Feature", "Wall")
base.Path = Path.Path([Path.Command(name, words) for name, words in given["commands"]])
job = document.addObject("App::DocumentObjectGroup", "Operations")
job.Group = [base]
document.recompute()
def members():
    return [each.Name for each in job.Group]
"""


def wavering_commands() -> list[tuple[str, dict[str, float]]]:
    """Return a path whose tool axis wavers, with TCP, as FreeCAD has it."""
    rows = [dict(zip("XYZAC", row, strict=True)) for row in wavering()]
    first = rows[0]
    return [
        ("(wall)", {}),
        ("G0", {"A": first["A"], "C": first["C"]}),
        ("M428", {}),
        ("G0", {"X": first["X"] + 1e-9, "Y": first["Y"], "F": 50.0}),
        ("G0", {"Z": 40.0}),
        ("G1", {"Z": first["Z"], "F": FEED}),
        *(("G1", {**row, "F": FEED}) for row in rows[1:]),
        ("G0", {"Z": 40.0}),
        ("M429", {}),
    ]


def in_freecad(folder: Path, script: str, **given: Any) -> Any:
    """Run a script in FreeCAD, with a job of one operation, `base`; return what it answers.

    Parameters
    ----------
    folder : for script and answer
    script : calls `answer` with what becomes JSON; it has `dressup`, `document`, `given`, `plain`, `members`
    given : to the script; `commands` of the base, and by default the options and command of the dress-up
    """
    file, answer = folder / "script.py", folder / "answer.json"
    given = {"commands": wavering_commands(), "options": OPTIONS, "program": FIVEAXIS} | given
    before = BEFORE.format(example=str(EXAMPLE), given=json.dumps(given), answer=str(answer))
    file.write_text(before + script, encoding="utf-8")
    run = subprocess.run(
        [str(FREECAD), str(file)], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    # FreeCAD ends with 0 whatever a script does: what isn't in the answer didn't happen.
    assert answer.is_file(), run.stdout[-2000:] + run.stderr[-2000:]
    return json.loads(answer.read_text(encoding="utf-8"))
