"""The page of `fiveaxis app` as a process of its own, and requests to it."""

from __future__ import annotations

import http.client
import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import psutil

from support.patience import PATIENCE


class ServedPage:
    """A server without a browser; its key is in its address."""

    def __init__(self) -> None:
        command = [sys.executable, "-m", "fiveaxis.cli", "app", "--no-browser"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.address = re.search(r"http\S+", self.process.stdout.readline())[0]
        self.port = int(re.search(r":(\d+)/", self.address)[1])
        self.key = self.address.partition("key=")[2]

    def ask(
        self, method: str, path: str, body: bytes | None = None, **headers: str
    ) -> tuple[int, Any, Mapping[str, str]]:
        """Send a request as the page does, with other headers where some are given; None leaves one out."""
        usual = {"Cookie": f"fiveaxis{self.port}={self.key}", "X-Fiveaxis": "1"}
        names = {name.replace("_", "-"): value for name, value in headers.items()}
        sent = {name: value for name, value in (usual | names).items() if value is not None}
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        connection.request(method, path, body, sent)
        answer = connection.getresponse()
        text = answer.read()
        connection.close()
        is_json = "json" in answer.headers.get("Content-Type", "")
        return answer.status, json.loads(text) if is_json else text, answer.headers

    def put(self, path: Path, name: str | None = None) -> str:
        """Send a file; return its name there."""
        status, found, _ = self.ask("PUT", f"/file/{name or path.name}", path.read_bytes())
        assert status == 200, found
        return found["name"]

    def work(self, verb: str, **ask: Any) -> dict[str, Any]:
        """Do a piece of work, and return how it ended."""
        status, found, _ = self.ask("POST", f"/run/{verb}", json.dumps(ask).encode())
        assert status == 200, found
        return self.ended()

    def ended(self) -> dict[str, Any]:
        """Wait for the end of the work."""
        end = time.monotonic() + PATIENCE
        while (state := self.ask("GET", "/state")[1])["end"] is None:
            assert time.monotonic() < end, state
            time.sleep(0.05)
        return state

    @property
    def workers(self) -> list[psutil.Process]:
        """The processes of the work, that which waits too."""
        return psutil.Process(self.process.pid).children(recursive=True)

    @property
    def folder(self) -> Path:
        """Where the files of the session are, as a worker is told."""
        end = time.monotonic() + PATIENCE
        while not self.workers:
            assert time.monotonic() < end
            time.sleep(0.02)
        return Path(self.workers[0].cmdline()[-1])

    def close(self, number: int = signal.SIGTERM) -> None:
        """End it by a signal."""
        self.process.send_signal(number)
        self.process.wait(PATIENCE)
        self.process.stdout.close()
