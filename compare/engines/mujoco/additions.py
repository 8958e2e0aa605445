"""What may be added to a model in MuJoCo, each as an edit of the file's MjSpec."""

from collections.abc import Callable

import mujoco
import numpy as np

from .dynamics import FLAGS, MujocoDynamics
from .engine import Mujoco
from .lock import editable

LEFT_OUT = int(FLAGS["contact"]) | int(FLAGS["constraint"])  # stages of a step that the minimal model leaves out
MINIMAL = "nothing (minimal)"
AGAIN = "nothing, timed again"
CAPSULES = "default flags + capsules"
ON_FLOOR = f"{CAPSULES} + floor in reach"


def with_additions(engine: Mujoco, radius: float, near: float, far: float) -> dict[str, Mujoco]:
    """Engines that have one thing more than the minimal model, the loaded one without contact and constraint stages.

    radius: of the capsules, m; near, far: heights of a floor in reach and of one out of reach, m. No joint of these engines can
    be locked.
    """

    def capsules(spec):
        for body in engine.bodies:
            end = 2.0 * engine.model.body_ipos[body]  # as long again beyond the centre of mass
            shape = {"type": mujoco.mjtGeom.mjGEOM_CAPSULE, "fromto": [0.0] * 3 + list(end)}
            if np.linalg.norm(end) < radius:  # too short for a capsule
                shape = {"type": mujoco.mjtGeom.mjGEOM_SPHERE}
            spec.bodies[body].add_geom(**shape, size=[radius, 0.0, 0.0], mass=0.0)

    def floor(spec, height=far):
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, pos=[0.0, 0.0, height], size=[2.0, 2.0, 0.1])

    def stage(spec, name):
        spec.option.disableflags &= ~int(FLAGS[name])

    def energy(spec):
        spec.option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)

    def sensors(spec):
        for kind in (mujoco.mjtSensor.mjSENS_JOINTPOS, mujoco.mjtSensor.mjSENS_JOINTVEL):
            for joint in engine.joints:
                spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint)

    def motor(spec):
        spec.add_actuator(target=engine.joints[-1], trntype=mujoco.mjtTrn.mjTRN_JOINT)

    def default(spec):
        spec.option.disableflags = spec.option.enableflags = 0

    def default_with(*more):
        return lambda spec: [edit(spec) for edit in (default, *more)]

    many = {1: "a capsule", 2: "two capsules"}.get(len(engine.bodies), f"{len(engine.bodies)} capsules")
    edits = {
        MINIMAL: lambda spec: None,
        AGAIN: lambda spec: None,
        many: capsules,
        "a floor": floor,
        "contact stage": lambda spec: stage(spec, "contact"),
        "constraint stage": lambda spec: stage(spec, "constraint"),
        "energy flag": energy,
        f"{2 * len(engine.joints)} sensors": sensors,
        "a motor": motor,
        "default flags": default,
        CAPSULES: default_with(capsules),
        f"{CAPSULES} + floor out of reach": default_with(capsules, floor),
        ON_FLOOR: default_with(capsules, lambda spec: floor(spec, near)),
    }
    return {name: edited(engine, edit) for name, edit in edits.items()}


def edited(engine: Mujoco, edit: Callable) -> Mujoco:
    """The engine's model from its file, its contact and constraint stages off, with an edit."""
    spec = editable(engine.source)
    spec.option.disableflags |= LEFT_OUT
    edit(spec)
    return Mujoco(spec.compile(), engine.joints, engine.bodies, None)


def contacts(
    dynamics: MujocoDynamics, q: np.ndarray, v: np.ndarray, tau: np.ndarray, dt: float, steps: int, integrator: str
) -> tuple[float, bool]:
    """How many contacts there are in a step of a run, on average, and whether any of them pushes a joint."""
    model, data = dynamics.own_copy(dt, integrator, q, v, tau)
    total, pushed = 0, False
    for _ in range(steps):
        mujoco.mj_step(model, data)
        total += data.ncon
        pushed |= bool(data.ncon and data.qfrc_constraint.any())
    return total / steps, pushed
