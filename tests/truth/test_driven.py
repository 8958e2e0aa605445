"""Limits of robots under their own servos beside the derivatives of MuJoCo's own steps."""

from functools import lru_cache

import numpy as np
import pytest
from driven_models import with_servos
from servo_models import posture_of

from compare.engines.mujoco.names import INTEGRATORS
from compare.experiments.stability.servos.predicted import acting_at

STEPPED = [name for name in INTEGRATORS if name != "RK4"]  # whose step MuJoCo differentiates
LINEAR = {"discrete": 1e-3}  # what the map of a step may differ by; of the others 1e-8: central differences
NOISE = 2e-4  # of a spectral radius of 1 in differences: a free base has it twice
at = lru_cache(maxsize=128)(posture_of)

ONE = """<mujoco><option gravity="0 0 {gravity}"/><worldbody><body><joint name="a" {joint}/>
<geom size="0.1" mass="1" pos="0.3 0 0"/></body></worldbody><actuator>{actuators}</actuator></mujoco>"""
# a body that flies, and something beside it
DRONE = """<mujoco><worldbody><body><freejoint/><geom size="0.1 0.1 0.02" type="box"/><site name="r" pos="0.05 0 0"/></body>{more}
</worldbody><actuator>{actuators}</actuator></mujoco>"""
ROD = """<body pos="0 0 2"><joint name="a" axis="0 1 0"/>
<geom pos="0.3 0 0" size="0.1"/><site name="tip" pos="0.3 0 0"/></body>"""


def transition(source, dt, integrator):
    """MuJoCo's own, of movements and speeds of all but lone bodies."""
    posture, reading = at(source)
    kept = [k for k in range(reading.model.nv) if k not in posture.lone]
    kept += [reading.model.nv + k for k in kept]
    stepped = acting_at(reading, posture).transition(posture.q, posture.u, dt, integrator)
    return stepped[np.ix_(kept, kept)]


def assert_the_same_map(source):
    """What a step makes of every small deviation, entry by entry, in units in which M is the identity."""
    posture, _ = at(source)
    assert posture.rest[1] == 0.0
    small = posture.whole.locked(posture.lone)
    units = np.kron(np.eye(2), small.root.T)
    for integrator in STEPPED:
        for dt in (1e-3, 0.1):
            theirs = units @ transition(source, dt, integrator) @ np.linalg.inv(units)
            off = np.abs(small.step(integrator, dt) - theirs).max()
            assert off <= LINEAR.get(integrator, 1e-8) * max(1.0, np.abs(theirs).max()), integrator
    return posture


def assert_limits(source, integrators=STEPPED):
    """Below a limit nothing grows in MuJoCo's step, above it something does; how many are finite."""
    posture, finite = at(source)[0], 0
    for integrator in integrators:
        limit = posture.small.limit(integrator)
        if limit.limit == "finite" and limit.joint in posture.small.names:
            finite += 1
            steps = [transition(source, share * limit.dt, integrator) for share in (0.99, 1.01)]
            below, above = np.abs(np.linalg.eigvals(steps)).max(axis=1)
            assert below <= 1.0 + NOISE < above
    return finite


@pytest.mark.parametrize("seed", [0, 2, 3])  # in 1 a body flies that no joint is on: see below
def test_a_step_of_any_servoed_robot_is_that_of_mujoco(seed):
    source = with_servos(seed, floats=bool(seed % 2))
    assert_the_same_map(source)
    assert_limits(source)


@pytest.mark.parametrize("flag", ["eulerdamp", "damper", "spring", "gravity"])
def test_a_step_is_that_of_mujoco_with_a_stage_switched_off(flag):
    assert_the_same_map(with_servos(8, flags={flag: "disable"}))


def test_discrete_has_nothing_implicit_that_pushes_away_or_speeds_up():
    servo = '<position joint="a" kp="100" kv="5"/>'
    for bias in ("0 20 2", "0 -20 2", "0 20 -2"):
        more = f'{servo}<general joint="a" biastype="affine" biasprm="{bias}"/>'
        assert_the_same_map(ONE.format(gravity=0, joint='axis="0 1 0"', actuators=more))


def test_a_free_body_that_stands_alone_is_left_out_and_one_that_is_pulled_is_not():
    servo = '<position joint="a" kp="100" kv="10"/>'
    alone = at(DRONE.format(more=ROD, actuators=servo))[0]
    assert (len(alone.lone), alone.base, alone.base_kind) == (6, [], "fixed")
    assert alone.small.names == ("a",)
    for more in ('<motor site="r"/>', '<motor site="r" refsite="tip"/>'):
        assert at(DRONE.format(more=ROD, actuators=servo + more))[0].base == list(range(6))
    rope = '<tendon><spatial stiffness="9" springlength="0.5"><site site="r"/><site site="tip"/></spatial></tendon>'
    source = DRONE.format(more=ROD, actuators=servo).replace("<actuator>", rope + "<actuator>")
    assert at(source)[0].base_kind == "free"
    # implicitfast up to MuJoCo 3.10 turns a body without joints on it by the mean of two speeds
    assert assert_limits(source, ("Euler", "implicit")) == 2


def test_a_base_that_a_spring_or_a_servo_holds_is_not_free():
    motor = DRONE.format(more="", actuators='<motor site="r" gear="0 0 1 0 0 0"/>')
    sprung = at(motor.replace("<freejoint/>", '<joint type="free" stiffness="500"/>'))[0]
    gantry = '<body><joint name="d" type="ball"/><geom size="0.1"/></body>'
    for name, axis in (("c", "0 0 1"), ("b", "0 1 0"), ("a", "1 0 0")):
        gantry = f'<body><joint name="{name}" type="slide" axis="{axis}"/><geom size="0.1"/>{gantry}</body>'
    servos = "".join(f'<position joint="{name}" kp="99"/>' for name in "abc")
    slides = at(f"<mujoco><worldbody>{gantry}</worldbody><actuator>{servos}</actuator></mujoco>")[0]
    for posture in (sprung, slides):
        assert posture.base_kind == "fixed" and not posture.driven.weightless and posture.rest[1] == 0.0
    assert at(motor)[0].base_kind == "free" and not at(motor)[0].small.names
