"""The simulation as one HTML page that needs no network, with everything packed in it.

It is written to a file, served on the loopback address, or shown in a notebook. Text from files is escaped.
"""

from __future__ import annotations

import logging
import math
import sys
import webbrowser
from collections.abc import Sequence
from html import escape
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.metadata import distribution
from importlib.resources import files
from pathlib import Path
from string import Template
from threading import Thread
from typing import TYPE_CHECKING, Any

from fiveaxis.base import CadFile, Finding, MeshSource, SettingError, group_findings, write_atomically
from fiveaxis.posture import Optimum
from fiveaxis.show.viewer.moves import NO_LINE, ShownProgram, Side, choose_sides, find_stops, shown_result
from fiveaxis.show.viewer.payload import VIRIDIS, describe_show, pack_payload
from fiveaxis.show.viewer.recorder import Recorder
from fiveaxis.show.viewer.scene import STOCK_COLOUR, Scene, build_scene
from fiveaxis.show.viewer.stock import PlayedStock
from fiveaxis.show.viewer.whole import WholeProgram

if TYPE_CHECKING:
    from fiveaxis.check import Surroundings

logger = logging.getLogger(__name__)

# In this order: each uses the ones before.
SCRIPTS = (
    *("data.js", "chain.js", "stage.js", "stock.js", "readings.js", "timeline.js", "lines.js"),
    *("camera.js", "main.js"),
)
# Pixels of the time line: its curves, and each axis's row below them (`timeline.js`).
CURVES, AXIS_ROW = 64, 12
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


def write_preview(
    solution: Optimum | WholeProgram,
    path: str | Path,
    *,
    program: ShownProgram | None = None,
    part: MeshSource | None = None,
    surroundings: Surroundings | None = None,
    findings: Sequence[Finding] = (),
    cad: CadFile = CadFile(),
) -> Path:
    """Write the simulation as one HTML page that works offline; the same solution gives the same bytes.

    Parameters
    ----------
    solution : to show; or a program as it is, with its own surroundings and findings (`show_program`)
    path : of the page
    program : of the solution, as `make_program` makes it: its moves and blocks are shown instead of the
        path's locations
    part : mesh of the part in mm, or its file; None takes that of the surroundings
    surroundings : stock and fixtures to show
    findings : of verification, on the solution's motion
    cad : how a file of the part is taken

    Raises
    ------
    MeshError
        A mesh of the part, a fixture or the machine can't be read.
    SettingError
        The page can't be written there; neither a solution nor a program.
    """
    page = render_page(
        solution, program=program, part=part, surroundings=surroundings, findings=findings, cad=cad
    )
    logger.info("%s: %d kB", Path(path).name, len(page) // 1000)
    return write_atomically(path, page)


def render_page(
    solution: Optimum | WholeProgram,
    *,
    program: ShownProgram | None = None,
    part: MeshSource | None = None,
    surroundings: Surroundings | None = None,
    findings: Sequence[Finding] = (),
    cad: CadFile = CadFile(),
) -> str:
    """Return the text of the page that `write_preview` writes."""
    if not isinstance(solution, Optimum | WholeProgram):
        raise SettingError(
            f"a preview shows a solution, and this is {solution!r:.80}; show a program by "
            "preview(show_program(FILE, MACHINE))"
        )
    standing = None if program is None else program.report.standing
    if isinstance(solution, WholeProgram):
        surroundings, findings, standing = solution.surroundings, solution.findings, solution.standing
    recorder = Recorder()
    sides = (solution.side,) if isinstance(solution, WholeProgram) else choose_sides(solution, program)
    stops = find_stops(findings, sides[0])
    # Of a whole program, which may have a fault in every block, only where each run of them begins.
    marked = [stop.finding for stop in stops] if isinstance(solution, WholeProgram) else findings
    scene = build_scene(
        recorder,
        solution,
        sides,
        part,
        surroundings=surroundings,
        findings=marked,
        standing=standing,
        cad=cad,
    )
    blank = None if surroundings is None else surroundings.blank
    cut = None if program is None else program.report.cut
    played: PlayedStock | None = None
    text: tuple[str, ...] = ()
    if isinstance(solution, WholeProgram):
        text = solution.lines
    elif blank is not None:
        played = PlayedStock.of(blank, shown_result(solution, program), solution.machine, cut)
    if program is not None and bool((sides[0].line != NO_LINE).any()):
        text = program.text.lines
    bounds = math.degrees(solution.tilt.low), math.degrees(solution.tilt.high)
    head, sections = describe_show(solution.machine, scene, sides, text, bounds)
    head["stops"] = [stop.as_list() for stop in stops]
    if played is not None:
        head["stock"] = played.describe(sections) | {"colour": STOCK_COLOUR}
    logger.debug("%d messages to the scene; %d findings", len(recorder.commands), len(findings))
    # Its script alone: the library would import a server and a notebook.
    bundle = Path(str(distribution("meshcat").locate_file("meshcat/viewer/dist/main.min.js")))
    axes = solution.machine.axes
    others = "; those of a baseline beside the optimised program in the grey half of each row"
    return Template(_own("page.html")).substitute(
        title=escape(Path(solution.toolpath.name).name),
        style=_own("page.css"),
        facts=f"{solution.toolpath.count_given} locations, {escape(solution.machine.name)}",
        programs="<br>".join(_figures(side) for side in sides),
        others=others if len(sides) > 1 else "",
        beside=_beside(sides),
        boxes="".join(_boxes(scene)),
        map="" if played is None else _map(played),
        remarks="\n".join(_remarks(solution, scene)),
        stops=", ".join("rgb({:.0f} {:.0f} {:.0f})".format(*(255.0 * stop)) for stop in VIRIDIS),
        top=f"{head['top']:,.0f}",
        findings=_listed(findings, sides[0]) if findings else "",
        axes="".join(_reading(number, axis.letter) for number, axis in enumerate(axes)),
        letters="".join(f"<span>{axis.letter}</span>" for axis in axes),
        height=CURVES + AXIS_ROW * len(axes),
        licences=bundle.with_name("main.min.js.LICENSE.txt").read_text(encoding="utf-8"),
        scene=pack_payload(recorder.commands, sections, head),
        meshcat=bundle.read_text(encoding="utf-8"),
        scripts="".join(f"<script>\n{_own(name)}</script>\n" for name in SCRIPTS),
    )


def _own(name: str) -> str:
    return files("fiveaxis.show.viewer").joinpath("scripts", name).read_text(encoding="utf-8")


def _reading(number: int, letter: str) -> str:
    """Return an axis's row in the panel of values as HTML; the page's script fills it in."""
    return (
        f'<tr data-axis="{number}"><th scope="row">{letter}</th><td class="value"></td>'
        '<td class="range"><meter min="0" max="1" aria-label="place in its travel"></meter></td>'
        '<td class="power"></td><td class="other"></td></tr>'
    )


def _figures(side: Side) -> str:
    """Return energy, time, starts and reversals of a side."""
    starts, reversals = (sum(n.values()) for n in (side.steadiness.starts, side.steadiness.reversals))
    counts = f"starts {starts:,}, reversals {reversals:,}"
    return f"{escape(side.name)} {side.energy:,.0f} J, {side.time:,.1f} s; {counts}"


def _beside(sides: Sequence[Side]) -> str:
    if len(sides) < 2:
        return ""
    options = "".join(
        f'<option value="{number}">{escape(side.name)}</option>'
        for number, side in enumerate(sides)
        if number
    )
    return (
        '<p><label>beside the optimised program <select id="beside"><option value="">nothing</option>'
        f"{options}</select></label></p>"
    )


def _boxes(scene: Scene) -> list[str]:
    """Return a check box for every object that can be hidden."""
    wanted = [
        ("part", "workpiece/part", scene.has_part, not scene.cuts_stock),
        ("face numbers", "workpiece/numbers", scene.has_numbers, False),
        ("stock", "workpiece/stock", scene.has_stock, scene.cuts_stock),
        ("path", "workpiece/path", True, True),
        ("fixtures", "workpiece/fixtures", bool(scene.fixtures), True),
        ("machine", "links", True, True),
        ("tool", "tool", True, True),
        ("findings", "workpiece/marks", scene.has_marks, True),
    ]
    return [
        f'<label><input type="checkbox" data-node="{node}"{" checked" * shown}> {label}</label>'
        for label, node, there, shown in wanted
        if there
    ]


def _map(played: PlayedStock) -> str:
    """Return the switch for the colours of the finished part, with their meaning; empty if it has none."""
    if not played.is_compared:
        return ""
    key = ", ".join(
        f'<span style="color: rgb{colour}">▮</span> {escape(text)}' for colour, text in played.key().items()
    )
    return (
        '<p><label><input type="checkbox" id="map" checked> map of the finished part</label></p>'
        f'<p class="small" id="map-key">{key}</p>'
    )


def _remarks(solution: Optimum | WholeProgram, scene: Scene) -> list[str]:
    """Return the remarks on machine, fixtures and holder."""
    remarks = []
    if scene.is_schematic:
        remarks.append("The machine is a scheme: placed by its chain and travels, with invented thicknesses.")
    if scene.assumed:
        remarks.append(f"Brown-red: {' and '.join(scene.assumed)}, checked in place of [[bodies]].")
    if scene.fixtures:
        remarks.append("fixtures: " + ", ".join(scene.fixtures))
    if isinstance(solution, WholeProgram):
        remarks += [f"Assumed: {sentence}." for sentence in solution.assumed]
    if solution.toolpath.tool.holder is None:
        remarks.append("No holder is known; the shank's length is assumed.")
    return [f'<p class="small">{escape(line)}</p>' for line in remarks]


def _listed(findings: Sequence[Finding], result: Side) -> str:
    """List findings by cause, each a button that goes to the worst place, if there is one."""
    entries = []
    for cause in group_findings(finding.portable() for finding in findings):
        row = result.row_of(cause.worst)
        where = "" if row is None else f' data-row="{row}"'
        entries.append(f'<button type="button" class="{cause.severity}"{where}>{escape(str(cause))}</button>')
    inside = "\n".join(entries)
    return f'<details id="findings"><summary>findings: {len(findings)}</summary>\n{inside}</details>'


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


def preview(
    solution: Optimum | WholeProgram,
    *,
    program: ShownProgram | None = None,
    part: MeshSource | None = None,
    surroundings: Surroundings | None = None,
    findings: Sequence[Finding] = (),
    open_browser: bool | None = None,
    port: int = 0,
    cad: CadFile = CadFile(),
) -> Preview:
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
    page = render_page(
        solution, program=program, part=part, surroundings=surroundings, findings=findings, cad=cad
    )
    shown = Preview(page, port)
    logger.info("%d kB at %s", len(page) // 1000, shown.url())
    if not in_notebook() if open_browser is None else open_browser:
        webbrowser.open(shown.url())
    return shown


def in_notebook() -> bool:
    """Tell whether IPython runs this, as in a notebook; meshcat imports IPython in plain Python too."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and ipython.get_ipython() is not None


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
