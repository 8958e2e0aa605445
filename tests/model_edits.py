"""Wrong models of the arm: edits of its MJCF, the causes that `parameters` finds of each, and the experiments that cannot see it.

For test_model_edits and experiments/test_judge_parameters.
"""

from math import pi

from edited import XML
from pytest import approx

ALPHA, BETA, GAMMA = (f'<joint name="{name}" type="hinge"' for name in ("alpha", "beta", "gamma"))
FOREARM = '<inertial pos="0.15 0 0" mass="1.5" diaginertia="0.001 0.019 0.019"/>'
STAGES_OFF = 'contact="disable" constraint="disable"'
ON_THE_WORLD = XML.replace('<body name="fore', '</body><body name="fore').replace("</body>\n    </body>", "</body>")
GEOM = '<geom size="0.001" pos="0.2 0.2 0.2"/>'
TOUCHING = XML.replace("</worldbody>", f"{GEOM}</worldbody>").replace(FOREARM, FOREARM + GEOM)
TABLE = '<body pos="1 0 0"><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody>'
TENDON = '<tendon><fixed armature="0.1"><joint joint="beta" coef="1"/></fixed></tendon>'

# experiments that cannot see an edit
MOTION = "published mass gravity acceleration trajectory speed stability reduction"
SEEN = ""  # by all
NO_FORCE = "kinematics"  # no masses nor forces in positions, speeds and Jacobians
NO_WEIGHT = "kinematics gravity"  # no inertia in the torque that holds
NO_MASS = "kinematics mass"  # it is no part of M
NOT_AT_REST = "kinematics mass published gravity"
NOT_AT_ZERO = "kinematics mass published"  # where springs and servos are at rest
STANDS_STILL = OFF = f"kinematics {MOTION}"  # beside the arm; the file switches the constraint stage off
MIRROR = MOTION  # M, torques and runs are those of the arm turned about beta the other way
NO_PLACE = MOTION.replace("acceleration ", "")  # the equations do not depend on where the shoulder is
NOT_TRIED = None  # with others than `parameters`

EDITS = {  # by quantity: what is replaced by what; the causes: rank, place, stated, compiled; who cannot see it
    "flag gravity": ("<flag", '<flag gravity="disable"', [(1, "flag gravity", 1, 0)], NO_MASS),
    "flag damper": ("<flag", '<flag damper="disable"', [(1, "flag damper", 1, 0)], f"{NOT_AT_REST} acceleration speed reduction"),
    "flag eulerdamp": ("<flag", '<flag eulerdamp="disable"', [(1, "flag eulerdamp", 1, 0)], NOT_TRIED),
    "order": (f'{ALPHA} axis="0 1 0"/>\n      {BETA} axis="1 0 0"/>', f'{BETA} axis="1 0 0"/>\n      {ALPHA} axis="0 1 0"/>',
              [(1, "order of alpha", 0, 1), (1, "order of beta", 1, 0)], SEEN),
    "parent": (XML, ON_THE_WORLD, [(1, "parent of gamma", 1, -1)], NOT_TRIED),
    "ref": (GAMMA, f'{GAMMA} ref="0.5"', [(1, "ref of gamma", 0, 0.5)], SEEN),
    "axis": (f'{BETA} axis="1', f'{BETA} axis="-1', [(1, "axis x of beta", 1, -1)], MIRROR),
    "anchor": ('pos="0 0 -0.3"', 'pos="0 0 -0.301"', [(2, "anchor z of gamma", -0.3, -0.301)], SEEN),
    "anchor of all": ('name="upper_arm" pos="0 0 0"', 'name="upper_arm" pos="0 0 0.01"',
                      [(2, f"anchor z of {of}", at, at + 0.01) for of, at in (("alpha", 0), ("beta", 0), ("gamma", -0.3))],
                      NO_PLACE),
    "damping": (BETA, f'{BETA} damping="0.1"', [(2, "damping of beta", 0, 0.1)], NOT_AT_REST),
    "armature": (ALPHA, f'{ALPHA} armature="0.1"', [(2, "armature of alpha", 0, 0.1)], NO_WEIGHT),
    "frictionloss": (BETA, f'{BETA} frictionloss="0.2"', [(2, "frictionloss of beta", 0, 0.2)], OFF),
    "stiffness": (BETA, f'{BETA} stiffness="1"', [(2, "stiffness of beta", 0, 1)], NOT_AT_ZERO),
    "limited": (GAMMA, f'{GAMMA} limited="true" range="-1 1"', [(2, "limited of gamma", 0, 1)], OFF),
    "mass": ('mass="1.5"', 'mass="1.515"', [(2, "mass of forearm", 1.5, 1.515)], NO_FORCE),
    "com": ('pos="0.15 0 0"', 'pos="0.151 0 0"', [(2, "com x of forearm", 0.15, 0.151)], SEEN),
    "inertia": ("0.001 0.019 0.019", "0.001 0.01919 0.019", [(2, "inertia yy of forearm", 0.019, 0.01919)], NO_WEIGHT),
    "gravcomp": ('<body name="forearm"', '<body name="forearm" gravcomp="1"', [(2, "gravcomp of forearm", 0, 1)], NO_MASS),
    "gravity": ("-9.81", "-9.80665", [(2, "gravity z", -9.81, -9.80665)], NO_MASS),
    "density": ("<option", '<option density="100"', [(1, "density", 0, 100)], NOT_AT_REST),
    "viscosity": ("<option", '<option viscosity="1"', [(1, "viscosity", 0, 1)], NOT_AT_REST),
    "other mass": ("</worldbody>", TABLE, [(2, "other mass", 0, 2)], STANDS_STILL),
    "contact pairs": (XML, TOUCHING.replace(STAGES_OFF, ""), [(1, "contact pairs", 0, 1)], NOT_TRIED),
    "damping beyond linear": (BETA, f'{BETA} damping="0 0.1"', [(2, "damping beyond linear", 0, 0.1)], NOT_TRIED),
    "stiffness beyond linear": (BETA, f'{BETA} stiffness="0 0.1"', [(2, "stiffness beyond linear", 0, 0.1)], NOT_TRIED),
    "actuator damping": ("</mujoco>", '<actuator><motor joint="beta" damping="0.1"/></actuator></mujoco>',
                         [(2, "actuator damping", 0, 0.1)], NOT_TRIED),
    "actuator armature": ("</mujoco>", '<actuator><motor joint="beta" armature="0.1"/></actuator></mujoco>',
                          [(2, "actuator armature", 0, 0.1)], NOT_TRIED),
    "tendon armature": ("</worldbody>", f"</worldbody>{TENDON}", [(2, "tendon armature", 0, 0.1)], NO_WEIGHT),
    "no forces of actuators": ("</mujoco>", '<actuator><position joint="beta" kp="3"/></actuator></mujoco>',
                               [(2, "forces of actuators", 0, approx(3.0 * pi, rel=0.05))], NOT_AT_ZERO),
}  # fmt: skip


def edited(*edits) -> str:
    """The arm's file with each of these replaced, which must be there once."""
    text = XML
    for old, new in edits:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return text
