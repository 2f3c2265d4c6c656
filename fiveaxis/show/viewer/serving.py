"""The page of the simulation on the loopback address, or in a notebook."""

from __future__ import annotations

import logging
import sys
import webbrowser
from dataclasses import dataclass
from html import escape
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from typing import Any

from fiveaxis.base import SettingError, keywords_of
from fiveaxis.posture import Optimum
from fiveaxis.show.viewer.page import render_page
from fiveaxis.show.viewer.shown import Beside, WholeProgram

logger = logging.getLogger(__name__)

LOOPBACK = "127.0.0.1"
# s: longest wait for the server when closing.
POLL = 0.1
# s: an idle connection is closed after this.
PATIENCE = 10.0
# Characters: a notebook keeps its outputs, and Jupyter asks before it opens a file of more than some 100 MB.
MOST_INLINE = 20_000_000
# CSS height of the frame in a notebook.
HEIGHT = "640px"
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

    # On Windows, two servers could share a port; elsewhere it may be one that was closed just before.
    allow_reuse_address = sys.platform != "win32"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Log what ended a connection: a browser may close it at any time."""
        logger.debug("connection from %s: %s", client_address, sys.exception())


class Preview:
    """A page that is served to this computer only, until it is closed; a notebook shows it inline.

    meshcat's server listens on every network interface. This one listens on the loopback address only and
    answers only requests that name it, so no web page can read a part through its own host name. In a
    notebook the page is in the output itself, and stays there when the server is gone.

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
        self.page = page
        try:
            self._server = _Server((LOOPBACK, port), _handler(page.encode("utf-8")))
        except (OSError, OverflowError) as fault:
            raise SettingError(f"the preview can't use port {port}: {fault}; choose another, or 0") from None
        self._thread = Thread(
            target=self._server.serve_forever, args=(POLL,), name="fiveaxis-preview", daemon=True
        )
        self._thread.start()

    def __repr__(self) -> str:
        return f"<Preview at {self.url()}: {len(self.page) // 1000} kB>"

    def _repr_html_(self) -> str:
        """Put the page into a frame that runs its scripts but can't reach the notebook."""
        if len(self.page) > MOST_INLINE:
            size = f"{len(self.page) / 1e6:.0f} MB"
            return (
                f"<p>The preview has {size}, too much for a notebook: see {self.url()} or write_preview.</p>"
            )
        return (
            f'<iframe srcdoc="{escape(self.page)}" sandbox="allow-scripts" title="fiveaxis preview" '
            f'style="width:100%;height:{HEIGHT};border:0"></iframe>'
        )

    def url(self) -> str:
        """Return the address of the page."""
        return f"http://{LOOPBACK}:{self._server.server_port}/"

    def wait(self) -> None:
        """Serve until Ctrl-C, then close; in a notebook, whose next cells would wait too, return at once."""
        if in_notebook():
            return
        try:
            while self._thread.is_alive():  # on Windows, Ctrl-C doesn't end a wait without a time limit
                self._thread.join(POLL)
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


@dataclass(frozen=True, kw_only=True, eq=False)
class Previewing(Beside):
    """All that `preview` takes as keywords."""

    open_browser: bool | None = None
    port: int = 0


@keywords_of(Previewing)
def preview(solution: Optimum | WholeProgram, given: Previewing) -> Preview:
    """Show a solution in a browser on this computer, or inline in a notebook.

    Returns at once; the page is served while the program runs. ``preview(solution).wait()`` serves until
    Ctrl-C, ``with preview(solution):`` until the end of the block. In a notebook ``preview(solution)`` at the
    end of a cell shows the page below it.

    Parameters
    ----------
    solution, program, part, surroundings, findings, cad : as for `write_preview`
    open_browser : open the page; by default not in IPython and notebooks
    port : of the loopback address; 0 chooses a free one

    Raises
    ------
    MeshError
        A mesh of the part, a fixture or the machine can't be read.
    SettingError
        The port is taken; neither a solution nor a program, as `show_program` returns it.
    """
    page = render_page(solution, given)
    shown = Preview(page, given.port)
    logger.info("%d kB at %s", len(page) // 1000, shown.url())
    if not in_notebook() if given.open_browser is None else given.open_browser:
        webbrowser.open(shown.url())
    return shown


def in_notebook() -> bool:
    """Tell whether IPython runs this, as in a notebook; a library may import it in plain Python, too."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and ipython.get_ipython() is not None


def _handler(page: bytes) -> type[BaseHTTPRequestHandler]:
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
