"""Plan of a campaign: a TOML file, of which all combinations are played.

    crane x nominal x (operator or task) x imperfections x controller x seeds

    controllers = ["manual", "adaptive"]   # required; the rest as here if it is left out
    cranes = ["paper"]                     # presets, or fields that differ: {payload_mass = 150}
    nominals = ["same"]                    # what controllers believe in, likewise
    imperfections = ["none"]               # scenarios, single ones, tables, lists of these
    operators = ["table1"]                 # none if there are tasks
    tasks = []                             # {task = "bay", operator = "person:trained"}
    seeds = [0]                            # numbers, or "FIRST:END"
    settings = {}                          # fields of MpcSettings that differ from the paper's
    max_steps = 1250                       # of an episode with an operator [control periods]
    keep = "metrics"                       # or "trajectories"

A task is played by a person, "trained" if none is named, for 6000 control periods at most unless it
says `max_steps`; with `practise = true` the person tries crane and controller beforehand.
"""

from __future__ import annotations

import functools
import itertools
import math
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, cast, get_args

from baselines.evaluation.episode_spec import MOST_EPISODES, EpisodeSpec, Setup
from baselines.evaluation.results import Keep
from baselines.mpc.settings import MpcSettings
from crane_env import TASK_STEPS, CraneParameters
from crane_env.environment.options import start_of
from crane_env.imperfections.base import Imperfection
from crane_env.imperfections.registry import make_imperfections
from crane_env.operators.person.operator import PersonOperator
from crane_env.operators.registry import make_operator, operator_program
from crane_env.operators.table1 import TABLE_1
from crane_env.support import checks
from crane_env.tasks.registry import make_task

T = TypeVar("T")


@dataclass(frozen=True)
class Campaign:
    """What a file asks for.

    Attributes:
        specs: the episodes, controller by controller.
        keep: what is kept of each.
    """

    specs: list[EpisodeSpec]
    keep: Keep


@dataclass(frozen=True)
class Scene:
    """Who presses the buttons, and what for.

    Attributes:
        operator: its program, as `make_operator` takes it.
        task: as `make_task` takes it; None: none.
        max_steps: length of the episode [control periods].
        practise: whether the operator tries crane and controller beforehand.
    """

    operator: Mapping[str, Any]
    task: str | Mapping[str, Any] | None
    max_steps: int | None
    practise: bool = False


ENTRIES = (
    "controllers",
    "cranes",
    "nominals",
    "imperfections",
    "operators",
    "tasks",
    "seeds",
    "settings",
    "max_steps",
    "keep",
)


def read_campaign(file: Path) -> Campaign:
    """Reads a campaign.

    Raises:
        ValueError: the file is no TOML, lacks an entry, has one that is unknown or makes no sense;
            a sentence names the place.
        FileNotFoundError: it is not there.
        OSError: it cannot be read.
    """
    path = checks.regular_file("campaign file", file)
    with at(str(file)):
        try:
            given = tomllib.loads(path.read_text(encoding="utf-8"))
        except tomllib.TOMLDecodeError as error:
            raise ValueError(f"This is no TOML: {error}.") from error
        except UnicodeDecodeError:
            raise ValueError("This is no TOML: it is not text in UTF-8.") from None
        return campaign(given)


def campaign(given: Mapping[str, Any]) -> Campaign:
    """The campaign of a file's entries.

    Raises:
        ValueError: see `read_campaign`.
    """
    for name in given:
        checks.choice("entry", name, ENTRIES)

    def entries(name: str, default: list[Any], read: Callable[[Any], T]) -> list[T]:
        values = given.get(name, default)
        if not isinstance(values, list):
            raise ValueError(f"{name} must be a list, not {checks.shown(values)}.")
        found = []
        for place, value in enumerate(values):
            with at(f"{name}[{place}]"):
                found.append(read(value))
        return found

    with at("max_steps"):
        steps = given.get("max_steps")
        steps = None if steps is None else checks.whole("It", steps, least=1)
    with at("settings"):
        settings = MpcSettings.of(given.get("settings", {}))
    cranes = entries("cranes", ["paper"], CraneParameters.of)
    nominals = entries("nominals", ["same"], nominal)
    imperfections = entries("imperfections", ["none"], imperfections_of)
    operated = entries(
        "operators",
        [] if given.get("tasks") else ["table1"],
        lambda name: [Scene(operator_program(one), None, steps) for one in operator_names(name)],
    )
    scenes = [*itertools.chain.from_iterable(operated), *entries("tasks", [], task_scene)]
    controllers = entries("controllers", [], text)
    ranges = entries("seeds", [0], seed_range)
    # A range of seeds may be longer than there is memory.
    some = list(itertools.islice(itertools.chain.from_iterable(ranges), MOST_EPISODES + 1))
    parts = (controllers, cranes, nominals, imperfections, scenes, list(dict.fromkeys(some)))
    if math.prod(len(part) for part in parts) > MOST_EPISODES:
        raise ValueError(f"There may be at most {MOST_EPISODES} episodes: ask for fewer seeds.")
    keep = checks.choice("value of keep", given.get("keep", "metrics"), get_args(Keep))
    specs = list(unique(combinations(*parts, settings)))
    if not specs:
        raise ValueError("There is nothing to play: name a controller, an operator and a seed.")
    return Campaign(specs, cast(Keep, keep))


def combinations(
    controllers: list[str],
    cranes: list[CraneParameters],
    nominals: list[CraneParameters | None],
    imperfections: list[tuple[Imperfection, ...]],
    scenes: list[Scene],
    seeds: list[int],
    settings: MpcSettings,
) -> Iterator[EpisodeSpec]:
    """All episodes; those of a controller together, and among them those of a crane."""

    @functools.cache
    def setup(
        crane: CraneParameters,
        nominal: CraneParameters | None,
        imperfections: tuple[Imperfection, ...],
        steps: int | None,
    ) -> Setup:
        return Setup(
            crane=crane,
            nominal=nominal,
            settings=settings,
            max_steps=steps,
            imperfections=imperfections,
        )

    for crane, scene in itertools.product(cranes, scenes):
        with at("operators"):
            start_of({}, make_operator(scene.operator), crane)  # a recording is of one crane
    begun = itertools.product(controllers, cranes, nominals, imperfections, scenes, seeds)
    for controller, crane, nominal, parts, scene, seed in begun:
        yield EpisodeSpec(
            controller=controller,
            operator=scene.operator,
            seed=seed,
            setup=setup(crane, nominal, parts, scene.max_steps),
            task=scene.task,
            practice=seed if scene.practise else None,
        )


def unique(specs: Iterator[EpisodeSpec]) -> Iterator[EpisodeSpec]:
    """Every episode once, though two entries may mean the same."""
    seen: set[str] = set()
    for spec in specs:
        if spec.key not in seen:
            seen.add(spec.key)
            yield spec


def task_scene(given: Any) -> Scene:
    """A task with its operator, from an entry of `tasks`."""
    if not isinstance(given, dict):
        raise ValueError(f"It must be a table with a task, not {checks.shown(given)}.")
    for name in given:
        checks.choice("entry", name, ("task", "operator", "max_steps", "practise"))
    if "task" not in given:
        raise ValueError("The entry task is missing.")
    make_task(given["task"])
    operator = operator_program(text(given.get("operator", "person:trained")))
    practise = checks.flag("practise", given.get("practise", False))
    if practise and not isinstance(make_operator(operator), PersonOperator):
        raise ValueError(f"Only persons can practise, not the operator {given['operator']!r}.")
    steps = checks.whole("max_steps", given.get("max_steps", TASK_STEPS), least=1)
    return Scene(operator, given["task"], steps, practise)


def nominal(given: Any) -> CraneParameters | None:
    """The crane that controllers believe in; None for "same", the one that is driven."""
    return None if given == "same" else CraneParameters.of(given)


def imperfections_of(given: Any) -> tuple[Imperfection, ...]:
    """Imperfections, of which "none" is none."""
    return make_imperfections(None if given == "none" else given)


def text(given: Any) -> str:
    """A name."""
    if isinstance(given, str):
        return given
    raise ValueError(f"A name must be text, not {checks.shown(given)}.")


def operator_names(given: Any) -> list[str]:
    """All manoeuvres of Table I for the name of the table, else the name itself."""
    name = text(given)
    return [f"table1:{n}" for n in range(1, len(TABLE_1) + 1)] if name == "table1" else [name]


def seed_range(given: Any) -> range:
    """Seeds of a number, or of the text FIRST:END.

    Raises:
        ValueError: it is neither.
    """
    first, colon, end = given.partition(":") if isinstance(given, str) else (given, "", "")
    try:
        low = int(first) if isinstance(first, str) else checks.seed(first)
        high = int(end) if colon else low + 1
    except ValueError:
        raise ValueError(
            f"A seed is a whole number or a range FIRST:END, not {checks.shown(given)}."
        ) from None
    for number in range(low, high)[:1]:
        checks.seed(number)
    return range(low, high)


def some_seeds(given: Iterable[Any], most: int) -> list[int]:
    """Seeds of numbers and ranges, each once; no more of a long range is formed than may be.

    Raises:
        ValueError: one is neither, or there are more than `most`.
    """
    named = itertools.chain.from_iterable(map(seed_range, given))
    seeds = list(dict.fromkeys(itertools.islice(named, most + 1)))
    if len(seeds) > most:
        raise ValueError(f"seeds must be at most {most}.")
    return seeds


@contextmanager
def at(place: str) -> Iterator[None]:
    """Says of what is wrong within the block where it stands.

    Raises:
        ValueError, FileNotFoundError: what the block raised, with the place.
    """
    try:
        yield
    except FileNotFoundError as error:
        raise FileNotFoundError(f"{place}: {error}") from error
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from error
