"""Kill a batch's workers, and the batch itself, at random moments, and look at what comes of it."""

from __future__ import annotations

import json
import random
import re
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from fiveaxis.batch.ledger import LINES, LOCK
from soaking.rings import contents

# Shares of kills that meet the batch itself, and a worker just as it takes a job; the others meet any worker.
ON_BATCH, ON_TAKING = 0.08, 0.15
# Mean s between two kills where jobs, with those at work, are ahead of kills, and otherwise; between looks.
SOON, LATER, LOOK = 0.2, 1.5, 0.02
# s in which the workers of a killed batch have to end; s without an end that count as a hang.
GRACE, HANG = 2.0, 1800.0
SAID = re.compile(r"worker \d+ \(pid (\d+)\) (takes|has done)|runs on worker \d+ \(pid (\d+)\)")
STAGES = {"takes": "taking", "has done": "idle"}


@dataclass
class Tally:
    """What was done to a batch, and what is wrong with its results.

    Parameters
    ----------
    kills : by what the victim did: start-up, taking, running, idle, batch
    starts : of the command
    jobs, duplicated, lost : number of results; of jobs with several; of jobs without
    differing : files whose bytes aren't those of an undisturbed run, or that it doesn't have
    orphans : workers that outlived their batch
    exit_code : of the last command; None where it hung
    """

    kills: Counter[str] = field(default_factory=Counter)
    starts: int = 0
    jobs: int = 0
    duplicated: int = 0
    lost: int = 0
    differing: list[str] = field(default_factory=list)
    orphans: int = 0
    seconds: float = 0.0
    exit_code: int | None = None

    @property
    def is_clean(self) -> bool:
        """Whether each job has one result, as if nothing had happened."""
        wrong = self.duplicated or self.lost or self.differing or self.orphans
        return not wrong and self.exit_code == 0


class _Command:
    """The command line that runs the batch, and what its workers do by what it tells."""

    def __init__(self, files: Sequence[Path], folder: Path, workers: int) -> None:
        words = ["batch", *map(str, files), "-o", str(folder), "--workers", str(workers), "-v"]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "fiveaxis.cli", *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.stages: dict[int, str] = {}
        self.taken = threading.Event()
        self.last_taker = 0
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        with self.process.stderr as told:
            for line in told:
                for taker, what, runner in SAID.findall(line):
                    if what == "takes" and int(taker) not in self.stages:
                        continue  # a new worker takes its first job when it has started
                    self.stages[int(taker or runner)] = STAGES.get(what, "running")
                    if what == "takes":
                        self.last_taker = int(taker)
                        self.taken.set()

    def workers(self) -> list[psutil.Process]:
        with suppress(psutil.NoSuchProcess):
            return psutil.Process(self.process.pid).children()
        return []

    def kill_taker(self, seconds: float) -> str | None:
        """Kill the next worker that takes a job; return what it did."""
        self.taken.clear()
        return self._kill(self.last_taker) if self.taken.wait(seconds) else None

    def kill_worker(self, chance: random.Random) -> str | None:
        """Kill any worker; return what it did."""
        crew = [one.pid for one in self.workers()]
        return self._kill(chance.choice(crew)) if crew else None

    def _kill(self, pid: int) -> str | None:
        # Of this command, and no other process that has got its number.
        for worker in self.workers():
            if worker.pid == pid and worker.status() != psutil.STATUS_ZOMBIE:
                did = self.stages.get(pid, "start-up")
                worker.kill()
                return did
        return None

    def kill_batch(self) -> int:
        """Kill the command; return how many workers outlive it."""
        crew = self.workers()
        self.process.kill()
        self.process.wait()
        ends = time.monotonic() + GRACE
        while alive := [one for one in crew if _lives(one)]:
            if time.monotonic() > ends:
                return len(alive)
            time.sleep(0.05)
        return 0


def _lives(process: psutil.Process) -> bool:
    try:
        return process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def soak(files: Sequence[Path], folder: Path, kills: int, seed: int, workers: int = 2) -> Tally:
    """Run a batch again and again until it ends of itself, with kills at random moments.

    The jobs end no sooner than the kills: the more of them are done, the sooner comes the next kill.

    Parameters
    ----------
    files : jobs
    folder : for the results
    kills : how many
    seed : of the moments and victims
    workers : of the batch
    """
    chance, tally, began = random.Random(seed), Tally(), time.monotonic()
    command = _Command(files, folder, workers)
    tally.starts = 1
    while tally.kills.total() < kills and time.monotonic() - began < HANG:
        if command.process.poll() is not None:
            break  # all jobs are done
        time.sleep(LOOK)
        ahead = (count_done(folder) + workers) / len(files) >= tally.kills.total() / kills
        if chance.random() > LOOK / (SOON if ahead else LATER):
            continue
        draw = chance.random()
        if draw < ON_BATCH:
            tally.orphans += command.kill_batch()
            tally.kills["batch"] += 1
            command = _Command(files, folder, workers)
            tally.starts += 1
            continue
        taking = draw < ON_BATCH + ON_TAKING
        did = command.kill_taker(LATER) if taking else command.kill_worker(chance)
        if did is not None:
            tally.kills[did] += 1
    with suppress(subprocess.TimeoutExpired):
        tally.exit_code = command.process.wait(max(1.0, HANG - (time.monotonic() - began)))
    command.kill_batch()
    command.reader.join()
    tally.seconds = time.monotonic() - began
    return tally


def count_done(folder: Path) -> int:
    """Count the results that a batch has written so far."""
    lines = folder / LINES
    return len(lines.read_text().splitlines()) if lines.exists() else 0


def compare(tally: Tally, files: Sequence[Path], folder: Path, undisturbed: Path) -> Tally:
    """Compare the results with those of an undisturbed run, and note what is wrong with them."""
    names = Counter(json.loads(line)["name"] for line in (folder / LINES).read_text().splitlines())
    tally.jobs = names.total()
    tally.duplicated = sum(count > 1 for count in names.values())
    tally.lost = len({file.stem for file in files} - set(names))
    found, wanted = contents(folder), contents(undisturbed)
    both = found.keys() | wanted.keys()
    tally.differing = sorted(name for name in both - {LOCK} if found.get(name) != wanted.get(name))
    return tally
