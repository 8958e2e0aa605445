"""Derivatives by differences and exact ones: what is advised, and that a wrong model is found."""

import dataclasses

import numpy as np
import pytest
from edited import setup_of_file

import tmt
from compare.core.finding import Finding
from compare.core.text import say
from compare.engines.mujoco import read
from compare.engines.mujoco.differences import of_inverse, of_steps, of_transition
from compare.experiments.derivatives import add_advice, begin, contact_rows, of_mujoco, subjects, ways
from compare.experiments.derivatives.figures_derivatives import draw_errors
from compare.experiments.derivatives.ways import CostRow, DerivativeRow, best_of, worst_of_each_eps
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


@pytest.mark.parametrize("integrator", ["Euler", "implicit", "RK4"])
def test_all_scenes_have_the_files_integrator(integrator):
    xml = FREE_WITH_HINGE.replace("<mujoco>", f'<mujoco><option integrator="{integrator}"/>')
    setup = setup_of_file(xml)
    tasks: list[ways.Task] = []
    begin(dataclasses.replace(setup, map=lambda _, given: tasks.extend(given)))
    assert {task.subject.kind for task in tasks} == {"scene", "stiff", "singular"}
    assert all(integrator in task.integrators for task in tasks)


def test_differences_in_mujoco_are_those_of_its_steps(mujoco, bent):
    """mjd_transitionFD is, where the way is the same, what differences of mj_step are."""
    dynamics, state = mujoco.of(bent.case), (bent.q[0], bent.qd[0], bent.tau[0])
    for centred in (False, True):
        functions = of_transition, of_steps
        own, steps = (f(dynamics, *state, DT, "implicitfast", centred, 1e-6)() for f in functions)
        assert np.abs(own - steps[:, :6]).max() < 1e-8
    inverse = of_inverse(dynamics, *state[:2], np.ones(3), 1e-7)()
    truth = np.hstack(ways.tmt.inverse_dynamics_derivatives(*state[:2], np.ones(3), bent.tree))
    assert np.abs(inverse - truth).max() < 1e-4 < np.abs(truth[:, :3] - truth[:, :3].T).max()


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


FREE_WITH_HINGE = """<mujoco><worldbody><body pos="0 0 1"><freejoint/>
<inertial pos="0 0 0" mass="2" diaginertia="0.1 0.2 0.25"/><body><joint axis="0 0.6 0.8"/>
<inertial pos="0.1 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/></body></body></worldbody></mujoco>"""


def test_a_slow_turn_of_a_free_body_is_rounded_as_a_quaternion():
    """mjd_transitionFD makes a difference of less than 1e-15 rad zero; the components of a turn add to each other."""
    setup = setup_of_file(FREE_WITH_HINGE)
    case = setup.robot.cases[0]
    q, qd, tau = case.q[None], np.full((1, 7), 0.1), np.zeros((1, 7))
    subject = subjects.Subject("slow", "scene", case, case.tree, q, qd, tau)
    task = ways.Task(subject, ("implicitfast",), False)
    every = ways.measured(task, setup.engines["mujoco"], 1e-3)
    assert max(share for one in every for share in one.shares.values()) <= 1.0


@pytest.mark.parametrize("of_fourth", [8e3, 0.99e6])
def test_where_two_terms_of_the_truncation_nearly_cancel_another_eps_tells_their_size(bent, of_fourth):
    """Those in eps^2 and eps^4, at 1e-2 or 1e-3."""
    *_, step = ways.quantities(bent, ("Euler",))
    exact = step.exact_values(bent, DT)
    values = {eps: exact.high + (eps**2 - of_fourth * eps**4) for eps in ways.SIZES}
    assert 0.3 < ways.share_of_differences(values, exact, bent, step, DT) < 0.6


DAMPED = """<mujoco><worldbody><body pos="0 0 1"><joint axis="0 1 0" damping="{0}"/>
<inertial pos="0.1 0 0" mass="2" diaginertia="0.01 0.02 0.02"/><body pos="0.3 0 0"><joint axis="0 1 0" damping="{0}"/>
<inertial pos="0.2 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/></body></body></worldbody></mujoco>"""


def test_rounding_is_carried_through_a_step_that_grows():
    """Dampers with which a step of RK4 grows by 4e7: what its first stages round grows with it."""
    setup = setup_of_file(DAMPED.format(1000))
    case, mujoco = setup.robot.cases[0], setup.engines["mujoco"]
    q, qd = np.array([[0.5, 0.7]]), np.array([[1e-6, -1e-6]])
    tau = tmt.gravity_balance(q, case.tree)
    subject = subjects.Subject("stiff", "scene", case, case.tree, q, qd, tau)
    (*_, step) = ways.measured(ways.Task(subject, ("RK4",), False), mujoco, 2e-3)
    assert step.rows[0].largest > 1e6 and max(step.shares.values()) <= 1.0


def test_tmt_is_compared_with_mujocos_own_centred_function():
    ways_to_it = "mjd, one-sided", "differences, centred", "mjd, centred", ways.COMPILED
    costs = [CostRow(quantity="A", way=way, best_eps=None, error=0.0, time=1.0) for way in ways_to_it]
    assert of_mujoco(costs, "A") is costs[2] and of_mujoco(costs, "B") is None


def test_where_differences_lose_digits_is_said(bent):
    about = {"quantity": "A and B, RK4", "way": "a", "eps": 1e-5, "states": 1, "largest": 1.0}
    about["unit"] = "rad per rad"
    rows = [DerivativeRow(subject="stiff servos", error=error, **about) for error in (1e-7, 9e-9, None, 1e-9)]
    pairs = [{"row": row, "scenes": rows[3]} for row in rows[:3]]
    said = [say(Finding("derivatives", "hard", {"pairs": [pair]})) for pair in pairs]
    assert "lose digits: stiff servos: 1e-07 with eps 1e-05 (A and B, RK4, rad per rad" in said[0]
    assert "the same eps serves" in said[1] and "not finite" in said[2]
    finer = dataclasses.replace(rows[0], eps=1e-6)
    assert worst_of_each_eps(rows) == {1e-5: rows[2]} and best_of([*rows, finer]) is finer


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
