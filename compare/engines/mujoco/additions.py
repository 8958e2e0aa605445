"""Additions to a model, each an edit of the file's MjSpec, whose cost in MuJoCo an experiment measures."""

from collections.abc import Callable

import mujoco
import numpy as np

from .dynamics import MujocoDynamics
from .engine import Mujoco
from .inventory import take_away
from .names import bit, joint_name, kind_of
from .source import clear, editable_again, with_names, without_geoms

LEFT_OUT = bit("CONTACT", "CONSTRAINT")  # stages of a step that the minimal model leaves out
OF_THE_FORCES = bit("GRAVITY", "DAMPER", "SPRING")  # of the file, see take_away
# what the file's default class would give to an added element otherwise, where the installed MuJoCo has it
ITS_OWN = {
    "geom": {
        "contype": 1,
        "conaffinity": 1,
        "margin": 0.0,
        "gap": 0.0,
        "pos": [0.0] * 3,
        "quat": [1.0, 0.0, 0.0, 0.0],
    },
    "motor": {
        "ctrllimited": mujoco.mjtLimited.mjLIMITED_FALSE,
        "forcelimited": mujoco.mjtLimited.mjLIMITED_FALSE,
        "gear": [1.0] + [0.0] * 5,
        "armature": 0.0,
    },
}
MINIMAL = "nothing (minimal)"
AGAIN = "nothing, timed again"
CAPSULES = "default flags + capsules"
ON_FLOOR, OFF_FLOOR = f"{CAPSULES} + floor in reach", f"{CAPSULES} + floor out of reach"


def with_additions(engine: Mujoco, radius: float, near: float, far: float | None) -> dict[str, Mujoco]:
    """Engines with one addition each to the minimal model, the loaded one without contact and constraint stages.

    radius: of the capsules, m; near, far: heights of a floor in reach and of one out of reach, m; None: no
    floor is out of reach. No joint of these engines can be locked.
    """
    model = engine.model
    kinds = {joint_name(model, j): kind_of(model, j) for j in range(model.njnt)}
    single = [name for name in engine.joints if kinds.get(name) in ("hinge", "slide")]  # with one number, for a sensor
    last = next(reversed(single), next(reversed(kinds)))

    def capsules(spec):
        for body in engine.bodies:
            end = 2.0 * engine.model.body_ipos[body]  # as long again beyond the centre of mass
            shape = {"type": mujoco.mjtGeom.mjGEOM_CAPSULE, "fromto": [0.0] * 3 + list(end)}
            if np.linalg.norm(end) < radius:  # too short for a capsule
                shape = {"type": mujoco.mjtGeom.mjGEOM_SPHERE}
            spec.bodies[body].add_geom(**ITS_OWN["geom"] | shape, size=[radius, 0.0, 0.0], mass=0.0)

    def floor(spec, height=near if far is None else far):
        plane = {"type": mujoco.mjtGeom.mjGEOM_PLANE, "pos": [0.0, 0.0, height], "size": [2.0, 2.0, 0.1]}
        spec.worldbody.add_geom(**ITS_OWN["geom"] | plane)

    def stage(spec, name):
        spec.option.disableflags &= ~bit(name)

    def energy(spec):
        spec.option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)

    def sensors(spec):
        for kind in (mujoco.mjtSensor.mjSENS_JOINTPOS, mujoco.mjtSensor.mjSENS_JOINTVEL):
            for joint in single:
                spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint)

    def motor(spec):
        added = spec.add_actuator(target=last, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        added.set_to_motor()  # a default class of the file may have made it a servo, which pushes
        for name, value in ITS_OWN["motor"].items():
            if hasattr(added, name):
                setattr(added, name, value)

    def default(spec):
        spec.option.disableflags &= OF_THE_FORCES if engine.bare else 0  # which are then taken away, as they were
        spec.option.enableflags = 0

    def default_with(*more):
        return lambda spec: [edit(spec) for edit in (default, *more)]

    many = {1: "a capsule", 2: "two capsules"}.get(len(engine.bodies), f"{len(engine.bodies)} capsules")
    edits = {
        MINIMAL: lambda spec: None,
        AGAIN: lambda spec: None,
        many: capsules,
        "a floor": floor,
        "contact stage": lambda spec: stage(spec, "CONTACT"),
        "constraint stage": lambda spec: stage(spec, "CONSTRAINT"),
        "energy flag": energy,
        f"{2 * len(single)} sensors": sensors,
        "a motor": motor,
        "default flags": default,
        CAPSULES: default_with(capsules),
        **({} if far is None else {OFF_FLOOR: default_with(capsules, floor)}),
        ON_FLOOR: default_with(capsules, lambda spec: floor(spec, near)),
    }
    return {name: edited(engine, edit) for name, edit in edits.items()}


def edited(engine: Mujoco, edit: Callable) -> Mujoco:
    """The engine's model from its file, its contact and constraint stages off, with an edit."""
    spec = editable_again(engine.source)
    bare(without_geoms(spec)) if engine.bare else with_names(spec)
    spec.option.disableflags |= LEFT_OUT
    edit(spec)
    model = spec.compile()
    if engine.bare:
        take_away(model)
    return Mujoco(model, engine.joints, engine.bodies, None)


def bare(spec: mujoco.MjSpec) -> None:
    """Take out of a spec what a Tree does not have: nothing of the file may touch, act, or limit a joint."""
    with_names(spec)
    clear(spec, set(), bare=True)
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
    for joint in spec.joints:
        joint.limited, joint.frictionloss = mujoco.mjtLimited.mjLIMITED_FALSE, 0.0
    for actuator in spec.actuators:  # whose armature counts
        actuator.gainprm[:], actuator.biasprm[:] = 0.0, 0.0


def contacts(
    dynamics: MujocoDynamics, q: np.ndarray, v: np.ndarray, tau: np.ndarray, dt: float, steps: int, integrator: str
) -> tuple[float, bool]:
    """The mean number of contacts in a step of a run, and whether any of them pushes a joint."""
    model, data = dynamics.own_copy(dt, integrator, q, v, tau)
    total, pushed = 0, False
    for _ in range(steps):
        mujoco.mj_step(model, data)
        total += data.ncon
        pushed |= bool(data.ncon and data.qfrc_constraint.any())
    return total / steps, pushed
