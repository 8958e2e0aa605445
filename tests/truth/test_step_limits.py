"""Limits of the step of linear equations: the closed form beside the eigenvalues of steps, and what has none."""

import numpy as np
import pytest

from compare.truth.step_limits import POLE_RK4, Small

FAMILY = ("Euler", "implicitfast", "implicit", "discrete")
EVERY = (*FAMILY, "RK4")


def small(M, K, D, damping=None, springs=None, on_path=None, **more):
    """Small deviations of plain numbers; implicit: nothing by Euler, all by the others, but where something else is said."""
    M, K, D = (np.atleast_2d(np.asarray(x, float)) for x in (M, K, D))
    n = len(M)
    return Small(
        names=tuple(f"joint{k}" for k in range(n)),
        M=M,
        K=K,
        D=D,
        damping=np.zeros(n) if damping is None else np.asarray(damping, float),
        uncut=D,
        springs=np.zeros_like(K) if springs is None else np.atleast_2d(np.asarray(springs, float)),
        brakes=D,
        on_path=np.ones((n, n), bool) if on_path is None else on_path,
        **more,
    )


def not_negative(rng, n, rank):
    """A symmetric matrix of a rank, of very different sizes."""
    A = rng.normal(size=(n, rank)) * 10.0 ** rng.uniform(-1.0, 1.5, rank)
    return A @ A.T


def random_small(rng):
    """Symmetric M, K, D of several speeds, K with zero modes, some of D implicit by Euler, part of the rest across branches."""
    n = int(rng.integers(2, 6))
    damping = 10.0 ** rng.uniform(-2.0, 1.0, n) * rng.integers(0, 2, n)
    K = not_negative(rng, n, int(rng.integers(1, n + 1)))
    D = not_negative(rng, n, int(rng.integers(1, n + 1))) * rng.choice([0.01, 0.1, 1.0]) + np.diag(damping)
    root = rng.normal(size=(n, n))
    on_path = np.tril(rng.random((n, n)) < 0.6, -1)
    springs = K * rng.uniform(0.0, 1.0)
    return small(root @ root.T + 0.1 * np.eye(n), K, D, damping, springs, on_path | on_path.T | np.eye(n, dtype=bool))


def test_a_limit_is_where_the_spectral_radius_passes_one(rng):
    finite = dict.fromkeys(EVERY, 0)
    for _ in range(40):
        one = random_small(rng)
        assert one.is_symmetric and one.growing is None
        for name in EVERY:
            limit = one.limit(name)
            if limit.limit == "finite":
                finite[name] += 1
                assert one.has_closed_form(name) or name == "RK4"
                assert one.growth(name, 0.999 * limit.dt) <= 1.0 + 1e-9 < one.growth(name, 1.001 * limit.dt)
            elif limit.limit == "none":
                assert all(one.growth(name, dt) <= 1.0 + 1e-9 for dt in (0.01, 0.3, 4.9))
    assert min(finite.values()) > 5 and sum(finite.values()) > 80


@pytest.mark.parametrize("kv", [0.0, 0.3, 40.0])
def test_a_joint_with_a_servo_has_the_limits_of_its_formula(kv):
    """m = 2, k = 50: Euler with kv explicit, and with kv implicit."""
    m, k = 2.0, 50.0
    one = small(m, k, kv)
    explicit = (-kv + np.sqrt(kv * kv + 4.0 * m * k)) / k  # 4 m - 2 dt kv - dt^2 k = 0
    implicit = (kv + np.sqrt(kv * kv + 4.0 * m * k)) / k
    assert one.limit("Euler").dt == pytest.approx(explicit, rel=1e-8)
    assert one.limit("implicitfast").dt == pytest.approx(implicit, rel=1e-8)
    assert small(m, k, kv, damping=[kv]).limit("Euler").dt == pytest.approx(implicit, rel=1e-8)


def test_damping_across_branches_is_explicit():
    J = np.array([[1.0, -1.0]])
    D = 30.0 * J.T @ J
    apart = small(np.eye(2), np.eye(2), D, on_path=np.eye(2, dtype=bool))
    together = small(np.eye(2), np.eye(2), D)
    assert apart.braking("implicitfast").tolist() == [[30.0, 0.0], [0.0, 30.0]]
    # the mode along J meets 60 of damping, of which 30 are implicit: 4 + 2 dt (30 - 30) - dt^2 = 0; the other 4 + 60 dt - dt^2
    assert apart.limit("implicitfast").dt == pytest.approx(2.0, rel=1e-8)
    assert apart.limit("Euler").dt == pytest.approx(-60.0 + np.sqrt(3604.0), rel=1e-6)
    assert together.limit("implicit").dt == pytest.approx(2.0, rel=1e-8)


def test_rk4_has_the_limit_of_its_region():
    swing, decay = small(1.0, 900.0, 0.0).limit("RK4"), small(1.0, 0.0, 40.0).limit("RK4")
    assert swing.dt == pytest.approx(np.sqrt(8.0) / 30.0, rel=1e-6) and decay.dt == pytest.approx(
        POLE_RK4 / 40.0, rel=1e-6
    )
    assert (swing.rate, swing.kind) == (pytest.approx(30.0), "swing")


@pytest.mark.parametrize("implicit, longest", [(400.0, None), (200.0, None), (100.0, np.sqrt(4.0 / 200.0))])
def test_springs_of_which_half_is_implicit_have_no_limit(implicit, longest):
    """4 + dt^2 (2 x implicit - 400) = 0."""
    limit = small(1.0, 400.0, 0.0, springs=implicit).limit("discrete")
    assert limit.limit == "none" if longest is None else limit.dt == pytest.approx(longest)


def test_a_stiffness_that_is_not_symmetric_goes_by_the_eigenvalues(rng):
    several = 0
    for _ in range(25):
        one = random_small(rng)
        n = len(one.M)
        turned = small(
            one.M, one.K + 0.05 * np.abs(one.K).max() * rng.normal(size=(n, n)), one.D + np.eye(n), one.damping
        )
        assert not any(turned.has_closed_form(name) for name in EVERY)
        for name in ("Euler", "implicitfast"):
            limit = turned.limit(name)
            if limit.limit == "saddle":
                assert turned.modes[0].real.max() == pytest.approx(limit.rate)
            elif limit.limit == "finite":
                several += 1
                assert turned.growth(name, 0.99 * limit.dt) <= 1.0 + 1e-9 < turned.growth(name, 1.01 * limit.dt)
    assert several > 4


def test_a_force_that_turns_can_make_two_swings_grow():
    """K of equal swings and a circulation: no step is stable, and no energy says so."""
    limit = small(np.eye(2), [[100.0, 5.0], [-5.0, 100.0]], 1e-3 * np.eye(2)).limit("Euler")
    assert limit.limit == "saddle" and limit.rate == pytest.approx(0.25, rel=0.02)


@pytest.mark.parametrize("name", EVERY)
def test_a_saddle_says_how_fast_it_is_left_and_a_drift_that_nothing_holds(name):
    saddle = small(np.eye(2), np.diag([-16.0, 100.0]), np.zeros((2, 2))).limit(name)
    assert (saddle.limit, saddle.dt, saddle.joint, saddle.kind) == ("saddle", None, "joint0", "real")
    assert saddle.rate == pytest.approx(4.0)
    slow = small(np.eye(2), np.diag([-16.0, 100.0]), np.diag([6.0, 0.0])).limit(name)
    assert slow.rate == pytest.approx(2.0)  # s^2 + 6 s - 16 = 0
    assert small(np.eye(2), np.diag([0.0, 100.0]), np.zeros((2, 2))).limit(name).limit == "drifts"
    braked = small(np.eye(2), np.diag([0.0, 100.0]), np.diag([1.0, 0.0])).limit(name)
    assert braked.limit in ("finite", "none")


def test_rounding_is_no_saddle():
    """What is left where gravity is compensated."""
    noise = np.array([[-3e-15, 1e-15], [1e-15, 2e-15]])
    assert small(np.eye(2), noise, np.eye(2)).limit("Euler").limit != "saddle"
    assert small(np.eye(2), noise, np.zeros((2, 2))).limit("Euler").limit == "drifts"
    assert small(np.eye(2), noise - np.diag([1e-3, 0.0]), np.eye(2)).limit("Euler").limit == "saddle"


@pytest.mark.parametrize("name", EVERY)
def test_what_is_left_slowly_beside_a_stiff_servo_is_a_saddle_and_no_limit(name):
    """K is not symmetric: the eigenvalues alone say it, and what they are off goes with how well they are told apart."""
    slow = small(np.eye(2), [[1e10, 5e4], [0.0, -0.02]], np.diag([1e5, 10.0])).limit(name)
    assert slow.limit == "saddle" and slow.rate == pytest.approx(0.002, rel=1e-3)
    loose = small(np.eye(2), [[1e10, 0.0], [5e4, -1e-7]], np.diag([1e5, 0.0])).limit(name)
    assert loose.limit == "drifts"
    grows = small(np.eye(2), np.diag([1e8, 100.0]), np.diag([1e9, -0.05])).limit(name)
    assert grows.limit == "saddle" and grows.rate == pytest.approx(0.025, rel=1e-4)
    held = small(np.eye(2), [[1e10, 5e4], [0.0, 0.02]], np.diag([1e5, 10.0])).limit(name)
    assert held.limit in ("finite", "none")


@pytest.mark.parametrize("longest, kind", [(4.99, "finite"), (5.01, "none")])
def test_a_limit_is_one_up_to_five_seconds(longest, kind):
    turned = small(np.eye(2), 4.0 / longest**2 * np.array([[1.0, 0.01], [0.0, 0.5]]), 0.0 * np.eye(2))  # by eigenvalues
    filtered = small(1.0, 1e-3, 1.0, [1.0], poles=(("servo", longest / 2.0, False),))
    for one in (small(1.0, 4.0 / longest**2, 0.0), turned, filtered):
        assert one.limit("Euler").limit == kind


def test_a_fast_servo_leaves_the_limit_of_a_slow_joint_as_it_is():
    """K is not symmetric; kv of the one is implicit: 4 + 2 dt - 400 dt^2 = 0 of the other."""
    K, D = [[1e10, 5e4], [0.0, 400.0]], np.diag([1e9, 1.0])
    assert small(np.eye(2), K, D).limit("implicitfast").dt == pytest.approx((1.0 + np.sqrt(1601.0)) / 400.0, rel=1e-6)


@pytest.mark.parametrize("exact", [False, True])
def test_a_filter_has_a_limit_of_its_own(exact):
    one = small(1.0, 1.0, 1.0, damping=[1.0], poles=(("servo", 0.05, exact),))
    euler, rk4 = one.limit("Euler"), one.limit("RK4")
    assert (rk4.joint, rk4.dt) == ("servo", pytest.approx(POLE_RK4 * 0.05))
    assert euler.joint == ("joint0" if exact else "servo")
    if not exact:
        assert (euler.dt, euler.rate, euler.kind) == (pytest.approx(0.1), pytest.approx(20.0), "real")
        assert one.is_stable("Euler", 0.099) and not one.is_stable("Euler", 0.101)


@pytest.mark.parametrize("damping, kind", [(5.0, "real"), (0.01, "swing")])
def test_the_kind_of_a_limit_is_that_of_the_equations(damping, kind):
    M, D = np.diag([1.0, 1e-3]), np.diag([0.1, damping])
    limit = small(M, np.diag([4.0, 100.0]), D, damping=[0.1, 0.0]).limit("Euler")
    assert (limit.joint, limit.kind) == ("joint1", kind)
    assert limit.rate == pytest.approx(np.abs(np.roots([1e-3, damping, 100.0])).max())


@pytest.mark.parametrize("coupling", [0.0, 1.0])
@pytest.mark.parametrize("name", EVERY)
def test_the_joint_that_limits_is_the_fast_one(coupling, name):
    """Of three swings, one of them fast; K is symmetric or not."""
    K = np.diag([4.0, 900.0, 25.0])
    K[0, 2] = coupling
    limit = small(np.eye(3), K, 1e-3 * np.eye(3), springs=0.1 * K).limit(name)
    assert (limit.joint, limit.kind, limit.rate) == ("joint1", "swing", pytest.approx(30.0, rel=1e-3))


# free bases


def chain_of(rng, n=5, base=2):
    """Deviations with `base` speeds that nothing holds, and the others held."""
    root = rng.normal(size=(n, n))
    K, D = np.zeros((2, n, n))
    K[base:, base:] = not_negative(rng, n - base, n - base)
    D[base:, base:] = 0.1 * not_negative(rng, n - base, n - base)
    return small(root @ root.T + 0.1 * np.eye(n), K, D)


def test_a_free_base_moves_so_that_no_momentum_arises(rng):
    for _ in range(8):
        whole = chain_of(rng)
        without = whole.free([0, 1])
        assert without.names == ("joint2", "joint3", "joint4")
        for name in ("Euler", "implicitfast"):
            limit = without.limit(name)
            if limit.limit == "finite":
                # with the zero modes left in, the same
                assert whole.growth(name, 0.999 * limit.dt) <= 1.0 + 1e-6 < whole.growth(name, 1.001 * limit.dt)
                assert limit.dt <= (whole.locked([0, 1]).limit(name).dt or np.inf)


def test_without_speeds_there_is_no_limit_but_that_of_filters():
    empty = small(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), poles=(("rotor", 0.1, False),)).free([0, 1])
    assert not empty.names and empty.limit("Euler").dt == pytest.approx(0.2)
