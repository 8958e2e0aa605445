"""Derivatives by differences and exact ones: what is advised, and that a wrong model is found."""

import dataclasses

import numpy as np
import pytest

from compare.core.finding import Finding
from compare.core.text import say
from compare.engines.mujoco import read
from compare.engines.mujoco.differences import of_inverse, of_steps, of_transition
from compare.experiments.derivatives import subjects, ways
from compare.experiments.derivatives.contacts import contact_rows
from compare.experiments.derivatives.tables import HardRow
from compare.robots.arm import ARM

DT = 0.01


@pytest.fixture(scope="module")
def bent():
    return subjects.along(next(case for case in ARM.cases if case.name == "bent, damped"), 2)


def shares(mujoco, subject, *integrators) -> dict[str, float]:
    every = ways.measured(subject, mujoco, integrators, DT, compiles=False)
    return {way: share for one in every for way, share in one.shares.items()}


def test_centred_differences_are_more_exact_than_one_sided_ones_and_exact_derivatives_than_both(small):
    values = small("derivatives").top[0].values
    assert 1e-7 < values["eps"] < 1e-3 and 1e-12 < values["error"] < 1e-8
    assert values["usual_error"] > 30 * values["error"] and values["one_sided_error"] > 10 * values["error"]
    assert 1e-10 < values["inverse_error"] < 1e-5 and values["exact"] < 1e-12
    assert "use eps 1e-05, centred" in say(Finding("derivatives", "advice", {**values, "eps": 1e-5}))


def test_differences_in_mujoco_are_those_of_its_steps(mujoco, bent):
    """mjd_transitionFD is, where the way is the same, what differences of mj_step are."""
    dynamics, state = mujoco.of(bent.case), (bent.q[0], bent.qd[0], bent.tau[0])
    for centred in (False, True):
        own = of_transition(dynamics, *state, DT, "implicitfast", 1e-6, centred)()
        assert (
            np.abs(own - of_steps(dynamics, *state, DT, "implicitfast", 1e-6, centred)()[:, :6]).max() < 1e-8
        )
    inverse = of_inverse(dynamics, *state[:2], np.ones(3), 1e-7)()
    truth = np.hstack(ways.tmt.inverse_dynamics_derivatives(*state[:2], np.ones(3), bent.tree))
    assert np.abs(inverse - truth).max() < 1e-4 < np.abs(truth[:, :3] - truth[:, :3].T).max()


def test_a_wrong_damper_is_seen_in_the_centred_differences(mujoco, bent):
    assert max(shares(mujoco, bent, "Euler", "RK4").values()) <= 1.0
    damping = tuple(x + 1e-6 for x in bent.tree.damping)
    wrong = bent._replace(tree=dataclasses.replace(bent.tree, damping=damping))
    found = shares(mujoco, wrong, "implicitfast", "RK4")
    assert all(share > 1.0 for way, share in found.items() if way.endswith("centred"))
    assert found[ways.NUMPY] <= 1.0  # of its own model they are exact


def test_a_wrong_derivative_is_seen_entry_by_entry(mujoco, bent, monkeypatch):
    by_numpy = ways.Quantity.by_numpy

    def wrong(self, *arguments):
        values = by_numpy(self, *arguments)
        values[0, 0, 1] += 1e-9
        return values

    monkeypatch.setattr(ways.Quantity, "by_numpy", wrong)
    assert shares(mujoco, bent, "Euler")[ways.NUMPY] > 1.0


def test_errors_are_relative_to_entries_of_the_same_unit():
    units = np.array([0, 1]), np.array([0, 1])
    exact, off = np.array([[1.0, 1e3], [1e-3, 1.0]]), np.array([[0.0, 0.0], [1e-6, 0.0]])
    assert np.isclose(ways.relative(off, exact, units), 1e-3)
    assert np.isclose(ways.relative(off, exact, (np.zeros(2), np.zeros(2))), 1e-9)
    assert ways.relative(np.full((2, 2), np.nan), exact, units) == np.inf


def test_where_differences_lose_digits_is_said(bent):
    row = HardRow(
        subject="stiff servos",
        quantity="A and B, RK4",
        eps=1e-5,
        error=1e-7,
        scenes_error=1e-9,
        best_eps=1e-6,
        best_error=1e-8,
    )
    said = [
        say(Finding("derivatives", "hard", {"rows": [dataclasses.replace(row, error=error)]}))
        for error in (1e-7, 9e-9, None)
    ]
    assert "stiff servos, A and B, RK4: 1e-07 with eps 1e-05" in said[0] and "lose digits" in said[0]
    assert "the same eps serves" in said[1] and "not finite" in said[2]
    stiff = subjects.stiff(bent, DT)
    assert min(stiff.tree.stiffness) > 1e3 * DT and stiff.q.shape == (1, 3)


FEET = "".join(
    f'<geom name="foot{k}" type="sphere" size="0.02" pos="{x} {y} 0"/>'
    for k, (x, y) in enumerate([(0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)])
)
TABLE = f"""<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>
<geom name="floor" type="plane" size="1 1 1"/><body name="table" pos="0 0 0.02"><freejoint/>
<inertial pos="0.02 0.03 0.05" mass="1" diaginertia="0.01 0.02 0.025"/>{FEET}
</body></worldbody></mujoco>"""


def test_contacts_that_open_within_eps_are_named():
    """A table whose feet sink a fraction of a millimetre into the floor."""
    rows = contact_rows(read(TABLE))
    fine, coarse = (next(row for row in rows if row.eps == eps) for eps in (1e-7, 1e-2))
    assert fine.contacts == 4 and fine.changed == "" and fine.difference < 1e-3
    assert "floor and foot0" in coarse.changed and not coarse.difference < 10 * fine.difference
    said = say(Finding("derivatives", "contacts", {"rows": rows}))
    assert "open or close (floor and foot" in said and "qpos0, where 4 pairs of geoms touch" in said
    assert contact_rows(read(TABLE.replace('type="plane"', 'type="plane" contype="0" conaffinity="0"'))) == []
