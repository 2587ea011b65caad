"""Opens the cockpit: the crane in a browser, driven by hand.

oilcrane play
oilcrane play --controller manual --task position
"""

from __future__ import annotations

import threading
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass

from baselines.cockpit.access import LOOPBACK, Access
from baselines.cockpit.control.hand import YOU
from baselines.cockpit.control.lineup import CANDIDATES
from baselines.cockpit.control.loop import Hello
from baselines.cockpit.control.session import NO_TASK, TASKS, Opening
from baselines.cockpit.house import CockpitError, bind, keep
from baselines.commands.evaluate import crane_parameters
from baselines.commands.terminal import FailedError, Job, run
from crane_env.operators.registry import make_operator
from crane_env.support.checks import choice, whole

PROGRAM = "oilcrane play"

PORTS = 65536
"""Ports are below this."""

EVERYWHERE = ("", "0.0.0.0", "::", "[::]")
"""Addresses that are all of a machine's."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Opens the cockpit: the crane in a browser, driven by hand.

    Serves one page to this machine alone and moves the crane at 50 Hz until Ctrl-C or SIGTERM. The
    first page gets the pendant, further ones watch.

    Attributes:
        port: of the page; 0 is one that is free.
        host: address of this machine at which the page is reached. Any other than 127.0.0.1 lets
            everybody on that network watch, and drive who knows the key in the address printed.
        browser: whether to open the page.
        controllers: who may drive the trolley besides manual.
        controller: who drives it first; package.module:factory for one of your own.
        operator: who presses first: you, person:trained, table1:3, or any other operator.
        task: what is to be done first: none, position, over-wall, bay or sequence.
        parameters: the crane, as for oilcrane evaluate.
    """

    port: int = 8350
    host: str = "127.0.0.1"
    browser: bool = True
    controllers: tuple[str, ...] = CANDIDATES
    controller: str = "ltv"
    operator: str = YOU
    task: str = NO_TASK
    parameters: str = "paper"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Tries everything that can be wrong, and listens; returns the cockpit.

    Raises:
        ValueError: an option that means nothing, or a value out of range.
        OSError: the address is in use or none of this machine's.
    """
    port = whole("port", options.port, 0, PORTS)
    if options.host in EVERYWHERE:
        raise ValueError(
            "host must be the one address of this machine by which the page is reached, such as "
            f"192.168.1.20, not {options.host!r}, which stands for all."
        )
    if options.operator != YOU:
        make_operator(options.operator)
    opening = Opening(
        parameters=crane_parameters(options.parameters, "parameters"),
        controllers=options.controllers,
        controller=options.controller,
        operator=options.operator,
        task=choice("task", options.task, TASKS),
    )
    listener = bind(options.host, port)
    port = listener.getsockname()[1]
    access = Access.at(options.host, port)
    key = "" if access.key is None else f"?key={access.key}"
    address = f"http://{options.host}:{port}/{key}"
    if options.host not in LOOPBACK:
        print(f"Everybody on the network of {options.host} who knows the address can drive.")
    print(f"The cockpit is at {address} (Ctrl-C ends it).", flush=True)

    def told(hello: Hello) -> None:
        if hello.building is not None:
            print(f"Building {hello.building} ...", flush=True)
        else:
            print("The crane is ready.", flush=True)

    def job() -> None:
        if options.browser:
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
        try:
            keep(listener, access, opening, told)
        except CockpitError as error:
            raise FailedError(str(error)) from error
        finally:
            listener.close()

    return job
