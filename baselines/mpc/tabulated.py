"""Tabulated MPC: `adaptive` and `ltv` with costs from tables, the workaround of section VI.

`tabulated` has a table over log(l): in that coordinate an even grid serves all lengths alike.

`tabulated-ltv` needs the cable's rate r as well. Its cost is smooth in l and r while the hoist's
stop is beyond the horizon T_h, and while it is within, but not across; and near a limit the lines
of equal time to the stop t_s fan out from the point where r is 0. Hence four tables, for r < 0 and
r > 0, each in coordinates that make its part of the plane a rectangle:

    running     log of the shortest length over the horizon, and |r|
    stopping    t_s, and |r|

The stopping tables keep an error that no finer grid removes. Whenever one more control step comes
before the stop, one more sample of y has its share l' theta: there the cost of `ltv` jumps.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from baselines.mpc.cost_table import Axis, CostTable, node_cost
from baselines.mpc.linear import (
    LinearMpc,
    QuadraticCost,
    adaptive_cost,
    move_cost,
    time_varying_cost,
)
from baselines.mpc.prediction.cable import assumed_length, hoist_stop_time
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters

RATE_MARGIN = 1.25
"""Fastest cable in the tables over the hoist's speed: the elastic cable bounces."""


@dataclass(frozen=True, kw_only=True)
class LengthGrid:
    """Grid of `tabulated`; docs/tabulated.md shows error against memory.

    Attributes:
        lengths: nodes between the hoist's limits.
        interpolation: "nearest", "linear" or "cubic".
    """

    lengths: int = 48
    interpolation: str = "cubic"


@dataclass(frozen=True, kw_only=True)
class LengthRateGrid:
    """Grids of `tabulated-ltv`; docs/tabulated.md shows error against memory.

    Attributes:
        lengths: nodes of a running table between the hoist's limits.
        stops: nodes of a stopping table between a stop now and one at the end of the horizon.
        rates: nodes of all tables between rest and the fastest hoist.
        interpolation: "nearest", "linear" or "cubic".
    """

    lengths: int = 32
    stops: int = 17
    rates: int = 7
    interpolation: str = "cubic"


class AdaptiveTable:
    """`AdaptiveCost` from a table.

    Args:
        crane: nominal parameters; the table reaches from one limit of the hoist to the other, and
            holds the cost at a limit for lengths beyond.
        settings: the optimal control problem.
        grid: of the table.

    Raises:
        ValueError: too few nodes, or an unknown interpolation.
    """

    def __init__(self, crane: CraneParameters, settings: MpcSettings, grid: LengthGrid) -> None:
        model = adaptive_cost(crane, settings)
        axis = length_axis(crane, grid.lengths)
        nodes = (node_cost(model, math.exp(x), 0.0) for x in axis.points.tolist())
        self._table = CostTable(nodes, (axis,), model.move_cost, grid.interpolation)
        self._length_min = crane.cable_length_min

    @property
    def memory(self) -> int:
        """Size of the table [byte]."""
        return self._table.memory

    def cost(self, observation: Observation) -> QuadraticCost:
        """The cost at this length; see `CostModel`."""
        length = assumed_length(observation, self._length_min)
        return self._table.cost((math.log(length),), observation)


class TimeVaryingTable:
    """`TimeVaryingCost` from tables.

    Args:
        crane: nominal parameters; the tables reach from one limit of the hoist to the other, and up
            to `RATE_MARGIN` times its speed; beyond they hold the cost at their edge.
        settings: the optimal control problem.
        grid: of the tables.

    Raises:
        ValueError: too few nodes, or an unknown interpolation.
        ImportError: numba is not installed; the message names the extra.
    """

    def __init__(self, crane: CraneParameters, settings: MpcSettings, grid: LengthRateGrid) -> None:
        self._horizon = settings.prediction_horizon * crane.control_period
        self._length_min, self._length_max = crane.cable_length_min, crane.cable_length_max
        lengths = length_axis(crane, grid.lengths)
        rates = Axis(0.0, RATE_MARGIN * crane.hoist_speed, grid.rates)
        stops = Axis(0.0, self._horizon, grid.stops)
        weight = move_cost(settings)

        # Limits play no part where the hoist runs on; without them the running tables are smooth in
        # the corners too, which no crane comes to.
        endless = dataclasses.replace(
            crane,
            cable_length_min=0.5 * self._length_min,
            cable_length_max=self._length_max + 2.0 * self._horizon * rates.high,
        )
        running, stopping = time_varying_cost(endless, settings), time_varying_cost(crane, settings)
        self._running: dict[bool, CostTable] = {}
        self._stopping: dict[bool, CostTable] = {}
        for rises, sign, limit in (
            (True, -1.0, self._length_min),
            (False, 1.0, self._length_max),
        ):
            signed_rates = [sign * speed for speed in rates.points.tolist()]
            nodes = (
                node_cost(running, math.exp(x) + self._shortening(rate), rate)
                for x in lengths.points.tolist()
                for rate in signed_rates
            )
            self._running[rises] = CostTable(nodes, (lengths, rates), weight, grid.interpolation)
            nodes = (
                node_cost(stopping, limit - rate * time, rate)
                for time in stops.points.tolist()
                for rate in signed_rates
            )
            self._stopping[rises] = CostTable(nodes, (stops, rates), weight, grid.interpolation)

    @property
    def memory(self) -> int:
        """Size of all tables [byte]."""
        tables = (*self._running.values(), *self._stopping.values())
        return sum(table.memory for table in tables)

    def cost(self, observation: Observation) -> QuadraticCost:
        """The cost at this length and rate; see `CostModel`."""
        length, rate = assumed_length(observation, self._length_min), observation.cable_rate
        rises, speed = rate < 0.0, abs(rate)
        stop_time = hoist_stop_time(length, rate, self._length_min, self._length_max)
        if stop_time < self._horizon:
            return self._stopping[rises].cost((stop_time, speed), observation)
        shortest = length - self._shortening(rate)
        return self._running[rises].cost((math.log(shortest), speed), observation)

    def _shortening(self, cable_rate: float) -> float:
        """How much shorter the cable gets over the horizon, if at all [m]."""
        return max(-cable_rate, 0.0) * self._horizon


def length_axis(crane: CraneParameters, nodes: int) -> Axis:
    """Logarithm of the cable length between the hoist's limits."""
    return Axis(math.log(crane.cable_length_min), math.log(crane.cable_length_max), nodes)


def tabulated(crane: CraneParameters, settings: MpcSettings) -> LinearMpc:
    """`adaptive` with its cost from a table over the cable length."""
    return LinearMpc(crane, settings, AdaptiveTable(crane, settings, LengthGrid()))


def tabulated_ltv(crane: CraneParameters, settings: MpcSettings) -> LinearMpc:
    """`ltv` with its cost from tables over the cable's length and rate."""
    return LinearMpc(crane, settings, TimeVaryingTable(crane, settings, LengthRateGrid()))
