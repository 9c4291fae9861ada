"""The server of the explorer's page: what it serves, to whom, and which messages it answers."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import stat
import struct
import sys
import threading
import webbrowser
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from urllib.request import url2pathname

import pytest

import vkbloom
from tests.cli.calls import run
from tests.images import noise
from vkbloom import Renderer, Separable

tornado = pytest.importorskip("tornado")

from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest, HTTPResponse  # noqa: E402
from tornado.websocket import WebSocketClientConnection, websocket_connect  # noqa: E402

from tests.explorer.pages import Server, Viewer  # noqa: E402

#: Connections of the running test, which it leaves open.
OPENED: list[WebSocketClientConnection] = []


@pytest.fixture
def loop() -> Iterator[asyncio.Runner]:
    with asyncio.Runner() as runner:
        yield runner


@pytest.fixture
def server(loop: asyncio.Runner, renderer: Renderer) -> Iterator[Server]:
    image = noise(20, 30, 3, dtype="uint8")

    async def open_server() -> Server:
        return Server(lambda: Viewer(image, renderer=renderer))

    started = loop.run(open_server())

    async def stop() -> None:
        while OPENED:
            OPENED.pop().close()
        await started.stop()

    yield started
    loop.run(stop())


async def get(url: str, **headers: str) -> HTTPResponse:
    return await AsyncHTTPClient().fetch(HTTPRequest(url, headers=headers), raise_error=False)


async def connect(server: Server, **headers: str) -> WebSocketClientConnection:
    url = server.url.replace("http:", "ws:") + "socket"
    given = {"Origin": f"http://127.0.0.1:{server.port}"} | headers
    OPENED.append(await websocket_connect(HTTPRequest(url, headers=given)))
    return OPENED[-1]


async def answer(connection: WebSocketClientConnection) -> tuple[dict[str, Any], list[bytes]]:
    data = await connection.read_message()
    assert isinstance(data, bytes), (data, connection.close_code)
    (length,) = struct.unpack_from("<I", data)
    header = json.loads(data[4 : 4 + length])
    offset, buffers = 4 + length, []
    for size in header["buffers"]:
        buffers.append(data[offset : offset + size])
        offset += size
    assert offset == len(data)
    return header, buffers


def ask(number: int, *sides: str) -> str:
    settings = Separable(intensity=number).to_dict()
    return json.dumps({"kind": "frame", "id": number, "sides": dict.fromkeys(sides, settings)})


async def test_the_page_and_its_files(server: Server) -> None:
    for name, kind in {
        "": "text/html",
        "page.js": "text/javascript",
        "start.js": "text/javascript",
        "page.css": "text/css",
    }.items():
        response = await get(server.url + name)
        assert response.code == 200
        assert response.headers["Content-Type"].startswith(kind)
        assert "default-src 'none'" in response.headers["Content-Security-Policy"]
        assert "frame-ancestors 'none'" in response.headers["Content-Security-Policy"]
        assert response.headers["Cache-Control"] == "no-store"
        # Nothing is loaded from elsewhere.
        assert b"https://" not in response.body
        assert b"http://" not in response.body
    for name in ("other.js", "viewer.py", "../server.py", "..%2fserver.py"):
        assert (await get(server.url + name)).code in (403, 404)


async def test_only_this_machine_is_listened_to(server: Server) -> None:
    # All of 127.0.0.0/8 is this machine, so that whoever listens everywhere listens there too.
    for address, listens in (("127.0.0.1", True), ("127.0.0.2", False)):
        with socket.socket() as attempt:
            attempt.settimeout(5)
            assert (attempt.connect_ex((address, server.port)) == 0) == listens, address


async def test_the_token_and_the_host_are_needed(server: Server) -> None:
    root = f"http://127.0.0.1:{server.port}/"
    for path in ("", "x/", server.token[:-1] + "/", server.token + "x/page.js", "x/socket"):
        assert (await get(root + path)).code in (403, 404), path
    # The page says what to do.
    refused = await get(root + "x/")
    assert refused.code == 403
    assert refused.headers["Content-Type"].startswith("text/html")
    assert b"start <code>vkbloom explore" in refused.body
    # A foreign name that was made to point here.
    for host in ("example.org", f"example.org:{server.port}", "127.0.0.1", "127.0.0.1:1"):
        assert (await get(server.url, Host=host)).code == 403, host
    assert (await get(server.url, Host=f"localhost:{server.port}")).code == 200
    # Each server has a token of its own.
    other = Server(lambda: pytest.fail("nobody asked"))
    assert other.token != server.token
    assert len(other.token) >= 32
    await other.stop()


@pytest.mark.parametrize(
    "origin", ["http://example.org", "null", "", "http://127.0.0.1", "https://127.0.0.1:{port}"]
)
async def test_the_socket_is_for_the_page_itself(server: Server, origin: str) -> None:
    with pytest.raises(HTTPClientError) as caught:
        await connect(server, Origin=origin.format(port=server.port))
    assert caught.value.code == 403
    with pytest.raises(HTTPClientError):
        await connect(server, Host="example.org")
    (await connect(server)).close()


async def test_frames_come_with_their_pictures(server: Server) -> None:
    page = await connect(server)
    await page.write_message(json.dumps({"kind": "setup"}))
    header, buffers = await answer(page)
    assert (header["kind"], header["source_size"], buffers) == ("setup", [30, 20], [])
    await page.write_message(ask(1, "a", "b"))
    header, buffers = await answer(page)
    assert header["id"] == 1
    assert [side["picture"] for side in header["sides"].values()] == [0, 1]
    assert [buffer[:4] for buffer in buffers] == [b"\x89PNG"] * 2
    # Each page has its own viewer.
    other = await connect(server)
    await other.write_message(json.dumps({"kind": "setup"}))
    assert (await answer(other))[0]["sides"]["a"]["intensity"] == 0.15
    await other.write_message(json.dumps({"kind": "nonsense"}))
    assert (await answer(other))[0]["kind"] == "error"


async def test_the_newest_wins(server: Server) -> None:
    page = await connect(server)

    async def wait_for() -> None:
        """Wait until the messages before are read: a wrong one is answered by no thread."""
        await page.write_message('{"kind": "probe", "at": NaN}')
        assert (await answer(page))[0]["kind"] == "error"

    held = threading.Event()
    server._worker.submit(held.wait)
    await page.write_message(ask(1, "a", "b"))
    # The first is being answered when the others come.
    await wait_for()
    await page.write_message(ask(2, "b"))
    for number in range(3, 50):
        await page.write_message(ask(number, "a"))
    await page.write_message(json.dumps({"kind": "probe", "id": 50, "at": [0, 0]}))
    await wait_for()
    held.set()
    answers = [(await answer(page))[0] for _ in range(3)]
    assert [(header["kind"], header["id"]) for header in answers] == [
        ("frame", 1),
        ("frame", 49),
        ("probe", 50),
    ]
    # What only an older message asked for has not been lost.
    assert answers[1]["sides"]["a"]["code"] == "vkbloom.Separable(intensity=49.0)"
    assert answers[1]["sides"]["b"]["code"] == "vkbloom.Separable(intensity=2.0)"


async def test_a_file_comes_as_bytes(server: Server, tmp_path: Any) -> None:
    path = vkbloom.write(tmp_path / "a.png", noise(8, 9, 3, dtype="uint8"))
    header = json.dumps({"kind": "open", "name": "a.png"}).encode()
    message = struct.pack("<I", len(header)) + header + path.read_bytes()
    assert len(message) > 100

    page = await connect(server)
    await page.write_message(message, binary=True)
    source, _ = await answer(page)
    assert (source["kind"], source["source_size"]) == ("open", [9, 8])


@pytest.mark.parametrize(
    ("message", "code"),
    [
        *((one, 1003) for one in ("", "{", "[]", "3", "{}", b"\xff", b"\xff\xff\xff\xff{}")),
        (json.dumps({"kind": "frame", "sides": "x" * 100_000}), 1009),
    ],
)
async def test_wrong_messages_are_refused(server: Server, message: str | bytes, code: int) -> None:
    page = await connect(server)
    await page.write_message(message, binary=isinstance(message, bytes))
    assert await page.read_message() is None
    assert page.close_code == code


DEEP = "[" * 100_000 + "]" * 100_000
NESTED = '{"psf": ' * 900 + "1" + "}" * 900


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (f'{{"kind": "frame", "sides": {DEEP[:60_000]}}}', "nested too deeply"),
        (b'{"kind": "open", "name": ' + DEEP[:60_000].encode() + b"}", "nested too deeply"),
        ('{"kind": "frame", "sides": {}, "time": 1e999}', "1e999 is not a finite number"),
        ('{"kind": "probe", "at": [0, 0], "id": -1e999}', "-1e999 is not a finite number"),
        ('{"kind": "probe", "at": [NaN, 0]}', "NaN is not a finite number"),
        ('{"kind": "setup", "id": 1.5}', "id: it is not text or an integer"),
        (f'{{"kind": "setup", "id": {NESTED}}}', ""),
        (f'{{"kind": "save", "settings": {{"method": "convolution", "psf": {NESTED}}}}}', ""),
    ],
)
async def test_messages_are_refused_with_a_reason(
    server: Server, message: str | bytes, reason: str
) -> None:
    page = await connect(server)
    packed = struct.pack("<I", len(message)) + message if isinstance(message, bytes) else message
    await page.write_message(packed, binary=isinstance(message, bytes))
    header, _ = await answer(page)
    assert header["kind"] == "error"
    assert header["error"]
    assert reason in header["error"]
    # The socket is still there.
    await page.write_message(json.dumps({"kind": "setup"}))
    assert (await answer(page))[0]["kind"] == "setup"


def test_the_browser_gets_no_token_as_an_argument(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other users of the machine see the arguments of its processes."""
    opened: list[tuple[str, int, int, str]] = []

    def open_page(address: str) -> None:
        file = Path(url2pathname(urlsplit(address).path))
        mode, of_folder = (stat.S_IMODE(os.stat(path).st_mode) for path in (file, file.parent))
        opened.append((address, mode, of_folder, file.read_text()))
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(webbrowser, "open", open_page)
    done = run("explore")
    assert done.exit_code == 0, done.output
    (url,) = (line for line in done.output.splitlines() if line.startswith("http"))
    ((address, mode, folder_mode, text),) = opened
    assert address.startswith("file://")
    assert url.split("/")[-2] not in address
    assert (mode, folder_mode) == (0o600, 0o700)
    assert f"0; url={url}" in text
    assert not Path(urlsplit(address).path).exists()


async def test_port_in_use_is_an_error(server: Server) -> None:
    with pytest.raises(OSError, match="in use"):
        Server(lambda: pytest.fail("nobody asked"), server.port)


def test_without_tornado(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "tornado", None)
    result = run("explore", "--no-open")
    assert result.exit_code == 1
    assert "pip install vkbloom[notebook]" in result.stderr
