"""A cockpit in processes of its own, for tests that speak to it as a page does."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

ROOT = Path(__file__).parent.parent.parent
READY = "The crane is ready."


class CockpitProcess:
    """The command `oilcrane play` at a free port.

    Args:
        arguments: further ones of the command.
    """

    def __init__(self, *arguments: str) -> None:
        command = [sys.executable, "scripts/play.py", "--port", "0", "--no-browser", *arguments]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        self.process = subprocess.Popen(
            command, cwd=ROOT, env=environment, text=True, stdout=subprocess.PIPE
        )
        assert self.process.stdout is not None
        self.address = next(w for w in self.process.stdout.readline().split() if "://" in w)
        self.said = []
        for line in self.process.stdout:
            self.said.append(line.strip())
            if self.said[-1] == READY:
                break

    @property
    def host(self) -> str:
        return self.address.removeprefix("http://").rstrip("/")

    def children(self) -> list[int]:
        """Processes that the command has started."""
        listed = subprocess.run(
            ["ps", "-o", "pid=", "--ppid", str(self.process.pid)], capture_output=True, text=True
        )
        return [int(word) for word in listed.stdout.split()]

    def left(self, children: list[int]) -> list[int]:
        """Those of these processes that still run, after a moment."""
        end = time.monotonic() + 1.0
        while True:
            listed = subprocess.run(
                ["ps", "-o", "pid=,stat=", "-p", ",".join(map(str, children))],
                capture_output=True,
                text=True,
            )
            running = [line.split() for line in listed.stdout.splitlines()]
            left = [int(pid) for pid, status in running if not status.startswith("Z")]
            if not left or time.monotonic() > end:
                return left

    def end(self) -> tuple[int, float]:
        """Sends SIGTERM; returns the exit code and how long it took [s]."""
        start = time.monotonic()
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(timeout=10), time.monotonic() - start


@contextmanager
def cockpit(*arguments: str) -> Iterator[CockpitProcess]:
    started = CockpitProcess(*arguments)
    try:
        yield started
    finally:
        if started.process.poll() is None:
            started.end()
        assert started.process.stdout is not None
        started.process.stdout.close()


class RawPage:
    """What speaks to a cockpit as a page does, and may misbehave.

    Args:
        at: the cockpit.
    """

    socket: ClientConnection

    def __init__(self, at: CockpitProcess) -> None:
        self._at = at
        self._open = ExitStack()
        self.token: str | None = None
        self.sequence = self.tick = 0
        self.state: dict[str, Any] = {}

    def __enter__(self) -> RawPage:
        return self.connect(f"http://{self._at.host}")

    def connect(self, origin: str | None) -> RawPage:
        wire = f"ws://{self._at.host}/wire"
        made = connect(wire, origin=origin, proxy=None, compression=None)  # type: ignore[arg-type]
        self.socket = self._open.enter_context(made)
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def say(self, **message: Any) -> None:
        self.socket.send(json.dumps(message))

    def look(self, kind: str = "state", timeout: float = 5.0) -> dict[str, Any]:
        """The next message of a kind, acknowledging the states before it."""
        end = time.monotonic() + timeout
        while True:
            said: dict[str, Any] = json.loads(self.socket.recv(end - time.monotonic()))
            if said["type"] == "pendant":
                self.token = said["token"]
            if said["type"] == "state":
                self.state, self.tick = said, said["tick"]
                self.say(type="seen", tick=self.tick)
            if said["type"] == kind:
                return said

    def take(self) -> None:
        self.say(type="take")
        while self.token is None:
            self.look("pendant")

    def hold(self, *pressed: str, seconds: float = 0.0) -> dict[str, Any]:
        """Holds buttons for some time, a message a state."""
        buttons = [name in pressed for name in ("forward", "backward", "up", "down")]
        end = time.monotonic() + seconds
        while True:
            self.look()
            self.sequence += 1
            self.say(
                type="hold",
                token=self.token,
                sequence=self.sequence,
                tick=self.tick,
                buttons=buttons,
            )
            if time.monotonic() >= end:
                return self.state
