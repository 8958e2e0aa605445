"""Small models of every kind of force at rest, as MJCF text, and how they are asked: for the tests of this folder."""

from functools import lru_cache

import pytest

from compare.engines.mujoco.names import INTEGRATORS
from compare.engines.mujoco.reading import read
from compare.engines.mujoco.step import Step
from compare.stability.limits import limit
from compare.stability.place import Posture, standing_at
from compare.stability.rest import rest_near

INERTIA = 0.05  # kg m2, of the one hinge
# one hinge about an upright axis: gravity does nothing
HINGE = """<mujoco><option timestep="0.002" integrator="{integrator}"/><worldbody><body><joint name="turn" axis="0 0 1" {joint}/>
  <inertial pos="0 0 0" mass="1" diaginertia="0.05 0.05 0.05"/></body></worldbody><actuator>{actuator}</actuator></mujoco>"""
ROD = '<geom type="capsule" size="0.02" fromto="0 0 0 0.3 0 0" mass="0.5"/>'
# two rods that servos hold, one on the other
TWO = f"""<mujoco><compiler angle="radian"/><option timestep="0.002" {{option}}/><worldbody>
  <body pos="0 0 1"><joint name="j" axis="0 1 0" {{joint}}/>{ROD}
    <body pos="0.3 0 0"><joint name="k" axis="0 1 0" damping="0.05"/>{ROD}<site name="end" pos="0.3 0 0"/></body></body>
  <site name="wall" pos="{{wall}} 0 1.4"/></worldbody>{{more}}</mujoco>"""
SERVO = '<position joint="{}" kp="{}" kv="{}"/>'
HOLDING = f"<actuator>{SERVO.format('j', 60, 3)}{SERVO.format('k', 40, 2)}</actuator>"
SPHERE = """<mujoco><default><geom solref="{timeconst} {dampratio}" solimp="0.9 0.9 0.001"/></default>
  <option timestep="0.01" impratio="{impratio}" cone="elliptic" gravity="{pull} 0 -9.81"><flag refsafe="disable"/></option>
  <worldbody><geom type="plane" size="1 1 1" condim="1"/><body pos="0 0 0.1"><joint type="slide" axis="0 0 1"/>
  <joint type="slide" axis="1 0 0" {x}/><geom size="0.1" mass="2" condim="{condim}"/></body></worldbody></mujoco>"""
# a trunk on a vertical slide, a foot on a slide below it, a floor
LEG = """<mujoco><option timestep="0.002"/><worldbody><geom name="floor" type="plane" size="1 1 1" condim="1"/>
  <body name="trunk" pos="0 0 0.5"><joint name="lift" type="slide" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="5" diaginertia="1 1 1"/>
    <body pos="0 0 -0.4"><joint name="leg" type="slide" axis="0 0 1"/><geom name="foot" size="0.1" mass="0.1" condim="1"/>
  </body></body></worldbody><actuator><position joint="leg" kp="2000" kv="20"/></actuator></mujoco>"""
# a trunk on two slides with a leg of two hinges that stands on its foot
STANDING = """<mujoco><compiler angle="radian"/><option timestep="0.002" cone="{cone}" impratio="3"/>
  <default><geom condim="1" contype="0" conaffinity="0"/></default><worldbody>
  <geom name="floor" type="plane" size="2 2 1" contype="1"/>
  <body pos="0 0 0.5"><joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/>
    <geom size="0.05" mass="3"/>
    <body><joint name="hip" axis="0 1 0"/><geom type="capsule" size="0.02" fromto="0 0 0 0.1 0 -0.25" mass="0.5"/>
      <body pos="0.1 0 -0.25"><joint name="knee" axis="0 1 0"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 -0.1 0 -0.2" mass="0.3"/>
        <geom name="foot" size="0.05" pos="-0.1 0 -0.2" mass="0.1" condim="{condim}" conaffinity="1"/></body></body></body>
  </worldbody><actuator><position joint="x" kp="500" kv="50"/>
  <position joint="hip" kp="300" kv="6"/><position joint="knee" kp="300" kv="6"/></actuator></mujoco>"""
BOX = """<mujoco><option timestep="0.002" cone="elliptic"/><worldbody><geom type="plane" size="2 2 1"/><body pos="0 0 0.1">
  <freejoint/><geom type="box" size="0.2 0.1 0.1" mass="2"/></body></worldbody></mujoco>"""
# a box on two feet and a free caster with its wheel
CASTER = """<mujoco><option timestep="0.002" cone="elliptic"/><worldbody><geom type="plane" size="2 2 1"/>
  <body pos="0 0 0.2"><freejoint/><geom type="box" size="0.2 0.1 0.05" pos="0 0 0.05" mass="2"/>
    <geom size="0.05" pos="-0.2 0.15 -0.15" mass="0.1" friction="0.01"/>
    <geom size="0.05" pos="-0.2 -0.15 -0.15" mass="0.1" friction="0.01"/>
    <body pos="0.2 0 0"><joint name="caster" axis="0 0 1"/>
      <geom type="capsule" size="0.02" fromto="0 0 0 -0.05 0 -0.1" mass="0.2"/>
      <body pos="-0.05 0 -0.15"><joint name="wheel" axis="0 1 0"/><geom size="0.05" mass="0.2"/></body></body></body>
  </worldbody></mujoco>"""
BALL = """<mujoco><option timestep="0.002"/><worldbody><body pos="0 0 1"><joint type="ball" stiffness="30" damping="0.4"/>
  <geom type="box" size="0.1 0.03 0.05" pos="0.1 0 0" mass="1"/></body></worldbody></mujoco>"""


def hinge(kp=20.0, kv=0.0, joint="", integrator="Euler", actuator=""):
    servo = f'<position name="servo" joint="turn" kp="{kp}" kv="{kv}"/>'
    return HINGE.format(joint=joint, integrator=integrator, actuator=actuator or servo)


def two(more=HOLDING, option="", joint="", wall=0.4):
    return TWO.format(more=more, option=option, joint=joint, wall=wall)


def beside(actuator, kp=60, kv=0, key=""):
    """The two rods with a further actuator beside their servos."""
    servos = SERVO.format("j", kp, kv) + SERVO.format("k", 40, 2)
    return two(f"<actuator>{actuator}{servos}</actuator>{key}")


def sphere(timeconst=0.02, dampratio=1.0, impratio=1.0, pull=0.0, condim=1, x='stiffness="50" damping="50"'):
    values = {"timeconst": timeconst, "dampratio": dampratio, "impratio": impratio, "pull": pull}
    return SPHERE.format(**values, condim=condim, x=x)


KINDS = {  # every kind of force at rest
    "servos": two(),
    "a muscle": beside(
        '<muscle joint="j" ctrlrange="0 1" lengthrange="-2 2" force="40"/>', kv=1,
        key='<keyframe><key ctrl="0.3 0 0" act="0.3"/></keyframe>',
    ),
    "a DC motor": beside('<dcmotor joint="j" motorconst="0.8" resistance="2"/>'),
    "damping of an actuator": beside('<motor joint="k" gear="2" damping="0.3"/>', kv=1),
    "a filter": beside('<position joint="j" kp="20" kv="1" timeconst="0.02"/>'),
    "fluid": two(option='density="800" viscosity="2"'),
    "a loaded loop": two('<equality><connect site1="end" site2="wall"/></equality>' + HOLDING),
    "a limit": two(HOLDING.replace("60", "6"), joint='range="-0.05 0.05" limited="true"'),
    "friction loss": two(joint='frictionloss="0.5"'),
    "a spring of a tendon": two(
        '<tendon><spatial stiffness="200" damping="2" springlength="0.2"><site site="wall"/><site site="end"/></spatial></tendon>'
        + HOLDING
    ),
    "no damping implicit in Euler": two(HOLDING + '<option><flag eulerdamp="disable"/></option>', joint='damping="1"'),
    "a tendon across branches": f"""<mujoco><worldbody><body pos="0 0 1"><joint name="j" axis="0 1 0"/>{ROD}</body>
      <body pos="0 1 1"><joint name="k" axis="0 1 0"/>{ROD}</body></worldbody><tendon><fixed name="t" damping="2">
      <joint joint="j" coef="1"/><joint joint="k" coef="-0.5"/></fixed></tendon>"""
    + HOLDING.replace("</actuator>", '<position tendon="t" kp="50" kv="3"/></actuator></mujoco>'),
    "a ball": BALL, "a box": BOX, "a free caster": CASTER, "the two-mass leg": LEG,
    **{f"{cone}, condim {condim}": STANDING.format(cone=cone, condim=condim)
       for cone in ("elliptic", "pyramidal") for condim in (1, 3, 6)},
}  # fmt: skip


@lru_cache(maxsize=64)
def place_of(text):
    """Where a model rests, with all that is on, from its first keyframe or from qpos0; a skip where MuJoCo is too old for it."""
    try:
        reading = read(text)
    except ValueError as error:
        if "discrete" in INTEGRATORS:
            raise
        pytest.skip(f"not in this MuJoCo: {error}")
    return standing_at(reading, Posture("start", next(iter(reading.keyframes), "")))


def rest_of(text, dt=2e-3, integrator="Euler"):
    """The rest of a model at a step."""
    place = place_of(text)
    return rest_near(Step(place.model, dt, integrator), place.rest)


def limit_of(text, integrator="Euler", first=2e-3):
    place = place_of(text)
    return limit(place.model, place.rest, integrator, first)
