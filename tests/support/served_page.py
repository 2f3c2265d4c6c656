"""The page of `fiveaxis app` as a process of its own, and requests to it."""

import http.client
import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from support.browser import Browser
from support.patience import PATIENCE

# Width and height of the usual window.
SIZE = (1280, 900)


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
        while time.monotonic() < end:
            for worker in self.workers:
                # One may just end or begin: it has no words then, or those of the server.
                with suppress(psutil.Error):
                    words = worker.cmdline()
                    if "fiveaxis.cli.page.worker" in words:
                        return Path(words[-1])
            time.sleep(0.02)
        raise AssertionError("no worker runs")

    def close(self, number: int = signal.SIGTERM) -> None:
        """End it by a signal."""
        self.process.send_signal(number)
        self.process.wait(PATIENCE)
        self.process.stdout.close()


class Visitor:
    """Somebody who looks at the page, and uses it."""

    def __init__(self, browser: Browser, page: ServedPage, size: tuple[int, int] = SIZE) -> None:
        self.browser = browser
        browser.look(*size)
        browser.open(page.address, "document.querySelectorAll('.tile').length > 3")

    def drop(self, *files: Path) -> None:
        """Choose files, which is what dropping them does."""
        self.browser.ask("DOM.enable")
        root = self.browser.ask("DOM.getDocument")["root"]["nodeId"]
        node = self.browser.ask("DOM.querySelector", nodeId=root, selector="#file")["nodeId"]
        self.browser.ask("DOM.setFileInputFiles", files=[str(file) for file in files], nodeId=node)

    def click(self, css: str) -> None:
        self.browser.run(f"document.querySelector({json.dumps(css)}).click()")

    def text(self, css: str) -> str:
        return self.browser.run(f"document.querySelector({json.dumps(css)}).innerText")

    def wait(self, script: str) -> None:
        end = time.monotonic() + PATIENCE
        while not self.browser.run(f"!!({script})"):
            assert time.monotonic() < end, self.text("body")
            time.sleep(0.05)

    def wait_for(self, css: str) -> None:
        """Wait until something is shown, or a fault is told."""
        self.wait(f"!document.querySelector({json.dumps(css)}).hidden || document.querySelector('.fault')")
        assert self.browser.run("!document.querySelector('.fault')"), self.text("#fault")

    def picture(self, path: Path, width: int = SIZE[0]) -> np.ndarray:
        """Take a picture of the whole page in a window of some width, (h, w, 3) from 0 to 1."""
        self.browser.look(width, SIZE[1])
        height = self.browser.run("document.documentElement.scrollHeight")
        self.browser.look(width, max(height, SIZE[1]))
        time.sleep(1.0)  # frames draw their scenes
        taken = self.browser.shoot(path)
        self.browser.look(*SIZE)
        return taken

    def press(self, key: str, code: int, times: int = 1) -> None:
        for _ in range(times):
            self.browser.press(key, code)
