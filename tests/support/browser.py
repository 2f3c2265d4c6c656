"""A real browser for tests of pages: Debian's chromium, headless, driven over its pipe."""

import base64
import json
import os
import select
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from support.patience import PATIENCE

CHROMIUM = shutil.which("chromium")
# Marks of a module whose tests need the browser.
NEEDS_BROWSER = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium on the path"),
]
FLAGS = [
    "--headless=new",
    "--no-sandbox",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--window-size=1200,800",
    "--remote-debugging-pipe",
]
# The browser's ends of the pipe are its descriptors 3 and 4.
START = 'in=$1 out=$2; shift 2; exec "$@" 3<&"$in" 4>&"$out"'


class LeftError(Exception):
    """The page was left while it was asked."""


class Browser:
    """One page in a browser; talks DevTools' protocol: JSON texts, each ended by a zero byte."""

    def __init__(self, profile: Path) -> None:
        theirs_in, self.to = os.pipe()
        self.back, theirs_out = os.pipe()
        command = [CHROMIUM, *FLAGS, f"--user-data-dir={profile}", "about:blank"]
        self.process = subprocess.Popen(
            ["bash", "-c", START, "bash", str(theirs_in), str(theirs_out), *command],
            pass_fds=(theirs_in, theirs_out),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(theirs_in)
        os.close(theirs_out)
        self.number, self.rest, self.session = 0, b"", None
        self.complaints: list[str] = []
        attached = self.ask("Target.attachToTarget", targetId=self._first_page(), flatten=True)
        self.session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.ask(f"{domain}.enable")

    def _first_page(self) -> str:
        """Give the id of the page that the browser opens, once it has: it answers before."""
        end = time.monotonic() + PATIENCE
        while True:
            pages = [t for t in self.ask("Target.getTargets")["targetInfos"] if t["type"] == "page"]
            if pages:
                return pages[0]["targetId"]
            assert time.monotonic() < end, "the browser opens no page"
            time.sleep(0.05)

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command, and give its answer."""
        self.number += 1
        command: dict[str, Any] = {"id": self.number, "method": method, "params": parameters}
        if self.session is not None:
            command["sessionId"] = self.session
        os.write(self.to, json.dumps(command).encode() + b"\0")
        while True:
            message = self._receive()
            if message.get("id") == self.number:
                fault = message.get("error", {}).get("message", "")
                if "navigated" in fault:
                    raise LeftError(fault)
                assert "error" not in message, message
                return message["result"]
            self._listen(message)

    def _receive(self) -> dict[str, Any]:
        end = time.monotonic() + PATIENCE
        while b"\0" not in self.rest:
            ready, _, _ = select.select([self.back], [], [], max(0.0, end - time.monotonic()))
            assert ready, "the browser doesn't answer"
            found = os.read(self.back, 1 << 20)
            assert found, "the browser is gone"
            self.rest += found
        message, _, self.rest = self.rest.partition(b"\0")
        return json.loads(message)

    def _listen(self, message: dict[str, Any]) -> None:
        """Keep what the console says of warnings and errors, and every exception."""
        kind, params = message.get("method"), message.get("params", {})
        if kind == "Runtime.exceptionThrown":
            self.complaints.append(json.dumps(params["exceptionDetails"])[:500])
        elif kind == "Runtime.consoleAPICalled" and params["type"] in {"error", "warning", "assert"}:
            self.complaints.append(json.dumps(params["args"])[:500])
        elif kind == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.complaints.append(params["entry"]["text"])

    def open(self, url: str, ready: str = "document.readyState === 'complete'") -> None:
        """Load a page and wait until an expression in it is true."""
        self.complaints.clear()
        self.ask("Page.navigate", url=url)
        end = time.monotonic() + PATIENCE
        while not self.run(f"document.body !== null && ({ready})"):
            assert time.monotonic() < end, f"the page isn't ready: {self.complaints}"
            time.sleep(0.05)

    def look(self, width: int = 1200, height: int = 800, *, dark: bool = False, media: str = "") -> None:
        """Show the page in a window of some size, in light or dark, on the screen or in ``print``."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.ask("Emulation.setDeviceMetricsOverride", **size)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.ask("Emulation.setEmulatedMedia", media=media, features=[scheme])

    def press(self, key: str, code: int = 0) -> None:
        """Press and release a key: its name, and its virtual key code where the browser acts on it."""
        for kind in ("keyDown", "keyUp"):
            pressed = {"type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code}
            self.ask("Input.dispatchKeyEvent", **pressed)

    def run(self, script: str) -> Any:
        """Give the value of an expression in the page."""
        answer = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def shoot(self, path: Path) -> np.ndarray:
        """Take a picture, (h, w, 3) from 0 to 1, and keep it in a file."""
        from matplotlib.image import imread

        # Two frames later the request is drawn.
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")
        path.write_bytes(base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"]))
        return imread(path)[:, :, :3]

    def close(self) -> None:
        self.session = None
        self.ask("Browser.close")
        self.process.wait(PATIENCE)
        os.close(self.to)
        os.close(self.back)
