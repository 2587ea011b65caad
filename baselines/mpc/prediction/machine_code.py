"""Machine code: functions of a horizon and a start, compiled by numba.

The first call of a process compiles for seconds or loads what an earlier process compiled.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import sys
from collections.abc import Callable
from typing import Any, TypeVar, cast

from baselines.mpc.prediction.problem import Horizon, Start
from crane_env.support.extras import require

_First = TypeVar("_First")
_Result = TypeVar("_Result")


@functools.cache
def machine_code(
    function: Callable[[_First, Horizon, Start], _Result], *calls: Callable[..., Any]
) -> Callable[..., _Result]:
    """A function as machine code, for arguments (first, *horizon, *start).

    Numbers, because numba unpacks them faster than named tuples.

    Args:
        function: what to compile, in plain arithmetic on numbers and arrays.
        calls: the functions of this project that it calls, directly or not.

    Raises:
        ImportError: numba is not installed; the message names the extra.
    """
    for part in (*calls, function):
        _register(part)
    # numba looks for changes only in this file and in the values that `evaluate` encloses: without
    # the digest it would load machine code of what the functions have been.
    modules = sorted({part.__module__ for part in (*calls, function, Horizon, Start)})
    sources = (inspect.getsource(sys.modules[name]) for name in modules)
    digest = hashlib.sha256("".join(sources).encode()).digest()
    split = len(Horizon._fields)

    def evaluate(first: _First, *numbers: Any) -> _Result:
        _ = digest
        return function(first, Horizon(*numbers[:split]), Start(*numbers[split:]))

    jit = require("numba", extra="mpc").njit
    try:
        return cast("Callable[..., _Result]", jit(cache=True, error_model="numpy")(evaluate))
    except RuntimeError:  # "cannot cache function: no locator available": no folder to write to
        return cast("Callable[..., _Result]", jit(error_model="numpy")(evaluate))


@functools.cache
def _register(function: Callable[..., Any]) -> None:
    """Lets compiled functions call this one."""
    require("numba.extending", extra="mpc").register_jitable(error_model="numpy")(function)
