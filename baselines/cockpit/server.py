"""Server: hands out the page, and carries messages between pages and the control process.

Each page is told the newest state only. It has a credit of `CREDIT` states that it has not
acknowledged yet: a page that is slow or stopped gets fewer states, never old ones.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading
import time
from collections import deque
from collections.abc import Callable
from importlib import resources
from multiprocessing.connection import Connection

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from baselines.cockpit.access import Access, Allowance, Pendant
from baselines.cockpit.control.loop import Hello, Saved, State
from baselines.cockpit.messages import Choose, Do, Hold, Leave, Message, Seen, Stop, Take, read

CREDIT = 8
"""States that a page may have been sent without saying that it has seen them."""

MOST_PAGES = 24
"""Pages at the same time."""

STUCK = 1.0
"""After so long without a state the control process is sent nothing any more [s]."""

LOOK_AROUND = 0.25
"""Between two looks whether the holder of the pendant still speaks [s]."""

KINDS = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
"""Types of the page's files, by the ends of their names."""

HEADERS = {
    "Content-Security-Policy": "default-src 'self'; frame-ancestors 'none'; base-uri 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
"""What the browser has to know about every answer."""

POLICY, TOO_MANY = 1008, 1013
"""Codes with which a connection is closed."""


class Page:
    """A page that is connected: what it has yet to be told, of each kind the newest only."""

    def __init__(self) -> None:
        self.pending: dict[str, str] = {}
        self.news = asyncio.Event()
        self._sent: deque[int] = deque()

    def tell(self, kind: str, text: str) -> None:
        """Has something told to the page."""
        self.pending[kind] = text
        self.news.set()

    def next(self, tick: int) -> list[str]:
        """What is to be sent now; `tick` is that of the state that is pending."""
        if "state" in self.pending and len(self._sent) >= CREDIT:
            kept = self.pending.pop("state")
            texts, self.pending = list(self.pending.values()), {"state": kept}
            return texts
        if "state" in self.pending:
            self._sent.append(tick)
        texts, self.pending = list(self.pending.values()), {}
        return texts

    def seen(self, tick: int) -> None:
        """The page has seen the state of this tick, and those before."""
        while self._sent and self._sent[0] <= tick:
            self._sent.popleft()
            self.news.set()


class Cockpit:
    """The server's part of the cockpit.

    Args:
        connection: to the control process.
        access: who may speak.
        told: called with each `Hello` of the control process, and with None once it has ended.
    """

    def __init__(
        self, connection: Connection, access: Access, told: Callable[[Hello | None], None]
    ) -> None:
        self._connection, self._access, self._told = connection, access, told
        self._pages: set[Page] = set()
        self._pendant = Pendant()
        self._hello = json.dumps({"type": "hello"})
        self._state: State | None = None
        self._state_came = 0.0
        self._files = page_files()

    def app(self) -> Starlette:
        """The application."""
        return Starlette(
            routes=[
                WebSocketRoute("/wire", self._speak),
                Route("/{name:path}", self._hand_out, methods=["GET"]),
            ]
        )

    async def watch(self) -> None:
        """Listens to the control process and to the holder's silence, until it is cancelled."""
        loop = asyncio.get_running_loop()

        def listen() -> None:
            with contextlib.suppress(RuntimeError):  # the server's loop has ended first
                try:
                    while True:
                        loop.call_soon_threadsafe(self._hear, self._connection.recv())
                except (EOFError, OSError):
                    loop.call_soon_threadsafe(self._told, None)

        threading.Thread(target=listen, daemon=True).start()
        while True:
            await asyncio.sleep(LOOK_AROUND)
            if self._pendant.silent(time.monotonic()):
                self._let_go()

    def _hear(self, said: Hello | State | Saved) -> None:
        """Takes what the control process says."""
        if isinstance(said, State):
            self._state, self._state_came = said, time.monotonic()
            self._send(Seen(said.tick))
            for page in self._pages:
                page.tell("state", said.text)
        elif isinstance(said, Saved):
            for page in self._pages:
                if self._pendant.token_for(page) is not None:
                    page.tell("drive", json.dumps({"type": "drive", "text": said.text}))
        else:
            self._hello = json.dumps({"type": "hello", **said._asdict()})
            for page in self._pages:
                page.tell("hello", self._hello)
            self._told(said)

    def _send(self, message: Message) -> None:
        if time.monotonic() - self._state_came > STUCK:
            return  # whatever is sent would only wait, in the end for ever
        try:
            self._connection.send(message)
        except OSError:
            return  # it has ended, as `_told` is told too

    def _tell_who_holds(self) -> None:
        for page in self._pages:
            said = {
                "type": "pendant",
                "token": self._pendant.token_for(page),
                "taken": self._pendant.holder is not None,
                "pages": len(self._pages),
            }
            page.tell("pendant", json.dumps(said))

    def _let_go(self) -> None:
        self._pendant.leave()
        self._send(Leave(""))
        self._tell_who_holds()

    async def _hand_out(self, request: Request) -> Response:
        name = request.path_params["name"] or "index.html"
        if not self._access.answers(request.headers):
            return PlainTextResponse("This is another server.", 403, headers=HEADERS)
        if name not in self._files:
            return PlainTextResponse("There is no such page.", 404, headers=HEADERS)
        kind = KINDS[name[name.rindex(".") :]]
        return Response(self._files[name], media_type=kind, headers=HEADERS)

    async def _speak(self, socket: WebSocket) -> None:
        if not self._access.hears(socket.headers, socket.query_params.get("key", "")):
            await socket.close(POLICY)  # before it was accepted: status 403
            return
        await socket.accept()
        if len(self._pages) >= MOST_PAGES:
            await socket.close(TOO_MANY)
            return
        page = Page()
        self._pages.add(page)
        page.tell("hello", self._hello)
        self._tell_who_holds()
        writing = asyncio.create_task(self._write(page, socket))
        try:
            await self._read(page, socket)
        except (WebSocketDisconnect, RuntimeError):  # it went, or broke while we wrote to it
            pass
        finally:
            writing.cancel()
            self._pages.discard(page)
            if self._pendant.holder is page:
                self._let_go()
            self._tell_who_holds()

    async def _write(self, page: Page, socket: WebSocket) -> None:
        try:
            while True:
                await page.news.wait()
                page.news.clear()
                for text in page.next(self._state.tick if self._state else 0):
                    await socket.send_text(text)
        except (WebSocketDisconnect, RuntimeError):
            return  # the reader notices too

    async def _read(self, page: Page, socket: WebSocket) -> None:
        allowance = Allowance(time.monotonic())
        while True:
            said = await socket.receive()
            if said["type"] == "websocket.disconnect":
                return
            try:
                if not allowance.spend(time.monotonic()):
                    raise ValueError("too many messages")
                self._take(page, read(said.get("text")))
            except ValueError:
                await socket.close(POLICY)
                return

    def _take(self, page: Page, message: Message) -> None:
        """Does what a page says, as far as it may."""
        now = time.monotonic()
        if isinstance(message, (Seen, Hold)):
            page.seen(message.tick)
        match message:
            case Take():
                if self._pendant.take(page, now):
                    self._send(message)
                    self._tell_who_holds()
            case Leave():
                if self._pendant.hear(page, message.token, now):
                    self._let_go()
            case Stop():
                self._send(message)
            case Hold() | Do() | Choose():
                if self._pendant.hear(page, message.token, now):
                    self._send(message)


def page_files() -> dict[str, bytes]:
    """The page's files by name; nothing else is ever handed out."""
    folder = resources.files("baselines.cockpit") / "page"
    return {
        file.name: file.read_bytes()
        for file in folder.iterdir()
        if file.name.endswith(tuple(KINDS))
    }
