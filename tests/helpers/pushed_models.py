"""Small models whose longest stable step is known, as MJCF text, and plain runs of MuJoCo that judge a step."""

import mujoco
import numpy as np

INERTIA, KP, KV = 0.05, 20.0, 5.0  # kg m2, N m/rad, N m s/rad
# one hinge about an upright axis: gravity does nothing
HINGE = """<mujoco><option timestep="{dt}"/><worldbody><body name="arm">
  <joint name="turn" axis="0 0 1" {joint}/><inertial pos="0 0 0" mass="1" diaginertia="0.05 0.05 0.05"/></body></worldbody>
  <actuator>{actuator}</actuator><keyframe>{keys}</keyframe></mujoco>"""
SPHERE = """<mujoco><default><geom solref="0.02 {dampratio}" solimp="0.9 0.9 0.001"/></default>
  <option timestep="0.004" cone="elliptic" impratio="{impratio}" gravity="{pull} 0 -9.81"><flag refsafe="disable"/></option>
  <worldbody><geom type="plane" size="1 1 1"/><body name="ball" pos="0 0 0.1"><joint name="z" type="slide" axis="0 0 1"/>
  <joint name="x" type="slide" axis="1 0 0" {x}/><geom size="0.1" mass="2" condim="{condim}"/></body></worldbody></mujoco>"""
# a trunk on a vertical slide, a foot on a slide below it, on a floor or above it
LEG = """<mujoco><option timestep="0.002" integrator="{integrator}"/><worldbody>
  <geom name="floor" type="plane" size="1 1 1" condim="1" pos="0 0 {floor}"/>
  <body name="trunk" pos="0 0 0.5"><joint name="lift" type="slide" axis="0 0 1" {lift}/>
    <inertial pos="0 0 0" mass="5" diaginertia="1 1 1"/>
    <body pos="0 0 -0.4"><joint name="leg" type="slide" axis="0 0 1"/><geom name="foot" size="0.1" mass="0.1" condim="1"/>
  </body></body></worldbody><actuator><position joint="leg" kp="2000" kv="20"/></actuator></mujoco>"""
UPRIGHT = """<mujoco><option timestep="0.002"/><worldbody><body pos="0 0 1"><joint name="swing" axis="0 1 0" {}/>
  <geom type="capsule" size="0.02" fromto="0 0 0 0 0 0.5" mass="1"/></body></worldbody>{}</mujoco>"""
BOX = """<mujoco><option timestep="0.002"/><worldbody>{floor}<body name="box" pos="0 0 0.1"><freejoint/>
  <geom type="box" size="0.2 0.2 0.1" mass="2"/></body></worldbody></mujoco>"""
# a ball that moves on a hidden cart, 5 cm from the edge of a shelf
LEDGE = """<mujoco><default><geom condim="1"/></default><worldbody><geom type="box" size="0.5 0.5 0.1" pos="0.45 0 -0.1"/>
  <body pos="0 0 0.05"><joint type="slide" axis="1 0 0" damping="6"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <body><joint type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="0.1" diaginertia="1 1 1"/>
      <body><joint type="slide" axis="1 0 0" damping="6"/><geom size="0.05" mass="1"/></body></body></body>
  </worldbody></mujoco>"""
FLOOR = '<geom type="plane" size="2 2 1"/>'
SERVO = f'<position name="servo" joint="turn" kp="{KP}" kv="{KV}"/>'
LIMIT = (-KV + (KV**2 + 4.0 * INERTIA * KP) ** 0.5) / KP  # s, of Euler with this servo: 17.5 ms


def hinge(actuator=SERVO, dt=0.002, joint="", keys=""):
    return HINGE.format(actuator=actuator, dt=dt, joint=joint, keys=keys)


def sphere(dampratio=1.0, impratio=1.0, pull=0.0, condim=1, x='stiffness="50" damping="50"'):
    return SPHERE.format(dampratio=dampratio, impratio=impratio, pull=pull, condim=condim, x=x)


def leg(integrator="Euler", floor=0.0, lift=""):
    return LEG.format(integrator=integrator, floor=floor, lift=lift)


def compiled(text, dt=None, integrator=None):
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    if dt:
        model.opt.timestep = dt
    if integrator:
        model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    return model


def end_speed(text, dt, integrator, push, seed=7, lasts=4.0, signs=None):
    """The largest speed in the last quarter of a plain run after a push, rad/s or m/s; inf: it diverges.

    signs: of the push of each speed; None: random ones.
    """
    model = compiled(text, dt, integrator)
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qvel[:] += push * np.array(signs or np.sign(rng.normal(size=model.nv)))
    count, speed = round(lasts / dt), 0.0
    for step in range(count):
        mujoco.mj_step(model, data)
        fastest = np.abs(data.qvel).max()
        if not fastest < 100.0:
            return np.inf
        speed = max(speed, fastest) if step >= 3 * count // 4 else 0.0
    return speed


def linear_limit(text, integrator, within=1e-3):
    """The longest step at which mjd_transitionFD has no eigenvalue beyond 1 where the model rests, s."""
    rest = mujoco.MjData(fine := compiled(text, 1e-4, "Euler"))
    for _ in range(40_000):
        mujoco.mj_step(fine, rest)

    def grows(dt):
        model = compiled(text, dt, integrator)
        model.opt.iterations, model.opt.tolerance = 100, 1e-14
        data, A = mujoco.MjData(model), np.zeros((2 * model.nv, 2 * model.nv))
        data.qpos[:] = rest.qpos
        for _ in range(3):
            mujoco.mj_forward(model, data)
        mujoco.mjd_transitionFD(model, data, 1e-6, True, A, None, None, None)
        return np.abs(np.linalg.eigvals(A)).max() > 1.0 + 1e-6

    low, high = 1e-4, 0.2
    while high > low * (1.0 + within):
        middle = (low * high) ** 0.5
        low, high = (low, middle) if grows(middle) else (middle, high)
    return low


def walker(iterations, dt=0.005):
    """A trunk that stands on four servoed legs, with so many iterations of the solver and of its line search."""
    legs = "".join(
        f'<body pos="{x} {y} 0"><joint name="leg{k}" axis="0 1 0" damping="0.5" frictionloss="0.1" armature="0.01"/>'
        '<geom size="0.03" pos="0 0 -0.17" mass="0.2"/></body>'
        for k, (x, y) in enumerate([(-0.2, -0.1), (-0.2, 0.1), (0.2, -0.1), (0.2, 0.1)])
    )
    servos = "".join(f'<position joint="leg{k}" kp="50" kv="1"/>' for k in range(4))
    return (
        f'<mujoco><option timestep="{dt}" integrator="implicitfast" iterations="{iterations}" ls_iterations="{iterations}"/>'
        f'<worldbody>{FLOOR}<body pos="0 0 0.2"><freejoint/><geom type="box" size="0.2 0.1 0.05" mass="3"/>{legs}</body>'
        f"</worldbody><actuator>{servos}</actuator></mujoco>"
    )
