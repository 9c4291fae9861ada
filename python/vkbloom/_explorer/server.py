"""A server that serves the page only to this machine's user.

It listens on 127.0.0.1, which excludes other machines, but not other users of this machine or other
sites in the user's browser. So every address contains a token that cannot be guessed, requests must
name the server as their host (which excludes foreign names that point here), and only the page
itself can open the socket.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import json
import math
import os
import secrets
import socket
import struct
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib import resources
from pathlib import Path
from typing import Any, Final

from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.web import Application, HTTPError, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from vkbloom._explorer.viewer import Viewer

_ADDRESS: Final = "127.0.0.1"
_FILES: Final = resources.files("vkbloom._explorer")
_TYPES: Final = {
    "": ("page.html", "text/html; charset=utf-8"),
    "page.js": ("page.js", "text/javascript; charset=utf-8"),
    "start.js": ("start.js", "text/javascript; charset=utf-8"),
    "page.css": ("page.css", "text/css; charset=utf-8"),
}
# Nothing is loaded from other sites, and no site can frame the page.
_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' blob: data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_REFUSED: Final = (
    "<!doctype html><title>vkbloom explore</title><p>This address is not that of the explorer. It "
    "changes with each start. Open the complete address that the running <code>vkbloom explore"
    "</code> or the notebook printed, or start <code>vkbloom explore</code> again.</p>"
)
_REDIRECT: Final = (
    '<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer">'
    '<meta http-equiv="refresh" content="0; url={url}"><title>vkbloom explore</title>'
    '<p><a href="{url}">The explorer</a></p>\n'
)
# The longest text message in bytes. Settings are shorter. Files are sent as binary messages.
_MAX_MESSAGE_BYTES: Final = 1 << 16
_MAX_FILE_BYTES: Final = 1 << 30


class _RefusedNumber(ValueError):
    """A number of a message that JSON does not have."""


class Server:
    """Serves the page until it is stopped.

    - `new_viewer`: Makes a viewer for each page that is opened. Viewers may share a renderer.
    - `port`: The port to listen on; 0: any free port.
    - `url`: The address of the page.
    - `redirect`: A file for this user alone, from which a browser goes to the page. The address
      would stand among the arguments of the browser, which other users can list.

    Create and use it in a running event loop.
    """

    def __init__(self, new_viewer: Callable[[], Viewer], port: int = 0) -> None:
        listening = socket.create_server((_ADDRESS, port))
        listening.setblocking(False)
        self.port: int = listening.getsockname()[1]
        self.token = secrets.token_urlsafe(24)
        self.url = f"http://{_ADDRESS}:{self.port}/{self.token}/"
        # A folder that only this user can enter.
        self._folder = tempfile.TemporaryDirectory(prefix="vkbloom-explore-")
        self.redirect = Path(self._folder.name, "open.html")
        with open(os.open(self.redirect, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
            file.write(_REDIRECT.format(url=self.url))
        # One thread: the renderer takes one call at a time.
        self._worker = ThreadPoolExecutor(1, "vkbloom-explore")
        shared = {"server": self, "new_viewer": new_viewer, "worker": self._worker}
        self._http = HTTPServer(
            Application(
                [
                    (r"/([^/]+)/socket", _Socket, shared),
                    (r"/([^/]+)/([a-z.]*)", _File, {"server": self}),
                ],
                websocket_max_message_size=_MAX_FILE_BYTES,
                log_function=lambda handler: None,
            )
        )
        self._http.add_socket(listening)

    def allows(self, request: HTTPServerRequest, token: str) -> bool:
        """Return whether a request names this server and knows the token."""
        return request.host in self.hosts and hmac.compare_digest(
            token.encode(), self.token.encode()
        )

    @property
    def hosts(self) -> set[str]:
        """The names of this server in requests."""
        return {f"{_ADDRESS}:{self.port}", f"localhost:{self.port}"}

    async def stop(self) -> None:
        """Stop listening and close all pages' sockets."""
        self._http.stop()
        await self._http.close_all_connections()
        self._worker.shutdown()
        self._folder.cleanup()


class _File(RequestHandler):
    """The files of the page."""

    def initialize(self, server: Server) -> None:
        self._server = server

    def set_default_headers(self) -> None:
        self.set_header("Content-Security-Policy", _POLICY)
        self.set_header("Cross-Origin-Resource-Policy", "same-origin")
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Cache-Control", "no-store")
        self.clear_header("Server")

    def write_error(self, status_code: int, **_: Any) -> None:
        self.set_header("Content-Type", "text/html; charset=utf-8")
        self.finish(_REFUSED if status_code == 403 else f"{status_code}: there is no such file.")

    def get(self, token: str, name: str) -> None:
        if not self._server.allows(self.request, token):
            raise HTTPError(403)
        if name not in _TYPES:
            raise HTTPError(404)
        file, kind = _TYPES[name]
        self.set_header("Content-Type", kind)
        self.finish((_FILES / file).read_bytes())


class _Socket(WebSocketHandler):
    """The socket of one page. Its newest message is answered; older waiting ones are dropped."""

    def initialize(
        self, server: Server, new_viewer: Callable[[], Viewer], worker: ThreadPoolExecutor
    ) -> None:
        self._server = server
        self._new_viewer = new_viewer
        self._worker = worker
        self._waiting: dict[str, dict[str, Any]] = {}
        self._files: list[bytes] = []
        self._answers: asyncio.Future[None] | None = None

    def check_origin(self, origin: str) -> bool:
        return origin in {f"http://{host}" for host in self._server.hosts}

    def prepare(self) -> None:
        # A browser always sends the origin. Tornado accepts sockets without one.
        token, origin = self.path_args[0], self.request.headers.get("Origin", "")
        if not (self._server.allows(self.request, token) and self.check_origin(origin)):
            raise HTTPError(403)

    def open(self, *arguments: str) -> None:
        # Pictures are small messages, which must not be delayed.
        self.set_nodelay(True)
        self._viewer = self._new_viewer()

    def on_message(self, message: str | bytes) -> None:
        if isinstance(message, str) and len(message) > _MAX_MESSAGE_BYTES:
            self.close(1009, "the message is too long")
            return
        try:
            text, files = (message, []) if isinstance(message, str) else _unpack(message)
            asked = json.loads(text, parse_float=_finite, parse_constant=_finite)
            kind = str(asked["kind"])
        except (_RefusedNumber, RecursionError) as error:
            self._refuse(error)
            return
        except (ValueError, TypeError, KeyError, struct.error):
            self.close(1003, "a message with a kind is needed")
            return
        if files:
            self._files = files
        newest = dict(asked)
        older = self._waiting.get(kind, {}).get("sides")
        newer = newest.get("sides")
        if isinstance(older, dict) and isinstance(newer, dict):
            # A side that is missing in the newest message still has to be shown.
            newest["sides"] = older | newer
        self._waiting[kind] = newest
        # Not awaited here, so that the next message is read before the answer is sent.
        if self._answers is None or self._answers.done():
            self._answers = asyncio.ensure_future(self._answer())

    def _refuse(self, error: Exception) -> None:
        """Answer a message that cannot be read, and keep the socket."""
        is_deep = isinstance(error, RecursionError)
        reason = "lists and objects are nested too deeply" if is_deep else str(error)
        header = {"kind": "error", "error": f"message: {reason}"}
        with contextlib.suppress(WebSocketClosedError):
            self.write_message(_pack(header, []), binary=True)

    async def _answer(self) -> None:
        loop = asyncio.get_running_loop()
        try:
            while self._waiting:
                asked = self._waiting.pop(next(iter(self._waiting)))
                files = self._files if asked["kind"] == "open" else []
                header, pictures = await loop.run_in_executor(
                    self._worker, self._viewer.answer, asked, files
                )
                if files is self._files:
                    self._files = []
                await self.write_message(_pack(header, pictures), binary=True)
        except WebSocketClosedError:
            self._waiting.clear()
        except Exception:
            # An error that the viewer does not answer. Closing the socket ends the page's wait.
            self.close(1011, "the server failed")
            raise

    def on_close(self) -> None:
        self._waiting.clear()


def _finite(text: str) -> float:
    """Return a number of JSON; raise for 1e999, NaN and Infinity, which answers cannot have."""
    if not math.isfinite(number := float(text)):
        raise _RefusedNumber(f"{text:.80} is not a finite number")
    return number


def _unpack(message: bytes) -> tuple[bytes, list[bytes]]:
    """Return the header and the file of a message from `_pack`."""
    (length,) = struct.unpack_from("<I", message)
    if length > _MAX_MESSAGE_BYTES:
        raise ValueError(f"message: the length {length} of its header is out of range")
    return message[4 : 4 + length], [message[4 + length :]]


def _pack(header: dict[str, Any], buffers: list[bytes]) -> bytes:
    """Return a message: the header's length (uint32, little-endian), the header, the buffers."""
    text = json.dumps(
        {**header, "buffers": [len(buffer) for buffer in buffers]}, allow_nan=False
    ).encode()
    return b"".join([struct.pack("<I", len(text)), text, *buffers])
