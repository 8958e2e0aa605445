"""Derivatives by differences and exact ones: what is advised, and that a wrong model is found."""

import dataclasses

import numpy as np
import pytest

import tmt
from compare.core.finding import Finding
from compare.core.text import say
from compare.engines.mujoco import read
from compare.experiments.derivatives import add_advice, contact_rows, of_mujoco, subjects, ways
from compare.experiments.derivatives.figures_derivatives import draw_errors
from compare.experiments.derivatives.ways import CostRow, DerivativeRow, worst_of_each_eps
from compare.robots.arm import ARM
from compare.robots.states import Sample

DT = 0.01


@pytest.fixture(scope="module")
def bent():
    return subjects.along(next(case for case in ARM.cases if case.name == "bent, damped"), 2)


def shares(mujoco, subject, *integrators, compiles=False) -> dict[str, float]:
    every = ways.measured(ways.Task(subject, integrators, compiles), mujoco, DT)
    return {way: share for one in every for way, share in one.shares.items()}


def test_centred_differences_are_more_exact_than_one_sided_ones_and_exact_derivatives_than_both(small):
    result = small("derivatives")
    for row in result.tables["derivative_costs"]:
        seconds = result.times.get((row.quantity, row.way))
        assert row.time == (None if seconds is None else pytest.approx(1e6 * seconds))
    values = result.top[0].values
    centred, usual = values["centred"], values["usual"]
    assert 1e-7 < centred.eps < 1e-3 and 1e-12 < centred.error < 1e-8 and usual.eps == 1e-6
    assert usual.error > 30 * centred.error and values["one_sided"].error > 10 * centred.error
    assert 1e-10 < values["inverse"].error < 1e-5 and values["exact"].error < 1e-12
    values = {**values, "centred": dataclasses.replace(centred, eps=1e-5, unit="m per N", largest=3.0)}
    said = say(Finding("derivatives", "advice", values))
    assert (
        "(A and B; mjd_transitionFD does not take it): use eps 1e-05, centred" in said
        and "m per N, of 3)" in said
    )
    assert "contacts left out: use" in say(Finding("derivatives", "advice", values | {"in_air": True}))


def row(quantity="A and B, Euler", **values) -> DerivativeRow:
    about = {"subject": "swing", "states": 1, "unit": "rad per rad", "largest": 1.0}
    return DerivativeRow(quantity=quantity, **(about | values))


@pytest.mark.parametrize("integrator, eps, way, steps", [
    ("Euler", 1e-4, "mjd_transitionFD", 1e-3), ("implicit", 1e-6, "mjd_transitionFD", 1e-5),
    ("RK4", 1e-3, "differences of mj_step", None),
])  # fmt: skip
def test_the_eps_is_that_of_mujocos_own_function_and_of_the_files_integrator(integrator, eps, way, steps):
    """Each way has an eps of its own, a hundred times better than the others; differences of mj_step are worse."""
    best = {"Euler": (1e-4, 1e-3), "implicit": (1e-6, 1e-5), "RK4": (None, 1e-3)}
    rows = [row(ways.INVERSE, way=ways.BY_INVERSE, eps=at, error=1e-5) for at in ways.SIZES]
    rows += [row(ways.INVERSE, way=ways.NUMPY, eps=None, error=1e-15)]
    for name, of_ways in best.items():
        for by, at in zip((ways.TRANSITION, ways.BY_STEPS), of_ways):
            least = 1e-10 if by == ways.TRANSITION else 1e-8
            for side, larger in ((ways.CENTRED, 1.0), (ways.ONE_SIDED, 10.0)):
                errors = {size: larger * least * (1.0 if size == at else 100.0) for size in ways.SIZES}
                rows += [row(f"A and B, {name}", way=f"{by}, {side}", eps=size, error=error)
                         for size, error in errors.items() if at]  # fmt: skip
    result = ways.DerivativesResult("derivatives", rows=rows)
    add_advice(result, rows, [], integrator, False)
    said = say(result.top[0])
    assert f"steps with {integrator} by {way} (A" in said and f": use eps {eps:.1g}, centred" in said
    assert ("By differences of mj_step (A and B), centred: eps" in said) == (steps is not None)
    assert steps is None or f"centred: eps {steps:.1g}, 1e-08" in said
    assert say(result.headline).endswith(f"({way}, {integrator})")
    *_, caption = draw_errors(result)
    assert f"a step with {integrator} and of the inverse dynamics, the largest at 1 state (swing: 1)" in say(
        caption
    )
    drawn = worst_of_each_eps(line for line in result.drawn if line.way == f"{way}, centred")
    assert min(drawn, key=lambda size: drawn[size].size) == eps  # as the figure has it


def test_a_wrong_damper_is_seen_in_the_centred_differences(mujoco, bent):
    assert max(shares(mujoco, bent, "Euler", "RK4").values()) <= 1.0
    damping = tuple(x + 1e-8 for x in bent.tree.damping)
    wrong = bent._replace(tree=dataclasses.replace(bent.tree, damping=damping))
    found = shares(mujoco, wrong, "implicitfast", "RK4")
    assert all(share > 1.0 for way, share in found.items() if way.endswith("centred"))
    assert found[ways.NUMPY] <= 1.0  # of its own model they are exact


@pytest.mark.parametrize("way, owner, name", [
    (ways.NUMPY, ways.Quantity, "by_numpy"), (ways.COMPILED, ways.Evaluator, "of_rows"),
])  # fmt: skip
def test_a_wrong_derivative_is_seen_entry_by_entry(mujoco, bent, monkeypatch, way, owner, name):
    right = getattr(owner, name)

    def wrong(self, *arguments):
        values = right(self, *arguments)
        values.reshape(len(values), -1)[0, 1] += 1e-9
        return values

    monkeypatch.setattr(owner, name, wrong)
    assert shares(mujoco, bent, "Euler", compiles=True)[way] > 1.0


def test_a_block_of_a_step_that_is_as_good_as_zero_is_not_what_an_error_is_relative_to():
    """Balanced, speeds in units of the robot's own time: an oscillator of 10 rad/s, its step 1 ms, a force of 1 N."""
    units = np.array(["m", "m/s"]), np.array(["m", "m/s", "N"])
    exact = np.array([[1.0, 1e-3, 1e-6], [-0.1, 1.0, 1e-3]])
    sizes = np.array([[1.0, 0.1, 1e-4], [10.0, 1.0, 1e-3]])
    assert (np.abs(np.log2(ways.sizes(exact, units) / sizes)) < 2.0).all()
    forces = np.array(["N", "N m"]), units[1]
    assert (ways.sizes(exact, forces) == np.abs(exact)).all()  # of the inverse dynamics: of the same unit
    off = np.full((2, 3), 1e-9)
    assert ways.relative(off, exact, forces)[:2] == (pytest.approx(1e-3), "N per N")
    rounded = ways.relative(off, exact, forces, least=0.5)  # rounding may have made the others
    assert rounded == (1e-9, "N per m", 1.0)
    assert ways.relative(np.nan * off, exact, forces)[0] == np.inf


@pytest.mark.parametrize("of_fourth", [8e3, 0.99e6])
def test_where_two_terms_of_the_truncation_nearly_cancel_another_eps_tells_their_size(bent, of_fourth):
    """Those in eps^2 and eps^4, at 1e-2 or 1e-3."""
    *_, step = ways.quantities(bent, ("Euler",))
    exact = step.exact_values(bent, DT)
    values = {eps: exact.high + (eps**2 - of_fourth * eps**4) for eps in ways.SIZES}
    assert 0.3 < ways.share_of_differences(values, exact, bent, step, DT) < 0.6


def test_tmt_is_compared_with_mujocos_own_centred_function():
    ways_to_it = "mjd, one-sided", "differences, centred", "mjd, centred", ways.COMPILED
    costs = [CostRow(quantity="A", way=way, best_eps=None, error=0.0, time=1.0) for way in ways_to_it]
    assert of_mujoco(costs, "A") is costs[2] and of_mujoco(costs, "B") is None


def test_hard_states_are_those_of_critical_dampers_and_of_the_least_definite_matrix(bent):
    stiff = subjects.stiff(bent, DT)
    assert min(stiff.tree.stiffness) > 1e3 * DT and stiff.q.shape == (1, 3)
    damping = DT * np.array(stiff.tree.stiffness)  # 2 / rate, the rate 2 / DT
    assert stiff.tree.damping == pytest.approx(damping)
    M = tmt.mass_matrix(bent.q)
    roots = np.sqrt(np.einsum("sii->si", M))
    least = np.linalg.eigvalsh(M / (roots[:, :, None] * roots[:, None, :]))[:, 0]
    (q,) = subjects.near_singular(bent, Sample(bent.tree, "", bent.q, bent.qd, bent.tau, 0)).q
    assert np.array_equal(q, bent.q[least.argmin()]) and np.ptp(least) > 0.0


FEET = "".join(
    f'<geom name="foot{k}" type="sphere" size="0.02" pos="{x} {y} 0"/>'
    for k, (x, y) in enumerate([(0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)])
)
TABLE = f"""<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>
<geom name="floor" type="plane" size="1 1 1"/><body name="table" pos="0 0 0.02"><freejoint/>
<inertial pos="0.02 0.03 0.05" mass="1" diaginertia="0.01 0.02 0.025"/>{FEET}<geom name="knob" size="0.02" pos="0 0 0.002"/>
</body></worldbody></mujoco>"""


def test_contacts_that_open_within_eps_are_named():
    """A table whose feet sink a fraction of a millimetre into the floor."""
    rows = contact_rows(read(TABLE))
    fine, coarse = (next(row for row in rows if row.eps == eps) for eps in (1e-7, 1e-2))
    assert fine.contacts == 4 and fine.changed == "" and fine.difference < 1e-3
    assert "floor and knob" in coarse.changed  # which the movement downwards closes
    assert "floor and foot0" in coarse.changed and not coarse.difference < 10 * fine.difference
    said = say(Finding("derivatives", "contacts", {"rows": rows}))
    assert "open or close (floor and foot" in said and "qpos0, where 4 pairs of geoms touch" in said
    assert contact_rows(read(TABLE.replace('type="plane"', 'type="plane" contype="0" conaffinity="0"'))) == []
