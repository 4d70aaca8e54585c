"""The server of live scenes: who may connect, what viewers share, and invalid requests."""

import asyncio
import json
import re
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

import pytest
from aiohttp import ClientWebSocketResponse, WSMsgType, WSServerHandshakeError
from aiohttp.test_utils import TestClient, TestServer

from sandbox.interactive.live_scene import LiveScene
from sandbox.interactive.server import SceneServer, ServerOptions
from sandbox.scene.files.load import loads
from tests.interactive.conversation import SCENE

Client = TestClient[Any, Any]

ALL = "0.0.0.0"


def with_server(test: Callable[[Client, SceneServer], Awaitable[None]], **options: Any) -> None:
    """Run a test with a client of a server."""

    async def run() -> None:
        scene = loads(SCENE)
        server = SceneServer(scene, partial(LiveScene, scene), ServerOptions(**options))
        async with TestClient(TestServer(server.app)) as client:
            await test(client, server)

    asyncio.run(run())


async def ask(connection: ClientWebSocketResponse, *inputs: dict[str, Any]) -> dict[str, Any]:
    await connection.send_str(json.dumps(inputs))
    reply: dict[str, Any] = await connection.receive_json()
    return reply


def test_page_states_a_policy_and_fetches_nothing_else() -> None:
    async def test(client: Client, _server: SceneServer) -> None:
        response = await client.get("/")
        text = await response.text()
        assert response.status == 200
        assert response.headers["X-Content-Type-Options"] == "nosniff"
        assert "default-src 'none'" in text
        assert "connect-src 'self'" in text
        assert re.findall(r"<(?:script|link|img)[^>]*(?:src|href)=\"(?!data:)", text) == []
        assert (await client.get("/other")).status == 404

    with_server(test)


def test_hostile_texts_of_a_scene_are_escaped() -> None:
    async def run() -> None:
        scene = loads(f"title = \"</title><script>x=1</script>$policy\"\nabout = '<img src=x>'\n{SCENE}")
        server = SceneServer(scene, partial(LiveScene, scene), ServerOptions())
        async with TestClient(TestServer(server.app)) as client:
            text = await (await client.get("/")).text()
            assert "&lt;script&gt;x=1&lt;/script&gt;$policy" in text
            assert "<img" not in text
            assert "<script>" not in text

    asyncio.run(run())


@pytest.mark.parametrize("name", ["evil.example", "127.0.0.1.evil.example", "", "[", "192.168.0.7:80"])
def test_names_rebound_to_this_machine_are_refused(name: str) -> None:
    async def test(client: Client, _server: SceneServer) -> None:
        assert (await client.get("/", headers={"Host": name})).status in (400, 403)

    with_server(test)


def test_other_web_sites_cannot_open_a_socket() -> None:
    async def test(client: Client, _server: SceneServer) -> None:
        for origin in ("http://evil.example", "null", "http://[x", f"http://localhost:{client.port}"):
            with pytest.raises(WSServerHandshakeError) as error:
                await client.ws_connect("/socket", headers={"Origin": origin})
            assert error.value.status == 403
        own = f"http://{client.host}:{client.port}"
        async with client.ws_connect("/socket", headers={"Origin": own}) as connection:
            assert (await ask(connection, {"type": "open"}))["time"] == 0.0

    with_server(test)


def test_token_is_needed_on_other_addresses() -> None:
    async def test(client: Client, server: SceneServer) -> None:
        assert server.token is not None
        assert len(server.token) >= 20
        assert server.address(80).endswith(f":80/?token={server.token}")
        for address in ("/", "/?token=", "/?token=wrong", "/?token=%C3%A9", "/socket"):
            assert (await client.get(address)).status == 403
        headers = {"Host": "class.example"}
        assert (await client.get("/", params={"token": server.token}, headers=headers)).status == 200
        async with client.ws_connect(f"/socket?token={server.token}") as connection:
            assert "picture" in await ask(connection, {"type": "open"})

    with_server(test, host=ALL)


def test_each_viewer_has_its_own_simulation() -> None:
    async def test(client: Client, _server: SceneServer) -> None:
        async with client.ws_connect("/socket") as one, client.ws_connect("/socket") as other:
            assert (await ask(one, {"type": "step", "count": 5}))["time"] == pytest.approx(0.05)
            assert (await ask(other, {"type": "open"}))["time"] == 0.0

    with_server(test)


def test_viewers_share_a_simulation() -> None:
    async def test(client: Client, _server: SceneServer) -> None:
        async with client.ws_connect("/socket") as one, client.ws_connect("/socket") as other:
            await ask(one, {"type": "open"}, {"type": "step", "count": 5})
            reply = await ask(other, {"type": "open"})
            assert (reply["time"], reply["state"]["is_shared"]) == (pytest.approx(0.05), True)

    with_server(test, is_shared=True)


def test_viewers_beyond_the_limit_are_sent_away() -> None:
    async def test(client: Client, _server: SceneServer) -> None:
        async with client.ws_connect("/socket") as one:
            await ask(one, {"type": "open"})
            async with client.ws_connect("/socket") as other:
                message = await other.receive()
                assert (message.type, message.data) == (WSMsgType.CLOSE, 1013)
        async with client.ws_connect("/socket") as third:
            assert "picture" in await ask(third, {"type": "open"})

    with_server(test, max_viewers=1)


def test_invalid_requests_are_answered_or_end_the_connection() -> None:
    async def test(client: Client, _server: SceneServer) -> None:
        async with client.ws_connect("/socket") as connection:
            for text in ("", "[[[[", '[{"type":"advance","elapsed":NaN}]', '[{"type":"zzz"}]', "x" * 100_000):
                await connection.send_str(text)
                assert len((await connection.receive_json())["messages"]) == 1
            assert "picture" in await ask(connection, {"type": "open"})
            await connection.send_bytes(b"[]")
            assert (await connection.receive()).data == 1003
        async with client.ws_connect("/socket") as connection:
            await connection.send_str("x" * 1_000_000)
            assert (await connection.receive()).data == 1009

    with_server(test)


def test_viewer_that_leaves_while_dragging_releases_the_body() -> None:
    async def test(client: Client, server: SceneServer) -> None:
        live = server._shared
        assert live is not None
        async with client.ws_connect("/socket") as connection:
            await ask(
                connection, {"type": "play", "on": True}, {"type": "grab", "body": 0, "grip": [0, 0], "target": [0, 0]}
            )
            assert live.simulation.pulls
        for _ in range(200):
            if not live.simulation.pulls:
                break
            await asyncio.sleep(0.01)
        assert not live.simulation.pulls

    with_server(test, is_shared=True)
