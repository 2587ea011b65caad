"""Hand: whoever presses the buttons in the cockpit, a person at the page or an operator.

An operator of the environment may drive until the person takes over.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from crane_env.observation import CraneState
from crane_env.operators.base import RELEASED, Buttons, Operator
from crane_env.operators.registry import own_operator
from crane_env.parameters import CraneParameters

YOU = "you"
"""The operator that is the person at the page."""


class Hand:
    """An operator whose buttons are given to it, unless another one presses in its place.

    Attributes:
        buttons: what the person holds now.
        operator: who presses instead; None: the person does.
        stage: number of the goal that counts, if there is a task.
    """

    def __init__(self) -> None:
        self.buttons = RELEASED
        self.operator: Operator | None = None
        self.stage = 0

    def __deepcopy__(self, memo: dict[int, Any]) -> Hand:
        """There is only one person: the environment's copy is the hand itself."""
        return self

    def give_to(self, name: str) -> None:
        """Lets another operator press from the next episode on.

        Raises:
            ValueError: an unknown name; nothing has changed then.
        """
        self.operator = None if name == YOU else own_operator(name)

    @property
    def program(self) -> Any:
        """What the operator plays: the environment begins where a recording of it began."""
        return getattr(self.operator, "program", None)

    def reset(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> None:
        """Begins an episode; see `Operator.reset`."""
        if self.operator is not None:
            self.operator.reset(rng, start, parameters)

    def press(self, time: float, state: CraneState) -> Buttons:
        """Buttons at `time` [s]; see `Operator.press`."""
        if any(self.buttons):
            self.operator = None  # the person takes over
        return self.buttons if self.operator is None else self.operator.press(time, state)

    def pursue(self, task: Any, stage: int) -> None:
        """Turns to a goal; see `crane_env.tasks.task.Pursuer.pursue`."""
        self.stage = stage
        operator: Any = self.operator
        if hasattr(operator, "pursue"):
            operator.pursue(task, stage)
