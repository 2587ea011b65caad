"""The registry of controllers: what a factory is given, and what is refused before it plays."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from baselines import CONTROLLERS, make_controller, presets, settings_type
from baselines.classical.lqr import LqrSettings
from baselines.manual import Manual
from baselines.mpc.settings import MpcSettings
from crane_env.parameters import CraneParameters
from crane_env.support.fields import from_fields

FAST = ("manual", "linear", "adaptive")


@dataclass(frozen=True)
class Gain:
    """Settings of a controller that is no MPC."""

    gain: float = 1.0

    @classmethod
    def of(cls, value: Any) -> Gain:
        return from_fields(cls, value, must_be="Gains must be a mapping", unknown="gain")


class Recording:
    """Keeps what its factory was given."""

    def __init__(self, *given: Any) -> None:
        self.given = given

    def reset(self) -> None:
        """Nothing to forget."""

    def act(self, observation: np.ndarray) -> np.ndarray:
        """No acceleration."""
        return np.zeros(1)


def of_a_crane(crane: CraneParameters) -> Recording:
    return Recording(crane)


def without_annotations(crane, problem):  # type: ignore[no-untyped-def]
    return Recording(crane, problem)


def of_own_settings(crane: CraneParameters, settings: Gain) -> Recording:
    return Recording(crane, settings)


def of_a_number(crane: CraneParameters, gain: float) -> Recording:
    return Recording(crane, gain)


def of_nothing() -> Recording:
    return Recording()


def of_the_unknown(crane: Nobody) -> Recording:  # type: ignore[name-defined]  # noqa: F821
    return Recording(crane)


def none(crane: CraneParameters) -> None:
    return None


def a_class(crane: CraneParameters) -> type:
    return Recording


def leaving(crane: CraneParameters) -> Recording:
    raise SystemExit(3)


def dividing(crane: CraneParameters) -> Recording:
    return Recording(np.linalg.inv(np.zeros((2, 2))))


def own(factory: str) -> str:
    return f"{__name__}:{factory}"


def test_a_factory_is_given_what_it_takes() -> None:
    crane = CraneParameters(payload_mass=150.0)
    problem = MpcSettings(control_horizon=5)
    assert settings_type(own("of_a_crane")) is None
    assert settings_type(own("without_annotations")) is settings_type("adaptive") is MpcSettings
    assert settings_type(own("of_own_settings")) is Gain
    for factory, given_settings, expected in (
        ("of_a_crane", None, (crane,)),
        ("without_annotations", {"control_horizon": 5}, (crane, problem)),
        ("of_own_settings", {"gain": 2.0}, (crane, Gain(2.0))),
        ("of_own_settings", None, (crane, Gain())),
    ):
        controller: Any = make_controller(own(factory), parameters=crane, settings=given_settings)
        assert controller.given == expected


@pytest.mark.parametrize("name", ["manual", "ppo", "sac", own("of_a_crane")])
def test_settings_for_a_controller_without_any_are_refused(name: str) -> None:
    with pytest.raises(ValueError, match=f"controller '{name}' takes no settings"):
        make_controller(name, settings=MpcSettings())


def test_a_preset_is_named_by_keyword_or_suffix_and_settings_replace_single_fields_of_it() -> None:
    seen = np.array([0, 0.2, 5, 0, 0.1, 0, 1, 0.0])
    light = {"sway_weight": 0.3, "acceleration_weight": 0.01}

    def answer(name: str, **given_arguments: Any) -> float:
        return float(make_controller(name, **given_arguments).act(seen)[0])

    assert answer("lqr@light") == answer("lqr", preset="light")
    assert answer("lqr@light") == answer("lqr", settings={"cost": light}) != answer("lqr")
    assert answer("lqr@paper") == answer("lqr", preset="paper") == answer("lqr")
    changed = {"cost": {"acceleration_weight": 0.1}}
    assert answer("lqr@light", settings=changed) == answer(
        "lqr", settings={"cost": {**light, "acceleration_weight": 0.1}}
    )
    assert answer("manual", preset="paper") == answer("manual")
    assert settings_type("lqr@light") is LqrSettings


def test_every_shipped_preset_makes_a_controller_and_says_where_it_comes_from() -> None:
    for name in CONTROLLERS:
        for preset, content in presets(name).items():
            assert content.provenance
            if preset != "paper":
                make_controller(name, preset=preset)


@pytest.mark.parametrize(
    ("name", "given_arguments", "reason"),
    [
        ("lqr@fast", {}, "Unknown preset of 'lqr' 'fast'; valid: paper, light"),
        ("lqr", {"preset": 3}, "Unknown preset of 'lqr' 3; valid: paper, light"),
        ("manual", {"preset": "tuned"}, "Unknown preset of 'manual' 'tuned'; valid: paper"),
        ("lqr@light", {"preset": "paper"}, "one preset, not 'light' and 'paper'"),
        ("lqr@light", {"settings": LqrSettings()}, "a mapping of fields that differ from it"),
        (own("of_a_crane"), {"preset": "light"}, "valid: paper"),
        (own("of_a_crane") + "@paper", {}, "Unknown controller"),
    ],
)
def test_a_preset_that_means_nothing_is_refused(
    name: str, given_arguments: dict[str, Any], reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        make_controller(name, **given_arguments)


def test_settings_of_another_controller_are_refused() -> None:
    with pytest.raises(ValueError, match="Gains must be a mapping, not MpcSettings"):
        make_controller(own("of_own_settings"), settings=MpcSettings())
    with pytest.raises(ValueError, match="Unknown gain 'tail'; valid: gain"):
        make_controller(own("of_own_settings"), settings={"tail": "hold"})


@pytest.mark.parametrize(
    ("factory", "reason"),
    [
        (
            "none",
            "'.*:none' makes no controller. A controller is an object with reset and act, not None",
        ),
        ("a_class", "makes no controller. A controller is an object"),
        ("of_a_number", "must be build.crane., or build.crane, settings."),
        ("of_nothing", "must be build.crane., or build.crane, settings."),
        ("of_the_unknown", "no readable signature: name 'Nobody' is not defined"),
        ("leaving", r"fails with SystemExit: 3 \(.*test_registry.py, line \d+\)"),
        ("dividing", r"fails with LinAlgError: Singular matrix \(.*test_registry.py, line \d+\)"),
        ("FAST", "There is no controller factory at '.*:FAST'"),
    ],
)
def test_a_factory_that_makes_no_controller_is_refused_with_the_place(
    factory: str, reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        make_controller(own(factory))


@pytest.mark.parametrize(
    ("source", "kind", "reason"),
    [
        ("def build(crane)\n    return 1\n", ValueError, r"SyntaxError: .*\.py, line 1\)"),
        ("import sys\n\nsys.exit('enough')\n", ValueError, r"SystemExit: enough .*\.py, line 3\)"),
        ("gain = 1 / 0\n", ValueError, r"ZeroDivisionError: .*\.py, line 1\)"),
        ("from math import nothing\n", ImportError, r"ImportError: .*\.py, line 1\)"),
        ("import no_such_package\n", ImportError, "imported: No module named 'no_such_package'"),
    ],
)
def test_a_module_that_fails_at_import_is_one_sentence_with_the_place(
    source: str,
    kind: type[Exception],
    reason: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "failing_controller.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(kind, match=f"'failing_controller:build' .*{reason}") as raised:
        make_controller("failing_controller:build")
    assert raised.value.__cause__ is not None
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    "name", [None, 3, True, [], "", "nobody", "a b:c", ":", "a:", ":b", ".a:b", "a..b:c", "a\0:b"]
)
def test_what_is_no_controllers_name_is_refused_with_those_that_are(name: Any) -> None:
    with pytest.raises(ValueError, match=r"Unknown controller .*; valid: manual, linear"):
        make_controller(name)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3)
    ),
    max_leaves=8,
)
PROBLEMS = st.fixed_dictionaries(
    {},
    optional={
        name: JSON | st.integers(1, 30) | st.sampled_from(["hold", "zero", {"sway_weight": 2}])
        for name in MpcSettings.__dataclass_fields__
    },
)
CRANES = st.fixed_dictionaries(
    {}, optional={"payload_mass": JSON | st.just(150), "gravity": JSON, "travel_speed": JSON}
)


@given(name=st.sampled_from(FAST) | JSON, parameters=JSON | CRANES, problem=JSON | PROBLEMS)
@settings(max_examples=300, deadline=None)
def test_any_json_value_gives_a_controller_or_a_value_error(
    name: Any, parameters: Any, problem: Any
) -> None:
    with contextlib.suppress(ValueError):
        controller = make_controller(name, parameters=parameters, settings=problem)
        assert isinstance(controller.act(np.array([0, 0, 5, 0, 0.1, 0, 1, 0.0])), np.ndarray)


def test_every_controller_of_the_registry_is_named_once_and_found() -> None:
    assert len(set(CONTROLLERS.values())) == len(CONTROLLERS)
    for name in CONTROLLERS:
        settings_type(name)
    assert isinstance(make_controller("manual"), Manual)
