"""Messages that waited in a stalled connection do not reach the page's server."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import Any

import pytest

pytest.importorskip("viser")

from websockets.asyncio.client import connect
from websockets.asyncio.server import serve
from websockets.exceptions import ConnectionClosed

from snakewalk.controller.motion.command import Refused
from snakewalk.controller.view.browser_gamepad import BrowserGamepad
from snakewalk.controller.view.command_line import fresh_commands, timed
from snakewalk.controller.view.dead_man import DeadMan, hold_command
from snakewalk.controller.view.fresh_line import FreshConnection, Freshness
from tests.controller.view.test_browser_gamepad import state
from tests.helpers.browser import PATIENCE_S
from tests.helpers.proxy import Proxy


class Served:
    """A server of fresh connections, behind a proxy, at a time that the test sets."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.freshness = Freshness(lambda: self.now_s)
        self.late_s: list[float] = []
        self.freshness.on_late = self.late_s.append
        self.received: asyncio.Queue[Any] = asyncio.Queue()
        self.beginnings_s: list[float] = []
        self.connection: Any = None

    async def handle(self, connection: Any) -> None:
        self.connection = connection
        proof = asyncio.create_task(connection.prove())
        with suppress(ConnectionClosed):
            async for message in connection:
                self.beginnings_s += connection.beginnings_s
                connection.beginnings_s.clear()
                await self.received.put(message)
        proof.cancel()

    async def answered_since(self, time_s: float) -> None:
        """Wait for the answer to a ping that was sent at a time or later."""
        while self.connection is None or self.connection._since_s < time_s:
            await asyncio.sleep(0.0)

    async def next(self) -> Any:
        return await asyncio.wait_for(self.received.get(), PATIENCE_S)


@asynccontextmanager
async def connected(path: str) -> AsyncIterator[tuple[Served, Proxy, Any]]:
    served = Served()
    make = partial(FreshConnection, freshness=served.freshness, late_paths=["/own"])
    async with serve(served.handle, "127.0.0.1", 0, create_connection=make) as server:
        proxy = Proxy(server.sockets[0].getsockname()[1])
        listener = await asyncio.start_server(proxy.pass_on, "127.0.0.1", 0)
        address = f"ws://127.0.0.1:{listener.sockets[0].getsockname()[1]}{path}"
        async with listener, connect(address) as client:
            yield served, proxy, client


async def stalled(proxy: Proxy, served: Served, client: Any, message: str) -> None:
    """Send a message that arrives, with all answers to pings after it, 15 s later."""
    proxy.flows.clear()
    await client.send(message)
    await asyncio.wait_for(proxy.waiting.wait(), PATIENCE_S)
    served.now_s += 15.0
    proxy.flows.set()


def test_a_message_of_a_stalled_connection_is_dropped_and_the_connection_closed() -> None:
    async def tried() -> None:
        async with connected("/") as (served, proxy, client):
            await client.send("first")
            assert await served.next() == "first"
            assert served.freshness.take() == 100.0
            await stalled(proxy, served, client, "late")
            with pytest.raises(ConnectionClosed) as closed:
                await asyncio.wait_for(client.recv(), PATIENCE_S)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1013
            assert served.received.empty()
            assert served.late_s == [100.0]

    asyncio.run(tried())


def test_time_that_passes_on_a_healthy_connection_makes_nothing_late() -> None:
    """An answer to a ping proves that the messages after it are new."""

    async def tried() -> None:
        async with connected("/") as (served, _, client):
            for time_s in (115.0, 130.0):
                served.now_s = time_s
                await asyncio.wait_for(served.answered_since(time_s), PATIENCE_S)
                await client.send("new")
                assert await served.next() == "new"
                assert served.freshness.take() >= time_s
            assert served.late_s == []

    asyncio.run(tried())


def test_a_late_message_on_a_path_of_ours_comes_with_its_age() -> None:
    """E-STOP is accepted at any age."""

    async def tried() -> None:
        async with connected("/own") as (served, proxy, client):
            await stalled(proxy, served, client, "stop")
            assert await served.next() == "stop"
            assert served.beginnings_s == [100.0]
            assert served.late_s == []

    asyncio.run(tried())


def test_a_late_state_of_a_gamepad_moves_nothing_but_may_stop() -> None:
    now_s, stops = [115.0], list[str]()
    gamepad = BrowserGamepad(lambda: now_s[0])
    gamepad.on_stop = lambda: stops.append("stop")
    assert gamepad.take("a", state(), 114.9)
    assert gamepad.commands() == [hold_command(False, 115.0)]
    assert gamepad.take("a", state(4, 1), 113.9)
    assert gamepad.commands() == []
    assert gamepad.take("a", state(4, 1, 11), 100.0)
    assert stops == ["stop"]
    assert gamepad.take("a", state(4), 114.9)
    assert gamepad.take("a", state(4, 1), 114.9)
    assert gamepad.commands() == ["m", hold_command(True, 115.0)]


def test_the_run_drops_commands_that_waited_for_it() -> None:
    dead_man = DeadMan(lambda: 20.0)
    lines = [
        timed("frequency_hz=0.4", 19.1),
        timed("end", 18.9),
        timed("d", 20.2),
        timed(hold_command(False, 10.0), 10.0),
        timed("pad=none", 10.0),
        "space",
    ]
    found = fresh_commands(lines, dead_man, lambda: 20.0)
    assert [each for each in found if isinstance(each, str)] == ["frequency_hz=0.4"]
    assert not dead_man.is_enabled
    reasons = [each.why for each in found if isinstance(each, Refused)]
    assert reasons[0].startswith(
        "page: end came 1.1 s late and is dropped; at most 1 s is accepted"
    )
    assert "pad=none came 10.0 s late" in reasons[2]
    assert "space: has no time" in reasons[3]
    assert len(reasons) == 4
