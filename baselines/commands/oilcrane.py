"""Oilcrane: the program that finds each command by its name, and needs no extra itself.

oilcrane --help
oilcrane evaluate --help
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module

from baselines.commands.terminal import ended, interruptible, sentence
from crane_env.support.checks import choice
from crane_env.support.extras import missing

PROGRAM = "oilcrane"


@dataclass(frozen=True)
class Command:
    """One of the program's commands.

    Attributes:
        module: whose `main` it is, in this package.
        extras: of the distribution that bring the packages it needs.
        help: what it does, in a line.
    """

    module: str
    extras: str
    help: str


COMMANDS = {
    "evaluate": Command(
        "evaluate", "mpc,results", "drives controllers through manoeuvres and compares them"
    ),
    "reproduce": Command("reproduce", "mpc,results", "puts the paper to the test"),
    "play": Command("play", "mpc,results,play", "opens the crane in a browser, driven by hand"),
    "study": Command(
        "study", "mpc,results", "lets persons bring payloads to places with every controller"
    ),
    "leaderboard": Command(
        "rating.leaderboard",
        "mpc,policies,results",
        "ranks controllers in classes of equal sway, against the limits of these classes",
    ),
    "limit": Command(
        "rating.limit", "mpc,results", "computes how small the IAE of any policy can be, in classes"
    ),
    "scorecard": Command(
        "rating.scorecard", "mpc,results", "shows which controller survives which imperfection"
    ),
    "tune": Command(
        "rating.tune", "mpc,results,tune", "tunes every controller with the same budget"
    ),
    "train": Command("train", "results,rl", "trains a reinforcement learner, or exports one"),
    "compare-learners": Command(
        "compare_learners", "mpc,policies,results", "compares reinforcement learning with the MPCs"
    ),
    "table-memory": Command(
        "table_memory", "mpc,results", "measures tabulated controllers: error against memory"
    ),
    "film": Command(
        "film", "film,mpc,results", "films one controller, or two side by side, with one operator"
    ),
    "benchmark": Command("benchmark", "mpc,results", "measures speed, as ratios taken in one run"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command that the first argument names and returns its exit code."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    if not given or given[0] in ("-h", "--help"):
        try:
            print(overview(), file=sys.stdout if given else sys.stderr, flush=True)
        except OSError as error:
            return ended(PROGRAM, 1, sentence(error))
        return 0 if given else 2
    try:
        return run_command(choice("command", given[0], COMMANDS), given[1:])
    except ValueError as error:
        return ended(PROGRAM, 2, str(error))


def run_command(name: str, arguments: Sequence[str] | None = None) -> int:
    """Runs a command and returns its exit code.

    Args:
        name: of the command.
        arguments: its options; None: those of this process.
    """
    command, program = COMMANDS[name], f"{PROGRAM} {name}"
    with interruptible():
        try:
            module = import_module(f"baselines.commands.{command.module}")
        except KeyboardInterrupt:
            return ended(program, 130, "interrupted.")
        except ImportError as error:
            return ended(program, 2, missing(error.name or str(error), command.extras))
        code: int = module.main(arguments)
    return code


def overview() -> str:
    """What `oilcrane --help` says."""
    rows = [(name, f"[{command.extras}]", command.help) for name, command in COMMANDS.items()]
    names, extras = (max(len(row[column]) for row in rows) for column in (0, 1))
    lines = (f"  {name:{names}}  {extra:{extras}}  {text}" for name, extra, text in rows)
    return "\n".join(
        (
            f"usage: {PROGRAM} COMMAND [OPTION ...]",
            "",
            "Operator-in-the-loop overhead cranes: evaluate, reproduce, train, measure.",
            "",
            *lines,
            "",
            f"In brackets the extras that a command needs: pip install '{PROGRAM}[mpc,results]'.",
            f"The options of a command: {PROGRAM} COMMAND --help.",
        )
    )
