"""The live preview: this computer only, and gone when closed."""

import http.client
import socket
import struct
import threading
import time
import webbrowser

import pytest
from support.patience import PATIENCE

from fiveaxis.base.errors import SettingError
from fiveaxis.show import Preview, preview

PAGE = "<!DOCTYPE html><p>ä</p>"


def port_of(shown: Preview) -> int:
    return int(shown.url().rstrip("/").rpartition(":")[2])


def get(port: int, path: str = "/", host: str | None = None) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    connection.request("GET", path, headers={} if host is None else {"Host": host})
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, content


def test_the_page_is_served_as_it_is():
    with Preview(PAGE) as shown:
        assert get(port_of(shown)) == (200, PAGE.encode())


def test_it_listens_on_the_loopback_address_only():
    with Preview(PAGE) as shown:
        assert shown.url().startswith("http://127.0.0.1:")
        with pytest.raises(ConnectionRefusedError):
            # Another loopback address stands for any other interface: a wildcard listener would answer.
            socket.create_connection(("127.0.0.2", port_of(shown)), timeout=PATIENCE)


def test_a_foreign_host_name_gets_nothing():
    with Preview(PAGE) as shown:
        port = port_of(shown)
        assert get(port, host=f"localhost:{port}")[0] == 200
        status, content = get(port, host=f"attacker.example:{port}")
        assert status == 403
        assert PAGE.encode() not in content


@pytest.mark.parametrize(
    "path",
    [
        "/../etc/passwd",
        "/../../../../../../etc/passwd",
        "//etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/..%2f..%2fetc%2fpasswd",
        "/.%00/etc/passwd",
        "/..\\..\\etc\\passwd",
        "file:///etc/passwd",
        "http://127.0.0.1/etc/passwd",
        "/preview.js",
        "/index.html",
        "/?file=/etc/passwd",
    ],
)
def test_nothing_but_the_page_is_served_whatever_is_requested(path):
    with Preview(PAGE) as shown:
        port = port_of(shown)
        status, content = get(port, path, host=f"127.0.0.1:{port}")
    assert status == 404
    assert b"root:" not in content


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "HEAD", "PROPFIND"])
def test_the_page_can_only_be_read(method):
    with Preview(PAGE) as shown:
        connection = http.client.HTTPConnection("127.0.0.1", port_of(shown), timeout=PATIENCE)
        connection.request(method, "/", body=b"x" if method in {"POST", "PUT"} else None)
        assert connection.getresponse().status == 501
        connection.close()


def test_headers_forbid_framing_caching_and_sharing_of_the_page():
    with Preview(PAGE) as shown:
        connection = http.client.HTTPConnection("127.0.0.1", port_of(shown), timeout=PATIENCE)
        connection.request("GET", "/")
        headers = connection.getresponse().headers
        connection.close()
    assert headers["X-Frame-Options"] == "DENY"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Cache-Control"] == "no-store"
    assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert "Python" not in headers["Server"]


def test_the_icon_that_browsers_ask_for_is_nothing():
    with Preview(PAGE) as shown:
        assert get(port_of(shown), "/favicon.ico") == (204, b"")


def test_a_browser_that_closes_the_connection_leaves_no_traceback(capfd):
    closing = struct.pack("ii", 1, 0)  # closed at once, so that the server's next byte is an error
    with Preview("x" * 50_000_000) as shown:
        for sent in (
            b"",
            b"GET / HT",
            f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port_of(shown)}\r\n\r\n".encode(),
        ):
            with socket.create_connection(("127.0.0.1", port_of(shown)), timeout=PATIENCE) as browser:
                browser.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, closing)
                browser.sendall(sent)
                if sent.endswith(b"\n"):
                    browser.recv(100)
        assert get(port_of(shown), "/favicon.ico")[0] == 204
        while threading.active_count() > 2 and any(
            "process_request" in t.name for t in threading.enumerate()
        ):
            time.sleep(0.01)
    assert capfd.readouterr() == ("", "")


def test_closed_means_gone_and_closing_twice_is_allowed():
    before = set(threading.enumerate())
    shown = Preview(PAGE)
    port = port_of(shown)
    shown.close()
    shown.close()
    # Threads, not their number: one of another test may end meanwhile.
    assert set(threading.enumerate()) <= before
    with pytest.raises(ConnectionRefusedError):
        get(port)


def test_a_taken_port_is_an_error_that_says_so():
    with Preview(PAGE) as shown, pytest.raises(SettingError, match=f"can't use port {port_of(shown)}"):
        Preview(PAGE, port_of(shown))


def test_ctrl_c_while_waiting_closes(monkeypatch):
    shown = Preview(PAGE)
    [thread] = [t for t in threading.enumerate() if t.name == "fiveaxis-preview"]
    join, calls = thread.join, []

    def interrupted(*limit):
        calls.append(limit)
        if len(calls) == 1:
            raise KeyboardInterrupt
        join(*limit)

    monkeypatch.setattr(thread, "join", interrupted)
    shown.wait()
    assert not thread.is_alive()
    assert calls[0]  # a wait without a time limit would keep Ctrl-C from Windows


@pytest.mark.parametrize("wanted", [True, False])
def test_the_browser_opens_if_wanted(solution, monkeypatch, wanted):
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    with preview(solution, open_browser=wanted) as shown:
        assert opened == ([shown.url()] if wanted else [])
        assert get(port_of(shown))[1].startswith(b"<!DOCTYPE html>")
