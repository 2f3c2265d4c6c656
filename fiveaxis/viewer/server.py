"""The preview page served on the loopback address."""

from __future__ import annotations

import logging
import sys
import webbrowser
from collections.abc import Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

from fiveaxis.errors import SettingError
from fiveaxis.viewer.page import render_page

if TYPE_CHECKING:
    import trimesh

    from fiveaxis.collision import Surroundings
    from fiveaxis.findings import Finding
    from fiveaxis.posture.solution import Solution
    from fiveaxis.viewer.moves import ShownProgram

logger = logging.getLogger(__name__)

LOOPBACK = "127.0.0.1"
# s: longest wait for the server when closing.
POLL = 0.1
# s: an idle connection is closed after this.
PATIENCE = 10.0
# Forbid caching, guessing of types, framing, referrers, and reading by other sites.
HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class _Server(ThreadingHTTPServer):
    """A server that doesn't print the errors of connections."""

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Log what ended a connection: a browser may close it at any time."""
        logger.debug("connection from %s: %s", client_address, sys.exception())


class Preview:
    """A page that is served to this computer only, until it is closed.

    meshcat's server listens on every network interface. This one listens on the loopback address only and
    answers only requests that name it, so no web page can read a part through its own host name.

    Parameters
    ----------
    page : HTML text
    port : 0 chooses a free one

    Raises
    ------
    SettingError
        The port is taken or not allowed.
    """

    def __init__(self, page: str, port: int = 0) -> None:
        try:
            self._server = _Server((LOOPBACK, port), _handler(page.encode("utf-8")))
        except (OSError, OverflowError) as fault:
            raise SettingError(f"the preview can't use port {port}: {fault}; choose another, or 0") from None
        self._thread = Thread(
            target=self._server.serve_forever, args=(POLL,), name="fiveaxis-preview", daemon=True
        )
        self._thread.start()

    def url(self) -> str:
        """Return the address of the page."""
        return f"http://{LOOPBACK}:{self._server.server_port}/"

    def wait(self) -> None:
        """Serve until Ctrl-C, then close."""
        try:
            self._thread.join()
        except KeyboardInterrupt:
            self.close()

    def close(self) -> None:
        """Stop serving; closing twice is allowed."""
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()

    def __enter__(self) -> Preview:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def preview(
    solution: Solution,
    *,
    program: ShownProgram | None = None,
    part: str | Path | trimesh.Trimesh | None = None,
    surroundings: Surroundings | None = None,
    findings: Sequence[Finding] = (),
    open_browser: bool = True,
    port: int = 0,
) -> Preview:
    """Show a solution in a browser on this computer.

    Returns at once; the page is served while the program runs. ``preview(solution).wait()`` serves until
    Ctrl-C, ``with preview(solution):`` until the end of the block.

    Parameters
    ----------
    solution, program, part, surroundings, findings : as for `write_preview`
    open_browser : open the page
    port : of the loopback address; 0 chooses a free one

    Raises
    ------
    MeshError
        A mesh of the part, a fixture or the machine can't be read.
    SettingError
        The port is taken.
    """
    page = render_page(solution, program=program, part=part, surroundings=surroundings, findings=findings)
    shown = Preview(page, port)
    logger.info("%d kB at %s", len(page) // 1000, shown.url())
    if open_browser:
        webbrowser.open(shown.url())
    return shown


def _handler(page: bytes) -> type[BaseHTTPRequestHandler]:
    """Make a request handler that serves one page."""

    class Handler(BaseHTTPRequestHandler):
        server_version, sys_version = "fiveaxis", ""
        timeout = PATIENCE

        def do_GET(self) -> None:
            known = {f"{name}:{self.server.server_port}" for name in (LOOPBACK, "localhost")}  # type: ignore[attr-defined]
            if self.headers.get("Host") not in known:
                self.send_error(HTTPStatus.FORBIDDEN)
            elif self.path == "/favicon.ico":
                # Every browser requests one and reports an error without it.
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
            """Log requests instead of printing them to the terminal."""
            logger.debug("%s", format % args)

    return Handler
