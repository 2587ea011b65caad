"""Person at the pendant: how well somebody sees, judges and presses, in numbers with sources.

The structure is intermittent control (Gawthrop et al. 2011, 10.1007/s00422-010-0416-4): a person
looks, decides, and then carries a timed plan out without looking until the refractory time is over.
Refractory times of 0.35 s for a first- and 0.55 s for a second-order system are those of van de
Kamp et al. 2013 (10.1371/journal.pcbi.1002843); visual delays lie in the textbook ranges of simple
and choice reactions, 0.19 to 0.35 s; errors of the time ahead grow with it as in Kaiser and Hecht
1995. Nobody has published how precisely pendants are pressed or how patient operators are: what is
marked "assumed" is swept by `oilcrane study`.
"""

from __future__ import annotations

from dataclasses import dataclass

from crane_env.support.checks import flag, not_negative, positive, shown, whole, within
from crane_env.support.fields import check_fields

SHARES = (
    "awareness",
    "time_error",
    "press_error",
    "awareness_gain",
    "learning_rate",
    "slip_probability",
)
"""Numbers from 0 to 1."""

DURATIONS = (
    "glance_interval",
    "refractory_calm",
    "refractory_swinging",
    "press_shortest",
    "patience",
    "believed_run_out",
)
"""Times [s] above 0."""

LONGEST = 60.0
"""Longest time that a person may be described by [s]."""


@dataclass(frozen=True, kw_only=True)
class Person:
    """What an operator who looks is like, and what he or she believes of the crane at the start.

    The person knows the crane's data sheet: speeds, ramps, the reach of rail and hoist; and, which
    is unfair, the rhythm of the swing from the cable's length. What the controller does is learned
    by watching (`practise`, and during the episode), never told.

    Attributes:
        skill: the last part of the operator's name, "person:SKILL".
        visual_delay: from what happens to what it lets the person decide [s].
        glance_interval: between two looks at the payload [s] (assumed).
        position_noise: standard deviation of a seen position or depth [m] (assumed).
        speed_noise: of a seen speed [m/s] (assumed).
        lean_noise: of a seen lean of the cable [rad] (assumed).
        refractory_calm: from one decision to the next, payload calm [s].
        refractory_swinging: likewise, payload swinging [s].
        time_error: standard deviation of the error of a time ahead, as a share of it (assumed).
        press_error: of a press, as a share of its duration (assumed).
        press_jitter: of a press, the part that does not grow with it [s] (assumed).
        press_shortest: shortest press that the person gives [s] (assumed).
        pause: shortest wait after a release, whatever the payload does [s] (assumed).
        patience: longest wait for the payload to calm after a release [s] (assumed).
        calm_speed: below this the payload looks calm [m/s] (assumed).
        awareness: how much of the motion still to come is taken into account, 0 to 1 (assumed).
        patience_gain: factor of patience after a reversal of the person's own (assumed).
        awareness_gain: rise of awareness after a reversal of the person's own (assumed).
        learning_rate: weight of a new experience in a belief (assumed).
        catches_swing: whether the person can drive the trolley under a swinging payload.
        releases_in_steps: whether a release on a crane that swings is done in three short steps.
        overlaps: whether travel and hoist are pressed at the same time where there is room.
        slip_probability: of a decision that comes out as no press at all (assumed).
        practice_trials: presses that `practise` lets the person watch before the episode (assumed).
        believed_run_out: way of the payload after a release over its speed then [s] (assumed).
        believed_inching_gain: way of the payload over what a short press asks for (assumed).
        believed_swing: share of a swing's width that is left after one more period, 0 to 1
            (assumed); above one half the person takes it that a swing lasts.

    Raises:
        ValueError: a value out of range.
    """

    skill: str = "trained"
    visual_delay: float = 0.25
    glance_interval: float = 0.1
    position_noise: float = 0.01
    speed_noise: float = 0.01
    lean_noise: float = 0.002
    refractory_calm: float = 0.35
    refractory_swinging: float = 0.55
    time_error: float = 0.15
    press_error: float = 0.07
    press_jitter: float = 0.015
    press_shortest: float = 0.08
    pause: float = 0.0
    patience: float = 6.0
    calm_speed: float = 0.05
    awareness: float = 0.7
    patience_gain: float = 1.4
    awareness_gain: float = 0.2
    learning_rate: float = 0.3
    catches_swing: bool = True
    releases_in_steps: bool = False
    overlaps: bool = False
    slip_probability: float = 0.01
    practice_trials: int = 6
    believed_run_out: float = 0.5
    believed_inching_gain: float = 1.0
    believed_swing: float = 0.3

    def __post_init__(self) -> None:
        """Refuses what no person is like."""
        if not isinstance(self.skill, str) or not self.skill:
            raise ValueError(f"A person's skill must be a word, not {shown(self.skill)}.")
        check_fields(self, within, DURATIONS, 1e-3, LONGEST, "s")
        check_fields(self, within, ("visual_delay", "press_jitter", "pause"), 0.0, LONGEST, "s")
        check_fields(self, not_negative, ("position_noise", "speed_noise", "lean_noise"))
        check_fields(self, positive, ("calm_speed",))
        check_fields(self, within, (*SHARES, "believed_swing"), 0.0, 1.0)
        check_fields(self, within, ("patience_gain",), 1.0, 10.0)
        check_fields(self, within, ("believed_inching_gain",), 0.05, 2.0)
        check_fields(self, flag, ("catches_swing", "releases_in_steps", "overlaps"))
        check_fields(self, whole, ("practice_trials",), 0, 1000)

    @property
    def name(self) -> str:
        """The name that `make_operator` knows the person by."""
        return f"person:{self.skill}"


NOVICE = Person(
    skill="novice",
    visual_delay=0.35,
    time_error=0.30,
    press_error=0.12,
    press_jitter=0.03,
    press_shortest=0.12,
    patience=2.0,
    calm_speed=0.10,
    awareness=0.3,
    catches_swing=False,
    slip_probability=0.03,
    practice_trials=1,
)
TRAINED = Person()
EXPERT = Person(
    skill="expert",
    visual_delay=0.20,
    time_error=0.08,
    press_error=0.04,
    press_jitter=0.01,
    press_shortest=0.06,
    patience=10.0,
    calm_speed=0.04,
    awareness=1.0,
    releases_in_steps=True,
    overlaps=True,
    slip_probability=0.002,
    practice_trials=10,
)

PERSONS = {person.skill: person for person in (NOVICE, TRAINED, EXPERT)}
"""The skills by name."""
