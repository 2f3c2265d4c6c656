"""Workers for the pool of a batch that load no module of fiveaxis, so that they start in no time."""

import json
import os
import pickle
import sys
from collections.abc import Callable
from typing import Any

# Of every job: the same wherever `COMMAND` plans and `work` runs it.
DIGEST = "0" * 64
# The command line on light workers, of which each runs the Python text that is its first argument.
COMMAND = """
import sys
from fiveaxis.job.batch import pool, tasks
from fiveaxis.cli import main
from support.light_workers import DIGEST, light_entry

pool.ENTRY = light_entry(sys.argv.pop(1))
tasks.digest_job = lambda *_: DIGEST
main()
"""


class StandIn:
    """A task as a worker sees it."""

    name: str


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        return StandIn if name == "QueuedJob" else super().find_class(module, name)


def light_entry(text: str) -> str:
    """Return what a worker runs, with a text of Python in place of the worker itself."""
    from fiveaxis.job.batch import pool

    head, _, _ = pool.ENTRY.partition("from fiveaxis")
    return (
        f"{head}import time; from pathlib import Path; from support.light_workers import send, work\n{text}\n"
    )


def send(**message: Any) -> None:
    os.write(1, (json.dumps(message) + "\n").encode())


def work(act: Callable[[str], object]) -> None:
    """Be a worker: do each task by a function of its name."""
    while True:
        try:
            task, _folder = _Unpickler(sys.stdin.buffer).load()
        except EOFError:
            return
        send(stage="start", share=0.0)
        act(task.name)
        send(row={"name": task.name, "file": f"{task.name}.toml", "status": "fine", "digest": DIGEST})
