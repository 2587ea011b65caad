"""A proxy between page and server that stalls either direction, as a bad link does."""

from __future__ import annotations

import contextlib
import socket
import threading

CHUNK = 65536


class StallingProxy:
    """Carries bytes to a port of this machine and back.

    Args:
        port: of the server.

    Attributes:
        port: where the proxy listens.
        up: cleared while what pages say is kept back.
        down: cleared while what the server says is.
    """

    def __init__(self, port: int) -> None:
        self._target = port
        self.up, self.down = threading.Event(), threading.Event()
        self.up.set()
        self.down.set()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                page, _ = self._listener.accept()
                server = socket.create_connection(("127.0.0.1", self._target))
                for source, sink, flowing in ((page, server, self.up), (server, page, self.down)):
                    arguments = (source, sink, flowing)
                    threading.Thread(target=self._carry, args=arguments, daemon=True).start()

    @staticmethod
    def _carry(source: socket.socket, sink: socket.socket, flowing: threading.Event) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(CHUNK):
                flowing.wait()
                sink.sendall(data)
        for end in (source, sink):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def close(self) -> None:
        self._listener.close()
