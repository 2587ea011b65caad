"""Report of the limits, in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation.provenance import made_with
from baselines.evaluation.tables import markdown_table, mean_and_deviation
from baselines.limits.least_error import CraneClass
from baselines.limits.values import LimitTask, LimitValues

FIGURE = "price_of_intent"
"""Name of the figure's file, beside the report."""


@dataclass(frozen=True)
class LimitFindings:
    """All that was computed.

    Attributes:
        operator: who pressed.
        values: of each class, in the order of the seeds.
        previews: of the price of intent [s].
    """

    operator: str
    values: Mapping[CraneClass, Sequence[LimitValues]]
    previews: Sequence[float]

    @classmethod
    def of(cls, tasks: Sequence[LimitTask], values: Sequence[LimitValues]) -> LimitFindings:
        """Sorts what came of tasks by class."""
        by_class: dict[CraneClass, list[LimitValues]] = {}
        for task, found in zip(tasks, values, strict=True):
            by_class.setdefault(task.crane_class, []).append(found)
        previews = max((task.previews for task in tasks), key=len)
        return cls(tasks[0].operator, by_class, previews)

    def column(self, crane_class: CraneClass, name: str) -> NDArray[np.float64]:
        """A value of all manoeuvres of a class that have it [m]."""
        found = np.array([getattr(one, name) for one in self.values[crane_class]])
        return np.asarray(found[~np.isnan(found)])

    def tracked(self, crane_class: CraneClass) -> NDArray[np.float64]:
        """IAE of the clairvoyant plan on the MuJoCo crane over its value, less 1."""
        rows = [(one.tracked, one.clairvoyant) for one in self.values[crane_class]]
        ratio = np.array([tracked / value - 1.0 for tracked, value in rows])
        return np.asarray(ratio[~np.isnan(ratio)])

    def intent(self, crane_class: CraneClass) -> NDArray[np.float64]:
        """Mean IAE with each preview [m]; empty if none was asked for."""
        rows = [one.intent for one in self.values[crane_class] if one.intent]
        return np.nanmean(np.array(rows), axis=0) if rows else np.empty(0)

    @property
    def unsolved(self) -> int:
        """Programs without a solution."""
        every = [one for found in self.values.values() for one in found]
        numbers = [[one.clairvoyant, one.settled, one.replanned, *one.intent] for one in every]
        return sum(int(np.isnan(row).sum()) for row in numbers)


def limit_report(findings: LimitFindings) -> str:
    """The whole report in Markdown."""
    count = len(next(iter(findings.values.values())))
    intro = INTRODUCTION.format(count=count, operator=findings.operator)
    parts = [intro, limit_table(findings), "## How far the model carries", MODEL]
    if len(findings.previews):
        picture = f"![IAE over preview and delay of the buttons]({FIGURE}.png)"
        priced = max(sum(bool(v.intent) for v in found) for found in findings.values.values())
        parts += [
            "## The price of intent",
            INTENT.format(count=priced),
            picture,
            intent_table(findings),
        ]
    parts += ["## Made with", f"{findings.unsolved} programs unsolved; {made_with()}."]
    return "\n\n".join(parts) + "\n"


def limit_table(findings: LimitFindings) -> str:
    """One row a class."""
    columns = ("clairvoyant", "settled", "replanned")
    rows = [
        (
            str(one),
            *(mean_and_deviation(findings.column(one, name), 3) for name in columns),
            mean_and_deviation(100.0 * findings.tracked(one), 1),
        )
        for one in findings.values
    ]
    head = ("class", "clairvoyant [m]", "settled-class value [m]", "replanning [m]", "tracked [%]")
    return markdown_table(head, rows)


def intent_table(findings: LimitFindings) -> str:
    """One row a preview or delay, one column a class: the mean IAE and what it is worth."""
    shown = [one for one in findings.values if findings.intent(one).size]
    now = list(findings.previews).index(0.0) if 0.0 in findings.previews else None
    rows = []
    for place, preview in enumerate(findings.previews):
        means = [findings.intent(one) for one in shown]
        cells = [
            f"{mean[place]:.2f}" if now is None else f"{mean[place]:.2f} ({saved:+.2f})"
            for mean, saved in ((m, 0.0 if now is None else m[place] - m[now]) for m in means)
        ]
        rows.append((f"{preview:+g}", *cells))
    return markdown_table(("preview [s]", *map(str, shown)), rows)


INTRODUCTION = """# Limits of the IAE

Made by `oilcrane limit`: mean ± standard deviation of the IAE over {count} manoeuvres of the
operator `{operator}`, on the crane linearised at theta = 0 with a known, rigid cable l(t).

- **Clairvoyant**: all buttons are known in advance. No policy has a smaller IAE.
- **Settled-class value**: no policy that is at rest when a travel button is pressed, and in steady
  travel when it is released, has a smaller one. A policy that acts before the buttons do, on a
  guess, can: these premises must be checked in each run.
- **Replanning**: what an exact model reaches that replans at each event as if the buttons would
  stay as they are. It is *not* a bound.
- **Tracked**: how much more IAE the MuJoCo crane has when an LQR follows the clairvoyant plan,
  over the manoeuvres of the price of intent."""

MODEL = """The programs are exact for accelerations that are held over a control period of 20 ms;
with 10 ms the values change by less than 0.4 %. The rest is the model: sin(theta) = theta makes the
payload's acceleration too large by 2/3 theta², 0.5 % at 5 degrees of sway and 1.8 % at 9, which is
what the plans of 5 m/s² with free sway use. With the sway limited, or with 1 m/s² or less, the
crane follows the clairvoyant plan within 1 %; with free sway it misses that of 2 m/s² by 2 %, that
of 5 m/s² by 7 % (0.03 m), so that these bound the linear crane and the real one does not quite
reach them.

The gambler (`make_controller("gambler")`) acts on the family's statistics as if the buttons were
pressed and released before they are, and on forward manoeuvres goes below the settled-class value.
`baselines.limits.settled.premises(trajectory, crane_class)` finds it out: it says what the run's
states at the presses and releases were worth at most, and what IAE this run could not go below.
On the operator `memoryless` no such bet pays."""

INTENT = """Mean IAE [m] of replanning with the buttons known ahead (+) or late (-), and in brackets
what that changes; manoeuvres: {count}. A touch-sensing pendant would buy the preview, a radio link
costs the delay."""
