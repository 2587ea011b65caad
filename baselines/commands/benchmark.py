"""Benchmark: speed of environment and controllers, as ratios taken in one run.

Machines differ and are noisy, so absolute times say little. What is compared is run in turns,
round after round, on the same states; a ratio is that of the medians over the rounds. `act` times
are medians, 99th percentiles and maxima over states visited in closed loop on Table I.
"""

from __future__ import annotations

import copy
import os
import platform
import sys
import tempfile
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, NamedTuple

import gymnasium
import mujoco
import numpy as np
import rich.box
from mujoco.batch import Batch
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

import crane_env
from baselines import make_controller
from baselines.commands.terminal import (
    FailedError,
    Job,
    check_writable,
    failure_lines,
    run,
    table_console,
)
from baselines.evaluation.comparison import compare
from baselines.evaluation.episode_spec import EpisodeSpec, Setup, episode_specs
from baselines.evaluation.results import ResultsFolder, write_json
from baselines.evaluation.workers import Task, available_cores, perform
from baselines.mpc.controller import PredictiveController
from baselines.mpc.ipopt_form import WARM_BARRIER, IpoptNmpc
from baselines.mpc.linear import LinearMpc
from baselines.mpc.prediction.cable import measured_cable_rate
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.plant.model import build_model
from crane_env.plant.start import AT_REST
from crane_env.support.checks import choice, whole

PROGRAM = "oilcrane benchmark"


@dataclass(frozen=True)
class Timing:
    """Durations of one contestant [s].

    Attributes:
        name: what was timed.
        median: per operation.
        p99: 99th percentile.
        maximum: longest.
        ratio: median over the baseline's median.
        allowed: bound on the ratio that the project promises, as text; empty if none.
        build: time to build the controller [s]; None if nothing was built.
        iterations: solver iterations per solve; None if nothing was solved.
        late: share of durations above the control period; None if it does not apply.
    """

    name: str
    median: float
    p99: float
    maximum: float
    ratio: float
    allowed: str = ""
    build: float | None = None
    iterations: float | None = None
    late: float | None = None


TUNED = "nmpc-b-ipopt, warm barrier"
"""IPOPT told to start close to the optimum; not in the registry, a benchmark only."""

PROMISES = {
    "nmpc-a-ipopt": ">= 40",
    "nmpc-b-ipopt": ">= 40",
    "nmpc-a-do-mpc": ">= 100",
}
"""Bounds on ratios to `nmpc-b` that the project promises."""


def in_turns(
    contestants: dict[str, Callable[[int], object]],
    count: int,
    block: int = 50,
    clock: Callable[[], float] = perf_counter,
) -> dict[str, NDArray[np.float64]]:
    """Times every contestant on the same questions, a block at a time in turns.

    Blocks, not single calls: a contestant then finds the caches as its own calls left them.

    Args:
        contestants: name to what answers question k.
        count: number of questions.
        block: questions per turn.
        clock: gives the time [s].

    Returns:
        Durations [s], shape (count,) each.
    """
    durations = {name: np.empty(count) for name in contestants}
    for contestant in contestants.values():
        contestant(0)
    for start in range(0, count, block):
        for name, contestant in contestants.items():
            for k in range(start, min(start + block, count)):
                begin = clock()
                contestant(k)
                durations[name][k] = clock() - begin
    return durations


def timings(
    durations: dict[str, NDArray[np.float64]], baseline: str, allowed: dict[str, str]
) -> list[Timing]:
    """Summarises durations, with ratios to the baseline's median."""
    unit = float(np.median(durations[baseline]))
    return [
        Timing(
            name=name,
            median=float(np.median(seconds)),
            p99=float(np.percentile(seconds, 99)),
            maximum=float(seconds.max()),
            ratio=float(np.median(seconds)) / unit,
            allowed=allowed.get(name, ""),
        )
        for name, seconds in durations.items()
    ]


def benchmark_environment(rounds: int) -> list[Timing]:
    """One `env.step` against the bare `mj_step` substeps of an equal crane, at two physics steps.

    The unit is that of bare substeps of 2 ms: a longer step makes the physics cheaper, and so the
    environment quicker, though it weighs more against its own physics.
    """
    action = np.array([0.001])
    contestants: dict[str, Callable[[int], object]] = {}
    for label, step in (("2 ms", 0.002), ("default", crane_env.CraneParameters().physics_step)):
        env = gymnasium.make(
            "OILCrane-v0", parameters={"physics_step": step}, max_episode_steps=10**9
        )
        env.reset(seed=0)
        plant = copy.deepcopy(env.unwrapped.plant)  # type: ignore[attr-defined]
        bare = partial(mujoco.mj_step, plant.model, plant.data, nstep=plant.parameters.substeps)
        contestants[f"mj_step, {label}"] = lambda _, bare=bare: bare()  # type: ignore[misc]
        contestants[f"env.step, {label}"] = lambda _, env=env: env.step(action)  # type: ignore[misc]
    durations = in_turns(contestants, 100 * rounds)
    promises = {"env.step, 2 ms": "<= 1.45", "env.step, default": "<= 1.15"}
    return timings(durations, "mj_step, 2 ms", promises)


def closed_loop_episodes() -> list[NDArray[np.float64]]:
    """Observations of the adaptive MPC on the ten manoeuvres of Table I, shape (1250, 8) each."""
    seen = []
    for number in range(1, 11):
        env = gymnasium.make("OILCrane-v0", operator=f"table1:{number}")
        record = crane_env.run_episode(env, make_controller("adaptive"), seed=number)
        columns = record.columns()
        seen.append(np.stack([columns[name] for name in crane_env.Observation._fields], axis=1))
    return seen


def closed_loop_states(count: int) -> NDArray[np.float64]:
    """States visited on Table I, spread evenly, shape (count, 8)."""
    states = np.concatenate(closed_loop_episodes())
    spread: NDArray[np.float64] = states[np.linspace(0, len(states) - 1, count).astype(int)]
    return spread


def benchmark_linear(rounds: int) -> list[Timing]:
    """The adaptive MPC against its CVXPY statement and against a bare DAQP solve of its QP."""
    states = closed_loop_states(20 * rounds)
    adaptive = make_controller("adaptive")
    statement = make_controller("adaptive-cvxpy")
    linear = make_controller("linear")
    assert isinstance(adaptive, LinearMpc)
    observations = map(crane_env.Observation.of, states)
    questions = [adaptive.quadratic_program(observation) for observation in observations]
    import daqp

    kinds = np.zeros(len(questions[0][2]), dtype=np.intc)

    def bare(k: int) -> object:
        hessian, gradient, lower, upper = questions[k]
        matrix = adaptive.limits.velocity_gain
        return daqp.solve(hessian, gradient, matrix, upper, lower, kinds)

    contestants: dict[str, Callable[[int], object]] = {
        "adaptive": lambda k: adaptive.act(states[k]),
        "linear": lambda k: linear.act(states[k]),
        "bare DAQP": bare,
        "adaptive-cvxpy": lambda k: statement.act(states[k]),
    }
    durations = in_turns(contestants, len(states))
    return timings(durations, "adaptive", {"bare DAQP": ">= 1/6", "adaptive-cvxpy": ">= 30"})


SOLVERS = (
    "adaptive",
    "tabulated",
    "ltv",
    "tabulated-ltv",
    "nmpc-a",
    "nmpc-b",
    "nmpc-a-rti",
    "nmpc-b-rti",
    "adaptive-cvxpy",
    "nmpc-a-ipopt",
    "nmpc-b-ipopt",
    TUNED,
    "nmpc-a-do-mpc",
)
"""Controllers of the section "solvers", quick ones first."""

PEERS = {"nmpc-a-do-mpc"}
"""Left out, and said so, where their package is not installed."""


def benchmark_solvers(rounds: int) -> list[Timing]:
    """Every predictive controller on the same closed-loop states, with a fresh warm start each.

    The states are stretches of 50 consecutive control steps, so that a controller finds its own
    plan of the step before, as in closed loop.
    """
    stretch = 50
    states = closed_loop_stretches(rounds, stretch)
    controllers: dict[str, Controller] = {}
    build_times: dict[str, float] = {}
    for name in SOLVERS:
        begin = perf_counter()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # peers warn of what they lack
                controllers[name] = build(name)
        except ImportError as error:
            if name not in PEERS:
                raise
            print(f"{name} is left out: {error}", file=sys.stderr)
            continue
        build_times[name] = perf_counter() - begin

    def answer(controller: Controller) -> Callable[[int], object]:
        return lambda k: controller.act(states[k])

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        durations = in_turns(
            {name: answer(controller) for name, controller in controllers.items()},
            len(states),
            stretch,
        )
    rows = timings(durations, "nmpc-b", PROMISES)
    period = crane_env.CraneParameters().control_period
    return [
        replace(
            row,
            build=build_times[row.name],
            iterations=iterations_per_solve(controllers[row.name]),
            late=float(np.mean(durations[row.name] > period)),
        )
        for row in rows
    ]


def build(name: str) -> Controller:
    """A controller by its name; `TUNED` is the IPOPT reference with a warm barrier."""
    if name != TUNED:
        return make_controller(name)
    return IpoptNmpc(
        crane_env.CraneParameters(),
        MpcSettings(),
        measured_cable_rate,
        ipopt_options=WARM_BARRIER,
    )


def iterations_per_solve(controller: Controller) -> float:
    """Mean number of solver iterations."""
    assert isinstance(controller, PredictiveController)
    statistics = controller.statistics
    return statistics.iterations / max(statistics.solves, 1)


def closed_loop_stretches(count: int, length: int) -> NDArray[np.float64]:
    """`count` stretches of `length` consecutive states on Table I, shape (count * length, 8)."""
    episodes = closed_loop_episodes()
    rng = np.random.default_rng(0)
    stretches = []
    for k in range(count):
        episode = episodes[k % len(episodes)]
        first = int(rng.integers(len(episode) - length))
        stretches.append(episode[first : first + length])
    return np.concatenate(stretches)


def resident_memory() -> int:
    """Memory of this process that is in use [byte]; 0 where the system does not tell."""
    status = Path("/proc/self/statm")
    if not status.exists():
        return 0
    return int(status.read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")


STEADY = 10
"""After so many episodes of an evaluation all its workers run."""

TURNS = 3
"""So often an evaluation by one process and one by two take turns."""


def benchmark_evaluate(rounds: int) -> list[Timing]:
    """An episode of `adaptive` in an evaluation, kept on the disk, against it played bare.

    What an evaluation adds is counted in processor time, episode by episode in turns, and once for
    the whole of it with the start of its workers: on a busy machine the wall clock tells of its
    other users. That two workers are quicker than one only the wall clock tells, in turns too.

    Raises:
        FailedError: an episode failed, as all do when the code is edited meanwhile.
    """
    many = episode_specs(["adaptive"], ["random"], range(15 * rounds + STEADY), Setup())
    specs = many[: 2 * rounds + STEADY + 2]
    env, controller = gymnasium.make("OILCrane-v0"), make_controller("adaptive")
    with tempfile.TemporaryDirectory() as name:
        folder = ResultsFolder(Path(name))
        folder.prepare()
        tasks = [Task(spec, spec.key, folder.path, "trajectories") for spec in specs]
        processor = in_turns(
            {
                "run_episode": lambda k: crane_env.run_episode(env, controller, seed=k),
                "an episode of evaluate": lambda k: perform(tasks[k]),
            },
            len(specs),
            block=1,
            clock=process_time,
        )
    turns = [(jobs, evaluation(specs, jobs)) for _ in range(TURNS) for jobs in (1, 2)]
    wall = {
        f"evaluate, jobs {jobs}": np.concatenate(
            [run.pace for number, run in turns if number == jobs]
        )
        for jobs in (1, 2)
    }
    bare, kept = timings(processor, "run_episode", {"an episode of evaluate": "<= 1.05"})
    paired = np.median(processor[kept.name] / processor[bare.name])  # each pair in the same weather
    whole = evaluation(many, 2).processor_time / len(many)
    ratio = whole / float(np.mean(processor[bare.name]))
    return [
        bare,
        replace(kept, ratio=float(paired)),
        Timing(f"{len(many)} episodes from start to end", whole, whole, whole, ratio, "<= 1.05"),
        *timings(wall, "evaluate, jobs 1", {"evaluate, jobs 2": "<= 1/1.8"}),
    ]


class Evaluation(NamedTuple):
    """What an evaluation took.

    Attributes:
        pace: time from one episode to the next but one, halved, once all workers run [s].
        processor_time: of this process and its workers, their start included [s].
    """

    pace: NDArray[np.float64]
    processor_time: float


def evaluation(specs: Sequence[EpisodeSpec], jobs: int) -> Evaluation:
    """Plays and keeps episodes by so many processes.

    Raises:
        FailedError: an episode failed.
    """
    ends: list[float] = []
    with tempfile.TemporaryDirectory() as name:
        folder = ResultsFolder(Path(name))
        before = os.times()
        results = compare(specs, folder, jobs=jobs, on_result=lambda _: ends.append(perf_counter()))
        after = os.times()
    if failures := failure_lines(results):
        raise FailedError(*failures)
    steady = np.array(ends[STEADY:])
    return Evaluation((steady[2:] - steady[:-2]) / 2.0, sum(after[:4]) - sum(before[:4]))


VECTOR_SIZE = 1024
"""Cranes of the section "vector"."""


def benchmark_vector(rounds: int) -> list[Timing]:
    """One crane's step among 1,024, against the bare batch and Gymnasium's AsyncVectorEnv.

    All use all cores. The asynchronous environments are as many as are quickest per crane on few
    cores; more cost the same per crane.
    """
    parameters = crane_env.CraneParameters()
    cores = available_cores()
    batch = Batch(build_model(parameters), VECTOR_SIZE, cores)
    batch.bind("qpos")[:] = AT_REST.coordinates(parameters).position
    batch.forward()
    action = np.random.default_rng(0).uniform(-0.1, 0.1, (VECTOR_SIZE, 1))
    before = resident_memory()
    native = gymnasium.make_vec("OILCrane-v0", num_envs=VECTOR_SIZE, threads=cores)
    native.reset(seed=0)
    native.step(action)
    print(f"make_vec takes {(resident_memory() - before) / VECTOR_SIZE / 1e3:.1f} kB a crane.")
    count = 8 * cores
    processes = gymnasium.make_vec("OILCrane-v0", num_envs=count, vectorization_mode="async")
    processes.reset(seed=0)
    contestants: dict[str, Callable[[int], object]] = {
        "mujoco.batch": lambda _: batch.step(None, parameters.substeps),
        "make_vec": lambda _: native.step(action),
        "AsyncVectorEnv": lambda _: processes.step(action[:count]),
    }
    cranes = {"mujoco.batch": VECTOR_SIZE, "make_vec": VECTOR_SIZE, "AsyncVectorEnv": count}
    durations = in_turns(contestants, 5 * rounds, block=5)
    processes.close()
    per_crane = {name: seconds / cranes[name] for name, seconds in durations.items()}
    promises = {"make_vec": "<= 1.25", "AsyncVectorEnv": ">= 4 make_vec"}
    return timings(per_crane, "mujoco.batch", promises)


SECTIONS: dict[str, Callable[[int], list[Timing]]] = {
    "environment": benchmark_environment,
    "linear": benchmark_linear,
    "solvers": benchmark_solvers,
    "vector": benchmark_vector,
    "evaluate": benchmark_evaluate,
}


def show(title: str, rows: Sequence[Timing], console: Console) -> None:
    """Prints one section as a table."""
    table = Table(title=title, title_justify="left", box=rich.box.SIMPLE)
    solved = any(row.build is not None for row in rows)
    headings = ["", "median [us]", "p99 [us]", "max [us]", "ratio", "promised"]
    headings += ["build [s]", "iterations", "> 20 ms"] if solved else []
    for heading in headings:
        table.add_column(heading, justify="right" if heading else "left", no_wrap=True)
    for row in rows:
        times = (f"{1e6 * t:.1f}" for t in (row.median, row.p99, row.maximum))
        cells = [row.name, *times, f"{row.ratio:.3g}", row.allowed]
        if row.build is not None:
            cells += [f"{row.build:.2f}", f"{row.iterations:.1f}", f"{row.late:.1%}"]
        table.add_row(*cells)
    console.print(table)


@dataclass(frozen=True, kw_only=True)
class Options:
    """Measures the speed of environment and controllers, as ratios taken in one run.

    Attributes:
        sections: which to run, of environment, linear, solvers, vector and evaluate.
        rounds: more rounds, steadier medians.
        output: write the results to this JSON file too.
    """

    sections: tuple[str, ...] = tuple(SECTIONS)
    rounds: int = 20
    output: Path | None = None


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Tries what can be wrong; returns the measurement.

    Raises:
        ValueError: an unknown section, or a number of rounds below 1.
        OSError: a file that cannot be written.
    """
    for name in options.sections:
        choice("section", name, SECTIONS)
    whole("rounds", options.rounds, least=1)
    if options.output is not None:
        check_writable("output", options.output)
    return partial(measure, options)


def measure(options: Options) -> None:
    """Runs the sections, prints their tables and writes their numbers."""
    console = table_console()
    console.print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores")
    results: dict[str, Any] = {}
    for name in options.sections:
        rows = SECTIONS[name](options.rounds)
        results[name] = [asdict(row) for row in rows]
        if options.output is not None:  # before the table, which may have nowhere to go
            write_json(options.output, results)
        show(name, rows, console)
