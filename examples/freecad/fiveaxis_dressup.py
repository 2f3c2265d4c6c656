"""A dress-up for FreeCAD's Path workbench: another operation's path with postures that fiveaxis chooses.

It needs nothing but FreeCAD and a command `fiveaxis`, which runs as a process of its own. Copy this file into
FreeCAD's macro folder, select an operation whose path turns the tool, and type into the Python console:

    import fiveaxis_dressup
    fiveaxis_dressup.make(Gui.Selection.getSelection()[0], "-m mill.toml --tool ball:6 --cone 15")

The path of the base goes out as an NC program; the revised program comes back as the dress-up's path. If
nothing better is found, or something fails, the dress-up has the path of the base, and `Answer` says why.
"""

import hashlib
import json
import os
import re
import shlex
import subprocess
import tempfile
from pathlib import Path as File

import FreeCAD
import Path

# Properties of the dress-up: type, meaning, value at first.
PROPERTIES = {
    "Base": ("App::PropertyLink", "the operation whose path is revised", None),
    "Program": ("App::PropertyString", "the command, with its path if it isn't found", "fiveaxis"),
    "Options": ("App::PropertyString", "of `fiveaxis optimise`: machine, tool, bounds", ""),
    "Head": ("App::PropertyString", "line before the path, such as G43.4 H1 or M428 for TCP", "G21 G90 G94"),
    "Answer": ("App::PropertyString", "what became of the path", ""),
    "Done": ("App::PropertyString", "digest of what the path was made of", ""),
}
RAPID = ("G0", "G00")
# Words that have no decimal point; all others need one on some controls.
WHOLE = "HDTSLN"
WORD = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))")
# Modes and motions that may stand in a line that fiveaxis writes into a path.
MOTIONS, MODES = ("G0", "G1"), ("G90", "G93", "G94")


def line_of(command):
    """Write a command as a line of a program, as posts do: F in mm/min, where FreeCAD has mm/s."""
    if command.Name.startswith("("):
        return command.Name
    words = [command.Name]
    for letter, value in command.Parameters.items():
        # Posts leave them out: the speed of a rapid move is the machine's, and a missing I is 0.
        if (letter == "F" and command.Name in RAPID) or (letter in "IJK" and value == 0.0):
            continue
        value = 60.0 * value if letter == "F" else value
        text = f"{value:.6f}".rstrip("0")
        words.append(letter + (text.rstrip(".") if letter in WHOLE else text))
    return " ".join(words)


def commands_of(lines, known):
    """Read the lines of a program as commands.

    Parameters
    ----------
    lines : of the program, without its head
    known : line -> the command that it was written from, which comes back with all its digits
    """
    commands, motion = [], "G0"
    for line in lines:
        if line in known:
            commands.append(known[line])
            motion = known[line].Name if known[line].Name in MOTIONS else motion
            continue
        plain = re.sub(r"\(.*?\)|;.*", "", line).upper().strip()
        words = [(letter, float(value)) for letter, value in WORD.findall(plain)]
        codes = [f"G{value:g}" for letter, value in words if letter == "G"]
        if WORD.sub("", plain).strip() or any(code not in MOTIONS + MODES for code in codes):
            raise ValueError(f"the new line {line!r} isn't understood")
        motion = next((code for code in codes if code in MOTIONS), motion)
        commands += [Path.Command(code) for code in codes if code in MODES]
        values = {
            letter: value / 60.0 if letter == "F" else value for letter, value in words if letter not in "GN"
        }
        if values:
            commands.append(Path.Command(motion, values))
    return commands


def revise(commands, program, options, head):
    """Return the commands of a better path, or None, and what fiveaxis says about it."""
    lines = [line_of(command) for command in commands]
    # The Python that FreeCAD brings isn't that of the command.
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONHOME", "PYTHONPATH")}
    with tempfile.TemporaryDirectory() as folder:
        file, out = File(folder, "path.nc"), File(folder, "out")
        file.write_text("\n".join([head, *lines]) + "\n", encoding="ascii", errors="replace")
        words = [
            *shlex.split(program),
            "optimise",
            str(file),
            *shlex.split(options),
            "-o",
            str(out),
            "--json",
        ]
        try:
            run = subprocess.run(
                words, capture_output=True, encoding="utf-8", errors="replace", env=environment
            )
        except OSError as fault:
            return None, f"{program} can't be run: {fault}"
        if run.returncode:
            said = run.stderr.strip()[-2000:].replace(str(file), "the path")
            return None, f"{program} ended with {run.returncode}: {said}"
        made = sorted(out.glob("program.*"))
        told = " ".join(answers_of(json.loads(run.stdout)))
        if not made:
            return None, told
        new = made[0].read_text(encoding="utf-8").splitlines()
    if new[0] != head:
        return None, f"the head of the new program is {new[0]!r} and no longer {head!r}"
    return commands_of(new[1:], {line_of(command): command for command in commands}), told


def answers_of(document):
    """Yield what fiveaxis says of each operation, from its JSON."""
    for part in document.get("operations", [document]):
        answers = part.get("answers")
        if answers is None:
            yield part.get("why") or part.get("stays") or ""
        else:
            yield f"{answers['saved']['text']} Safe to run? {answers['safe']['text']}"


class Dressup:
    """What FreeCAD calls: the properties, and how the path is made."""

    def __init__(self, obj):
        for name, (kind, meaning, value) in PROPERTIES.items():
            obj.addProperty(kind, name, "fiveaxis", meaning)
            setattr(obj, name, value)
        obj.setEditorMode("Answer", 1)  # read only
        obj.setEditorMode("Done", 2)  # hidden
        obj.Proxy = self

    def execute(self, obj):
        """Make the path anew, unless all that it is made of is as it was."""
        given = [obj.Program, obj.Options, obj.Head, *map(line_of, obj.Base.Path.Commands)]
        digest = hashlib.sha256("\n".join(given).encode()).hexdigest()
        if digest == obj.Done:
            return
        obj.Done = ""
        try:
            better, told = revise(obj.Base.Path.Commands, obj.Program, obj.Options, obj.Head)
        except ValueError as fault:
            better, told = None, str(fault)
        if better is None:
            obj.Path = obj.Base.Path
            obj.Answer = f"The path of {obj.Base.Label} stays: {told}"
            FreeCAD.Console.PrintWarning(f"{obj.Label}: {obj.Answer}\n")
        else:
            obj.Path = Path.Path(better)
            obj.Answer = told
            obj.Done = digest
            FreeCAD.Console.PrintMessage(f"{obj.Label}: {told}\n")

    def dumps(self):
        """Keep nothing beside the properties in the document; FreeCAD before 0.21.2 asks `__getstate__`."""
        return None

    def loads(self, state):
        """Take back what `dumps` has kept."""

    __getstate__, __setstate__ = dumps, loads


class Shown:
    """The dress-up in the tree: with the base below it, which comes back when the dress-up is deleted."""

    def __init__(self, view):
        view.Proxy = self

    def attach(self, view):
        """Remember the dress-up."""
        self.obj = view.Object

    def claimChildren(self):  # noqa: N802 (FreeCAD's name)
        """Return what stands below it."""
        return [self.obj.Base]

    def onDelete(self, view, _names):  # noqa: N802 (FreeCAD's name)
        """Put the base back into its job."""
        replace(view.Object, view.Object.Base)
        view.Object.Base.ViewObject.Visibility = True
        return True

    dumps, loads = Dressup.dumps, Dressup.loads
    __getstate__, __setstate__ = dumps, loads


def replace(old, new):
    """Put an operation in another one's place in the group that holds it, as the operations of a job."""
    for holder in old.InList:
        if old in getattr(holder, "Group", ()):
            holder.Group = [new if each == old else each for each in holder.Group]


def make(base, options, program="fiveaxis", head=PROPERTIES["Head"][2]):
    """Dress an operation up, in one step that can be undone.

    Parameters
    ----------
    base : operation with a path
    options, program, head : as the properties
    """
    document = base.Document
    document.openTransaction("Postures by fiveaxis")
    # FreeCAD's own dress-ups, on top of this one, find the tool below what has "Dressup" in its name.
    obj = document.addObject("Path::FeaturePython", "PosturesDressup")
    Dressup(obj)
    obj.Base, obj.Options, obj.Program, obj.Head = base, options, program, head
    replace(base, obj)
    if FreeCAD.GuiUp:
        Shown(obj.ViewObject)
        base.ViewObject.Visibility = False
    document.recompute()
    document.commitTransaction()
    return obj
