"""Terminal: the exit code says whether anything was started, and one line on standard error why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pytest

from baselines.commands.terminal import FailedError, run


@dataclass(frozen=True)
class Options:
    """Fails.

    Attributes:
        late: after the start.
    """

    late: bool = False


@pytest.mark.parametrize(
    ("error", "early", "late", "said"),
    [
        (ValueError("a is b."), 2, 1, "a is b."),
        (ImportError("no c."), 2, 1, "no c."),
        (OSError(28, "No space left on device", "d"), 2, 1, "'d' cannot be read or written: No s"),
        (FailedError("e failed."), 1, 1, "e failed."),
        (RuntimeError("f"), 1, 1, "RuntimeError: f ("),
        (KeyboardInterrupt("kept"), 130, 130, "interrupted; kept."),
    ],
    ids=lambda value: type(value).__name__,
)
def test_what_goes_wrong_ends_with_2_before_the_start_and_with_1_after_it(
    error: BaseException, early: int, late: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def prepare(options: Options, command: object) -> Callable[[], None]:
        def job() -> None:
            raise error

        if not options.late:
            job()
        return job

    for arguments, code in (([], early), (["--late"], late)):
        assert run("oilcrane fail", Options, prepare, arguments) == code
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(f"oilcrane fail: {said}")
