"""The preview page on this computer's own address."""

from __future__ import annotations

import logging
import webbrowser
from collections.abc import Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from types import TracebackType
from typing import TYPE_CHECKING, Any

from fiveaxis.errors import SettingError
from fiveaxis.viewer.page import render_page

if TYPE_CHECKING:
    import trimesh

    from fiveaxis.collision import Surroundings
    from fiveaxis.findings import Finding
    from fiveaxis.posture.solution import Solution

logger = logging.getLogger(__name__)

LOOPBACK = "127.0.0.1"
# How long closing may wait for the server to look up, s.
POLL = 0.1
# A connection that says nothing for so long is closed, s.
PATIENCE = 10.0
# Nothing may be guessed from the page, framed around it or read from another site.
HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class Preview:
    """A page that is served to this computer only, until it is closed.

    meshcat's own server listens on every network interface; this one on the loopback address alone, and it
    answers only requests that name that address, so that no web page can read a part through a host name
    of its own.

    Parameters
    ----------
    page : HTML text
    port : 0 takes a free one

    Raises
    ------
    SettingError
        The port is taken or not allowed.
    """

    def __init__(self, page: str, port: int = 0) -> None:
        try:
            self._server = ThreadingHTTPServer((LOOPBACK, port), _handler(page.encode("utf-8")))
        except (OSError, OverflowError) as fault:
            raise SettingError(f"the preview can't use port {port}: {fault}; take another, or 0") from None
        self._thread = Thread(
            target=self._server.serve_forever, args=(POLL,), name="fiveaxis-preview", daemon=True
        )
        self._thread.start()

    def url(self) -> str:
        """Give the address of the page."""
        return f"http://{LOOPBACK}:{self._server.server_port}/"

    def wait(self) -> None:
        """Serve until Ctrl-C, then close."""
        try:
            self._thread.join()
        except KeyboardInterrupt:
            self.close()

    def close(self) -> None:
        """Stop serving; closing twice is no fault."""
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()

    def __enter__(self) -> Preview:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        fault: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def preview(
    solution: Solution,
    *,
    part: str | Path | trimesh.Trimesh | None = None,
    surroundings: Surroundings | None = None,
    findings: Sequence[Finding] = (),
    open_browser: bool = True,
    port: int = 0,
) -> Preview:
    """Show a solution in a browser on this computer.

    Returns at once; the page is served while the program runs. ``preview(solution).wait()`` serves until
    Ctrl-C, ``with preview(solution):`` as long as the block lasts.

    Parameters
    ----------
    solution : what to show
    part : mesh of the part in mm, or its file; None takes that of the surroundings
    surroundings : stock and fixtures to show
    findings : of verification, on the solution's motion
    open_browser : open the page
    port : of the loopback address; 0 takes a free one

    Raises
    ------
    MeshError
        The part, a fixture's mesh or one of the machine can't be read.
    SettingError
        The port is taken.
    """
    page = render_page(solution, part=part, surroundings=surroundings, findings=findings)
    shown = Preview(page, port)
    logger.info("%d kB at %s", len(page) // 1000, shown.url())
    if open_browser:
        webbrowser.open(shown.url())
    return shown


def _handler(page: bytes) -> type[BaseHTTPRequestHandler]:
    """Make a request handler that knows one page."""

    class Handler(BaseHTTPRequestHandler):
        server_version, sys_version = "fiveaxis", ""
        timeout = PATIENCE

        def do_GET(self) -> None:
            known = {f"{name}:{self.server.server_port}" for name in (LOOPBACK, "localhost")}  # type: ignore[attr-defined]
            if self.headers.get("Host") not in known:
                self.send_error(HTTPStatus.FORBIDDEN)
            elif self.path == "/favicon.ico":
                # Every browser asks for one, and shows a fault where there is none.
                self.send_response(HTTPStatus.NO_CONTENT)
                self.end_headers()
            elif self.path != "/":
                self.send_error(HTTPStatus.NOT_FOUND)
            else:
                self._send_page()

        def _send_page(self) -> None:
            self.send_response(HTTPStatus.OK)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(page)))
            for name, value in HEADERS.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(page)

        def log_message(self, format: str, *args: Any) -> None:
            """Log requests for those who ask for details: the terminal belongs to the caller."""
            logger.debug("%s", format % args)

    return Handler
