"""Limits of the step of linear equations: the closed form beside the eigenvalues of steps, and what has none."""

import numpy as np
import pytest

from compare.truth.step_limits import POLE_RK4, Small

EVERY = ("Euler", "implicitfast", "implicit", "discrete", "RK4")


def small(M, K, D, damping=0.0, springs=0.0, on_path=True, poles=()):
    """Small deviations of plain numbers; implicit: nothing by Euler, all by the others, but where something else is said."""
    M, K, D = (np.atleast_2d(np.asarray(x, float)) for x in (M, K, D))
    names, damping = [f"joint{k}" for k in range(len(M))], np.zeros(len(M)) + damping
    return Small(
        tuple(names), M, K, D, damping, 0.0 * K + springs, D, np.ones(K.shape, bool) & on_path, poles
    )


def alone(K, D, **more):
    """The same of unit masses; K and D by their diagonals, or whole."""
    K, D = (np.diag(x) if np.ndim(x) == 1 else np.atleast_2d(x) for x in (K, D))
    return small(np.eye(len(K)), K, D, **more)


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
    on_path = on_path | on_path.T | np.eye(n, dtype=bool)
    return small(root @ root.T + 0.1 * np.eye(n), K, D, damping, K * rng.uniform(0.0, 1.0), on_path)


def assert_passes_one(one, name, dt, by):
    """The spectral radius of a step, within a share of a limit."""
    assert one.growth(name, (1.0 - by) * dt) <= 1.0 + 1e-9 < one.growth(name, (1.0 + by) * dt)


@pytest.mark.parametrize("turning", [0.0, 0.05])
def test_a_limit_is_where_the_spectral_radius_passes_one(turning, rng):
    """Of symmetric matrices and others."""
    finite = dict.fromkeys(EVERY, 0)
    for _ in range(25):
        one = random_small(rng)
        if turning:
            turned = one.K + turning * np.abs(one.K).max() * rng.normal(size=one.K.shape)
            one = small(one.M, turned, one.D + np.eye(len(one.M)), one.damping)
        for name in EVERY:
            limit = one.limit(name)
            if limit.limit == "finite":
                finite[name] += 1
                assert_passes_one(one, name, limit.dt, 0.001)
            elif limit.limit == "none":
                assert all(one.growth(name, dt) <= 1.0 + 1e-9 for dt in (0.01, 0.3, 4.9))
            elif limit.limit == "saddle":
                assert turning and one.modes[0].real.max() == pytest.approx(limit.rate)
    assert min(finite.values()) > 1


KV, M, K = 30.0, 2.0, 50.0
ACROSS = KV * np.array([[1.0, -1.0], [-1.0, 1.0]])
SWING, DECAY = np.sqrt(8.0) / 30.0, POLE_RK4 / 40.0
KNOWN = {  # what is limited, by which integrator, and the limit in closed form; None: there is none
    # 4 m - 2 dt kv - dt^2 k = 0 with kv explicit, + 2 dt kv where it is implicit
    "a servo": (small(M, K, KV), "Euler", (-KV + np.sqrt(KV * KV + 4.0 * M * K)) / K),
    "kv implicit": (small(M, K, KV), "implicitfast", (KV + np.sqrt(KV * KV + 4.0 * M * K)) / K),
    "kv of a joint": (small(M, K, KV, damping=[KV]), "Euler", (KV + np.sqrt(KV * KV + 4.0 * M * K)) / K),
    # the mode across branches meets 60 of damping, of which 30 are implicit: 4 + 2 dt (30 - 30) - dt^2 = 0
    "across branches": (alone([1, 1], ACROSS, on_path=np.eye(2, dtype=bool)), "implicitfast", 2.0),
    "across branches, Euler": (alone([1, 1], ACROSS), "Euler", -60.0 + np.sqrt(3604.0)),
    "on one path": (alone([1, 1], ACROSS), "implicit", 2.0),
    "RK4, a swing": (small(1.0, 900.0, 0.0), "RK4", SWING),
    "RK4, a decay": (small(1.0, 0.0, 40.0), "RK4", DECAY),
    # 4 + dt^2 (2 x implicit - 400) = 0
    "half of a spring implicit": (small(1.0, 400.0, 0.0, springs=200.0), "discrete", None),
    "a quarter": (small(1.0, 400.0, 0.0, springs=100.0), "discrete", np.sqrt(4.0 / 200.0)),
    # K is not symmetric; kv of the fast one is implicit: 4 + 2 dt - 400 dt^2 = 0 of the other
    "beside a fast servo": (alone([[1e10, 5e4], [0.0, 400.0]], [1e9, 1.0]), "implicitfast", (1 + np.sqrt(1601.0)) / 400),
    # one limit is up to five seconds: by its closed form, by eigenvalues, of a filter
    "4.99 s": (small(1.0, 4.0 / 4.99**2, 0.0), "Euler", 4.99),
    "5.01 s": (small(1.0, 4.0 / 5.01**2, 0.0), "Euler", None),
    "4.99 s, turned": (alone(4.0 / 4.99**2 * np.array([[1.0, 0.01], [0.0, 0.5]]), [0, 0]), "Euler", 4.99),
    "5.01 s, turned": (alone(4.0 / 5.01**2 * np.array([[1.0, 0.01], [0.0, 0.5]]), [0, 0]), "Euler", None),
    "4.99 s, filter": (small(1.0, 1e-3, 1.0, [1.0], poles=(("servo", 4.99 / 2, False),)), "Euler", 4.99),
    "5.01 s, filter": (small(1.0, 1e-3, 1.0, [1.0], poles=(("servo", 5.01 / 2, False),)), "Euler", None),
    "a filterexact": (small(1.0, 1.0, 1.0, [1.0], poles=(("servo", 0.05, True),)), "Euler", 1.0 + np.sqrt(5.0)),
    "a filterexact, RK4": (small(1.0, 1.0, 1.0, [1.0], poles=(("servo", 0.05, True),)), "RK4", 0.05 * POLE_RK4),
}  # fmt: skip


@pytest.mark.parametrize("one, integrator, dt", KNOWN.values(), ids=KNOWN)
def test_a_limit_in_closed_form(one, integrator, dt):
    limit = one.limit(integrator)
    assert limit.limit == ("none" if dt is None else "finite")
    assert limit.dt == (dt and pytest.approx(dt, rel=1e-6))


@pytest.mark.parametrize("name", EVERY)
def test_a_saddle_says_how_fast_it_is_left_and_a_drift_that_nothing_holds(name):
    saddle = alone([-16.0, 100.0], [0, 0]).limit(name)
    assert (saddle.limit, saddle.dt, saddle.joint, saddle.kind) == ("saddle", None, "joint0", "real")
    for K, D, rate, off in (
        ([-16.0, 100.0], [0.0, 0.0], 4.0, 1e-6),
        ([-16.0, 100.0], [6.0, 0.0], 2.0, 1e-6),  # s^2 + 6 s - 16 = 0
        ([[100.0, 5.0], [-5.0, 100.0]], [1e-3, 1e-3], 0.25, 0.02),  # a force that turns, though no energy says so
        # left slowly beside a stiff servo, K symmetric or not:
        ([[1e10, 5e4], [0.0, -20.0]], [1e5, 10.0], 1.71, 1e-2), ([1e8, 100.0], [1e5, -0.5], 0.25, 1e-4),
    ):  # fmt: skip
        limit = alone(K, D).limit(name)
        assert limit.limit == "saddle" and limit.rate == pytest.approx(rate, rel=off)
    for K, D in (([0.0, 100.0], [0.0, 0.0]), ([[1e10, 0.0], [5e4, -1e-7]], [1e5, 0.0])):
        assert alone(K, D).limit(name).limit == "drifts"
    for K, D in (([0.0, 100.0], [1.0, 0.0]), ([[1e10, 5e4], [0.0, 0.02]], [1e5, 10.0])):
        assert alone(K, D).limit(name).limit in ("finite", "none")


def test_rounding_is_no_saddle():
    """What is left where gravity is compensated."""
    noise = np.array([[-3e-15, 1e-15], [1e-15, 2e-15]])
    assert alone(noise, [1, 1]).limit("Euler").limit != "saddle"
    assert alone(noise, [0, 0]).limit("Euler").limit == "drifts"
    assert alone(noise - np.diag([1e-3, 0.0]), [1, 1]).limit("Euler").limit == "saddle"


@pytest.mark.parametrize("name", EVERY)
def test_the_joint_that_limits_is_the_fast_one(name):
    """Of three, K symmetric or not; it swings or is damped. Or it is a filter."""
    for coupling, damping, kind in ((0.0, 1e-3, "swing"), (1.0, 1e-3, "swing"), (0.0, 75.0, "real")):
        K, D = np.diag([4.0, 900.0, 25.0]), np.diag([1e-3, damping, 1e-3])
        K[0, 2] = coupling
        limit = small(np.eye(3), K, D, springs=0.1 * K, on_path=np.zeros((3, 3), bool)).limit(name)
        assert (limit.joint, limit.kind) == ("joint1", kind)
        assert limit.rate == pytest.approx(np.abs(np.roots([1.0, damping, 900.0])).max(), rel=1e-3)
    limit = small(1.0, 1.0, 1.0, [1.0], poles=(("servo", 0.05, False),)).limit(name)
    assert (limit.joint, limit.kind) == ("servo", "real") and limit.rate == pytest.approx(20.0)


def test_a_free_base_moves_so_that_no_momentum_arises(rng):
    """Of five speeds nothing holds two."""
    for _ in range(8):
        root, (K, D) = rng.normal(size=(5, 5)), np.zeros((2, 5, 5))
        K[2:, 2:], D[2:, 2:] = not_negative(rng, 3, 3), 0.1 * not_negative(rng, 3, 3)
        whole = small(root @ root.T + 0.1 * np.eye(5), K, D)
        without = whole.free([0, 1])
        assert without.names == ("joint2", "joint3", "joint4")
        for name in ("Euler", "implicitfast"):
            limit = without.limit(name)
            if limit.limit == "finite":
                assert_passes_one(whole, name, limit.dt, 0.001)  # with the zero modes left in, the same
                assert limit.dt <= (whole.locked([0, 1]).limit(name).dt or np.inf)
