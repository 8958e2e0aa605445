"""What may be added to a model in MuJoCo, each as an edit of the file's MjSpec."""

import mujoco

from .engine import FLAGS, INTEGRATORS, Engine
from .engine_lock import read

STAGES = int(FLAGS["contact"]) | int(FLAGS["constraint"])  # of a step, that the minimal model leaves out
RADIUS = 0.03  # m, of the capsules
FAR, NEAR = -2.0, -0.4  # m, height of a floor that the arm cannot reach, and of one that it falls on
NOTHING = "nothing (minimal)"
AGAIN = "nothing, timed again"
CONTACT = "default flags + capsules + floor in reach"


def with_additions(engine) -> dict:
    """Engines that have one thing more than the minimal model, the loaded one without contact and constraint stages."""

    def capsules(spec):
        for body in engine.bodies:
            ends = [0.0] * 3 + list(2.0 * engine.model.body_ipos[body])  # as long again beyond the centre of mass
            spec.bodies[body].add_geom(
                type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=ends, size=[RADIUS, 0.0, 0.0], mass=0.0
            )

    def floor(spec, height=FAR):
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, pos=[0.0, 0.0, height], size=[2.0, 2.0, 0.1])

    def stage(spec, name):
        spec.option.disableflags &= ~int(FLAGS[name])

    def energy(spec):
        spec.option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)

    def sensors(spec):
        for kind in (mujoco.mjtSensor.mjSENS_JOINTPOS, mujoco.mjtSensor.mjSENS_JOINTVEL):
            for hinge in engine.hinges:
                spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=hinge)

    def motor(spec):
        spec.add_actuator(target=engine.hinges[-1], trntype=mujoco.mjtTrn.mjTRN_JOINT)

    def default(spec):
        spec.option.disableflags = spec.option.enableflags = 0

    def default_with(*more):
        return lambda spec: [edit(spec) for edit in (default, *more)]

    edits = {
        NOTHING: lambda spec: None,
        AGAIN: lambda spec: None,
        "two capsules": capsules,
        "a floor": floor,
        "contact stage": lambda spec: stage(spec, "contact"),
        "constraint stage": lambda spec: stage(spec, "constraint"),
        "energy flag": energy,
        f"{2 * len(engine.hinges)} sensors": sensors,
        "a motor": motor,
        "default flags": default,
        "default flags + capsules": default_with(capsules),
        "default flags + capsules + floor out of reach": default_with(capsules, floor),
        CONTACT: default_with(capsules, lambda spec: floor(spec, NEAR)),
    }
    return {name: edited(engine, edit) for name, edit in edits.items()}


def edited(engine, edit) -> Engine:
    """The engine's model from its file, its contact and constraint stages off, with an edit."""
    spec = read(engine.source)
    spec.option.disableflags |= STAGES
    edit(spec)
    return Engine(spec.compile(), engine.hinges, engine.carriers, engine.source)


def contacts(engine, q, qd, tau, dt, steps, integrator) -> float:
    """How many contacts there are in a step of a run, on average."""
    model, data = mujoco.MjModel.__copy__(engine.model), mujoco.MjData(engine.model)
    model.opt.timestep, model.opt.integrator = dt, INTEGRATORS[integrator]
    data.qpos[engine.qpos], data.qvel[engine.dofs], data.qfrc_applied[engine.dofs] = q, qd, tau
    total = 0
    for _ in range(steps):
        mujoco.mj_step(model, data)
        total += data.ncon
    return total / steps
