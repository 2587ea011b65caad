"""The picture of the crane: what it shows, that it follows, and what is said where it cannot be."""

from __future__ import annotations

import contextlib
import copy
import itertools
import json
import os
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

import crane_env  # noqa: F401  (registers OILCrane-v0)
from crane_env.operators.base import RELEASED, Buttons
from crane_env.parameters import CraneParameters
from crane_env.plant.single import Plant
from crane_env.plant.start import Start
from crane_env.rendering import canvas, opengl
from crane_env.rendering.canvas import SMALLEST_PICTURE, WindowCanvas
from crane_env.rendering.hall import floor_depth, hall, marks
from crane_env.rendering.instruments import CHART_SPAN, Chart
from crane_env.rendering.scene import CraneRenderer

ROOT = Path(__file__).parents[2]
PAPER = CraneParameters.paper()
WIDTH, HEIGHT = SMALLEST_PICTURE
SCENE = slice(0, HEIGHT - 184)
"""Rows of the picture above the instruments."""

Picture = NDArray[np.uint8]
Mask = NDArray[np.bool_]


class Drawn:
    """A plant with its renderer."""

    def __init__(self, parameters: CraneParameters) -> None:
        self.plant = Plant(parameters)
        self.renderer = CraneRenderer(self.plant, width=WIDTH, height=HEIGHT, window=False)

    def draw(
        self, buttons: Buttons = RELEASED, travel_reference: float = 0.0, **state: float
    ) -> Picture:
        self.plant.reset(Start(**state))
        picture = self.renderer.draw(buttons, travel_reference)
        assert picture is not None
        return picture


@pytest.fixture(scope="module")
def crane() -> Iterator[Drawn]:
    drawn = Drawn(PAPER)
    yield drawn
    drawn.renderer.close()


def crate(picture: Picture) -> Mask:
    """Pixels of the crate: brown."""
    red, green, blue = (picture[SCENE, :, k].astype(float) for k in range(3))
    return (red > 1.28 * green) & (green > 1.2 * blue) & (blue > 0.25 * red) & (red > 40)


def trolley(picture: Picture) -> Mask:
    """Pixels of the trolley: red."""
    red, green, blue = (picture[SCENE, :, k].astype(float) for k in range(3))
    return (red > 2.5 * green) & (red > 2.5 * blue) & (red > 60)


def orange(picture: Picture) -> Mask:
    """Pixels of the reference's arrow: the orange that is nearer to red than the girder's."""
    red, green, blue = (picture[SCENE, :, k].astype(float) for k in range(3))
    return (red > 230) & (green > 130) & (green < 0.78 * red) & (blue < 90)


def blue(picture: Picture) -> Mask:
    """Pixels of the payload velocity's arrow."""
    red, green, blue = (picture[SCENE, :, k].astype(float) for k in range(3))
    return (blue > 200) & (blue > 2.0 * red) & (green > 100)


def centre(mask: Mask) -> NDArray[np.float64]:
    """Column and row of the middle of the pixels."""
    assert mask.sum() > 20
    rows, columns = np.nonzero(mask)
    return np.array([columns.mean(), rows.mean()])


def touches_edge(mask: Mask) -> bool:
    return bool(mask[[0, -1]].any() or mask[:, [0, -1]].any())


def changed(one: Picture, other: Picture) -> Mask:
    # Antialiasing may round an edge differently from one drawing to the next.
    difference = np.abs(one.astype(int) - other.astype(int)).max(axis=2)
    return np.asarray(difference > 8)


def test_a_picture_is_an_array_of_pixels_of_the_size_asked_for(crane: Drawn) -> None:
    picture = crane.draw()
    assert picture.shape == (HEIGHT, WIDTH, 3)
    assert picture.dtype == np.uint8
    assert picture.flags.c_contiguous
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100


@pytest.mark.parametrize("length", [1.0, 2.0, 4.0, 8.0, 12.0])
def test_payload_and_trolley_are_in_the_picture_at_every_length(
    crane: Drawn, length: float
) -> None:
    for sway in (-0.3, 0.3):
        picture = crane.draw(cable_length=length, sway_angle=sway)
        for part in (crate(picture), trolley(picture)):
            assert part.sum() > 100
            assert not touches_edge(part)
        assert np.sign((centre(crate(picture)) - centre(trolley(picture)))[0]) == np.sign(sway)


def test_a_crane_with_another_cable_is_in_the_picture_too() -> None:
    for parameters in (CraneParameters.field(), CraneParameters.of({"cable_length_max": 25.0})):
        drawn = Drawn(parameters)
        longest = crate(drawn.draw(cable_length=parameters.cable_length_max))
        shortest = crate(drawn.draw(cable_length=parameters.cable_length_min))
        drawn.renderer.close()
        for part in (longest, shortest):
            assert part.any()
            assert not touches_edge(part)


def test_camera_follows_the_trolley(crane: Drawn) -> None:
    places = (-15.0, 0.0, 3.3, 15.0)
    pictures = [crane.draw(trolley_position=place) for place in places]
    centres = [centre(trolley(picture)) for picture in pictures]
    assert np.ptp(centres, axis=0).max() < 1.5
    assert abs(centres[0][0] - WIDTH / 2) < 10
    for one, other in itertools.pairwise(pictures):
        assert changed(one, other)[SCENE].sum() > 1000


def test_each_pressed_button_is_lit_in_green_at_a_place_of_its_own(crane: Drawn) -> None:
    still, places = crane.draw(), []
    for button in Buttons._fields:
        pressed = crane.draw(Buttons(**{button: True}))
        lit = changed(pressed, still)
        red, green, blue = pressed[lit].mean(axis=0)
        assert green > 1.5 * max(red, blue)
        places.append(np.argwhere(lit).mean(axis=0))
    forward, backward, up, down = places
    assert forward[1] > backward[1]
    assert up[0] < down[0]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_velocities_are_arrows_that_point_their_way_from_the_payload(
    crane: Drawn, sign: float
) -> None:
    still = crane.draw(cable_length=6.0)
    moving = crane.draw(cable_length=6.0, trolley_velocity=sign, travel_reference=sign)
    payload = centre(crate(still))[0]
    for arrow in (orange(moving), blue(moving)):
        ahead = sign * (np.nonzero(arrow & changed(still, moving)[SCENE])[1] - payload)
        assert ahead.max() > 12
        assert ahead.max() > -2 * ahead.min()
    assert not (blue(still) & ~blue(moving)).any()


def test_drawing_does_not_touch_the_plant(crane: Drawn) -> None:
    undrawn = copy.deepcopy(crane.plant)
    for k in range(40):
        acceleration = float(np.sin(k))
        for plant in (crane.plant, undrawn):
            plant.step(acceleration, -0.5)
        if k % 10 == 0:
            crane.renderer.draw(RELEASED, 0.0)
    assert crane.plant.data.qpos.tobytes() == undrawn.data.qpos.tobytes()
    assert crane.plant.data.qvel.tobytes() == undrawn.data.qvel.tobytes()
    assert crane.plant.data.qacc.tobytes() == undrawn.data.qacc.tobytes()


def test_environment_renders_and_its_copy_draws_for_itself() -> None:
    env = gymnasium.make(
        "OILCrane-v0", operator="table1:1", render_mode="rgb_array", render_width=800
    )
    env.reset(seed=0)
    first = env.render()
    assert isinstance(first, np.ndarray)
    assert first.shape == (720, 800, 3)
    twin = copy.deepcopy(env.unwrapped)
    for _ in range(100):
        env.step(np.array([1.0]))
        twin.step(np.array([1.0]))
    one, other = env.render(), twin.render()
    env.close()
    twin.close()
    assert isinstance(one, np.ndarray)
    assert isinstance(other, np.ndarray)
    assert changed(first, one).sum() > 1000
    # The chart of the copy begins with the copy.
    assert not changed(one, other)[: 720 - 184].any()


@pytest.mark.parametrize(("width", "height"), [(320, 480), (640, 200), (0, 0)])
def test_a_picture_too_small_for_the_instruments_is_refused(width: int, height: int) -> None:
    with pytest.raises(ValueError, match=f"at least 640 x 480 pixels, not {width} x {height}"):
        CraneRenderer(Plant(PAPER), width=width, height=height, window=False)


def test_a_closed_renderer_says_so_and_closes_again_quietly() -> None:
    drawn = Drawn(PAPER)
    drawn.renderer.close()
    drawn.renderer.close()
    with pytest.raises(RuntimeError, match="closed"):
        drawn.draw()


def test_a_window_that_takes_the_threads_opengl_is_named(
    crane: Drawn, monkeypatch: pytest.MonkeyPatch
) -> None:
    def taken() -> None:
        raise OSError("EGL_BAD_ACCESS")

    monkeypatch.setattr(crane.renderer._canvas._gl, "as_current", taken)  # type: ignore[attr-defined]
    with pytest.raises(RuntimeError, match="HumanRendering does under X11: use render_mode"):
        crane.draw()


@given(st.lists(st.floats(0.0, 0.5), min_size=1, max_size=3000))
def test_the_chart_keeps_its_span_and_never_more_than_a_figure_can_hold(gaps: list[float]) -> None:
    chart, now = Chart(1.0), 0.0
    for gap in gaps:
        now += gap
        chart.add(now, 1.0, -1.0)
    times = chart.samples()[:, 0]
    assert times[-1] == now
    assert times[-1] - times[0] <= CHART_SPAN
    assert np.all(np.diff(times) >= 0.0)
    assert len(times) <= 1001


def test_a_new_episode_begins_a_new_chart() -> None:
    chart = Chart(1.0)
    for time in (0.0, 0.02, 0.04, 0.0):
        chart.add(time, 1.0, 0.5)
    assert chart.samples().tolist() == [[0.0, 1.0, 0.5]]


def test_girder_buffers_and_marks_follow_the_rails() -> None:
    for half in (5.0, 20.0, 200.0):
        parameters = CraneParameters.of({"rail_half_length": half})
        girder = max(solid.half[0] for solid in hall(parameters))
        assert girder > half
        edge = [solid.label for solid in marks(parameters, half) if solid.label]
        assert edge[-1] == f"{half:.0f} m"
        everywhere = list(marks(parameters, 0.0))
        assert len(everywhere) <= 2 * (2 * 40 + 1) + 2 * 17
        floor = -floor_depth(parameters)
        assert all(solid.centre[2] - solid.half[2] >= floor for solid in everywhere)


# What is said where there is nothing to draw with.


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """A Linux without display and with MUJOCO_GL unset."""
    for name in ("MUJOCO_GL", "PYOPENGL_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(opengl.platform, "system", lambda: "Linux")
    return monkeypatch


def assert_says_what_to_do(error: BaseException) -> None:
    for advice in ("MUJOCO_GL=egl", "libegl1", "MUJOCO_GL=osmesa", "libosmesa6"):
        assert advice in str(error)


def test_without_a_back_end_the_error_says_what_to_set_and_install(
    bare: pytest.MonkeyPatch,
) -> None:
    bare.setattr(opengl, "_loads", lambda library: False)
    env = gymnasium.make("OILCrane-v0", render_mode="rgb_array")
    env.reset(seed=0)
    with pytest.raises(RuntimeError, match="No OpenGL back end is installed") as caught:
        env.render()
    assert_says_what_to_do(caught.value)
    env.step(np.zeros(1))
    env.close()


@pytest.mark.parametrize(
    ("value", "complaint"),
    [
        ("off", "switches OpenGL off"),
        ("vulkan", "is no OpenGL back end; valid: egl, osmesa, glfw"),
        ("glfw", "needs a display"),
        ("glx", "needs a display"),
    ],
)
def test_a_setting_that_cannot_draw_is_named(
    bare: pytest.MonkeyPatch, value: str, complaint: str
) -> None:
    bare.setenv("MUJOCO_GL", value)
    with pytest.raises(RuntimeError, match=complaint) as caught:
        opengl.offscreen_context(64, 64)
    assert_says_what_to_do(caught.value)


@pytest.mark.parametrize(
    ("libraries", "display", "chosen"),
    [
        ({"libEGL.so.1", "libOSMesa.so.8"}, None, "mujoco.egl"),
        ({"libOSMesa.so.8"}, None, "mujoco.osmesa"),
        ({"libEGL.so.1"}, ":0", "mujoco.egl"),
        (set(), ":0", "mujoco.glfw"),
    ],
)
def test_the_back_end_is_chosen_by_what_is_installed(
    bare: pytest.MonkeyPatch, libraries: set[str], display: str | None, chosen: str
) -> None:
    asked = []

    def note(module: str) -> None:
        asked.append(module)
        raise ImportError("only asked")

    if display is not None:
        bare.setenv("DISPLAY", display)
    bare.setattr(opengl, "_loads", lambda library: library in libraries)
    bare.setattr(opengl.importlib, "import_module", note)
    with pytest.raises(RuntimeError, match="only asked"):
        opengl.offscreen_context(64, 64)
    assert asked == [chosen]


def test_the_back_end_that_a_process_is_committed_to_is_kept(bare: pytest.MonkeyPatch) -> None:
    bare.setenv("PYOPENGL_PLATFORM", "osmesa")
    assert opengl._automatic() == "osmesa"


def test_a_window_without_a_display_says_so(bare: pytest.MonkeyPatch) -> None:
    env = gymnasium.make("OILCrane-v0", render_mode="human")
    with pytest.raises(RuntimeError, match="needs a display") as caught:
        env.reset(seed=0)
    assert 'render_mode="rgb_array"' in str(caught.value)
    env.close()


# Windows keep real time.


class Clock:
    """Stands for the `time` module: real time passes only when something takes it."""

    def __init__(self) -> None:
        self.now = 100.0

    def perf_counter(self) -> float:
        return self.now

    def sleep(self, duration: float) -> None:
        self.now += duration


class FakeWindow:
    """A window, and its OpenGL context, that takes `cost` seconds to show a picture."""

    def __init__(self, clock: Clock, cost: float) -> None:
        self.clock, self.cost = clock, cost
        self.shown: list[float] = []
        self.unwanted = False
        self.freed = 0

    def as_current(self) -> contextlib.AbstractContextManager[None]:
        return contextlib.nullcontext()

    def area(self) -> mujoco.MjrRect:
        return mujoco.MjrRect(0, 0, WIDTH, HEIGHT)

    def show(self) -> None:
        self.clock.now += self.cost
        self.shown.append(self.clock.now)

    def is_unwanted(self) -> bool:
        return self.unwanted

    def free(self) -> None:
        self.freed += 1


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    fake = Clock()
    monkeypatch.setattr(canvas, "time", fake)
    return fake


def play(monkeypatch: pytest.MonkeyPatch, window: FakeWindow) -> Callable[[float], None]:
    """A function that paints picture after picture, one a control period, for a duration."""
    monkeypatch.setattr(canvas, "Window", lambda width, height: window)
    monkeypatch.setattr(canvas, "drawing_context", lambda model, height: FakeWindow(Clock(), 0.0))
    screen = WindowCanvas(Plant(PAPER).model, width=WIDTH, height=HEIGHT)
    steps = itertools.count()

    def paint(duration: float) -> None:
        for _ in range(round(duration / 0.02)):
            screen.paint(0.02 * next(steps), lambda area, context: None)

    return paint


def test_a_window_shows_every_picture_in_real_time(
    monkeypatch: pytest.MonkeyPatch, clock: Clock
) -> None:
    window = FakeWindow(clock, cost=0.005)
    play(monkeypatch, window)(10.0)
    assert clock.now - 100.0 == pytest.approx(10.0, abs=0.05)
    assert np.diff(window.shown)[2:] == pytest.approx(0.02)


def test_a_window_on_a_slow_computer_leaves_out_pictures_and_keeps_real_time(
    monkeypatch: pytest.MonkeyPatch, clock: Clock
) -> None:
    window = FakeWindow(clock, cost=0.09)
    play(monkeypatch, window)(10.0)
    assert clock.now - 100.0 == pytest.approx(10.0, abs=0.15)
    assert 90 <= len(window.shown) <= 112


def test_a_window_that_a_person_closes_stays_closed_and_nothing_waits_for_it(
    monkeypatch: pytest.MonkeyPatch, clock: Clock
) -> None:
    window = FakeWindow(clock, cost=0.005)
    paint = play(monkeypatch, window)
    paint(1.0)
    window.unwanted = True
    paint(0.02)
    closed, pictures = clock.now, len(window.shown)
    paint(100.0)
    assert window.freed == 1
    assert clock.now == closed
    assert len(window.shown) == pictures


# In processes of their own: what is imported, how a program ends, a real window.


def run(code: str, **environment: str) -> str:
    """Runs a program with warnings as errors; what it prints, having said nothing on stderr."""
    names = ("MUJOCO_GL", "PYOPENGL_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY")
    inherited = {name: value for name, value in os.environ.items() if name not in names}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", textwrap.dedent(code)],
        env={**inherited, **environment},
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_stepping_touches_no_graphics() -> None:
    run(
        """
        import sys
        import gymnasium, crane_env
        for mode in (None, "rgb_array", "human"):
            env = gymnasium.make("OILCrane-v0", render_mode=mode)
            if mode != "human":
                env.reset(seed=0)
                env.step(env.action_space.sample())
            env.close()
        loaded = {name.split(".")[0] for name in sys.modules}
        assert "OpenGL" not in loaded, loaded
        assert not [name for name in sys.modules if name.startswith("crane_env.rendering.scene")]
        """
    )


@pytest.mark.parametrize(
    "broken",
    [
        {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"},
        {"MUJOCO_GL": "glfw", "DISPLAY": ":4711"},
    ],
)
def test_a_back_end_that_is_installed_but_does_not_work_is_an_error_and_no_more(
    broken: dict[str, str],
) -> None:
    printed = run(
        """
        import gymnasium, crane_env
        env = gymnasium.make("OILCrane-v0", render_mode="rgb_array")
        env.reset(seed=0)
        try:
            env.render()
        except RuntimeError as error:
            print(error)
        """,
        **broken,
    )
    assert_says_what_to_do(RuntimeError(printed))


@pytest.mark.parametrize("back_end", ["", "egl", "osmesa"])
def test_a_program_draws_without_a_display_and_ends_quietly_without_closing(back_end: str) -> None:
    if back_end == "osmesa" and not opengl._loads(opengl.BACK_ENDS["osmesa"][1] or ""):
        pytest.skip("the fallback OSMesa (Debian: libosmesa6) is not installed")
    setting = {"MUJOCO_GL": back_end} if back_end else {}
    shapes = run(
        """
        import mujoco  # first, as a program of its own would
        import gymnasium, crane_env
        envs = [gymnasium.make("OILCrane-v0", render_mode="rgb_array") for _ in range(2)]
        for env in envs:
            env.reset(seed=0)
            print(env.render().shape)
        other = mujoco.Renderer(envs[0].unwrapped.plant.model, 32, 32) if {back_end!r} else None
        print(envs[0].render().shape)
        """.replace("{back_end!r}", repr(back_end)),
        **setting,
    )
    assert shapes == "(720, 960, 3)\n" * 3


def test_back_ends_draw_the_same_picture() -> None:
    if not opengl._loads(opengl.BACK_ENDS["osmesa"][1] or ""):
        pytest.skip("the fallback OSMesa (Debian: libosmesa6) is not installed")
    code = """
        import sys
        import numpy as np
        from crane_env import Buttons, CraneParameters
        from crane_env.plant.single import Plant
        from crane_env.rendering.scene import CraneRenderer
        renderer = CraneRenderer(Plant(CraneParameters()), width=640, height=480, window=False)
        print(renderer.draw(Buttons(up=True), 1.0)[::8, ::8].tolist())
    """
    one, other = (np.array(json.loads(run(code, MUJOCO_GL=name))) for name in ("egl", "osmesa"))
    assert np.abs(one - other).mean() < 4.0


@pytest.fixture
def display() -> Iterator[str]:
    """A virtual screen."""
    if shutil.which("Xvfb") is None:
        pytest.skip("a window needs a virtual screen (Debian: xvfb)")
    command = ["Xvfb", "-displayfd", "1", "-screen", "0", "1024x800x24", "-nolisten", "tcp"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    assert server.stdout is not None
    try:
        yield ":" + server.stdout.readline().strip()
    finally:
        server.terminate()
        server.wait()
        server.stdout.close()


def test_a_real_window_opens_shows_and_closes_beside_a_picture_without_one(display: str) -> None:
    printed = run(
        """
        import gymnasium, crane_env, glfw
        import numpy as np
        shown = gymnasium.make("OILCrane-v0", render_mode="human", operator="table1:1")
        drawn = gymnasium.make("OILCrane-v0", render_mode="rgb_array", operator="table1:1")
        for env in (shown, drawn):
            env.reset(seed=0)
        before = drawn.render()
        for _ in range(30):
            shown.step(np.array([1.0]))
            drawn.step(np.array([1.0]))
        print(bool((before != drawn.render()).any()), bool(glfw.get_current_context()))
        window = shown.unwrapped._pictures._renderer._canvas._window._handle
        print(glfw.get_window_size(window))
        glfw.set_window_should_close(window, True)
        for _ in range(50):
            shown.step(np.array([0.0]))
        shown.close()
        shown.reset(seed=0)
        print(shown.render())
        """,
        DISPLAY=display,
        LIBGL_ALWAYS_SOFTWARE="1",
    )
    assert printed.splitlines() == ["True False", "(960, 720)", "None"]
