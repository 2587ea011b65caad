"""Plan: a TOML file means all combinations, and what is wrong in it is named with its place."""

from __future__ import annotations

from pathlib import Path

import pytest

from baselines.campaign.plan import TASK_STEPS, campaign, read_campaign, some_seeds
from crane_env import CraneParameters
from crane_env.imperfections.registry import make_imperfections


def test_a_campaign_is_every_combination_once() -> None:
    asked = campaign(
        {
            "controllers": ["manual", "adaptive", "manual"],
            "cranes": ["paper", {"payload_mass": 150.0}],
            "nominals": ["same", "paper"],  # of the paper's crane, both are the same
            "imperfections": ["none", "field:0.5", ["noise", {"name": "drive-lag"}]],
            "operators": ["table1", "random"],
            "tasks": [{"task": "bay"}, {"task": "position", "practise": True, "max_steps": 9}],
            "seeds": [7, "0:3", 0],
        }
    )
    assert len(asked.specs) == 2 * (1 + 2) * 3 * (10 + 1 + 2) * 4
    assert len({spec.key for spec in asked.specs}) == len(asked.specs)
    assert asked.keep == "metrics"
    setups = {spec.setup for spec in asked.specs}
    assert {setup.crane for setup in setups} == {
        CraneParameters(),
        CraneParameters(payload_mass=150.0),
    }
    assert {setup.believed.payload_mass for setup in setups if setup.nominal} == {100.0}
    assert make_imperfections("field:0.5") in {setup.imperfections for setup in setups}
    practised = {spec.practice for spec in asked.specs if spec.task == "position"}
    assert practised == {7, 0, 1, 2}
    steps = {spec.task: spec.setup.max_steps for spec in asked.specs}
    assert steps == {None: None, "bay": TASK_STEPS, "position": 9}


def test_where_there_are_tasks_table_1_is_not_played_unless_it_is_named() -> None:
    alone = campaign({"controllers": ["manual"], "tasks": [{"task": "bay"}]})
    assert [spec.task for spec in alone.specs] == ["bay"]
    assert len(campaign({"controllers": ["manual"]}).specs) == 10


WRONG = {
    "entry": ('controler = ["manual"]', "Unknown entry 'controler'; valid: controllers, cranes, n"),
    "none": ("seeds = [1]", "There is nothing to play: name a controller"),
    "list": ('controllers = "manual"', "controllers must be a list, not 'manual'."),
    "name": ("controllers = [1]", "controllers[0]: A name must be text, not 1."),
    "crane": ('cranes = ["paper", "moon"]', "cranes[1]: Unknown crane preset 'moon'; valid: pa"),
    "field": ("cranes = [{mass = 1}]", "cranes[0]: Unknown crane parameter 'mass'; valid: troll"),
    "range": ("cranes = [{payload_mass = -1}]", "cranes[0]: payload_mass must be a positive fini"),
    "nominal": ("nominals = [3]", "nominals[0]: Crane parameters must be CraneParameters, a map"),
    "imperfection": ('imperfections = ["rust"]', "imperfections[0]: "),
    "severity": ('imperfections = ["none", "field:-1"]', "imperfections[1]: severity of "),
    "operator": ('operators = ["table1", "nobody"]', "operators[1]: Unknown operator 'nobody'; va"),
    "script": ('operators = ["script:none.csv"]', "operators[0]: There is no button script 'none"),
    "task": ('tasks = [{task = "fly"}]', "tasks[0]: Unknown task 'fly'; valid: "),
    "table": ('tasks = ["bay"]', "tasks[0]: It must be a table with a task, not 'bay'."),
    "no task": ('tasks = [{operator = "random"}]', "tasks[0]: The entry task is missing."),
    "key": ('tasks = [{task = "bay", steps = 1}]', "tasks[0]: Unknown entry 'steps'; valid: task"),
    "practice": (
        'tasks = [{task = "bay", operator = "random", practise = true}]',
        "tasks[0]: Only persons can practise, not the operator 'random'.",
    ),
    "seed": ('seeds = ["0:x"]', "seeds[0]: A seed is a whole number or a range FIRST:END, not '0:"),
    "negative": ("seeds = [0, -1]", "seeds[1]: A seed is a whole number or a range FIRST:END, no"),
    "many": ('seeds = ["0:999999999999"]', "There may be at most 1000000 episodes"),
    "settings": ("settings = {horizon = 3}", "settings: Unknown "),
    "steps": ("max_steps = 0", "max_steps: It must be a whole number of at least 1, not 0."),
    "keep": ('keep = "all"', "Unknown value of keep 'all'; valid: trajectories, metrics."),
    "toml": ("seeds = [", "This is no TOML: "),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_gets_one_sentence_that_names_the_place(case: str, tmp_path: Path) -> None:
    line, sentence = WRONG[case]
    file = tmp_path / "wrong.toml"
    own = line.startswith(("contro", "seeds = [1]"))
    file.write_text(("" if own else 'controllers = ["manual"]\n') + line + "\n", encoding="utf-8")
    with pytest.raises((ValueError, FileNotFoundError)) as raised:
        read_campaign(file)
    assert str(raised.value).startswith(f"{file}: {sentence}")
    assert "\n" not in str(raised.value)


def test_a_file_that_is_none_is_said_so(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="There is no campaign file"):
        read_campaign(tmp_path / "none.toml")
    (binary := tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ValueError, match="it is not text in UTF-8"):
        read_campaign(binary)


def test_more_seeds_than_may_be_are_refused_before_they_are_formed() -> None:
    assert some_seeds([3, "1:4", "2"], 3) == [3, 1, 2]
    with pytest.raises(ValueError, match="seeds must be at most 3"):
        some_seeds(["0:1000000000000"], 3)
