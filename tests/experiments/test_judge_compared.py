"""Each quantity is compared with what the other engine says of that quantity: one that is off fails its own checks alone."""

import pytest
from edited import XML, setup_of

from compare.engines.mujoco import parse
from compare.experiment import Setup
from compare.experiments import acceleration, gravity, kinematics, mass, parameters
from compare.robots.arm import ARM
from tmt import literal

OFF = 1e-6  # far above rounding


def off(values, place=None):
    """Values that are a little off, in one of a pair only if that has a place."""
    if place is None:
        return values * (1 + OFF) + OFF
    return tuple(off(part) if k == place else part for k, part in enumerate(values))


class Off:
    """MuJoCo that gives one quantity a little off, with gravity or only without."""

    name = "mujoco"

    def __init__(self, mujoco, quantity, place=None, weightless=False):
        self.mujoco, self.changed, self.weightless = mujoco, (quantity, place), weightless
        self.methods = mujoco.methods

    def of(self, case):
        dynamics = self.mujoco.of(case)
        return dynamics if case.scene.gravity == self.weightless else OffDynamics(dynamics, *self.changed)


class OffDynamics:
    """Dynamics that give one quantity a little off."""

    def __init__(self, dynamics, quantity, place):
        self.dynamics, self.quantity, self.place = dynamics, quantity, place

    def __getattr__(self, name):
        given = getattr(self.dynamics, name)
        return given if name != self.quantity else lambda *states: off(given(*states), self.place)


def failing(experiment, mujoco) -> set:
    """The quantities whose comparison of both engines fails."""
    result = experiment.rows(setup_of(mujoco, make=Setup, states=20, exact_states=1))
    return {check.quantity for check in result.checks if not check.passed and not check.quantity.endswith("to exact")}


@pytest.mark.parametrize(
    "experiment, changed, quantities",
    [
        (kinematics, ("com_positions",), {"x_b"}),
        (kinematics, ("angular_velocities",), {"omega_b"}),
        (kinematics, ("jacobians", 0), {"T_b"}),
        (kinematics, ("jacobians", 1), {"B_b"}),
        (kinematics, ("convective_terms", 0), {"v_conv"}),
        (kinematics, ("convective_terms", 1), {"w_conv"}),
        (mass, ("mass_matrix",), {"Mbar", "MuJoCo: condition number - 126.83"}),
        (gravity, ("gravity_balance",), {"holding torque", "MuJoCo: torque - dV/dq"}),
        (gravity, ("potential_energy",), {"MuJoCo: torque - dV/dq"}),
        (gravity, ("acceleration",), {"qdd of MuJoCo under TMT's torque"}),
        (acceleration, ("bias",), {"bias"}),
        (acceleration, ("acceleration",), {"qdd", "tau from MuJoCo's qdd by TMT", "dE/dt - tau.qd at MuJoCo's qdd"}),
        (acceleration, ("acceleration", None, True), {"dp_alpha/dt at MuJoCo's qdd, no gravity"}),
        (acceleration, ("inverse",), {"tau from TMT's qdd by mj_inverse"}),
        (acceleration, ("energy",), {"energy"}),
        (acceleration, ("potential_energy",), {"potential energy"}),
    ],
)
def test_a_quantity_of_mujoco_that_is_off_fails_its_own_checks(mujoco, experiment, changed, quantities):
    assert failing(experiment, mujoco) == set()
    alone = {
        "T_b",
        "B_b",
        "v_conv",
        "w_conv",
        "x_b",
        "omega_b",
        "Mbar",
        "holding torque",
        "bias",
        "qdd",
        "energy",
        "potential energy",
    }
    compiled = {f"{quantity}, compiled" for quantity in quantities & alone}
    assert failing(experiment, Off(mujoco, *changed)) == quantities | compiled


@pytest.mark.parametrize(
    "experiment, name, quantities",
    [
        (gravity, "potential_energy", {"TMT: torque - dV/dq"}),
        (acceleration, "acceleration", {"qdd", "tau from TMT's qdd by mj_inverse", "dE/dt - tau.qd at TMT's qdd",
                                        "dp_alpha/dt at TMT's qdd, no gravity"}),
    ],
)  # fmt: skip
def test_a_quantity_of_tmt_that_is_off_fails_its_own_checks(mujoco, monkeypatch, experiment, name, quantities):
    right = getattr(literal, name)
    monkeypatch.setattr(literal, name, lambda *states: off(right(*states)))
    assert failing(experiment, mujoco) == quantities


BETA, GAMMA = (f'<joint name="{name}" type="hinge"' for name in ("beta", "gamma"))
FOREARM = '<inertial pos="0.15 0 0" mass="1.5" diaginertia="0.001 0.019 0.019"/>'
GEOM = '<geom size="0.001" pos="0.5 0.5 0"/>'
READ = {
    "flag gravity": ("<flag", '<flag gravity="disable"'),
    "flag eulerdamp": ("<flag", '<flag eulerdamp="disable"'),
    "order": (XML, XML.replace('"alpha"', '"x"').replace('"beta"', '"alpha"').replace('"x"', '"beta"')),
    "ref": (GAMMA, f'{GAMMA} ref="0.1"'),
    "axis": (f'{GAMMA} axis="0 1 0"', f'{GAMMA} axis="0 1 0.001"'),
    "anchor": (GAMMA, f'{GAMMA} pos="0 0 0.001"'),
    "damping": (BETA, f'{BETA} damping="0.001"'),
    "armature": (BETA, f'{BETA} armature="0.001"'),
    "frictionloss": (BETA, f'{BETA} frictionloss="0.001"'),
    "stiffness": (BETA, f'{BETA} stiffness="0.001"'),
    "limited": (BETA, f'{BETA} limited="true" range="-9 9"'),
    "mass": (FOREARM, FOREARM.replace("1.5", "1.501")),
    "com": (FOREARM, FOREARM.replace("0.15 0", "0.15 0.001")),
    "inertia": (FOREARM, FOREARM.replace("0.001 ", "0.002 ")),
    "gravcomp": ('<body name="forearm"', '<body name="forearm" gravcomp="0.001"'),
    "gravity": ("-9.81", "-9.811"),
    "density": ("<option", '<option density="0.001"'),
    "viscosity": ("<option", '<option viscosity="0.001"'),
    "other mass": ("</worldbody>", '<body><inertial pos="0 0 0" mass="0.001" diaginertia="1 1 1"/></body></worldbody>'),
    "parent": (XML, XML.replace('<body name="fore', '</body><body name="fore').replace("</body>\n    </body>", "</body>")),
    "contact pairs": (XML, XML.replace('contact="disable" constraint="disable"', "").replace(FOREARM, FOREARM + GEOM)
                      .replace("</worldbody>", f"{GEOM}</worldbody>")),
    "damping beyond linear": (BETA, f'{BETA} damping="0 0.001"'),
    "stiffness beyond linear": (BETA, f'{BETA} stiffness="0 0.001"'),
    "actuator damping": ("</mujoco>", '<actuator><motor joint="beta" damping="0.001"/></actuator></mujoco>'),
    "actuator armature": ("</mujoco>", '<actuator><motor joint="beta" armature="0.001"/></actuator></mujoco>'),
    "tendon armature": (
        "</worldbody>", '</worldbody><tendon><fixed armature="0.001"><joint joint="beta" coef="1"/></fixed></tendon>',
    ),
}  # fmt: skip


OF_A_SOLUTION = ("rest",)  # compared with a solution alone, see test_judge_solution


@pytest.mark.parametrize("quantity", [name for name in parameters.QUANTITIES if name not in OF_A_SOLUTION])
def test_each_number_of_the_compiled_model_is_compared(quantity):
    if quantity == "flag damper":  # one flag for springs and dampers before there were two
        changes = [("<flag", f'<flag {name}="disable"') for name in ("damper", "passive")]
    else:
        changes = [READ[quantity]]
    for old, new in changes:
        assert old in XML
        try:
            model = parse(XML.replace(old, new), ARM.tree)
        except ValueError:
            continue
        result = parameters.rows(setup_of(model, make=Setup, states=5))
        assert quantity in {check.quantity for check in result.checks if not check.passed}
        return
    if quantity not in parameters.NOT_HAD:
        pytest.fail("no such flag in this MuJoCo")
