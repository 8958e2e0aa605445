"""Wrong models of the arm: edits of its MJCF, and for each the experiments that cannot see it, with the reason.

Every experiment in its smallest setting, in one process. For test_model_edits, and small_runs.
"""

from functools import partial

from edited import XML, setup_of

from compare.experiment import Setup
from compare.experiments import (
    acceleration,
    gravity,
    kinematics,
    mass,
    parameters,
    published,
    reduction,
    speed,
    stability,
    trajectory,
)
from compare.judge.check import Result
from compare.robots.arm import ARM

ALPHA, BETA, GAMMA = (f'<joint name="{name}" type="hinge" axis="' for name in ("alpha", "beta", "gamma"))
KNOWN = {}  # what TMT gives, the same for every edit
FOLLOWED = tuple(case for case in ARM.cases if case.name in ("bent, free", "bent, damped"))
SMALLEST = {"states": 20, "exact_states": 1, "finer": (1,), "size": "small"}


def with_more(line, more):
    return line, line.replace("type", f"{more} type")


def follow(setup) -> Result:
    result = Result("trajectory")
    for case in FOLLOWED:
        result.checks += trajectory.runs.follow(case, setup.engines, setup.finer, KNOWN).checks
    return result


def linearise(setup) -> Result:
    result = Result("stability")
    stability.check_equilibria(result, setup)
    return result


EXPERIMENTS = {
    "parameters": parameters.rows,
    "published": published.rows,
    "kinematics": kinematics.rows,
    "mass": mass.rows,
    "gravity": gravity.rows,
    "acceleration": acceleration.rows,
    "trajectory": follow,
    "speed": partial(speed.rows, timed=False),
    "stability": linearise,
    "reduction": partial(reduction.rows, timed=False),
}

NO_FORCE = "positions, speeds and Jacobians have neither masses nor forces in them"
NOT_IN_M = "it is no part of M"
NO_INERTIA = "the torque that holds against gravity has no inertia in it"
AT_REST = "every printed number is asked at rest"
NO_PLACE = "the equations of motion do not depend on where the shoulder is"
MIRROR = "the arm is its own mirror image: M, gravity torques, bias and runs are those of the arm turned about beta the other way"
SWITCHED_OFF = "the file switches MuJoCo's constraint stage off, so that neither friction nor limits act"
WORLD = "it stands still beside the arm"
UNDAMPED = "no hinge of the file has damping, and no scene of this experiment's smallest setting adds any"
ALONG = "the spring is at rest where numbers are printed, or qfrc_bias has no springs in it"
DYNAMICS = ("published", "mass", "gravity", "acceleration", "trajectory", "speed", "stability", "reduction")

EDITS = {  # name: old, new, {reason: experiments that cannot see it}; all others must
    "gravity of the moon": ("-9.81", "-1.62", {NO_FORCE: ["kinematics"], NOT_IN_M: ["mass"]}),
    "standard gravity": ("-9.81", "-9.80665", {NO_FORCE: ["kinematics"], NOT_IN_M: ["mass"]}),
    "gravity switched off": ("<flag ", '<flag gravity="disable" ', {NO_FORCE: ["kinematics"], NOT_IN_M: ["mass"]}),
    "forearm 1 % heavier": ('mass="1.5"', 'mass="1.515"', {NO_FORCE: ["kinematics"]}),
    "CoM of the forearm 1 mm out": ('pos="0.15 0 0"', 'pos="0.151 0 0"', {}),
    "inertia 1 % larger": ("0.001 0.019 0.019", "0.001 0.01919 0.019", {NO_FORCE: ["kinematics"], NO_INERTIA: ["gravity"]}),
    "axes of inertia exchanged": ("0.015 0.014 0.002", "0.014 0.015 0.002",
                                  {NO_FORCE: ["kinematics"], NO_INERTIA: ["gravity"]}),
    "elbow 1 mm lower": ('pos="0 0 -0.3"', 'pos="0 0 -0.301"', {}),
    "shoulder 1 cm higher": ('name="upper_arm" pos="0 0 0"', 'name="upper_arm" pos="0 0 0.01"',
                             {NO_PLACE: [name for name in DYNAMICS if name != "acceleration"]}),
    "gamma axis tilted": (f"{GAMMA}0 1 0", f"{GAMMA}0 1 0.001", {}),
    "beta axis flipped": (f"{BETA}1", f"{BETA}-1", {MIRROR: DYNAMICS}),
    "hinges in another order": (f'{ALPHA}0 1 0"/>\n      {BETA}1 0 0"/>', f'{BETA}1 0 0"/>\n      {ALPHA}0 1 0"/>', {}),
    "gamma zero at 0.5 rad": (*with_more(GAMMA, 'ref="0.5"'), {}),
    "armature": (*with_more(GAMMA, 'armature="0.01"'), {NO_FORCE: ["kinematics"], NO_INERTIA: ["gravity"]}),
    "damping": (*with_more(BETA, 'damping="0.1"'), {NO_FORCE: ["kinematics"], NOT_IN_M: ["mass"],
                                                    AT_REST: ["published", "gravity"]}),
    "spring": (*with_more(BETA, 'stiffness="1"'), {NO_FORCE: ["kinematics"], NOT_IN_M: ["mass"], ALONG: ["published"]}),
    "friction loss": (*with_more(BETA, 'frictionloss="0.1"'), {NO_FORCE: ["kinematics"], SWITCHED_OFF: DYNAMICS}),
    "limit": (*with_more(GAMMA, 'limited="true" range="-1 1"'), {NO_FORCE: ["kinematics"], SWITCHED_OFF: DYNAMICS}),
    "gravity compensated": ('<body name="forearm"', '<body name="forearm" gravcomp="1"',
                            {NO_FORCE: ["kinematics"], NOT_IN_M: ["mass"]}),
    "position servo": ("</mujoco>", '<actuator><position joint="beta" kp="3"/></actuator></mujoco>',
                       {NO_FORCE: ["kinematics"], NOT_IN_M: ["mass"], ALONG: ["published"]}),
    "air": ("<option ", '<option density="100" viscosity="1" ',
            {NO_FORCE: ["kinematics"], NOT_IN_M: ["mass"], AT_REST: ["published", "gravity"]}),
    "damping switched off": ("<flag ", '<flag damper="disable" ',
                             {NO_FORCE: ["kinematics"], NOT_IN_M: ["mass"], AT_REST: ["published", "gravity"],
                              UNDAMPED: ["acceleration", "speed", "reduction"]}),
    "a table": ("</worldbody>", '<body pos="1 0 0"><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody>',
                {WORLD: ["kinematics", *DYNAMICS]}),
}  # fmt: skip


def failing(old, new, names=tuple(EXPERIMENTS)) -> set | None:
    """The experiments in which a check fails for the edited model; None if this MuJoCo does not know what the edit asks for."""
    assert XML.count(old) == 1
    try:
        setup = setup_of(XML.replace(old, new), Setup, **SMALLEST)
    except ValueError:
        return None
    return {name for name in names if not all(check.passed for check in EXPERIMENTS[name](setup).checks)}
