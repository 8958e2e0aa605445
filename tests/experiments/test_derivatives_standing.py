"""Derivatives where a robot stands: which eps is right, which is said first, limits, what no control moves."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from helpers.edited import setup_of_file

from compare.core.text import say
from compare.engines.mujoco import read
from compare.experiments import derivatives
from compare.experiments.derivatives import standing, ways
from compare.experiments.derivatives.standing import Standing, directions, errors_of, not_moved


def answered(xml):
    return derivatives.rows(replace(setup_of_file(xml), alone=True))


def failed(result) -> list[str]:
    return [check.quantity for check in result.checks if not check.passed]


def standing_of(result):
    return next(text for text in result.top if text.kind == "standing")


def noisy(eps, noise, slope, kink):
    """A derivative of 2, of a block of one entry, with a term in eps^2, noise of a step, and a kink from an eps on."""
    rounding = np.random.default_rng(int(1e15 * eps)).uniform(-1.0, 1.0)
    size = 2.0 + slope * eps**2 + noise / eps * rounding + (np.sqrt(eps / kink) if eps > kink else 0.0)
    return np.array([[size, 1.0], [1.0, 1.0]])


@pytest.mark.parametrize("noise, kink, eps", [(1e-13, 1.0, 1e-5), (1e-13, 1e-6, 1e-6), (1e-9, 1.0, 1e-3)])
def test_what_agrees_for_neighbouring_eps_is_right(noise, kink, eps):
    values, halved = ([noisy(size / part, noise, 1e3, kink) for size in ways.SIZES] for part in (1.0, 2.0))
    errors, truth = errors_of(values, halved, 1)
    assert truth[0, 0] == pytest.approx(2.0, abs=1e-4 if noise > 1e-12 else 1e-6)
    found = ways.best_of("", dict(zip(ways.SIZES, errors)))
    assert eps / 10.1 < found.eps < 10.1 * eps
    known = [abs(value[0, 0] - 2.0) / 2.0 for value in values]
    assert all(0.3 < error / right < 3.0 for error, right in zip(errors, known) if right > 1e-4)


def test_where_nothing_agrees_no_eps_is_right():
    rng = np.random.default_rng(0)
    values = [rng.normal(size=(2, 2)) for _ in ways.SIZES]
    errors, truth = errors_of(values, values, 1)
    assert truth is None and set(errors) == {np.inf}
    about = {"posture": "stand", "contacts": 4, "limits": ["limit of knee"]}
    told = {"about": about | {"way": "mjd_transitionFD"}, "best": None, "opened": None, "names": []}
    assert "No eps is right" in say(derivatives.Result("derivatives").finding("standing", **told))


FEET = "".join(
    f'<geom name="foot{k}" type="sphere" size="0.02" pos="{x} {y} 0"/>'
    for k, (x, y) in enumerate([(0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)])
)
TABLE = f"""<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>
<geom name="floor" type="plane" size="1 1 1"/><body name="table" pos="0 0 0.02"><freejoint/>
<inertial pos="0.02 0.03 0.05" mass="1" diaginertia="0.01 0.02 0.025"/>{FEET}<geom name="knob" size="0.02" pos="0 0 0.002"/>
</body></worldbody></mujoco>"""


def differences_of_six(model, state, eps):
    """[A B] of order 6 by plain MuJoCo: columns by tangents and speeds."""
    data, spec = mujoco.MjData(model), mujoco.mjtState.mjSTATE_INTEGRATION
    start, columns = np.zeros(model.nq), []

    def after(k, by):
        mujoco.mj_setState(model, data, state, spec)
        start[:] = data.qpos
        tangent = by * np.eye(2 * model.nv)[k]
        mujoco.mj_integratePos(model, data.qpos, tangent[: model.nv], 1.0)
        data.qvel += tangent[model.nv :]
        mujoco.mj_step(model, data)
        moved = np.zeros(model.nv)
        mujoco.mj_differentiatePos(model, moved, 1.0, start, data.qpos)
        return np.concatenate([moved, data.qvel])

    for k in range(2 * model.nv):
        one, two, three = (after(k, n * eps) - after(k, -n * eps) for n in (1, 2, 3))
        columns.append((45.0 * one - 9.0 * two + three) / (60.0 * eps))
    return np.array(columns).T


def test_a_table_on_its_feet():
    """The advised eps is as right as is said, beside differences of order 6; contacts that open or close are named."""
    result = answered(TABLE)
    rows = {row.eps: row for row in result.tables["contact_derivatives"]}
    values = standing_of(result).values
    best, place = values["best"], Standing(read(TABLE))
    assert values["about"]["contacts"] == 4 and values["about"]["limits"] == [] and failed(result) == []
    right = differences_of_six(place.stepper.model, place.state, 1e-6)
    for eps, row in rows.items():
        error = ways.worst_block(place.values(eps)[:, :12] - right, right, 6)[0]
        assert error < 1e-8 or 0.3 < row.error / error < 3.0
    assert rows[best.eps].error == best.error < 1e-5
    assert "floor and knob" in rows[1e-2].changed and rows[1e-7].changed == ""
    assert values["opened"].eps == min(eps for eps, row in rows.items() if row.changed)
    assert f"From {values['opened'].eps:.0e} on".replace("e-0", "e-") in say(standing_of(result))


@pytest.mark.parametrize(
    "height, acts, stands", [(0.02, True, True), (4.8, True, False), (6.0, False, False)]
)
def test_the_eps_on_contacts_comes_first_where_it_stands_on_them(height, acts, stands):
    """A table on its feet; one that hits the floor within the second; one that is in the air all the time."""
    result = answered(TABLE.replace('pos="0 0 0.02"><free', f'pos="0 0 {height}"><free'))
    told = {text.kind: text.values for text in result.top}
    assert [*told] == (["standing", "answer"] if stands else ["answer", "standing"])
    assert bool(told["standing"]["about"]["contacts"]) == acts == told["answer"]["about"]["acting"]
    row = told["standing"]["best"] if stands else told["answer"]["rows"][0]
    assert result.headline.values["row"] is row
    assert f"eps {row.eps:.0e}, ".replace("e-0", "e-") in say(result.top[0])


def test_what_touches_nothing_has_no_row_and_a_limit_that_acts_is_said():
    in_air = answered(TABLE.replace('type="plane"', 'type="plane" contype="0" conaffinity="0"'))
    assert "contact_derivatives" not in in_air.tables and "standing" not in say(standing_of(in_air))
    rests = """<mujoco><worldbody><body><joint name="lid" axis="0 1 0" range="-10 10" damping="0.1"/>
    <geom size="0.05" pos="0.3 0 0"/></body></worldbody></mujoco>"""
    told = standing_of(answered(rests))
    about = {"posture": "qpos0", "way": "mjd_transitionFD", "contacts": 0, "limits": ["limit of lid"]}
    assert told.values["about"] == about and "standing on its limit of lid" in say(told)


CARTS = """<mujoco><option gravity="0 0 0"/><worldbody><body>
<joint name="driven" type="slide" axis="1 0 0"/><geom size="0.1" mass="1"/></body>
<body pos="0 1 0"><joint name="other" type="slide" axis="1 0 0" {}/><geom size="0.1" mass="1"/></body></worldbody>
<actuator><motor joint="driven"/>{}</actuator></mujoco>"""
BALANCER = """<mujoco><option timestep="0.002"/><worldbody><geom type="plane" size="5 5 .1"/>
<body name="frame" pos="0 0 0.07"><freejoint name="base"/>
<geom type="box" pos="0 0 0.12" size=".04 .05 .07" mass="0.9" contype="0" conaffinity="0"/>{}</body></worldbody>
<actuator><motor joint="left"/><motor joint="right"/></actuator></mujoco>"""
WHEEL = """<body pos="0 {} 0"><joint name="{}" axis="0 1 0" damping="0.002"/>
<geom type="cylinder" zaxis="0 1 0" size=".07 .015" mass=".15"/></body>"""
INVERTED = CARTS.replace('<option gravity="0 0 0"/>', "").replace(
    'type="slide" axis="1 0 0" {}/><geom size="0.1" mass="1"/>',
    'axis="0 1 0" {}/><geom size="0.1" mass="1" pos="0 0 0.5"/>'
)  # fmt: skip


@pytest.mark.parametrize("xml, names", [
    (CARTS.format("", ""), ["other"]), (CARTS.format('damping="5"', ""), ["other"]),  # its place stays
    (CARTS.format('damping="5" stiffness="9"', ""), []), (CARTS.format("", '<motor joint="other"/>'), []),
    (CARTS.format("", '<general joint="other" dyntype="filter" dynprm="0.1"/>'), []), (INVERTED.format("", ""), ["other"]),
    (BALANCER.format(WHEEL.format(0.09, "left") + WHEEL.format(-0.09, "right")), ["base x", "base y", "base turn z"]),
])  # fmt: skip
def test_directions_that_no_control_moves_are_named(xml, names):
    """A cart on its own; of a robot on two wheels three: it slips neither along nor about the vertical, nor sideways."""
    told = standing_of(answered(xml))
    assert sorted(told.values["names"]) == sorted(names)
    assert ("a linear-quadratic regulator has no solution" in say(told)) == bool(names)


def test_a_singular_value_within_the_error_counts_as_zero():
    """The second of two integrators is moved by a little: that divided by the root of 2 is the singular value."""
    A, units = np.array([[1.0, 1.0], [0.0, 1.0]]), np.ones(2)
    for moved, error, count in ((0.0, 1e-9, 1), (1.35e-6, 1e-6, 1), (1.5e-6, 1e-6, 0)):
        values = np.hstack([A, [[1.0], [moved]]])
        truth = values + np.diag([0.0, error])[:, [0, 1, 0]] * [1.0, 1.0, 0.0]
        assert len(not_moved(values, truth, units)) == count
    stepper = Standing(read(CARTS.format("", ""))).stepper
    assert directions(stepper, np.array([[0.6, 1.0, 0.0, 0.0], [0.0, 0.0, 0.1, 1.0]])) == [
        "driven with other",
        "other",
    ]
    assert standing.FEWEST == 3
