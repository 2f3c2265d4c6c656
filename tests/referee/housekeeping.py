"""One LinuxCNC at a time, and nothing of it left behind: its processes, its lock, its shared memory."""

import fcntl
import os
import re
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

# s: how long others may keep LinuxCNC.
QUEUE = 600.0
# System V shared memory, and keys in it that are LinuxCNC's alone.
MEMORY = Path("/proc/sysvipc/shm")
SHARED_MEMORY = (0x48414C32, 0x48484C34, 0x90280A48)
# Made by LinuxCNC while it runs; its processes; number, name and state of a process.
STARTED = Path("/tmp/linuxcnc.lock")
SERVERS = ("linuxcncsvr", "milltask", "rtapi_app")
STATE = re.compile(r"(\d+) \((.*)\) (\w)", re.DOTALL)


class SimulationFault(Exception):
    """The simulated machine stopped with an error, or not at all."""


@contextmanager
def machine_to_oneself() -> Iterator[None]:
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


def end_leftovers(folder: Path) -> None:
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
