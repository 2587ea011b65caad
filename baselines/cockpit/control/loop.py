"""Loop: the control process, which moves the crane every control period and listens to the page.

What comes in is drained at every tick, in order. What goes out is the state of this tick, unless
the other side still has `CREDIT` states to read: a server that stands still stops no crane, and
later finds no old states.
"""

from __future__ import annotations

import json
import signal
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

from baselines.cockpit.control.lineup import build_lineup
from baselines.cockpit.control.pace import Pace, go_first
from baselines.cockpit.control.session import BRAKE, OPERATORS, TASKS, Opening, Session
from baselines.cockpit.messages import Hold, Message, Seen

CREDIT = 25
"""States that may be on their way to the server: half a second of them."""


class Hello(NamedTuple):
    """What the control process says before its first state.

    Attributes:
        building: the controller that is being built; None: the loop begins.
        facts: what does not change any more, for the page.
        failure: why there will be no loop, in a sentence.
    """

    building: str | None = None
    facts: dict[str, Any] | None = None
    failure: str | None = None


class State(NamedTuple):
    """What the control process says at a tick, as JSON."""

    tick: int
    text: str


class Saved(NamedTuple):
    """A drive that was to be saved, as JSON."""

    text: str


def control(connection: Connection, opening: Opening) -> None:
    """The control process: builds the controllers, then drives until the connection is closed.

    Args:
        connection: of which it reads messages, and `Seen` for each state that was taken from it;
            which it tells `Hello`s, then `State`s and `Saved`s.
        opening: how the session begins.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # they reach the parent too, which closes
    try:
        names = dict.fromkeys((BRAKE, *opening.controllers, opening.controller))
        crane = opening.parameters
        lineup = build_lineup(names, crane, lambda name: connection.send(Hello(building=name)))
        if opening.controller in lineup.left_out:
            raise ValueError(lineup.left_out[opening.controller])
        session = Session(opening, lineup)
        facts = {
            "controllers": list(session.controllers),
            "left_out": lineup.left_out,
            "operators": list(OPERATORS),
            "tasks": list(TASKS),
            "first": go_first(),
            "period": crane.control_period,
            "rail": crane.rail_half_length,
            "cable": [crane.cable_length_min, crane.cable_length_max],
            "speeds": [crane.travel_speed, crane.hoist_speed],
            "acceleration": crane.acceleration_max,
        }
        connection.send(Hello(facts=facts))
    except (ValueError, ImportError) as error:
        connection.send(Hello(failure=str(error)))
        return
    except OSError:
        return  # the parent is gone
    run(connection, session, Pace(crane.control_period))


def run(connection: Connection, session: Session, pace: Pace) -> None:
    """Drives, a control step a tick, until the connection is closed."""
    credit, saved = CREDIT, 0
    buttons, since = None, 0
    try:
        while True:
            now = pace.wait()
            while connection.poll():
                message: Message = connection.recv()
                if isinstance(message, Seen):
                    credit += 1
                    continue
                tick = message.tick if isinstance(message, Hold) else 0
                session.hear(message, pace.time_of(tick), now)
            state = session.step(now)
            if state["buttons"] != buttons:
                buttons, since = state["buttons"], pace.tick
            if credit:
                credit -= 1
                kept = pace.kept
                state["tick"], state["since"] = pace.tick, since
                state["kept"] = [kept.steps, kept.late, round(1000.0 * kept.worst, 1), kept.missed]
                connection.send(State(pace.tick, json.dumps(state)))
            if session.saved[0] != saved:
                saved, text = session.saved
                connection.send(Saved(text))
    except (EOFError, OSError):
        return
