"""What users call is what was judged: an error of the compiled functions alone fails a check of its own."""

import numpy as np
import pytest

import tmt
from compare.engines.tmt import Compiled
from compare.experiments import acceleration, gravity, kinematics, mass
from compare.robots.arm import ARM
from tmt import answers

JUDGED = {
    kinematics: {
        "com_positions": ("x_b",), "angular_velocities": ("omega_b",), "jacobians": ("T_b", "B_b"),
        "convective_terms": ("v_conv", "w_conv"),
    },
    mass: {"mass_matrix": ("Mbar",)},
    gravity: {"gravity_balance": ("holding torque",)},
    acceleration: {
        "bias": ("bias",), "acceleration": ("qdd",), "energy": ("energy",), "potential_energy": ("potential energy",),
    },
}  # fmt: skip


def larger(found):
    """The same, larger by 1e-9 of itself."""
    return tuple(values * (1.0 + 1e-9) for values in found) if isinstance(found, tuple) else found * (1.0 + 1e-9)


@pytest.mark.parametrize("experiment", JUDGED, ids=lambda module: module.__name__.rpartition(".")[2])
def test_an_error_of_the_compiled_functions_alone_fails_their_own_check(experiment, setup, monkeypatch):
    checks = experiment.rows(setup).checks
    names = {name for of in JUDGED[experiment].values() for name in of}
    assert {f"{name}, compiled" for name in names} == {c.quantity for c in checks if "compiled" in c.quantity}
    assert all(check.passed for check in checks)
    for quantity, rows in JUDGED[experiment].items():
        right = getattr(tmt, quantity)
        with monkeypatch.context() as patch:
            patch.setattr(tmt, quantity, lambda *given, right=right, **named: larger(right(*given, **named)))
            failed = {check.quantity for check in experiment.rows(setup).checks if not check.passed}
        assert failed == {f"{name}, compiled" for name in rows}


def test_what_is_compared_is_compiled(monkeypatch):
    compiled = Compiled(ARM.tree)
    monkeypatch.setattr(answers, "literal", None)  # whoever asks for that form fails
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (20, 3))
    assert compiled.mass_matrix(q).shape == (20, 3, 3) and compiled.acceleration(q, q, q).shape == (20, 3)
