"""Policy network: features of an observation, and an actor that is a learned gain schedule.

A crane has no preferred direction: mirrored, an observation asks for the mirrored action. Four
features change sign in the mirror,

    z = (2 (w - s'), 2 l sin(theta), 2 (l theta' cos(theta) + l' sin(theta)), w)

the gap between reference and trolley velocity, the payload's displacement and its velocity relative
to the trolley, and the reference. Three do not, h: the cable length, centred and scaled, and the
measured and commanded cable rates; nor do the ten products of two of z. The trolley's position is
left out: eq. (6) does not know it either. One network finds gains, another the value,

    action = K_1(l) z_1 + K_2(l) z_2 + K_3(l) z_3        value = V(h, products)

so that policy and value are mirror-symmetric whatever has been learned, and a payload that hangs
still under a trolley that moves as the operator asks is left alone. The policy is a feedback whose
gains follow the cable length, as practice schedules them, and as the optimum of eq. (6) under
Assumption A does while no limit is active. Gains that may also depend on z are worse: a squared
error hardly feels what they are where z is small, and the payload creeps.

Importing this module needs the extra "rl".
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from crane_env.observation import Observation
from crane_env.support.extras import require

if TYPE_CHECKING:
    import torch
    from stable_baselines3.common.policies import ActorCriticPolicy
    from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
    from torch import nn
else:
    torch = require("torch", extra="rl")
    nn = torch.nn
    ActorCriticPolicy = require("stable_baselines3.common.policies", extra="rl").ActorCriticPolicy
    BaseFeaturesExtractor = require(
        "stable_baselines3.common.torch_layers", extra="rl"
    ).BaseFeaturesExtractor

ODD = 4
"""Features that change sign in the mirror."""

ANSWERED = 3
"""The first of them, which the actor weighs; the reference alone calls for nothing."""

PRODUCTS = tuple((i, j) for i in range(ODD) for j in range(i, ODD))
"""Pairs of odd features whose products are even features."""

HOIST = 3
"""Features of cable length and rates."""

SCHEDULED = 1
"""The first of them, which the gains follow."""

EVEN = HOIST + len(PRODUCTS)
"""Features that do not change sign in the mirror."""

LENGTH_CENTRE = 6.0
LENGTH_SPREAD = 3.0
"""The cable length's feature is (l - centre) / spread [m]."""

GAIN = 2.0
"""Scale of velocities [s/m] and displacements [1/m], to bring them to the order of 1."""

SWAY_ANGLE = Observation._fields.index("sway_angle")

WIDTH = 64
"""Units of each of the two hidden layers."""


class CraneFeatures(BaseFeaturesExtractor):
    """Features of observations: `ODD` odd ones, then `EVEN` even ones."""

    def __init__(self, observation_space: Any) -> None:
        super().__init__(observation_space, ODD + EVEN)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Features, shape (N, 17), of observations, shape (N, 8)."""
        columns: Any = observations.unbind(dim=1)
        seen = Observation(*columns)
        sine, cosine = torch.sin(columns[SWAY_ANGLE]), torch.cos(columns[SWAY_ANGLE])
        odd = (
            GAIN * (seen.travel_reference - seen.trolley_velocity),
            GAIN * seen.cable_length * sine,
            GAIN * (seen.cable_length * seen.sway_rate * cosine + seen.cable_rate * sine),
            seen.travel_reference,
        )
        even = (
            (seen.cable_length - LENGTH_CENTRE) / LENGTH_SPREAD,
            seen.cable_rate,
            seen.hoist_reference,
            *(odd[i] * odd[j] for i, j in PRODUCTS),
        )
        return torch.stack((*odd, *even), dim=1)  # type: ignore[arg-type]


class GainSchedule(nn.Module):
    """Networks of the actor, whose output is K_i z_i, and of the critic's hidden layers.

    Stable-Baselines3 puts a linear layer behind each: the policy's sums the K_i z_i.
    """

    def __init__(self, activation: type[nn.Module]) -> None:
        super().__init__()
        self.latent_dim_pi = ANSWERED
        self.latent_dim_vf = WIDTH
        self.gains = nn.Sequential(*_hidden(SCHEDULED, activation), nn.Linear(WIDTH, ANSWERED))
        self.critic = nn.Sequential(*_hidden(EVEN, activation))

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Latent vectors of policy and value."""
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """K_i z_i, shape (N, 3)."""
        gains: torch.Tensor = self.gains(features[:, ODD : ODD + SCHEDULED])
        return gains * features[:, :ANSWERED]

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        """Last hidden layer of the value, shape (N, 64)."""
        latent: torch.Tensor = self.critic(features[:, ODD:])
        return latent


class GainScheduledPolicy(ActorCriticPolicy):
    """Actor and critic of a mirror-symmetric policy, for the on-policy algorithms.

    The gains begin at zero: a trolley driven by random gains ends at the rail's buffers, and what
    it earns there drowns everything else. The exploration does not shrink: eq. (6) charges for it
    at once and repays it never, so that left to itself it dies out before the gains are right.
    """

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = GainSchedule(self.activation_fn)  # type: ignore[assignment]

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        total: Any = self.action_net
        total.weight.data.fill_(1.0)
        total.weight.requires_grad_(False)
        total.bias.requires_grad_(False)
        self.log_std.requires_grad_(False)
        last: Any = self.mlp_extractor.gains[-1]  # type: ignore[index]
        last.weight.data.zero_()
        last.bias.data.zero_()


def _hidden(inputs: int, activation: type[nn.Module]) -> tuple[nn.Module, ...]:
    return nn.Linear(inputs, WIDTH), activation(), nn.Linear(WIDTH, WIDTH), activation()
