"""The step at rest: cases that are known exactly, and the closed form beside the differences of MuJoCo's own step."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from small import INERTIA, KINDS, LEG, hinge, limit_of, place_of, rest_of, sphere

from compare.engines.mujoco.forces import forces_near
from compare.engines.mujoco.names import INTEGRATORS
from compare.engines.mujoco.step import REMEMBERED
from compare.stability.closed_form import matrix, radius_apart
from compare.stability.growth import growth

SAME = 1e-6  # of the largest entry of a step: central differences, and steps of RK4 that are no linear map
EVERY = ("Euler", "implicitfast", "implicit", "RK4")


def size(A):
    return float(np.abs(np.linalg.eigvals(A)).max())


@pytest.mark.parametrize("dampratio", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_the_limit_of_a_sphere_on_a_plane_is_known_to_seven_digits(dampratio, integrator):
    """4 - 4 x - x^2 / z^2 = 0, x = dt / timeconst: 0.828427 at z = 1."""
    z, text = dampratio, sphere(0.02, dampratio)
    x = 2.0 * z**2 * (np.sqrt(1.0 + 1.0 / z**2) - 1.0)
    sizes = [size(rest_of(text, by * x * 0.02, integrator).A) - 1.0 for by in (1 - 2e-7, 1 + 2e-7)]
    assert sizes[0] < -1e-7 and sizes[1] > 1e-7
    found = limit_of(text, integrator, 0.005)
    assert found.kind == "finite" and found.dt == pytest.approx(x * 0.02, rel=3e-3)


def test_a_floor_raises_the_limit_of_euler_and_lowers_that_of_implicitfast():
    """In the air the masses 5 and 0.1 kg on one servo have 4 m +- 2 dt kv - dt^2 kp = 0."""
    m, kv, kp = 5.0 * 0.1 / 5.1, 20.0, 2000.0
    standing = {name: limit_of(LEG, name) for name in ("Euler", "implicitfast")}
    for name, sign, least, most in (("Euler", -1.0, 1.5, 10.0), ("implicitfast", 1.0, 0.1, 0.5)):
        air = (sign * kv + np.sqrt(kv**2 + 4.0 * m * kp)) / kp
        assert least < standing[name].dt / air < most
        weightless = LEG.replace("<option", '<option gravity="0 0 0"')
        weightless = weightless.replace('name="foot"', 'contype="0" conaffinity="0"')
        assert limit_of(weightless, name).dt == pytest.approx(air, rel=3e-3)
    for dt in (1e-3, 4e-3):
        rest = rest_of(LEG, dt)
        ours = matrix(rest, place_of(LEG).tree, forces_near(rest.step, rest.state))
        assert np.abs(ours - rest.A).max() < 1e-8


@pytest.mark.parametrize("impratio, timeconst", [(1.0, 0.02), (7.0, 0.05)])
def test_one_sticking_contact_creeps_at_a_known_speed(impratio, timeconst):
    """g_t (1 - d) / (d b impratio), b = 2 / (d timeconst)."""
    pull, d = 0.3, 0.9
    text = sphere(timeconst, impratio=impratio, pull=pull, condim=3, x="")
    for dt, integrator in ((0.001, "Euler"), (0.003, "RK4")):
        creep = pull * (1.0 - d) / (d * 2.0 / (d * timeconst) * impratio)
        assert rest_of(text, dt, integrator).speeds == pytest.approx([0.0, creep], rel=1e-7, abs=1e-12)


def test_limits_of_one_hinge_are_those_of_the_formula():
    """4 I + 2 dt (implicit - explicit) - dt^2 kp = 0; a filter that is too fast for the step: twice its time."""
    kp, kv = 20.0, 5.0
    for integrator, off in (("Euler", -kv), ("implicitfast", kv)):
        exact = (off + np.sqrt(off**2 + 4.0 * INERTIA * kp)) / kp
        found = limit_of(hinge(kp, kv), integrator)
        expected = ("finite", pytest.approx(exact, rel=3e-3)) if exact < 0.1 else ("none", None)
        assert (found.kind, found.dt) == expected
    filtered = '<general joint="turn" dyntype="filter" dynprm="0.004" gainprm="20" biastype="affine" biasprm="0 -20 -0.1"/>'
    assert limit_of(hinge(actuator=filtered), "implicitfast").dt == pytest.approx(0.008, rel=3e-3)
    exactly = filtered.replace('"filter"', '"filterexact"')
    assert limit_of(hinge(actuator=exactly), "implicitfast").kind == "finite"
    assert limit_of(hinge(actuator=exactly), "implicitfast").dt > 0.05


@pytest.mark.skipif(not REMEMBERED, reason="this MuJoCo knows neither delays nor springs that yield")
def test_a_delay_of_constant_controls_and_springs_that_do_not_yield_change_no_limit():
    servo = '<position joint="turn" kp="20" kv="1"{}/>'
    late, plain = (hinge(actuator=servo.format(more)) for more in (' delay="0.004" nsample="4"', ""))
    spring = 'stiffness="3" springref="20"'
    yielding, elastic = (
        plain.replace('name="turn"', f'name="turn" {spring}{more}') for more in (' springyield="9"', "")
    )
    for text, same in ((late, plain), (yielding, elastic)):
        assert limit_of(text, "implicitfast").dt == pytest.approx(limit_of(same, "implicitfast").dt)


@pytest.mark.parametrize("kind", KINDS)
def test_the_closed_form_is_the_derivative_of_mujocos_own_step(kind):
    place, known = place_of(KINDS[kind]), 0
    for integrator in EVERY:
        rest = rest_of(KINDS[kind], 2e-3, integrator)
        assert rest.is_found
        forces = forces_near(rest.step, rest.state)
        ours = matrix(rest, place.tree, forces)
        n = len(ours)  # RK4: without activations
        assert np.abs(ours - rest.A[:n, :n]).max() < SAME * np.abs(rest.A).max(), integrator
        known = len(forces.rows.R)
        if kind == "a loaded loop":
            assert np.abs(forces.rows.f).max() > 1.0
    rows = {"a loaded loop": 3, "a limit": 1, "friction loss": 1, "a box": 12, "a free caster": 9}
    rows |= {"the two-mass leg": 1}
    rows |= {f"{cone}, condim {d}": count for cone, counts in (("elliptic", (1, 3, 6)), ("pyramidal", (1, 4, 10)))
             for d, count in zip((1, 3, 6), counts)}  # fmt: skip
    assert known == rows.get(kind, 0)


def test_no_closed_form_of_discrete_or_at_the_edge_of_a_limit():
    place = place_of(LEG)
    assert radius_apart(rest_of(LEG), place.tree) is not None
    others = [name for name in INTEGRATORS if name not in EVERY]
    assert all(radius_apart(rest_of(LEG, integrator=name), place.tree) is None for name in others)
    touching = hinge(joint='range="-1 0" limited="true"')
    touching = touching.replace("<mujoco>", '<mujoco><compiler angle="radian"/>')
    assert radius_apart(rest_of(touching), place_of(touching).tree) is None


def test_activations_are_left_out_of_rk4_on_both_sides_and_none_that_moves_with_the_joint():
    # its activation has the eigenvalue 1
    turning = '<intvelocity joint="turn" kp="20" kv="5" actrange="-1 1"/>'
    for actuator in (turning, '<dcmotor joint="turn" motorconst="0.8" resistance="2"/>'):
        text = hinge(joint='stiffness="9"', actuator=actuator)
        assert abs(radius_apart(rest_of(text, integrator="RK4"), place_of(text).tree)) < 1e-8
    inductive = hinge(actuator='<dcmotor joint="turn" motorconst="0.8" resistance="2" inductance="0.004"/>')
    for integrator, known in (("Euler", True), ("RK4", False)):
        apart = radius_apart(rest_of(inductive, 1e-3, integrator), place_of(inductive).tree)
        assert (apart is not None) is known


def test_a_wrong_mass_is_seen_in_the_closed_form():
    place, rest = place_of(LEG), rest_of(LEG)
    heavy = replace(place.tree, mass=(5.001, 0.1))
    assert abs(radius_apart(rest, place.tree)) < 1e-8
    forces = forces_near(rest.step, rest.state)
    assert np.abs(matrix(rest, heavy, forces) - rest.A).max() > 1e-6


@pytest.mark.parametrize("noise, factor", [(0.0, 1.0002), (1e-6, 1.0002), (4e-5, 1.0)])
def test_what_noise_splits_from_one_does_not_grow(noise, factor):
    """A double eigenvalue 1: an entry e splits it by the root of e dt, which is growth unless it may be noise."""
    dt, entry = 1e-3, 4e-5
    A, other = (np.array([[1.0, dt], [below, 1.0]]) for below in (entry, entry - noise))
    step = SimpleNamespace(dt=dt, derivative=lambda state, nudge: other)
    rest = SimpleNamespace(A=A, state=None, step=step)
    assert growth(rest).factor == pytest.approx(factor, rel=1e-9)
