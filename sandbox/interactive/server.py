"""Server of a live scene: one page, and a web socket that carries requests and replies.

On a loopback address, only pages of this server under a loopback name may connect, which excludes other web sites
(origin) and names that are rebound to this machine (host). On other addresses, a token in the URL is required as well.
The content of requests is checked by `messages.read_inputs`.
"""

import asyncio
import json
import secrets
import socket
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from threading import Lock
from time import monotonic
from typing import Any
from urllib.parse import urlsplit

from aiohttp import WSCloseCode, WSMsgType, web

from sandbox.interactive.front_end import page
from sandbox.interactive.live_scene import LiveScene
from sandbox.interactive.messages import MAX_CHARACTERS
from sandbox.interactive.viewer import Viewer
from sandbox.scene.compile.scene import Scene

LOOPBACK = ("127.0.0.1", "localhost", "::1")
HEARTBEAT = 20.0
"""s between pings of a web socket; a viewer that does not answer is disconnected"""
SHUTDOWN_TIMEOUT = 2.0
"""s that open connections may take to end"""
TOKEN_BYTES = 16

HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


@dataclass(frozen=True)
class ServerOptions:
    """Address and limits of a server."""

    host: str = LOOPBACK[0]
    port: int = 0
    """0: a free one"""
    is_shared: bool = False
    """whether all viewers see and control one simulation; otherwise each has its own"""
    max_viewers: int = 32

    @property
    def is_local(self) -> bool:
        """Whether only this machine can connect."""
        return self.host in LOOPBACK


class SceneServer:
    """Serves a scene to viewers."""

    def __init__(self, scene: Scene, start: Callable[..., LiveScene], options: ServerOptions) -> None:
        """Prepare a server; `app` is its application.

        Args:
            scene: scene of the page.
            start: returns a live scene of it; called with `wall_clock` for a shared one.
            options: address and limits.
        """
        self._scene, self._start, self._options = scene, start, options
        self.token = None if options.is_local else secrets.token_urlsafe(TOKEN_BYTES)
        """required in the address of the page and of the socket; None: not needed"""
        self._shared = start(wall_clock=monotonic) if options.is_shared else None
        self._lock = Lock()  # of the shared scene
        self._sockets: set[web.WebSocketResponse] = set()
        self.app = web.Application(middlewares=[self._check])
        self.app.router.add_get("/", self._page)
        self.app.router.add_get("/socket", self._socket)
        self.app.on_shutdown.append(self._close_sockets)

    @web.middleware
    async def _check(self, request: web.Request, handler: Callable[[web.Request], Any]) -> web.StreamResponse:
        """Refuse requests without the token, of foreign origins and to foreign names."""
        if self.token is not None:
            if not secrets.compare_digest(request.query.get("token", "").encode(), self.token.encode()):
                raise web.HTTPForbidden(text="the address lacks the token that the server has printed\n")
        elif _name_of(f"//{request.host}") not in LOOPBACK:
            raise web.HTTPForbidden(text="this server answers to loopback names only\n")
        origin = request.headers.get("Origin")
        if origin is not None and _address_of(origin) != request.host:
            raise web.HTTPForbidden(text="requests of other web sites are refused\n")
        response: web.StreamResponse = await handler(request)
        return response

    async def _page(self, _request: web.Request) -> web.Response:
        text = page(self._scene.title or "Untitled scene", self._scene.about or "")
        return web.Response(text=text, content_type="text/html", headers=HEADERS)

    async def _socket(self, request: web.Request) -> web.WebSocketResponse:
        """Answer the requests of one viewer, one after the other."""
        connection = web.WebSocketResponse(heartbeat=HEARTBEAT, max_msg_size=4 * MAX_CHARACTERS)  # bytes
        await connection.prepare(request)
        if len(self._sockets) >= self._options.max_viewers:
            await connection.close(code=WSCloseCode.TRY_AGAIN_LATER, message=b"The server has too many viewers.")
            return connection
        self._sockets.add(connection)
        try:
            await self._converse(connection)
        finally:
            self._sockets.discard(connection)
        return connection

    async def _converse(self, connection: web.WebSocketResponse) -> None:
        shared, lock = self._shared, self._lock if self._shared is not None else Lock()
        live = await asyncio.to_thread(self._start) if shared is None else shared
        viewer = Viewer(live)

        def answer(text: str) -> str:
            with lock:
                return json.dumps(viewer.handle(text), allow_nan=False, separators=(",", ":"))

        def end() -> None:
            with lock:
                viewer.close()
                if shared is None:
                    live.close()

        try:
            async for message in connection:
                if message.type is not WSMsgType.TEXT:
                    await connection.close(code=WSCloseCode.UNSUPPORTED_DATA)
                    break
                await connection.send_str(await asyncio.to_thread(answer, message.data))
        except ConnectionResetError:  # the viewer has left before the reply
            pass
        finally:
            await asyncio.shield(asyncio.to_thread(end))

    async def _close_sockets(self, _app: web.Application) -> None:
        for connection in list(self._sockets):
            await connection.close(code=WSCloseCode.GOING_AWAY, message=b"The server has ended.")

    async def serve(self, say: Callable[[str], None]) -> None:
        """Serve until the task is cancelled.

        Args:
            say: called with the address of the page, once it can be opened.

        Raises:
            OSError: the address cannot be used.
        """
        runner = web.AppRunner(self.app, access_log=None, shutdown_timeout=SHUTDOWN_TIMEOUT)
        await runner.setup()
        try:
            await web.TCPSite(runner, self._options.host, self._options.port).start()
            say(self.address(runner.addresses[0][1]))
            await asyncio.Event().wait()
        finally:
            await runner.cleanup()
            if self._shared is not None:
                self._shared.close()

    def address(self, port: int) -> str:
        """Return the address of the page on a port."""
        host = _outward_address() if self._options.host in ("0.0.0.0", "::") else self._options.host
        host = f"[{host}]" if ":" in host else host
        return f"http://{host}:{port}/" + ("" if self.token is None else f"?token={self.token}")


def _address_of(url: str) -> str | None:
    """Return the host and port of a URL; None if it is malformed."""
    try:
        return urlsplit(url).netloc
    except ValueError:
        return None


def _name_of(url: str) -> str | None:
    """Return the host of a URL; None if it is malformed."""
    try:
        return urlsplit(url).hostname
    except ValueError:
        return None


def _outward_address() -> str:
    """Return the address of this machine in its network, else its name."""
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # an address for documentation; UDP sends nothing yet
            return str(probe.getsockname()[0])
        except OSError:
            return socket.gethostname()
