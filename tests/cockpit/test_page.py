"""Page: a person drives the crane in a real browser, with mouse, fingers and keys."""

from __future__ import annotations

import http.server
import shutil
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from baselines.cockpit.control.drive import Drive
from baselines.cockpit.control.lineup import build_lineup
from tests.cockpit.cockpit_process import CockpitProcess, RawPage, cockpit

DESKTOP, SMALL, PHONE = (1440, 900), (1000, 640), (390, 844)
CONTROLLERS = ("manual", "lqr", "adaptive")
PATIENCE = 10.0
"""A busy machine may stall the page, whose dead-man then lets go: press again, so often [s]."""


@pytest.fixture(scope="module")
def running() -> Iterator[CockpitProcess]:
    with cockpit("--controllers", *CONTROLLERS, "--controller", "lqr") as started:
        yield started


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    program = shutil.which("chromium")
    if program is None:
        pytest.skip("needs Debian's chromium")
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture
def crane(running: CockpitProcess) -> Iterator[RawPage]:
    """A watcher that sees what the crane really does."""
    with RawPage(running) as watcher:
        yield watcher


@contextmanager
def opened(
    browser: Browser, at: CockpitProcess, size: tuple[int, int] = SMALL, **options: Any
) -> Iterator[Page]:
    """The page of the cockpit, in which nothing goes wrong."""
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]}, has_touch=size == PHONE, **options
    )
    page = context.new_page()
    wrong: list[str] = []
    page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    try:
        page.goto(at.address)
        expect(page.locator("#controllers button")).to_have_count(len(CONTROLLERS))
        yield page
        assert wrong == []
    finally:
        context.close()


def driving(page: Page) -> None:
    expect(page.locator("#status")).to_have_text("You hold the pendant")


def newest(crane: RawPage, seconds: float = 0.0) -> dict[str, Any]:
    """The state as it is after some time, read to the end of what is waiting."""
    end = time.monotonic() + seconds
    while True:
        begun = time.monotonic()
        state = crane.look()
        if begun >= end and time.monotonic() - begun > 0.005:
            return state


def moved(crane: RawPage, press: Any, let_go: Any, number: int) -> dict[str, Any]:
    """Presses until the control process has the button, as a person would."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        press()
        until = time.monotonic() + 1.0
        while time.monotonic() < until:
            if newest(crane)["buttons"][number]:
                return crane.state
        let_go()
    raise AssertionError("The button never reached the crane.")


def test_a_key_moves_the_trolley_as_long_as_it_is_held(
    browser: Browser, running: CockpitProcess, crane: RawPage
) -> None:
    with opened(browser, running) as page:
        driving(page)
        keys = page.keyboard
        for key, number in (("ArrowRight", 0), ("a", 1), ("ArrowUp", 2), ("s", 3)):
            moved(crane, lambda key=key: keys.down(key), lambda key=key: keys.up(key), number)
            keys.up(key)
            assert not any(newest(crane, 0.3)["buttons"])
        assert crane.state["crane"][6] == 0.0


def test_a_mouse_button_moves_the_trolley_until_it_is_let_go_anywhere(
    browser: Browser, running: CockpitProcess, crane: RawPage
) -> None:
    with opened(browser, running) as page:
        driving(page)
        page.get_by_label("Travel right").hover()
        before = newest(crane)["crane"][0]
        moved(crane, page.mouse.down, page.mouse.up, 0)
        assert newest(crane, 0.3)["crane"][0] > before
        page.mouse.move(5, 5)
        page.mouse.up()
        assert not any(newest(crane, 0.3)["buttons"])


def test_two_fingers_travel_and_hoist_at_once(
    browser: Browser, running: CockpitProcess, crane: RawPage
) -> None:
    with opened(browser, running, PHONE) as page:
        driving(page)
        client = page.context.new_cdp_session(page)
        points = []
        for number, label in enumerate(("Travel left", "Hoist up")):
            box = page.get_by_label(label).bounding_box()
            assert box is not None
            middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
            points.append({"x": middle[0], "y": middle[1], "id": number})

        def touch(kind: str, *touches: dict[str, float]) -> None:
            client.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [*touches]})

        def press() -> None:
            touch("touchStart", points[0])
            touch("touchStart", *points)

        moved(crane, press, lambda: touch("touchEnd"), 1)
        assert crane.look()["buttons"] == [False, True, True, False]
        touch("touchEnd")
        assert not any(newest(crane, 0.3)["buttons"])


def test_a_key_moves_the_crane_and_not_the_list_that_has_the_focus(
    browser: Browser, running: CockpitProcess, crane: RawPage
) -> None:
    with opened(browser, running) as page:
        driving(page)
        operator = page.get_by_label("Who presses")
        operator.focus()
        keys = page.keyboard
        moved(crane, lambda: keys.down("ArrowDown"), lambda: keys.up("ArrowDown"), 3)
        keys.up("ArrowDown")
        expect(operator).to_have_value("you")


def test_the_controller_is_switched_while_the_crane_moves(
    browser: Browser, running: CockpitProcess, crane: RawPage
) -> None:
    with opened(browser, running) as page:
        driving(page)
        keys = page.keyboard
        moved(crane, lambda: keys.down("ArrowLeft"), lambda: keys.up("ArrowLeft"), 1)
        for name in ("manual", "adaptive", "lqr"):
            chip = page.get_by_role("radio", name=name)
            chip.click()
            expect(chip).to_be_checked()
            assert newest(crane)["controller"] == name
        keys.up("ArrowLeft")


def test_whatever_takes_the_hand_from_the_page_lets_go(
    browser: Browser, running: CockpitProcess, crane: RawPage
) -> None:
    with opened(browser, running) as page:
        driving(page)
        keys = page.keyboard
        for event in ("blur", "pagehide", "contextmenu"):
            moved(crane, lambda: keys.down("ArrowRight"), lambda: keys.up("ArrowRight"), 0)
            page.evaluate("name => window.dispatchEvent(new Event(name))", event)
            assert not any(newest(crane, 0.3)["buttons"])
            keys.up("ArrowRight")


def test_a_second_page_watches_until_the_first_lets_go(
    browser: Browser, running: CockpitProcess, crane: RawPage
) -> None:
    with opened(browser, running) as first, opened(browser, running) as second:
        driving(first)
        expect(second.locator("#status")).to_have_text("Watching: another page drives")
        second.keyboard.down("ArrowRight")
        assert not any(newest(crane, 0.4)["buttons"])
        second.keyboard.up("ArrowRight")
        first.get_by_role("button", name="Let others drive").click()
        second.get_by_role("button", name="Take the pendant").click()
        driving(second)
        keys = second.keyboard
        moved(crane, lambda: keys.down("ArrowRight"), lambda: keys.up("ArrowRight"), 0)
        keys.up("ArrowRight")


def test_the_emergency_stop_holds_until_the_driver_goes_on(
    browser: Browser, running: CockpitProcess, crane: RawPage
) -> None:
    with opened(browser, running) as page:
        driving(page)
        keys = page.keyboard
        moved(crane, lambda: keys.down("ArrowRight"), lambda: keys.up("ArrowRight"), 0)
        page.get_by_role("button", name="Emergency stop").click()
        expect(page.locator("#status")).to_have_text("Emergency stop")
        state = newest(crane, 0.5)
        assert state["stopped"]
        assert abs(state["crane"][1]) < 0.02
        page.get_by_role("button", name="Go on").click()
        driving(page)
        keys.up("ArrowRight")


def test_a_page_of_another_origin_in_the_same_browser_is_not_heard(
    browser: Browser, running: CockpitProcess
) -> None:
    script = (
        "<script>window.said = 'waiting';"
        f"const socket = new WebSocket('ws://{running.host}/wire');"
        "socket.onopen = () => window.said = 'open'; socket.onerror = () => window.said = 'refused'"
        "</script>"
    )

    class Foreign(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(script.encode())

        def log_message(self, *_: object) -> None:
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Foreign) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page = browser.new_page()
        page.goto(f"http://127.0.0.1:{server.server_port}/")
        page.wait_for_function("window.said !== 'waiting'")
        assert page.evaluate("window.said") == "refused"
        page.close()
        server.shutdown()


def test_a_drive_made_in_the_page_is_replayed_bit_for_bit_there_and_from_its_file(
    browser: Browser, running: CockpitProcess, crane: RawPage, tmp_path: Path
) -> None:
    with opened(browser, running) as page:
        driving(page)
        page.get_by_role("button", name="Reset").click()
        keys = page.keyboard
        moved(crane, lambda: keys.down("ArrowRight"), lambda: keys.up("ArrowRight"), 0)
        page.get_by_role("radio", name="adaptive").click()
        page.get_by_role("button", name="Bump").click()
        keys.up("ArrowRight")
        with page.expect_download() as download:
            page.get_by_role("button", name="Save").click()
        download.value.save_as(tmp_path / "drive.json")
        page.get_by_role("button", name="Replay").click()
        expect(page.locator("#status")).to_have_text("Replayed bit for bit", timeout=20_000)
    drive = Drive.from_json((tmp_path / "drive.json").read_text(encoding="utf-8"))
    lineup = build_lineup(CONTROLLERS, drive.parameters, lambda name: None)
    assert drive.play(lineup.controllers)[1] == drive.digest


def test_a_task_is_started_with_one_click_and_has_a_clock(
    browser: Browser, running: CockpitProcess, crane: RawPage
) -> None:
    with opened(browser, running) as page:
        driving(page)
        page.get_by_role("radio", name="Position").click()
        expect(page.locator("#task-text")).to_be_visible()
        keys = page.keyboard
        moved(crane, lambda: keys.down("ArrowRight"), lambda: keys.up("ArrowRight"), 0)
        keys.up("ArrowRight")
        expect(page.locator("#task-presses")).not_to_have_text("0 presses")
        page.get_by_role("radio", name="Drive freely").click()
        expect(page.locator("#task-text")).to_be_hidden()


@pytest.mark.parametrize("size", [PHONE, DESKTOP], ids=["phone", "desktop"])
@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_everything_that_is_needed_first_is_in_the_window(
    browser: Browser, running: CockpitProcess, size: tuple[int, int], scheme: str, tmp_path: Path
) -> None:
    with opened(browser, running, size, color_scheme=scheme) as page:
        driving(page)
        first = ("Travel left", "Travel right", "Hoist up", "Hoist down", "Emergency stop")
        for element in [
            *(page.get_by_label(label) for label in first),
            *(page.get_by_role("radio", name=name) for name in ("manual", "Position")),
        ]:
            box = element.bounding_box()
            assert box is not None
            assert 0 <= box["x"] < box["x"] + box["width"] <= size[0]
            assert 0 <= box["y"] < box["y"] + box["height"] <= size[1]
            assert box["height"] >= 28
        assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
        assert len(page.screenshot(path=tmp_path / "page.png")) > 10_000
