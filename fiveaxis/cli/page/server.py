"""The server of the page: on this computer only, for whoever has the key that its address holds.

Every piece of work is a process of its own (`worker`), so that the page answers while it runs and its cancel
is the end of that process. The next worker is started ahead and waits, since imports take a second.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import json
import os
import re
import secrets
import shutil
import signal
import socket
import sys
import tempfile
import time
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.web import Application, HTTPError, RequestHandler, StaticFileHandler, stream_request_body

HERE, LOOPBACK = Path(__file__).parent, "127.0.0.1"
# Bytes of an upload, and of a request without one.
LARGEST, LARGEST_ASK = 200_000_000, 1_000_000
# What a file of the session may be named.
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,120}")
VERBS = ("look", "improve")
PAGES = {"": "text/html", "page.js": "text/javascript", "page.css": "text/css"}
# What the page itself may load; what is shown in its frames brings all with it.
OWN = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; frame-src 'self'; "
    "img-src data:"
)
SHOWN = (
    "default-src 'unsafe-inline' data: blob:; script-src 'unsafe-inline' 'unsafe-eval' blob:; "
    "connect-src data: blob:"
)
CLOSED = "; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
CANCELLED = "cancelled"


class Run:
    """A piece of work, and what its process says, which waits for the request."""

    def __init__(self, process: asyncio.subprocess.Process, ask: dict[str, Any]) -> None:
        self.ask, self.began, self.process = ask, time.monotonic(), process
        self.last: dict[str, Any] = {"stage": "starting"}
        self.seen: Any = None
        self.end: dict[str, Any] | None = None
        self.following = asyncio.ensure_future(self._follow())

    async def _follow(self) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        with contextlib.suppress(ConnectionError):
            self.process.stdin.write(json.dumps(self.ask).encode() + b"\n")
            async for line in self.process.stdout:
                message = json.loads(line)
                if "seen" in message:
                    self.seen = message["seen"]
                elif "result" in message or "error" in message:
                    self.end = message
                else:
                    self.last = message
        code = await self.process.wait()
        if self.end is None:
            broke = f"the work broke off (exit code {code}); the terminal of fiveaxis app has the reason"
            self.end = {
                "error": CANCELLED if code == -signal.SIGKILL else broke,
                "kind": "Ended",
                "causes": [],
            }

    @property
    def runs(self) -> bool:
        """Whether it hasn't ended."""
        return self.end is None

    def state(self) -> dict[str, Any]:
        """How it is doing, as data for the page."""
        elapsed = time.monotonic() - self.began
        return {**self.last, "ask": self.ask, "elapsed": elapsed, "seen": self.seen, "end": self.end}


class Session:
    """The files and the work of a server."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="fiveaxis-app-"))
        # What was dropped, and what was made: neither can replace the other.
        self.given, self.made = self.folder / "given", self.folder / "made"
        self.given.mkdir()
        self.made.mkdir()
        self.key = secrets.token_urlsafe(24)
        self.port = 0
        self.run: Run | None = None
        self._waiting: asyncio.subprocess.Process | None = None
        self._listing: Run | None = None

    async def wait_ahead(self) -> None:
        """Start the process of the next piece of work, unless it waits."""
        if self._waiting is None or self._waiting.returncode is not None:
            pipe = asyncio.subprocess.PIPE
            self._waiting = await asyncio.create_subprocess_exec(
                *(sys.executable, "-m", "fiveaxis.cli.page.worker", str(self.folder)),
                stdin=pipe,
                stdout=pipe,
                # A group of its own, so that what it starts ends with it.
                start_new_session=True,
                limit=LARGEST,
            )

    async def begin(self, ask: dict[str, Any]) -> None:
        """Begin a piece of work."""
        self.run = Run(await self._take_waiting(), ask | {"folder": str(self.made)})

    async def machines(self) -> dict[str, Any]:
        """Return the machines of the library, which are read once."""
        if self._listing is None:
            self._listing = Run(await self._take_waiting(), {"verb": "machines"})
        await self._listing.following
        assert self._listing.end is not None
        return self._listing.end

    async def _take_waiting(self) -> asyncio.subprocess.Process:
        await self.wait_ahead()
        process, self._waiting = self._waiting, None
        assert process is not None
        await self.wait_ahead()
        return process

    def cancel(self) -> None:
        """End the piece of work that runs."""
        if self.run is not None and self.run.runs:
            _kill(self.run.process)

    def close(self) -> None:
        """End all work, and take all files away."""
        self.cancel()
        if self._waiting is not None:
            _kill(self._waiting)
        shutil.rmtree(self.folder, ignore_errors=True)


def _kill(process: asyncio.subprocess.Process) -> None:
    with contextlib.suppress(ProcessLookupError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()


class Guarded(RequestHandler):
    """Answers this page alone: by its host, by the key as a cookie, and to no request of another site."""

    policy = OWN

    @property
    def session(self) -> Session:
        """The files and the work."""
        session: Session = self.settings["session"]
        return session

    def prepare(self) -> None:
        """Refuse what this page didn't ask."""
        port, given = self.session.port, self.request.headers
        hosts = [f"{LOOPBACK}:{port}", f"localhost:{port}"]
        if self.request.host not in hosts:
            raise HTTPError(403, reason="this page is for this computer only")
        if given.get("Sec-Fetch-Site", "none") not in ("none", "same-origin"):
            raise HTTPError(403, reason="another page asked")
        if given.get("Origin", f"http://{hosts[0]}") not in [f"http://{host}" for host in hosts]:
            raise HTTPError(403, reason="another page asked")
        key = self.get_query_argument("key", "") or self.get_cookie(self._cookie, "") or ""
        if not hmac.compare_digest(key.encode(), self.session.key.encode()):
            raise HTTPError(403, reason="open the address that fiveaxis app printed")
        if self.request.method != "GET" and given.get("X-Fiveaxis") != "1":
            raise HTTPError(403, reason="another page asked")

    @property
    def _cookie(self) -> str:
        return f"fiveaxis{self.session.port}"

    def set_default_headers(self) -> None:
        """Let no other page embed, keep or read an answer."""
        for name, value in {
            "Server": "fiveaxis",
            "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Content-Security-Policy": self.policy + CLOSED,
        }.items():
            self.set_header(name, value)

    def write_error(self, status_code: int, **_: Any) -> None:
        """Answer with a sentence."""
        self.set_header("Content-Type", "application/json")
        self.finish({"error": self._reason})


class Page(Guarded):
    """GET /: the page; its key becomes a cookie, and leaves the address."""

    def get(self, name: str) -> None:
        """Send a file of the page."""
        if self.get_query_argument("key", ""):
            self.set_cookie(self._cookie, self.session.key, httponly=True, samesite="Strict")
            self.redirect("/")
            return
        self.set_header("Content-Type", f"{PAGES[name]}; charset=utf-8")
        self.write((HERE / (name or "page.html")).read_bytes())


@stream_request_body
class Upload(Guarded):
    """PUT /file/NAME: a file of the session, written as it comes."""

    def prepare(self) -> None:
        """Refuse a wrong name, or more than a file may hold."""
        super().prepare()
        name, length = self.path_args[0], int(self.request.headers.get("Content-Length", -1))
        if not NAME.fullmatch(name):
            raise HTTPError(400, reason="a file's name is letters, digits, dots, dashes and underscores here")
        if not 0 <= length <= LARGEST:
            raise HTTPError(413, reason=f"a file may have {LARGEST // 1_000_000} MB")
        connection: Any = self.request.connection
        connection.set_max_body_size(LARGEST)
        self._path = self.session.given / name
        self._file = self._path.with_name(f"{name}.part").open("wb")

    def data_received(self, chunk: bytes) -> None:
        """Write a piece."""
        self._file.write(chunk)

    def put(self, name: str) -> None:
        """Keep the file."""
        self._file.close()
        Path(self._file.name).replace(self._path)
        self.write({"name": name})

    def on_connection_close(self) -> None:
        """Forget a file that didn't come whole."""
        self._file.close()
        Path(self._file.name).unlink(missing_ok=True)


class Start(Guarded):
    """POST /run/VERB: begin a piece of work; one at a time."""

    async def post(self, verb: str) -> None:
        """Begin it."""
        if len(self.request.body) > LARGEST_ASK:
            raise HTTPError(413, reason="the request is too long")
        try:
            ask = json.loads(self.request.body)
        except ValueError:
            ask = None
        if not isinstance(ask, dict):
            raise HTTPError(400, reason="a request is a JSON object")
        if self.session.run is not None and self.session.run.runs:
            raise HTTPError(
                409, reason="another window of this page is at work; wait for it, or cancel it there"
            )
        for name in ("program", "machine", "part"):
            if ask.get(name) and not NAME.fullmatch(str(ask[name])):
                raise HTTPError(400, reason=f"{name} is no file or machine")
            given = self.session.given / str(ask.get(name) or "")
            if ask.get(name) and given.is_file():
                ask[name] = str(given)
            elif name != "machine" and ask.get(name):
                raise HTTPError(400, reason=f"{ask[name]} isn't there any more; drop it again")
        await self.session.begin(ask | {"verb": verb})
        self.write({})


class Machines(Guarded):
    """GET /machines: those of the library."""

    async def get(self) -> None:
        """Send them."""
        told = await self.session.machines()
        self.write({"machines": told.get("result", [])})


class State(Guarded):
    """GET /state: how the work is doing; DELETE: cancel it."""

    def get(self) -> None:
        """Send it."""
        run = self.session.run
        self.write({} if run is None else run.state())

    def delete(self) -> None:
        """Cancel it."""
        self.session.cancel()


class Made(Guarded, StaticFileHandler):
    """GET /out/…: pages, programs and machine files that were made."""

    policy = SHOWN

    def set_extra_headers(self, path: str) -> None:
        """Let everything but a page be a download."""
        if Path(path).suffix != ".html":
            name = self.get_query_argument("as", Path(path).name)
            safe = "".join(c for c in name if c.isascii() and (c.isalnum() or c in "._-"))
            self.set_header("Content-Disposition", f'attachment; filename="{safe}"')
            self.set_header("Content-Type", "application/octet-stream")


def serve(port: int, announce: Callable[[str], None], *, browser: bool) -> None:
    """Serve the page until Ctrl-C, at an address that is announced; port 0 chooses a free one.

    `OSError` if the port is taken.
    """
    asyncio.run(_serve(port, announce, browser))


async def _serve(port: int, announce: Callable[[str], None], browser: bool) -> None:
    session, done = Session(), asyncio.Event()
    handlers: list[Any] = [
        (r"/(|page\.js|page\.css)", Page),
        (r"/file/([^/]+)", Upload),
        (rf"/run/({'|'.join(VERBS)})", Start),
        (r"/machines", Machines),
        (r"/state", State),
        (r"/out/(.*)", Made, {"path": str(session.made)}),
    ]
    try:
        application = Application(handlers, session=session, log_function=lambda _: None)
        server = HTTPServer(application, max_body_size=LARGEST)
        listening = socket.create_server((LOOPBACK, port))
        listening.setblocking(False)
        session.port = listening.getsockname()[1]
        server.add_socket(listening)
        address = f"http://{LOOPBACK}:{session.port}/?key={session.key}"
        announce(address)
        await session.wait_ahead()
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            with contextlib.suppress(NotImplementedError):  # Windows raises KeyboardInterrupt itself
                loop.add_signal_handler(number, done.set)
        if browser:
            webbrowser.open(address)
        await done.wait()
    finally:
        session.close()
