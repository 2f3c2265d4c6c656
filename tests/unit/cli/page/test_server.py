"""The server of the page: whom it answers, what it takes, and what it leaves behind."""

import json
import math
import re
import signal
import time
from pathlib import Path

import psutil
import pytest
from support.patience import PATIENCE
from support.served_page import ServedPage

import fiveaxis as fx
from fiveaxis.cli.page import server
from fiveaxis.model import save_machine

TRUNNION = "linuxcnc-xyzac-trt"
PROGRAM = """G21 G90 G54
(T3 ball 8)
T3 M6
S9000 M3
G43 H3
M428
G0 X0 Y5 Z50 A-20 C0
G1 Z5 F600
G1 X10 Y5 Z5 A-20 C30 F2400
G1 X20 Y5 Z5 A-20 C60
G1 X30 Y5 Z5 A-20 C90
M429
G0 Z100
M30
"""

# Cosine and sine of a quarter turn.
ROUND = [(math.cos(0.05 * k), math.sin(0.05 * k)) for k in range(30)]


@pytest.fixture(scope="module")
def page():
    served = ServedPage()
    yield served
    served.close()


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "part.ngc"
    path.write_text(PROGRAM)
    return path


@pytest.mark.parametrize(
    "headers",
    [
        {"Cookie": None},
        {"Cookie": "fiveaxis=wrong"},
        {"Host": "example.org"},
        {"Host": "192.168.1.4"},
        {"Origin": "https://example.org"},
        {"Origin": "null"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Sec_Fetch_Site": "same-site"},
    ],
)
@pytest.mark.parametrize("path", ["/", "/state", "/machines", "/out/part.ngc", "/page.js"])
def test_nobody_else_gets_an_answer(page, headers, path):
    status, _, answered = page.ask("GET", path, **headers)
    assert status == 403
    assert "Access-Control-Allow-Origin" not in answered


@pytest.mark.parametrize("request_line", [("PUT", "/file/a.nc"), ("POST", "/run/look"), ("DELETE", "/state")])
def test_a_request_that_changes_something_has_a_header_that_no_form_can_send(page, request_line):
    status, told, _ = page.ask(*request_line, b"{}", X_Fiveaxis=None)
    assert (status, told["error"]) == (403, "another page asked")


def test_the_key_becomes_a_cookie_that_scripts_and_other_sites_never_see(page):
    status, _, headers = page.ask("GET", f"/?key={page.key}", Cookie=None)
    assert (status, headers["Location"]) == (302, "/")
    assert "HttpOnly" in headers["Set-Cookie"]
    assert "SameSite=Strict" in headers["Set-Cookie"]


def test_the_page_loads_nothing_from_elsewhere_and_runs_its_own_script_alone(page):
    _, _, headers = page.ask("GET", "/")
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    for name in ("page.html", "page.js", "page.css"):
        text = (Path(server.__file__).parent / name).read_text()
        assert not re.search(r"https?://", text)
    assert not re.search(
        r"<script>|\son\w+=|style=", (Path(server.__file__).parent / "page.html").read_text()
    )


@pytest.mark.parametrize("name", ["..%2f..%2fx", ".hidden", "a%20b.nc", "a%00.nc", "x" * 200])
def test_a_file_has_a_plain_name(page, name):
    status, told, _ = page.ask("PUT", f"/file/{name}", b"G0")
    assert status == 400
    assert "name" in told["error"]


def test_a_file_that_is_too_large_is_refused_before_it_is_sent(page):
    status, told, _ = page.ask("PUT", "/file/a.nc", None, Content_Length=str(server.LARGEST + 1))
    assert (status, told["error"]) == (413, "a file may have 200 MB")


@pytest.mark.parametrize(
    "path", ["/out/../../../etc/hostname", "/out/%2e%2e/%2e%2e/etc/hostname", "/out//etc/hostname"]
)
def test_only_files_of_the_session_are_sent(page, path):
    assert page.ask("GET", f"/out/{path}")[0] in (403, 404)


def test_what_was_made_is_a_download_and_what_is_shown_cannot_read_the_page(page, program):
    page.work("look", program=page.put(program), machine="variaxis-730", answers={"A.speeds": "30"})
    assert page.ask("GET", "/out/part.ngc")[0] == 404
    _, _, headers = page.ask("GET", "/out/machine.toml?as=new%22%3B%20x=%22y.ngc")
    assert headers["Content-Disposition"] == 'attachment; filename="newxy.ngc"'
    assert 'sandbox="allow-scripts"' in (Path(server.__file__).parent / "page.js").read_text()


def test_a_request_names_files_of_the_session_only(page, program):
    for wrong in ("../part.ngc", "/etc/hostname", "missing.ngc"):
        status, told, _ = page.ask("POST", "/run/look", f'{{"program": "{wrong}", "machine": "x"}}'.encode())
        assert status == 400, told


def test_a_dropped_machine_is_answered_again_and_again_and_stays_as_it_was(page, program, tmp_path):
    own = tmp_path / "machine.toml"
    save_machine(fx.load_machine("variaxis-730"), own)
    ask = {"program": page.put(program), "machine": page.put(own)}
    for answers in ({"A.speeds": "30"}, {"C.speeds": "50"}):
        page.work("look", **ask, answers=answers)
    made = tmp_path / "made.toml"
    made.write_bytes(page.ask("GET", "/out/machine.toml")[1])
    speeds = {axis.letter: axis.max_speed for axis in fx.load_machine(made).axes}
    assert speeds["A"] is None
    assert speeds["C"] is not None


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b"7", b'"look"'])
def test_a_request_is_a_json_object(page, body):
    assert page.ask("POST", "/run/look", body)[0] == 400


def test_a_program_as_it_is_is_what_the_library_says(page, program):
    state = page.work("look", program=page.put(program), machine=TRUNNION)
    assert state["end"]["result"]["simulation"] == "as-it-is.html"
    seen, expected = state["seen"], json.loads(json.dumps(fx.look(program, TRUNNION).as_dict()))
    assert seen["operations"] == expected["operations"]
    assert seen["totals"]["time"] == expected["operations"][0]["energy"]["time"]
    status, shown, _ = page.ask("GET", "/out/as-it-is.html")
    assert status == 200
    assert b"<canvas" in shown or b"canvas" in shown


def test_what_the_machine_lacked_is_kept_as_a_file(page, program, tmp_path):
    name = page.put(program)
    answers = {"A.points": "0,0,50", "A.speeds": "30", "C.speeds": "50"}
    before = page.work("look", program=name, machine="variaxis-730")["seen"]["missing"]
    assert {each["name"] for each in before} >= answers.keys()
    after = page.work("look", program=name, machine="variaxis-730", answers=answers)
    assert after["seen"]["missing"] == []
    file = tmp_path / "machine.toml"
    file.write_bytes(page.ask("GET", "/out/machine.toml")[1])
    kept, assumed = fx.load_machine(file), fx.load_machine("variaxis-730", answers)
    assert [axis.max_speed for axis in kept.axes] == [axis.max_speed for axis in assumed.axes]


@pytest.mark.parametrize(
    ("content", "told"),
    [(b"\x7fELF\x02\x01" + bytes(99), "isn't a text file"), (b"", "part.ngc"), (b"hello\n", "part.ngc")],
)
def test_what_is_no_program_ends_in_one_sentence_without_the_servers_folder(page, tmp_path, content, told):
    path = tmp_path / "part.ngc"
    path.write_bytes(content)
    end = page.work("look", program=page.put(path), machine=TRUNNION)["end"]
    assert told in end["error"]
    assert str(page.folder) not in end["error"]
    assert "Traceback" not in end["error"]


def test_one_piece_of_work_at_a_time_and_cancel_ends_its_process(page, program):
    ask = f'{{"program": "{page.put(program)}", "machine": "{TRUNNION}", "effort": "thorough", "cone": 40}}'
    assert page.ask("POST", "/run/improve", ask.encode())[0] == 200
    status, told, _ = page.ask("POST", "/run/look", ask.encode())
    assert status == 409
    assert "another window" in told["error"]
    busy = [worker for worker in page.workers if worker.is_running()]
    assert page.ask("DELETE", "/state")[0] == 200
    assert page.ended()["end"]["error"] == "cancelled"
    assert len([worker for worker in busy if worker.is_running()]) < len(busy)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_a_server_that_ends_or_is_killed_leaves_no_process_and_no_file(program, number):
    page = ServedPage()
    ask = f'{{"program": "{page.put(program)}", "machine": "{TRUNNION}", "effort": "thorough"}}'
    folder = page.folder
    assert (folder / "given" / "part.ngc").is_file()
    assert page.ask("POST", "/run/improve", ask.encode())[0] == 200
    workers = page.workers
    page.close(number)
    _, left = psutil.wait_procs(workers, PATIENCE)
    assert not left
    end = time.monotonic() + PATIENCE
    while folder.exists():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_taken_port_is_told(page):
    from typer.testing import CliRunner

    from fiveaxis.cli.commands import app

    result = CliRunner().invoke(app, ["app", "--no-browser", "--port", str(page.port)])
    assert result.exit_code == 2
    assert f"port {page.port} can't be opened" in result.output


@pytest.mark.slow
def test_a_part_gets_its_program_with_the_retract_that_was_asked_for(page):
    part = Path(__file__).parents[4] / "examples" / "overhang" / "part.stl"
    ask = {"program": page.put(part), "machine": "hayashi-640123", "tool": "ball:8", "tilt": [15, 75]}
    for retract in (120, 0):
        end = page.work("improve", **ask, stepdown=8, effort="quick", retract=retract)["end"]
        assert end["result"]["verdict"] == "new"
        text = page.ask("GET", f"/out/result/{end['result']['program']}")[1].decode()
        assert f"G53 G0 Z{retract}.000000" in text


@pytest.mark.parametrize("verb", ["improve", "look"])
def test_a_part_beside_a_program_is_used(page, program, tmp_path, verb):
    part = tmp_path / "block.stl"
    part.write_bytes(b"solid nothing\nendsolid nothing\n")
    ask = {"program": page.put(program), "part": page.put(part), "machine": TRUNNION, "tool": "ball:8"}
    end = page.work(verb, **ask, effort="quick")["end"]
    assert "block.stl" in (end.get("error") or end["result"]["no_simulation"])


@pytest.mark.slow
def test_a_path_that_is_no_program_becomes_one(page, tmp_path):
    path = tmp_path / "ring.cl"
    rows = [f"GOTO/{20 * c:.4f},{20 * s:.4f},5,{0.5 * c:.5f},{0.5 * s:.5f},0.86603" for c, s in ROUND]
    path.write_text("\n".join(["UNITS/MM", "MULTAX/ON", "FEDRAT/600,MMPM", *rows, "FINI"]) + "\n")
    ask = {"program": page.put(path), "machine": "hayashi-640123", "tool": "ball:8", "cone": 15}
    end = page.work("improve", **ask, effort="quick")["end"]
    assert end["result"]["verdict"] == "new", end
