"""LinuxCNC's own simulated machine, without a display: what its axes really do under a program.

It comes with Debian's linuxcnc-uspace (``apt-get install -y --no-install-recommends linuxcnc-uspace``),
refuses to run as root, and knows one machine at a time: runs wait for each other. The simulated machine is a
trunnion (C on A under the workpiece, kinematics module ``xyzac-trt-kins``); M428 switches tool centre point
control on, M429 off. It runs in real time, but its time is counted in servo cycles, so a busy computer
doesn't change it.

The files in ``machine/`` and the INI file here are our own.
"""

from __future__ import annotations

import fcntl
import json
import os
import pwd
import re
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from fiveaxis.kinematics import tool_poses
from fiveaxis.machine import Machine

FILES = Path(__file__).parent / "machine"
SYSTEM_PYTHON = Path("/usr/bin/python3")
USER = "nobody"
LETTERS = "XYZAC"
# s: one servo cycle, LinuxCNC's usual one; start and end of LinuxCNC itself; how long others may keep it.
CYCLE, STARTING, QUEUE = 1e-3, 30.0, 240.0
# System V shared memory, and LinuxCNC's keys in it: HAL's, RTAPI's and motion's, and the message buffers'.
MEMORY = Path("/proc/sysvipc/shm")
SHARED_MEMORY = (0x48414C32, 0x48484C34, 0x90280A48, 0x00000064, *range(1001, 1007))
# Made by LinuxCNC while it runs; its processes; number, name and state of a process.
STARTED = Path("/tmp/linuxcnc.lock")
SERVERS = ("linuxcncsvr", "milltask", "rtapi_app")
STATE = re.compile(r"(\d+) \((.*)\) (\w)", re.DOTALL)
# How names of scratch folders begin.
SCRATCH = "fiveaxis-linuxcnc-"
# What an axis without limits has in the INI file, mm or deg.
UNLIMITED = 1e6
# mm or deg: a joint that moves by less in a cycle stands.
STANDS = 1e-9


class SimulationFault(Exception):
    """The simulated machine stopped with an error, or not at all."""


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
        LinuxCNC stops with an error, isn't done in time, or is in use for too long.
    """
    with _machine_to_oneself(), _scratch() as folder:
        (folder / "program.ngc").write_text(text, encoding="ascii")
        (folder / "machine.ini").write_text(ini_text(machine), encoding="ascii")
        (folder / "tool.tbl").write_text("T1 P1 Z0 D10\n", encoding="ascii")
        for file in FILES.iterdir():
            if file.is_file():
                shutil.copy(file, folder)
        _hand_over(folder)
        said = _run_linuxcnc(folder, limit)
        verdict = folder / "verdict.json"
        result = json.loads(verdict.read_text()) if verdict.exists() else {"done": False, "faults": []}
        if not result["done"] or result["faults"]:
            raise SimulationFault("; ".join(result["faults"]) or f"LinuxCNC didn't run: {said[-600:]}")
        return _run_of((folder / "samples.txt").read_text(), machine)


def ini_text(machine: Machine) -> str:
    """Write LinuxCNC's INI file for a machine.

    Axes whose highest speed or acceleration the machine doesn't state can't be simulated.
    """
    if machine.letters != LETTERS:
        raise ValueError(f"the simulated machine has {LETTERS}, and {machine.name!r} has {machine.letters}")
    pivot, table = (np.array(_line_point(machine, letter)) for letter in "AC")
    tables = {
        "EMC": {"VERSION": 1.1, "MACHINE": machine.name, "DEBUG": 0},
        "DISPLAY": {"DISPLAY": "./display.py", "PROGRAM_PREFIX": "."},
        "RS274NGC": {
            "SUBROUTINE_PATH": ".",
            "REMAP": ["M428 modalgroup=10 ngc=428remap", "M429 modalgroup=10 ngc=429remap"],
            "PARAMETER_FILE": "machine.var",
        },
        "KINS": {"KINEMATICS": "xyzac-trt-kins sparm=identityfirst", "JOINTS": len(LETTERS)},
        "TRUNNION": {
            "Y_OFFSET": (pivot - table)[1],
            "Z_OFFSET": (pivot - table)[2],
            **{f"{letter}_ROT": place for letter, place in zip("XYZ", table, strict=True)},
        },
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
    for number, axis in enumerate(machine.axes):
        sign = -1.0 if axis.reversed else 1.0
        ends = sign * axis.shown(axis.limits.low), sign * axis.shown(axis.limits.high)
        low, high = np.clip(sorted(ends), -UNLIMITED, UNLIMITED)
        if axis.max_speed is None or axis.max_acceleration is None:
            raise ValueError(f"{axis.letter} of {machine.name!r} has no highest speed or acceleration")
        bounds = {
            "MIN_LIMIT": low,
            "MAX_LIMIT": high,
            "MAX_VELOCITY": axis.shown(axis.max_speed),
            "MAX_ACCELERATION": axis.shown(axis.max_acceleration),
        }
        tables[f"AXIS_{axis.letter}"] = bounds
        tables[f"JOINT_{number}"] = {
            "TYPE": "ANGULAR" if axis.is_rotary else "LINEAR",
            **bounds,
            "HOME": 0,
            "HOME_SEARCH_VEL": 0,
            "HOME_SEQUENCE": 0,
            "FERROR": 50,
            "MIN_FERROR": 50,
        }
    return "".join(_table_text(name, keys) for name, keys in tables.items())


def _table_text(name: str, keys: dict) -> str:
    lines = [f"[{name}]"]
    for key, value in keys.items():
        lines += [f"{key} = {v}" for v in (value if isinstance(value, list) else [value])]
    return "\n".join([*lines, ""])


def _line_point(machine: Machine, letter: str) -> tuple[float, float, float]:
    return next(joint.line.point for joint in machine.chain.joints if joint.letter == letter)


def _run_of(samples: str, machine: Machine) -> Run:
    """Turn halsampler's rows (number, five joints, speed, line) into a run without rests at both ends."""
    if "overrun" in samples:
        raise SimulationFault("samples were lost: the computer is too busy")
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
            _end_leftovers(folder)
            process.wait()
    return (folder / "said.txt").read_text(errors="replace")


def _end_leftovers(folder: Path) -> None:
    """End what a run has left alive: processes whose home is its scratch folder, and their shared memory."""
    for order, patience in ((None, 3.0), (signal.SIGTERM, 3.0), (signal.SIGKILL, 3.0)):
        left = _processes_of(folder)
        for number in left:
            if order is not None:
                _signal(number, order)
        end = time.monotonic() + patience
        while _processes_of(folder) and time.monotonic() < end:
            time.sleep(0.05)
    _remove_shared_memory()


def _signal(number: int, order: signal.Signals) -> None:
    # A process may end by itself between being found and being told.
    try:
        os.kill(number, order)
    except ProcessLookupError:
        return


def _processes_of(folder: Path) -> list[int]:
    mark = f"HOME={folder}".encode()
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            environment = (place / "environ").read_bytes().split(b"\0")
        except OSError:  # it has ended, or belongs to someone else
            continue
        if mark in environment:
            found.append(int(place.name))
    return found


def _remove_shared_memory() -> None:
    """Remove LinuxCNC's shared memory that no process uses: another user's would stop the next run."""
    for row in MEMORY.read_text().splitlines()[1:]:
        key, number, _mode, _size, _creator, _last, attached = (int(v) for v in row.split()[:7])
        if key % 2**32 in SHARED_MEMORY and attached == 0:
            subprocess.run(["ipcrm", "-m", str(number)], check=False, capture_output=True)


@contextmanager
def _machine_to_oneself() -> Iterator[None]:
    """Wait until no other run has the machine, whoever began it."""
    # A user's own file: in a shared folder others mayn't open it.
    path = Path(tempfile.gettempdir()) / f"fiveaxis-linuxcnc.{os.getuid()}.lock"
    with path.open("a") as handle:
        _wait_until(lambda: _locked(handle.fileno()))
        _wait_until(lambda: not _is_running())
        # A run that was killed leaves its mark and its memory, and with either the next one doesn't start.
        STARTED.unlink(missing_ok=True)
        _remove_shared_memory()
        yield


def _wait_until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + QUEUE
    while not condition():
        if time.monotonic() > end:
            raise SimulationFault(f"LinuxCNC was in use for {QUEUE:g} s")
        time.sleep(0.2)


def _locked(handle: int) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _is_running() -> bool:
    """Whether any LinuxCNC runs on this computer."""
    for place in Path("/proc").glob("[0-9]*"):
        try:
            _, name, state = STATE.match((place / "stat").read_text()).groups()
        except OSError:  # it has ended
            continue
        if name in SERVERS and state != "Z":
            return True
    return False


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
