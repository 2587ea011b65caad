"""Server: only its own page is heard, only one page drives, and nothing brings it down."""

from __future__ import annotations

import os
import random
import signal
import socket
import time
import urllib.error
import urllib.request
from collections.abc import Iterator

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from baselines.cockpit.access import BURST
from baselines.cockpit.messages import LONGEST
from baselines.cockpit.server import CREDIT
from baselines.commands import play
from tests.cockpit.cockpit_process import CockpitProcess, RawPage, cockpit

FAST = ("--controllers", "manual", "lqr", "--controller", "lqr")


@pytest.fixture(scope="module")
def running() -> Iterator[CockpitProcess]:
    with cockpit(*FAST) as started:
        yield started


def status(at: CockpitProcess, path: str, **headers: str) -> int:
    request = urllib.request.Request(at.address + path, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=5) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code


def test_the_page_is_handed_out_and_nothing_else_on_the_disk(running: CockpitProcess) -> None:
    assert status(running, "") == 200
    for path in ("server.py", "../server.py", "..%2fserver.py", "%2fetc%2fpasswd", "page/", "wire"):
        assert status(running, path) == 404


def test_another_host_or_port_is_refused(running: CockpitProcess) -> None:
    for host in ("oilcrane.example", f"oilcrane.example:{running.host.split(':')[1]}", "127.0.0.1"):
        assert status(running, "", Host=host) == 403


@pytest.mark.parametrize("origin", [None, "null", "http://oilcrane.example", "http://127.0.0.1"])
def test_another_origin_is_refused(running: CockpitProcess, origin: str | None) -> None:
    with pytest.raises(InvalidStatus) as refused:
        RawPage(running).connect(origin)
    assert refused.value.response.status_code == 403


def test_a_second_page_cannot_press_until_the_first_lets_go(running: CockpitProcess) -> None:
    with RawPage(running) as first, RawPage(running) as second:
        first.take()
        first.hold(seconds=0.1)
        second.say(type="take")
        assert second.look("pendant")["token"] is None
        for sequence in range(5):  # even if it knew the token
            hold = {"type": "hold", "token": first.token, "buttons": [True, False, False, False]}
            second.say(**hold, sequence=sequence, tick=second.look()["tick"])
            first.hold()
        assert first.hold()["buttons"] == [False] * 4
        first.say(type="leave", token=first.token)
        second.take()
        second.hold(seconds=0.1)
        assert second.hold("forward", seconds=0.3)["crane"][6] > 0.0


def test_a_holder_who_is_silent_loses_the_pendant(running: CockpitProcess) -> None:
    with RawPage(running) as first, RawPage(running) as second:
        first.take()
        time.sleep(2.5)
        second.take()


def test_a_watcher_that_reads_nothing_is_sent_no_old_states(running: CockpitProcess) -> None:
    with RawPage(running) as watcher:
        time.sleep(1.0)
        ticks = [watcher.look()["tick"] for _ in range(CREDIT + 1)]
        assert ticks[-2] - ticks[0] < 25  # of when it began
        assert ticks[-1] - ticks[-2] > 25  # of now


def test_anybody_can_stop_and_only_the_holder_goes_on(running: CockpitProcess) -> None:
    with RawPage(running) as holder, RawPage(running) as watcher:
        holder.take()
        holder.hold(seconds=0.1)
        holder.hold("forward", seconds=0.4)
        watcher.say(type="stop")
        assert holder.hold("forward", seconds=0.2)["stopped"]
        assert holder.state["crane"][6] == 0.0
        watcher.say(type="do", token="", action="resume")
        assert holder.hold(seconds=0.2)["stopped"]
        holder.say(type="do", token=holder.token, action="resume")
        assert not holder.hold(seconds=0.2)["stopped"]


def refused(at: CockpitProcess, *texts: str | bytes) -> bool:
    """Whether the server closes the connection of a page that says this."""
    try:
        with RawPage(at) as page:
            for text in texts:
                page.socket.send(text)
            while True:
                page.look()
    except ConnectionClosed:
        return True


def test_nothing_that_is_sent_brings_the_server_down(running: CockpitProcess) -> None:
    rng = random.Random(5)
    noise = "".join(chr(rng.randrange(32, 0x2FFF)) for _ in range(50))
    for text in ("{", noise, '{"type": "seen", "tick": 1e400}', "x" * (LONGEST + 1), "x" * 2**20):
        assert refused(running, text)
    assert refused(running, b"\x00\xff")
    assert refused(running, *['{"type": "take"}'] * int(BURST + 50))
    with RawPage(running) as watcher:
        assert watcher.look()["crane"][6] == 0.0


def test_sigterm_ends_all_processes_while_a_page_is_stopped() -> None:
    with cockpit(*FAST) as started, RawPage(started), RawPage(started) as holder:
        holder.take()
        children = started.children()
        code, seconds = started.end()
        assert (code, seconds < 3.0) == (0, True)
        assert started.left(children) == []


def test_a_control_process_that_ends_is_told_in_a_sentence() -> None:
    with cockpit(*FAST) as started:
        for child in started.children():
            os.kill(child, signal.SIGKILL)
        assert started.process.wait(timeout=5) == 1


def test_a_port_in_use_is_an_error_in_a_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert play.main(["--port", port, "--no-browser"]) == 2
    assert f"127.0.0.1:{port}: Address already in use." in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--port", "70000"], "port must be a whole number"),
        (["--host", "0.0.0.0"], "the one address"),
        (["--operator", "nobody"], "Unknown operator"),
        (["--task", "juggle"], "Unknown task"),
        (["--parameters", "shop"], "parameters must be"),
    ],
)
def test_a_wrong_option_is_refused_before_anything_begins(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert play.main([*arguments, "--no-browser"]) == 2
    assert told in capsys.readouterr().err
