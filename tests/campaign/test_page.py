"""The page on campaigns: its campaign is one, and its queries read what a run of it leaves."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType

import pytest

from baselines.campaign.plan import read_campaign
from baselines.commands.evaluate import main
from baselines.evaluation.results import ResultsFolder

PAGE = (Path(__file__).parents[2] / "docs" / "campaigns.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    (found,) = re.findall(rf"^```{language}.*?\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return str(found)


def test_the_campaign_of_the_page_is_as_large_as_it_says_and_its_queries_read_its_data_set(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text = block("toml")
    Path("campaign.toml").write_text(text, encoding="utf-8")
    assert main(["--campaign", "campaign.toml", "--dry-run"]) == 0
    count = 2 * 3 * (10 + 1) * 3 * 50
    assert f"{count} episodes, 0 of them there already" in capfd.readouterr().out
    assert len(read_campaign(Path("campaign.toml")).specs) == count

    few = text.replace('"0:50"', '"0:2"').replace('"table1", ', "") + "max_steps = 20\n"
    Path("campaign.toml").write_text(few, encoding="utf-8")
    assert main(["--campaign", "campaign.toml"]) == 0
    exec(compile(block("python"), "campaigns.md", "exec"), vars(module := ModuleType("reader")))
    rows = ResultsFolder(Path("results/campaign")).read_metrics()
    means = module.means.fetchall()
    assert len(means) == 3 * 3
    assert sum(episodes for _, _, episodes, *_ in means) == len(rows) == 36
    for controller, imperfections, episodes, failed, IAE, _ in means:
        own = [
            row["IAE"]
            for row in rows
            if (row["controller"], row["imperfections"]) == (controller, imperfections)
        ]
        assert (episodes, failed) == (4, 0)
        assert pytest.approx(sum(own) / 4) == IAE
    assert {*module.by_crane["crane"]} == {"paper", '{"payload_mass": 150.0}'}
