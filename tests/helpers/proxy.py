"""A proxy for a browser's connections, which stall, delay, drop, duplicate or end on request."""

import asyncio
import threading
from typing import Any

from tests.helpers.browser import PATIENCE_S


class Proxy:
    """A TCP connection whose bytes can be held back."""

    def __init__(self, port: int) -> None:
        self.port = port
        self.flows = asyncio.Event()
        self.flows.set()
        self.back = asyncio.Event()
        """Bytes to the browser pass while it is set."""
        self.back.set()
        self.waiting = asyncio.Event()
        """Set when bytes are held back."""
        self.delay_s = 0.0
        self.drops = self.duplicates = 0
        """Pieces of bytes to the browser that are still to be dropped, or sent twice."""

    async def pass_on(self, reader: Any, writer: Any) -> None:
        try:
            far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self.port)
        except OSError:  # the server is gone
            writer.close()
            return
        try:
            await asyncio.gather(
                self._copy(reader, far_writer, self.flows),
                self._copy(far_reader, writer, self.back, to_browser=True),
                return_exceptions=True,
            )
        finally:
            writer.close()
            far_writer.close()

    async def _copy(
        self, reader: Any, writer: Any, passes: asyncio.Event, *, to_browser: bool = False
    ) -> None:
        while data := await reader.read(1 << 16):
            if self.delay_s:
                await asyncio.sleep(self.delay_s)
            if to_browser and self.drops:
                self.drops -= 1
                continue
            if to_browser and self.duplicates:
                self.duplicates -= 1
                data += data
            if not passes.is_set():
                self.waiting.set()
                await passes.wait()
            writer.write(data)
        writer.close()


class Proxied:
    """A page behind a proxy, whose connections stall on request."""

    def __init__(self, port: int) -> None:
        self._loop = asyncio.new_event_loop()
        self._proxy = Proxy(port)
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        listener = self._run(asyncio.start_server(self._proxy.pass_on, "127.0.0.1", 0))
        self.port = listener.sockets[0].getsockname()[1]

    def _run(self, work: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def stall(self, *, both: bool = False, for_s: float | None = None) -> None:
        """Hold what the browser sends, or both directions, until ``go_on`` or for a time."""
        self._loop.call_soon_threadsafe(self._proxy.flows.clear)
        if both:
            self._loop.call_soon_threadsafe(self._proxy.back.clear)
        if for_s is not None:
            self._loop.call_soon_threadsafe(self._loop.call_later, for_s, self._go_on)

    def go_on(self) -> None:
        """Let everything pass again."""
        self._loop.call_soon_threadsafe(self._go_on)

    def _go_on(self) -> None:
        self._proxy.flows.set()
        self._proxy.back.set()

    def delay(self, seconds: float) -> None:
        """Delay each piece of bytes in both directions."""
        self._proxy.delay_s = seconds

    def drop(self, pieces: int) -> None:
        """Drop the next pieces of bytes to the browser."""
        self._proxy.drops = pieces

    def duplicate(self, pieces: int) -> None:
        """Send the next pieces of bytes to the browser twice."""
        self._proxy.duplicates = pieces

    @property
    def is_done(self) -> bool:
        """Whether all pieces were dropped or sent twice."""
        return not self._proxy.drops and not self._proxy.duplicates

    def wait_for_a_message(self) -> None:
        """Wait until the browser has sent something that does not pass."""
        self._run(asyncio.wait_for(self._proxy.waiting.wait(), PATIENCE_S))

    def cut(self) -> None:
        """Cut all connections."""
        self._run(_ended(asyncio.all_tasks(self._loop)))

    def close(self) -> None:
        self.cut()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()


async def _ended(tasks: set[asyncio.Task[Any]]) -> None:
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
