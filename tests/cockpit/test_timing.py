"""Timing: the control loop keeps its ticks while a browser draws and others watch."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import sync_playwright

from tests.cockpit.cockpit_process import CockpitProcess, RawPage, cockpit

pytestmark = pytest.mark.timing

SECONDS = 60.0


@contextmanager
def watcher_that_receives(at: CockpitProcess) -> Iterator[None]:
    over = threading.Event()

    def watch() -> None:
        with RawPage(at) as watcher:
            while not over.is_set():
                watcher.look()

    thread = threading.Thread(target=watch)
    thread.start()
    yield
    over.set()
    thread.join()


@pytest.mark.parametrize("drawing", [1, 3])
def test_control_steps_begin_within_5_ms_of_their_time(drawing: int) -> None:
    with (
        cockpit("--controllers", "nmpc-b", "--controller", "nmpc-b") as running,
        sync_playwright() as playwright,
        watcher_that_receives(running),
        watcher_that_receives(running),
        RawPage(running) as crane,
    ):
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        first = crane.look("hello")["facts"]["first"]
        for _ in range(drawing):
            browser.new_page(viewport={"width": 1280, "height": 800}).goto(running.address)
        begun = crane.look()
        while crane.state["tick"] - begun["tick"] < 50.0 * SECONDS:
            crane.look()
        steps, late = (crane.state["kept"][k] - begun["kept"][k] for k in range(2))
        browser.close()
    assert late <= (0.01 if first or drawing == 1 else 0.1) * steps
