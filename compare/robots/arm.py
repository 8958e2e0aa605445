"""The assignment's arm: names, postures, scenes, printed results, claims."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import tmt

from ..core.finding import Finding
from .case import Robot, Scene
from .printed import Claims, Printed, Question

POSTURES = {  # deg, (alpha, beta, gamma); the assignment's named postures
    "zero": (0, 0, 0),
    "hanging": (0, 0, 90),
    "upright": (180, 0, 90),
    "ball catch": (-70, 70, -30),
    "bent": (30, 20, 60),
}
THROWN = (100.0, 200.0, -150.0)  # deg/s
SCENES = (
    Scene("zero, free", "zero", "free", tags=("full only", "speed")),
    Scene("ball catch, free", "ball catch", "free", tags=("speed",)),
    Scene("bent, free", "bent", "free", tags=("speed", "regular")),
    Scene("ball catch, held", "ball catch", "hold", judged=2.5),  # unstable: rounding grows fast
    Scene("bent, held", "bent", "hold"),
    Scene("bent, damped", "bent", "free", damping=0.5, tags=("full only", "speed")),
    Scene("thrown, no gravity", "bent", speed=THROWN, gravity=False, judged=4.5, tags=("full only",)),
    Scene("elbow swing", "zero", "free", locked=("alpha", "beta"), tags=("full only",)),
)
PRINTED = (
    Printed("c", "holding torque", "zero", (-2.2072, 0.0, -2.2072), "N m", 0.5e-4),
    Printed("f1", "qdd", "zero", (0.0, 0.0, 41.8436), "rad/s2", 0.5e-4),
    Printed("f2", "qdd", "hanging", (0.1641e-14, 0.0, 0.3021e-14), "rad/s2", 0.5e-18, is_rounding=True,
            sizes=("alpha",)),
    Printed("f3", "qdd", "upright", (-0.3456e-14, 0.0, 0.0192e-14), "rad/s2", 0.5e-18, is_rounding=True,
            to_every_digit=("exact", "tmt")),
    Printed("f4", "qdd", "zero", (0.0, 0.0, 0.0), "rad/s2", 0.0, torque="c", is_rounding=True),
    Printed("g", "Mbar", "zero", ((0.2445, 0.0, 0.0527), (0.0, 0.1938, 0.0), (0.0527, 0.0, 0.0527)), "kg m2", 0.5e-4),
    Printed("h", "holding torque", "ball catch", (-2.6164, 1.9627, 0.8135), "N m", 0.5e-4),
)  # fmt: skip
QUESTIONS = (
    Question("a", "sketch of the arm with its hinges", "parameters", ("figure", "arm")),
    Question("b", "positions of the centres of mass", "kinematics", ("largest", "kinematics", "x_b", {})),
    Question("c", "torques that hold the zero posture", "published, gravity", ("printed", "c")),
    Question("d", "angular velocities in body axes", "kinematics", ("largest", "kinematics", "omega_b", {})),
    Question("e", "equations of motion by TMT", "mass, acceleration",
             ("largest", "mass", "Mbar", {}, "acceleration", "bias", {})),
    Question("f", "accelerations from rest that can be predicted", "published", ("printed", "f1", "f2", "f3", "f4")),
    Question("g", "Mbar at the zero posture", "published, mass", ("printed", "g")),
    Question("h", "torques that hold ball catch", "published, gravity", ("printed", "h")),
    Question("i", "five seconds of motion by RK4", "trajectory",
             ("largest", "trajectory", "RK4, angles", {"level": "open loop", "twin": "rk4"})),
)  # fmt: skip
CLAIMS = Claims(
    dt=5 / 64,
    duration=5.0,
    left="ball catch",
    left_after=4.5,
    kept="bent",
    end="hanging",
    of_scenes={
        "ball catch, held": "held at ball catch with dt = 5/64 s, the arm leaves the unstable posture after about 4.5 s, "
        "because of rounding",
        "bent, held": "held at bent, the arm does not move",
    },
    figures={"ball catch, held": 2, "bent, held": 3},
)


def landmarks(q: np.ndarray) -> list[Any]:
    """Shoulder, elbow and finger tips in the world, of numbers or arrays (times,), at q (times, 3)."""
    return tmt.arm.points(list(q.T))


def remarks(answers: Mapping[str, Any], dynamics: Mapping[str, Any]) -> list[Finding]:
    """Errors in the printed solution. answers: by item, of TMT and MuJoCo; dynamics: by engine."""
    q, qd = ARM.posture("ball catch"), np.ones(3)
    c, s = np.cos(q[1]), np.sin(q[1])
    stated = {
        "text": np.array([qd[1], c * qd[0], s * qd[0]]),  # (bd, 0, 0) + Rb (0, ad, 0)
        "matrix": np.array([[0.0, 1.0, 0.0], [c, 0.0, 0.0], [-s, 0.0, 0.0]]) @ qd,  # B_1
    }
    engines = {"TMT": dynamics["tmt"], "MuJoCo": dynamics["mujoco"]}
    right = {label: engine.angular_velocities(q, qd)[0] for label, engine in engines.items()}
    transposes = {}
    for name, values in stated.items():
        transposes[name] = {label: float(np.abs(values - omega).max()) for label, omega in right.items()}
    holding = np.array(PRINTED[0].values)
    sign = {"printed": holding[0], "tmt": answers["c"].tmt[0], "mujoco": answers["c"].mujoco[0]}
    findings: dict[str, Mapping[str, Any]] = {"transposes": transposes}
    findings |= {"stacked_transform": {}, "equations": {}, "program": {}, "sign": sign}
    return [Finding("arm", kind, values) for kind, values in findings.items()]


ARM = Robot(
    name="arm",
    mjcf=Path(__file__).resolve().parents[2] / "mjcf" / "arm.xml",
    tree=tmt.ARM,
    postures={name: tuple(np.radians(angles).tolist()) for name, angles in POSTURES.items()},
    scenes=SCENES,
    described="a human arm",
    symbols={"alpha": "α", "beta": "β", "gamma": "γ"},
    kinds={"centre": "bent", "saddle": "ball catch", "marginal": "zero"},
    landmarks=landmarks,
    sketched=("zero", "ball catch"),
    axes=("x north", "y west", "z up"),
    printed=PRINTED,
    claims=CLAIMS,
    questions=QUESTIONS,
    remarks=remarks,
)
