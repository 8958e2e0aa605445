"""The assignment's arm: its names, postures and scenes, and what the assignment prints and claims."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

import tmt

from . import Claims, Conditioning, Printed, Question, Robot
from .case import Scene

POSTURES = {  # deg, (alpha, beta, gamma); the assignment's named postures
    "zero": (0, 0, 0),
    "hanging": (0, 0, 90),
    "upright": (180, 0, 90),
    "ball catch": (-70, 70, -30),
    "bent": (30, 20, 60),
}
SCENES = (
    Scene("zero, free", "zero", "free", tags=("full only", "speed", "fewer joints")),
    Scene("ball catch, free", "ball catch", "free", tags=("digits", "speed")),
    Scene("bent, free", "bent", "free", tags=("digits", "speed", "regular")),
    Scene("ball catch, held", "ball catch", "hold", judged=2.5),  # unstable: rounding grows fast
    Scene("bent, held", "bent", "hold"),
    Scene("bent, damped", "bent", "free", damping=0.5, tags=("full only", "speed")),
    Scene("thrown, no gravity", "bent", "free", (100.0, 200.0, -150.0), gravity=False, judged=4.5, tags=("full only",)),
    Scene("elbow swing", "zero", "free", locked=("alpha", "beta"), tags=("full only", "fewer joints")),
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
    Question("f", "accelerations from rest that can be foreseen", "published", ("printed", "f1", "f2", "f3", "f4")),
    Question("g", "Mbar at the zero posture, by rows", "published, mass", ("printed", "g")),
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
    printed_torque="h",
    of_scenes={
        "ball catch, held": "held at ball catch with dt = 5/64 s, the arm leaves after about 4.5 s, by rounding in an "
        "unstable posture",
        "bent, held": "held at bent, the arm does not move",
    },
    figures={"ball catch, held": 2, "bent, held": 3},
)


def landmarks(q: np.ndarray) -> dict:
    """Shoulder, elbow and hand in the world, m, at hinge angles q, rad."""
    points = tmt.arm.points([float(angle) for angle in q])
    return {name: np.array([float(c) for c in point]) for name, point in zip(("shoulder", "elbow", "hand"), points)}


def remarks(answers: Mapping, dynamics: Mapping) -> list[str]:
    """The slips of the original, with what is right.

    answers: by item, what TMT (`.tmt`) and MuJoCo (`.mujoco`) find; dynamics: of the arm, by engine.
    """
    q, qd = ARM.posture("ball catch"), np.ones(3)
    c, s = np.cos(q[1]), np.sin(q[1])
    texts = {
        "text": np.array([qd[1], c * qd[0], s * qd[0]]),  # (bd, 0, 0) + Rb (0, ad, 0)
        "matrix": np.array([[0.0, 1.0, 0.0], [c, 0.0, 0.0], [-s, 0.0, 0.0]]) @ qd,  # B_1 as it is stated
    }
    names = {"TMT": "tmt", "MuJoCo": "mujoco"}
    right = {label: dynamics[name].angular_velocities(q, qd)[0] for label, name in names.items()}
    off = {
        name: ", ".join(f"{np.abs(values - omega).max():.1e} rad/s from {of}'s" for of, omega in right.items())
        for name, values in texts.items()
    }
    ours, theirs = answers["c"].tmt, answers["c"].mujoco
    printed = PRINTED[0].values[0]
    signs = ["the sign" if printed * value > 0.0 else "not the sign" for value in (ours[0], theirs[0])]
    return [
        "The text writes omega_1 = (bd, 0, 0) + Rb (0, ad, 0), and the same for omega_2; body components need the "
        f"transposes Rb' and Rg'. At ball catch with unit rates the text's omega_1 is {off['text']}; that of the stated "
        f"B_1 is {off['matrix']}.",
        "The stacked T carries alpha, beta, gamma as three more rows with zero mass: no effect, not needed.",
        "The equation for Qbar omits the transpose of T_b; the one for Mbar carries a stray qdd; the first line of "
        "virtual power has the gyroscopic term with the wrong sign; the second derivative of x is bracketed wrongly; "
        "two parts are called g.",
        "The program leaves an unused inertia matrix with mixed axes; states are listed with five entries where six are "
        "meant; the caption of Figure 3 repeats 'ball catch' and the number 2.",
        f"The sign of (c): the printed {printed} has {signs[0]} of the torque that holds TMT's arm ({ours[0]:+.5f} N m) and "
        f"{signs[1]} of MuJoCo's qfrc_bias at rest ({theirs[0]:+.5f} N m); the original's formula gives the opposite of what it "
        "prints. Its program flips gravity in the torque function and adds the result, and that function is right only at "
        "rest: the convective sign is wrong and the Euler part is missing.",
    ]


ARM = Robot(
    name="arm",
    mjcf=Path(__file__).resolve().parents[2] / "mjcf" / "arm.xml",
    tree=tmt.ARM,
    postures=POSTURES,
    scenes=SCENES,
    described="a human arm",
    symbols={"alpha": "α", "beta": "β", "gamma": "γ"},
    kinds={"centre": "bent", "saddle": "ball catch", "marginal": "zero", "resonant": "bent"},
    landmarks=landmarks,
    sketched=("zero", "ball catch"),
    axes=("x north", "y west", "z up"),
    printed=PRINTED,
    claims=CLAIMS,
    conditioning=Conditioning(("beta", "gamma"), (90.0, 90.0)),
    questions=QUESTIONS,
    remarks=remarks,
)
