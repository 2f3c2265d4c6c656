"""LinuxCNC's own simulated machine, without a display: what its axes really do under a program.

It comes with Debian's linuxcnc-uspace (``apt-get install -y --no-install-recommends linuxcnc-uspace``),
refuses to run as root, and knows one machine at a time: runs wait for each other. The simulated machine is a
trunnion (C on A under the workpiece, kinematics module ``xyzac-trt-kins``); M428 switches tool centre point
control on, M429 off. It runs in real time, but its time is counted in servo cycles, so a busy computer
doesn't change it.

The files in ``machine/`` and the INI file here are our own.
"""

from __future__ import annotations

import json
import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from fiveaxis.model import Machine, tool_poses
from fiveaxis.model.machine.axes import Axis
from referee.housekeeping import MEMORY, SimulationFault, end_leftovers, machine_to_oneself

FILES = Path(__file__).parent / "machine"
SYSTEM_PYTHON = Path("/usr/bin/python3")
USER = "nobody"
LETTERS = "XYZAC"
# s: one servo cycle, LinuxCNC's usual one; start and end of LinuxCNC itself.
CYCLE, STARTING = 1e-3, 300.0
# How often LinuxCNC is started until it gives a verdict: on a busy computer its tasks may lose one another's
# first messages, and it ends by itself before the program has begun.
STARTS = 3
# How names of scratch folders begin.
SCRATCH = "fiveaxis-linuxcnc-"
# What an axis without limits has in the INI file, mm or deg.
UNLIMITED = 1e6
# mm or deg: a joint that moves by less in a cycle stands.
STANDS = 1e-9


@dataclass(frozen=True, eq=False)
class Run:
    """How the simulated machine ran a program.

    Parameters
    ----------
    machine : whose axes moved
    positions : (s, 5), mm and rad, in the machine's own sign, at the end of each servo cycle
    line : (s,), of the program, whose move was under way
    """

    machine: Machine
    positions: np.ndarray
    line: np.ndarray

    @cached_property
    def moving(self) -> np.ndarray:
        """(s,), whether any axis moved in the cycle that ends at the sample."""
        return (np.abs(np.diff(self.positions, axis=0, prepend=self.positions[:1])) > STANDS).any(axis=1)

    def of_lines(self, first: int, last: int) -> Run:
        """Cut out what belongs to some lines of the program, both included, from first cycle to last."""
        inside = np.flatnonzero((self.line >= first) & (self.line <= last) & self.moving)
        if len(inside) == 0:
            raise SimulationFault(f"nothing moved in lines {first} to {last}")
        piece = slice(inside[0], inside[-1] + 1)
        return replace(self, positions=self.positions[piece], line=self.line[piece])

    @property
    def seconds(self) -> float:
        """Time of all cycles."""
        return CYCLE * len(self.positions)

    @cached_property
    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Tip, (s, 3) mm, and direction, (s, 3), of the tool in the workpiece frame."""
        return tool_poses(self.machine, self.positions)


def why_unavailable() -> str | None:
    """Say why the simulated machine can't run here; None where it can."""
    for program in ("linuxcnc", "halsampler"):
        if shutil.which(program) is None:
            return f"{program} isn't installed (apt-get install linuxcnc-uspace)"
    if not SYSTEM_PYTHON.exists():
        return "there is no /usr/bin/python3, for which linuxcnc-uspace has its module"
    if not MEMORY.exists():
        return "there is no System V shared memory"
    if os.geteuid() == 0:
        if shutil.which("runuser") is None:
            return "LinuxCNC doesn't run as root, and there is no runuser"
        if USER not in {user.pw_name for user in pwd.getpwall()}:
            return f"LinuxCNC doesn't run as root, and there is no user {USER}"
    return None


def run_program(text: str, machine: Machine, *, limit: float = 60.0) -> Run:
    """Run a program on the simulated machine.

    Parameters
    ----------
    text : the program; begins with all axes at 0
    machine : a trunnion, letters X Y Z A C; the simulated one has its highest speeds and accelerations, its
        limits, and its rotary axes where its A and C have theirs
    limit : s, how long the program may run

    Raises
    ------
    SimulationFault
        LinuxCNC stops with an error, isn't done in time, doesn't begin, or is in use for too long.
    """
    said = ""
    for _ in range(STARTS):
        with machine_to_oneself(), _scratch() as folder:
            (folder / "program.ngc").write_text(text, encoding="ascii")
            (folder / "machine.ini").write_text(ini_text(machine), encoding="ascii")
            (folder / "tool.tbl").write_text("T1 P1 Z0 D10\n", encoding="ascii")
            for file in FILES.iterdir():
                if file.is_file():
                    shutil.copy(file, folder)
            _hand_over(folder)
            said = _run_linuxcnc(folder, limit)
            verdict = folder / "verdict.json"
            if verdict.exists():
                result = json.loads(verdict.read_text())
                if not result["done"] or result["faults"]:
                    raise SimulationFault("; ".join(result["faults"]) or "the program wasn't done")
                samples = (folder / "samples.txt").read_text()
                if "overrun" not in samples:
                    return _run_of(samples, machine)
                said = "samples were lost: the computer is too busy"
    raise SimulationFault(f"LinuxCNC was started {STARTS} times and gave no verdict: {said[-600:]}")


# What the INI file says of every machine.
TABLES = {
    "EMC": {"VERSION": 1.1, "MACHINE": "simulated", "DEBUG": 0},
    "DISPLAY": {"DISPLAY": "./display.py", "PROGRAM_PREFIX": "."},
    "RS274NGC": {
        "SUBROUTINE_PATH": ".",
        "REMAP": ["M428 modalgroup=10 ngc=428remap", "M429 modalgroup=10 ngc=429remap"],
        "PARAMETER_FILE": "machine.var",
    },
    "KINS": {"KINEMATICS": "xyzac-trt-kins sparm=identityfirst", "JOINTS": len(LETTERS)},
    "HAL": {"HALFILE": "machine.hal"},
    "TRAJ": {
        "COORDINATES": LETTERS,
        "LINEAR_UNITS": "mm",
        "ANGULAR_UNITS": "deg",
        "DEFAULT_LINEAR_VELOCITY": 1,
        "MAX_LINEAR_VELOCITY": 1e4,
        "MAX_LINEAR_ACCELERATION": 1e6,
    },
    "EMCMOT": {"EMCMOT": "motmod", "SERVO_PERIOD": round(CYCLE * 1e9), "COMM_TIMEOUT": 1},
    "TASK": {"TASK": "milltask", "CYCLE_TIME": 0.001},
    "EMCIO": {"EMCIO": "io", "CYCLE_TIME": 0.02, "TOOL_TABLE": "tool.tbl"},
}
# Homed where they stand, and never far from their commands, which they follow at once.
JOINT = {"HOME": 0, "HOME_SEARCH_VEL": 0, "HOME_SEQUENCE": 0, "FERROR": 50, "MIN_FERROR": 50}


def ini_text(machine: Machine) -> str:
    """Write LinuxCNC's INI file for a machine.

    Axes whose highest speed or acceleration the machine doesn't state can't be simulated.
    """
    if machine.letters != LETTERS:
        raise ValueError(f"the simulated machine has {LETTERS}, and {machine.name!r} has {machine.letters}")
    pivot, table = (np.array(_line_point(machine, letter)) for letter in "AC")
    trunnion = {f"{letter}_ROT": place for letter, place in zip("XYZ", table, strict=True)}
    trunnion |= {f"{letter}_OFFSET": place for letter, place in zip("XYZ", pivot - table, strict=True)}
    tables = TABLES | {"TRUNNION": trunnion}
    for number, axis in enumerate(machine.axes):
        bounds = _bounds(axis)
        tables[f"AXIS_{axis.letter}"] = bounds
        tables[f"JOINT_{number}"] = {"TYPE": "ANGULAR" if axis.is_rotary else "LINEAR"} | bounds | JOINT
    return "".join(_table_text(name, keys) for name, keys in tables.items())


def _bounds(axis: Axis) -> dict[str, float]:
    """Limits in the control's own sign, highest speed and acceleration; mm or deg, s."""
    if axis.max_speed is None or axis.max_acceleration is None:
        raise ValueError(f"axis {axis.letter} has no highest speed or acceleration")
    sign = -1.0 if axis.reversed else 1.0
    ends = sign * axis.shown(axis.limits.low), sign * axis.shown(axis.limits.high)
    low, high = np.clip(sorted(ends), -UNLIMITED, UNLIMITED)
    return {
        "MIN_LIMIT": low,
        "MAX_LIMIT": high,
        "MAX_VELOCITY": axis.shown(axis.max_speed),
        "MAX_ACCELERATION": axis.shown(axis.max_acceleration),
    }


def _table_text(name: str, keys: dict) -> str:
    lines = [f"[{name}]"]
    for key, value in keys.items():
        lines += [f"{key} = {v}" for v in (value if isinstance(value, list) else [value])]
    return "\n".join([*lines, ""])


def _line_point(machine: Machine, letter: str) -> tuple[float, float, float]:
    return next(joint.line.point for joint in machine.chain.joints if joint.letter == letter)


def _run_of(samples: str, machine: Machine) -> Run:
    """Turn halsampler's rows (number, five joints, speed, line) into a run without rests at both ends."""
    table = np.loadtxt(samples.splitlines(), ndmin=2)
    signs = np.array([-1.0 if axis.reversed else 1.0 for axis in machine.axes])
    units = np.array([np.pi / 180.0 if axis.is_rotary else 1.0 for axis in machine.axes])
    line = table[:, 7].astype(int)
    # In the last cycle of a program and in waits no line is under way: they belong to the line before.
    line = line[np.maximum.accumulate(np.where(line > 0, np.arange(len(line)), 0))]
    return Run(machine, table[:, 1:6] * signs * units, line).of_lines(1, int(line.max()))


def _run_linuxcnc(folder: Path, limit: float) -> str:
    """Start LinuxCNC in a scratch folder and wait for its end; gives what it said."""
    names = {"PROGRAM": "program.ngc", "SAMPLES": "samples.txt", "VERDICT": "verdict.json"}
    environment = {name: str(folder / file) for name, file in names.items()}
    # No DISPLAY: there is no screen, and LinuxCNC would ask on it.
    environment |= {"HOME": str(folder), "LIMIT": f"{limit:g}", "PATH": os.environ["PATH"], "LANG": "C"}
    command = ["linuxcnc", "-r", str(folder / "machine.ini")]
    if os.geteuid() == 0:
        # runuser gives the user's own home, which `nobody` hasn't.
        command = ["runuser", "-u", USER, "--", "env", f"HOME={folder}", *command]
    # Into a file: a pipe that is closed early leaves servers behind.
    with (folder / "said.txt").open("w") as said:
        process = subprocess.Popen(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=said, stderr=said
        )
        try:
            process.wait(timeout=limit + STARTING)
        except subprocess.TimeoutExpired:
            process.terminate()
        finally:
            end_leftovers(folder)
            process.wait()
    return (folder / "said.txt").read_text(errors="replace")


@contextmanager
def _scratch() -> Iterator[Path]:
    """Make a folder that the user who runs LinuxCNC may reach: pytest's own are for one user alone."""
    folder = Path(tempfile.mkdtemp(prefix=SCRATCH))
    try:
        yield folder
    finally:
        shutil.rmtree(folder)


def _hand_over(folder: Path) -> None:
    if os.geteuid() == 0:
        user = pwd.getpwnam(USER)
        for place in (folder, *folder.iterdir()):
            os.chown(place, user.pw_uid, user.pw_gid)
