"""House: the processes of the cockpit, from the first one that listens to the last one that ends.

The address is bound before anything else begins, so that one in use is told at once. The first
signal to stop ends everything at once, whether pages are stopped or controllers are
being compiled.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection

import uvicorn

from baselines.cockpit.access import Access
from baselines.cockpit.control.loop import Hello, control
from baselines.cockpit.control.session import Opening
from baselines.cockpit.messages import LONGEST
from baselines.cockpit.server import Cockpit

LONGEST_END = 1
"""After this the server's tasks are not waited for [s]."""

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Idle threads of a numerics library compete with the control loop."""

STOPPING = (signal.SIGINT, signal.SIGTERM)
"""Signals that end the cockpit."""


class CockpitError(Exception):
    """The control process has ended by itself; the message says why."""


class Server(uvicorn.Server):
    """Uvicorn's server without its handling of signals, which would end the process by them."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leaves the signals alone."""
        yield


def bind(host: str, port: int) -> socket.socket:
    """A socket that listens at an address.

    Raises:
        OSError: it is in use, or not one of this machine; the message says so.
    """
    name = host.strip("[]")
    family = socket.AF_INET6 if ":" in name else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    try:
        if sys.platform != "win32":
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((name, port))
        listener.listen()
    except OSError as error:
        listener.close()
        raise OSError(f"The cockpit cannot listen at {host}:{port}: {error.strerror}.") from error
    return listener


def keep(
    listener: socket.socket,
    access: Access,
    opening: Opening,
    told: Callable[[Hello], None],
) -> None:
    """Runs the cockpit until a signal ends it, in order.

    Args:
        listener: where pages connect.
        access: who may.
        opening: how the session begins.
        told: called with what the control process says before its first state.

    Raises:
        CockpitError: the control process could not begin, or has ended.
    """
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=control, args=(theirs, opening), daemon=True)
    try:
        process.start()
        theirs.close()
        asyncio.run(_serve(listener, ours, access, told))
    finally:
        process.kill()  # which has nothing to lose, and may be compiling
        process.join()


async def _serve(
    listener: socket.socket,
    connection: Connection,
    access: Access,
    told: Callable[[Hello], None],
) -> None:
    failures: list[str] = []
    loop, over = asyncio.get_running_loop(), asyncio.Event()

    def hear(said: Hello | None) -> None:
        failure = "The control process has ended." if said is None else said.failure
        if over.is_set():
            return
        if failure is not None:
            failures.append(failure)
            over.set()
        elif said is not None:
            told(said)

    cockpit = Cockpit(connection, access, hear)
    config = uvicorn.Config(
        cockpit.app(),
        ws="websockets-sansio",
        ws_max_size=LONGEST,
        ws_per_message_deflate=False,
        lifespan="off",
        log_level="critical",
        access_log=False,
        proxy_headers=False,
        server_header=False,
        timeout_graceful_shutdown=LONGEST_END,
    )
    server = Server(config)
    before = {
        number: signal.signal(number, lambda *_: loop.call_soon_threadsafe(over.set))
        for number in STOPPING
    }
    try:
        tasks = [
            asyncio.create_task(cockpit.watch()),
            asyncio.create_task(server.serve(sockets=[listener])),
        ]
        await over.wait()
        server.should_exit = True
        await asyncio.wait(tasks[1:], timeout=2 * LONGEST_END)
        for task in tasks:
            task.cancel()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if failures:
        raise CockpitError(failures[0])
