"""Chromium over its own protocol, which can really hide a tab where Playwright emulates a focus."""

from __future__ import annotations

import itertools
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

KEY = {"code": "ArrowRight", "key": "ArrowRight", "windowsVirtualKeyCode": 39}


class RawChromium:
    """A headless browser.

    Args:
        profile: folder for what it keeps.
    """

    socket: ClientConnection

    def __init__(self, profile: Path) -> None:
        program = shutil.which("chromium")
        assert program is not None
        self._process = subprocess.Popen(
            [
                program,
                "--headless=new",
                "--no-sandbox",
                "--remote-debugging-port=0",
                f"--user-data-dir={profile}",
            ],
            stderr=subprocess.PIPE,
            text=True,
        )
        self._numbers = itertools.count(1)

    def __enter__(self) -> RawChromium:
        assert self._process.stderr is not None
        address = next(
            line.split()[-1] for line in self._process.stderr if "DevTools listening" in line
        )
        self._connection = connect(address, proxy=None, compression=None, max_size=None)
        self.socket = self._connection.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._connection.__exit__(*error)
        self._process.kill()
        self._process.wait()
        assert self._process.stderr is not None
        self._process.stderr.close()

    def say(self, method: str, session: str | None = None, **parameters: Any) -> dict[str, Any]:
        """Has something done; returns its result."""
        number = next(self._numbers)
        said = {"id": number, "method": method, "params": parameters}
        self.socket.send(json.dumps(said | ({"sessionId": session} if session else {})))
        while True:
            answer = json.loads(self.socket.recv(10.0))
            if answer.get("id") == number:
                result: dict[str, Any] = answer["result"]
                return result

    def open(self, address: str) -> tuple[str, str]:
        """Opens a tab; returns its target and session."""
        target: str = self.say("Target.createTarget", url=address)["targetId"]
        attached = self.say("Target.attachToTarget", targetId=target, flatten=True)
        return target, attached["sessionId"]

    def evaluate(self, session: str, script: str) -> Any:
        return self.say("Runtime.evaluate", session, expression=script)["result"].get("value")

    def key(self, session: str, kind: str) -> None:
        self.say("Input.dispatchKeyEvent", session, type=kind, **KEY)
