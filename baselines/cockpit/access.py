"""Access: who may speak to the server, how much, and which page holds the pendant.

The server listens on the loopback interface, where every page of the same browser can reach it too.
A request is answered only if its `Host` is the server's own with its port, which a foreign name
that resolves to this machine is not; and a page may speak only if its `Origin` is that host.
"""

from __future__ import annotations

import hmac
import math
import secrets
from collections.abc import Hashable, Mapping
from dataclasses import dataclass

LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
"""Names of this machine for itself."""

RATE = 120.0
"""Messages a second that a page may say."""

BURST = 240.0
"""Messages that it may say at once, after a stall of two seconds."""

LONGEST_SILENCE = 2.0
"""A holder that says nothing for this long loses the pendant [s]."""


@dataclass(frozen=True)
class Access:
    """Who may speak to the server.

    Attributes:
        hosts: what `Host` may say, with the port.
        key: what a page has to know besides, which is in the address that the server tells; None:
            nothing, as only this machine can reach it.
    """

    hosts: frozenset[str]
    key: str | None = None

    @classmethod
    def at(cls, host: str, port: int) -> Access:
        """Access to a server at an address: on a network only with a key, which is made here."""
        names = LOOPBACK if host in LOOPBACK else (host,)
        key = None if host in LOOPBACK else secrets.token_urlsafe(16)
        return cls(frozenset(f"{name}:{port}" for name in names), key)

    def answers(self, headers: Mapping[str, str]) -> bool:
        """Whether a request with these headers is for this server."""
        return headers.get("host", "") in self.hosts

    def hears(self, headers: Mapping[str, str], key: str) -> bool:
        """Whether a page with these headers and this key may speak."""
        own = headers.get("origin", "") == f"http://{headers.get('host', '')}"
        known = self.key is None or hmac.compare_digest(self.key.encode(), key.encode())
        return self.answers(headers) and own and known


class Allowance:
    """How much one page may still say; it grows by `RATE` up to `BURST`.

    Args:
        now: [s].
    """

    def __init__(self, now: float) -> None:
        self._left, self._since = BURST, now

    def spend(self, now: float) -> bool:
        """Takes one message from it; returns whether there was one left."""
        self._left = min(BURST, self._left + RATE * (now - self._since)) - 1.0
        self._since = now
        return self._left >= 0.0


class Pendant:
    """The one thing that only one page can have.

    Attributes:
        holder: who has it; None: nobody.
    """

    def __init__(self) -> None:
        self.holder: Hashable | None = None
        self._token = ""
        self._heard = -math.inf

    def take(self, page: Hashable, now: float) -> bool:
        """Gives it to a page if it is free; returns whether it was."""
        if self.holder is not None:
            return False
        self.holder, self._token, self._heard = page, secrets.token_hex(8), now
        return True

    def leave(self) -> None:
        """Nobody holds it any more, and the token is worth nothing."""
        self.holder, self._token = None, ""

    def token_for(self, page: Hashable) -> str | None:
        """The token if this page holds it; else None."""
        return self._token if page == self.holder and page is not None else None

    def hear(self, page: Hashable, token: str, now: float) -> bool:
        """Notes that a page speaks; returns whether it is the holder, and says so by the token."""
        if page != self.holder or token != self._token:
            return False
        self._heard = now
        return True

    def silent(self, now: float) -> bool:
        """Whether the holder has said nothing for too long."""
        return self.holder is not None and now - self._heard > LONGEST_SILENCE
