"""Kill a batch's workers, and the batch itself, at random moments, and check its results."""

import json
import queue
import random
import re
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from fiveaxis.job.batch.ledger import LINES, LOCK
from soaking.rings import contents

# What a victim does when it is killed, with its share of the kills; "batch" is the command itself.
KINDS = {"start-up": 0.2, "taking": 0.15, "running": 0.5, "idle": 0.07, "batch": 0.08}
# Most s from when it is told what a worker does to the kill; s in which the workers of a killed batch have to
# end; s without any news that count as a hang.
LATEST, GRACE, HANG = 0.5, 2.0, 600.0
TOLD = re.compile(r"worker \d+ \(pid (\d+)\) (starts|takes|has done)|runs on worker \d+ \(pid (\d+)\)")
STAGES = {"starts": "start-up", "takes": "taking", "has done": "idle", "": "running"}


@dataclass
class Tally:
    """What was done to a batch, and what is wrong with its results.

    Parameters
    ----------
    kills : by what the victim did, as in `KINDS`
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
    """The command line that runs the batch, and what it tells of its workers."""

    def __init__(self, files: Sequence[Path], folder: Path, workers: int) -> None:
        words = ["batch", *map(str, files), "-o", str(folder), "--workers", str(workers), "-v"]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "fiveaxis.cli", *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.stages: dict[int, str] = {}
        self._news: queue.SimpleQueue[tuple[int, str] | None] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        with self.process.stderr as lines:
            for pid, what, runner in (found for line in lines for found in TOLD.findall(line)):
                victim = int(pid or runner)
                # A new worker takes its first job when it has started.
                if what != "takes" or self.stages[victim] != "start-up":
                    self.stages[victim] = STAGES[what]
                    self._news.put((victim, STAGES[what]))
        self._news.put(None)

    def await_stage(self, stages: Collection[str]) -> int | None:
        """Wait until a worker is in one of some stages, and return its number; None if the batch ends."""
        while (news := self._news.get(timeout=HANG)) is not None:
            if news[1] in stages:
                return news[0]
        return None

    def kill_worker(self, pid: int) -> str | None:
        """Kill a worker that is still there; return what it did."""
        # Of this command, and no other process that has got its number.
        for worker in self._workers():
            if worker.pid == pid and _lives(worker):
                did = self.stages[pid]
                worker.kill()
                return did
        return None

    def kill(self) -> int:
        """Kill the command; return how many workers outlive it."""
        workers = self._workers()
        self.process.kill()
        self.process.wait()
        _, alive = psutil.wait_procs(workers, GRACE)
        self._reader.join()
        return sum(map(_lives, alive))

    def _workers(self) -> list[psutil.Process]:
        with suppress(psutil.NoSuchProcess):
            return psutil.Process(self.process.pid).children()
        return []


def _lives(process: psutil.Process) -> bool:
    try:
        return process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def soak(files: Sequence[Path], folder: Path, kinds: Sequence[str], seed: int, workers: int = 2) -> Tally:
    """Run a batch again and again until it ends of itself, with kills spread over its jobs.

    Parameters
    ----------
    files : jobs
    folder : for the results
    kinds : of the kills, in their order
    seed : of their moments
    workers : of the batch
    """
    chance, tally, began = random.Random(seed), Tally(starts=1), time.monotonic()
    command = _Command(files, folder, workers)
    for number, kind in enumerate(kinds):
        while (count_done(folder) + workers) / len(files) < number / len(kinds):
            if command.await_stage(["idle"]) is None:
                break
        did = None
        while did is None:
            victim = command.await_stage(list(KINDS) if kind == "batch" else [kind])
            if victim is None:
                break  # all jobs are done
            if kind != "taking":
                time.sleep(LATEST * chance.random())
            if kind == "batch":
                tally.orphans += command.kill()
                command, did = _Command(files, folder, workers), kind
                tally.starts += 1
            else:
                did = command.kill_worker(victim)
        if did is None:
            break
        tally.kills[did] += 1
    with suppress(subprocess.TimeoutExpired):
        tally.exit_code = command.process.wait(HANG)
    command.kill()
    tally.seconds = time.monotonic() - began
    return tally


def draw_kinds(kills: int, seed: int) -> list[str]:
    """Draw what the victims do when they are killed."""
    return random.Random(seed).choices(list(KINDS), list(KINDS.values()), k=kills)


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
