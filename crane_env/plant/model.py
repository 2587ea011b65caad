"""Model: the crane in MuJoCo's terms, from its parameters, and the formulas of cable and drives."""

from __future__ import annotations

from importlib import resources
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray

from crane_env.parameters import CraneParameters
from crane_env.plant.drives import Stroke
from crane_env.plant.rigging import Rigging
from crane_env.plant.start import Start

SETPOINT, DRIVE_ERROR, SWAY, REACH = range(4)
"""Places of the joints among positions and velocities."""

DRUM = -1
"""Place of the drum, behind the slings if there are some."""

JOINTS = ("setpoint", "drive_error", "sway", "reach", "drum")
"""Names of the joints in their order."""

ON_HOOK = ("hook_block",)
"""What is drawn of the payload and belongs to the hook."""

SLACKEST_REACH = 0.3
"""Share of the shortest cable length at which a payload that flies up meets the sheave."""


def build_model(parameters: CraneParameters, rigging: Rigging | None = None) -> mujoco.MjModel:
    """MuJoCo model of the crane with these parameters.

    Args:
        parameters: the crane.
        rigging: below the hook; None: the payload is a point on the cable.

    Raises:
        ValueError: the crane cannot be simulated with this rigging.
    """
    text = (resources.files("crane_env.plant") / "crane.xml").read_text(encoding="utf-8")
    if rigging is not None:
        rigging.check(parameters)
        text = _with_slings(text, rigging)
    model = mujoco.MjModel.from_xml_string(text)
    joints = [model.joint(index).name for index in range(model.njnt)]
    if tuple(name for name in joints if name != "swing") != JOINTS:
        raise RuntimeError(f"crane.xml must declare its joints in the order {JOINTS}.")
    model.opt.timestep = parameters.control_period / parameters.substeps
    model.opt.gravity[2] = -parameters.gravity
    model.body("trolley").mass[0] = parameters.trolley_mass
    rail = model.tendon("rail").id
    model.tendon_damping[rail] = parameters.trolley_friction
    model.tendon_range[rail] = (-parameters.rail_half_length, parameters.rail_half_length)
    shortest, longest = parameters.cable_length_min, parameters.cable_length_max
    model.joint("reach").range = (SLACKEST_REACH * shortest, 2.0 * longest)
    model.joint("sway").damping[0] = parameters.sway_friction
    position_loop, velocity_loop = drive_loops(parameters)
    model.joint("drive_error").stiffness[0] = position_loop
    model.joint("drive_error").damping[0] = velocity_loop
    hang(model.body_mass, model.body_inertia, hook_of(model), parameters.payload_mass, rigging)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def _with_slings(text: str, rigging: Rigging) -> str:
    """The crane's XML with the payload in a body of its own, hinged to the hook."""
    root = ElementTree.fromstring(text)
    hook = root.find(".//body[@name='payload']")
    assert hook is not None, "crane.xml has a payload"
    slung = ElementTree.SubElement(hook, "body", name="slung")
    ElementTree.SubElement(slung, "joint", name="swing", type="hinge", axis="0 -1 0")
    below = f"0 0 {-rigging.offset!r}"
    ElementTree.SubElement(slung, "inertial", pos=below, mass="1", diaginertia="1 1 1")
    for geom in hook.findall("geom"):
        if geom.get("name") not in ON_HOOK:
            hook.remove(geom)
            slung.append(geom)
    for keyframe in root.findall("keyframe"):  # of the joints of a plain crane
        root.remove(keyframe)
    return ElementTree.tostring(root, encoding="unicode")


def hook_of(model: mujoco.MjModel) -> int:
    """Number of the body at the cable's end: the payload, or a hook with the payload after it."""
    return int(model.body("payload").id)


def hang(
    mass: NDArray[np.float64],
    inertia: NDArray[np.float64],
    hook: int,
    payload_mass: float,
    rigging: Rigging | None,
) -> None:
    """Hangs a payload on the cable of a model; its constants are to be worked out anew.

    Args:
        mass: of all bodies [kg], shape (B,).
        inertia: of all bodies [kg m^2], shape (B, 3).
        hook: number of the body at the cable's end.
        payload_mass: with the hook [kg].
        rigging: below the hook.
    """
    if rigging is None:
        mass[hook] = payload_mass
        return
    slung = payload_mass - rigging.hook_mass
    mass[hook], mass[hook + 1] = rigging.hook_mass, slung
    inertia[hook + 1] = slung * rigging.gyration_radius**2


def joints_at(
    start: Start, parameters: CraneParameters, rigging: Rigging | None
) -> tuple[list[float], list[float]]:
    """Positions and velocities of all joints at a start; slings hang in line with the cable.

    Raises:
        ValueError: a value outside its range.
    """
    coordinates = start.coordinates(parameters)
    position, velocity = list(coordinates.position), list(coordinates.velocity)
    if rigging is not None:
        length = rigging.hook_length(parameters, position[REACH])
        position[DRUM] *= length / position[REACH]
        position[REACH] = length
        position.insert(REACH + 1, 0.0)
        velocity.insert(REACH + 1, 0.0)
    return position, velocity


def drive_loops(parameters: CraneParameters) -> tuple[float, float]:
    """Gains of the trolley drive's position loop [N/m] and velocity loop [N s/m]."""
    velocity_loop = parameters.trolley_mass * parameters.drive_bandwidth
    return velocity_loop * parameters.drive_bandwidth / 4.0, velocity_loop


def cable_gains(stiffness: Any, damping: Any, unstretched_length: Any) -> tuple[Any, Any, Any]:
    """Bias of the actuator "cable": 0, -K_l / l_0 and -C_l / l_0; of floats or arrays."""
    return 0.0, -stiffness / unstretched_length, -damping / unstretched_length


def cable_pull(
    stiffness: Any, damping: Any, reach: Any, reach_rate: Any, drum: Any, drum_rate: Any
) -> Any:
    """Tension of the cable [N] before it is cut off at 0, from `cable_gains`; floats or arrays."""
    return stiffness * (drum - reach) + damping * (drum_rate - reach_rate)


def drum_stroke(parameters: CraneParameters) -> Stroke:
    """Unstretched lengths [m] that the hoist's limit switches allow."""
    return Stroke.between(
        parameters.unstretched_length(parameters.cable_length_min),
        parameters.unstretched_length(parameters.cable_length_max),
    )
