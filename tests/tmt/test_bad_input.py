"""Whatever a user can get wrong gets a ValueError of one line that says what was given and what is accepted."""

import dataclasses
import warnings
from decimal import Decimal
from functools import partial
from inspect import signature

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import tmt
from tmt.compiled import Evaluator, runner_of
from tmt.derivation.quantities import PLAIN, QUANTITIES
from tmt.methods import METHODS

REST = np.zeros(3)
TOOL = dataclasses.replace(tmt.ARM, site_names=["tool"], site_joint=[2])
ALIKE = dataclasses.replace(tmt.ARM, site_names=["a b", "a_b", "a+c"], site_joint=[2, 1, 0])
LARGE = dataclasses.replace(tmt.ARM, gravity=(0.0, 0.0, 2e40))


def moved(dt=0.1, steps=10, method="rk4", q=REST, qd=REST, tau=REST, model=tmt.ARM, **more):
    return tmt.simulate(model, q, qd, tau, dt, steps, method, **more)


def stepped(name, value):
    """A step with another argument."""
    return tmt.step_derivatives(
        **{"model": tmt.ARM, "q": REST, "qd": REST, "tau": REST, "dt": 0.1} | {name: value}
    )


def refused(call, *arguments) -> str:
    """The message, of one line, of the ValueError that the call raises, without a warning before it."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ValueError) as error:
            call(*arguments)
    message = str(error.value)
    assert message and "\n" not in message and len(message) < 500
    return message


def with_field(of, name):
    return lambda value: dataclasses.replace(of, **{name: value})


RK4, TABLE = METHODS["rk4"], ((), (0.5, 0.5), (0.0, 0.5), (0.0, 0.0, 1.0))
EQUATIONS = [  # arguments of equations, and the word
    ({"language": "fortran"}, "language"), ({"language": None}, "language"), ({"quantities": []}, "quantity"),
    ({"quantities": ["mass"]}, "mass"), ({"quantities": "energie"}, "energie"), ({"model": "arm"}, "model"),
    *(({"name": name}, "name") for name in ("2", "_x", "while", "energy", None)),
    ({"model": ALIKE, "quantities": ["frame_pose:a b", "frame_pose:a_b"]}, "frame_pose_a_b"),
    ({"model": LARGE, "quantities": ["bias"], "single": True}, "single precision"),
    ({"language": "python", "single": True}, "single"), ({"language": "latex", "quantities": ["jacobians"]}, "jacobians"),
]  # fmt: skip
SAID = [  # calls that are refused, and a word of what is said
    *((partial(tmt.equations, **{"model": tmt.ARM} | given), word) for given, word in EQUATIONS),
    (partial(with_field(RK4, "b"), (1.0, 0.5, 0.0, 0.0)), "1.5"), (partial(with_field(RK4, "A"), TABLE), "entries"),
    (partial(with_field(RK4, "c"), (0.0, 0.5, 0.4, 1.0)), "row 2 of A"),
    (partial(with_field(METHODS["implicit_midpoint"], "A"), ((),)), "square"),
    (partial(tmt.ARM.lock, {"wrist": 0.0}), "no joint 'wrist'"),
    (partial(tmt.ARM.lock, dict.fromkeys(tmt.ARM.joint_names, 0.0)), "at least one must be free"),
    (lambda: tmt.mass_matrix(tmt.ARM, np.zeros((2, 4))), "(2, 4)"),
    (lambda: tmt.mass_matrix(tmt.ARM, [0.0, np.inf, 0.0]), "not finite"),
    (lambda: tmt.bias(tmt.ARM, np.zeros((2, 3)), np.zeros((4, 3))), "q (2, 3), qd (4, 3)"),
    (lambda: moved(0.0), "dt is"),
    (lambda: moved(1e308, 100), "largest double"),
    *((lambda n=n: moved(1e-30, n, every=n), "steps is") for n in (0, 2**63, 10**400)),
    (lambda: moved(method="rk5"), "rk4, rk4_mean_speed, dopri8"),
    (lambda: tmt.frame(tmt.ARM, "hand", REST), "upper arm, forearm"),
    (partial(stepped, "method", "taylor"), "dopri8"), (partial(stepped, "dt", -0.1), "dt is"),
    (lambda: tmt.prepare(tmt.ARM, "step_derivatives:implicit_midpoint"), "NumPy alone"),
    (partial(with_field(tmt.ARM, "site_names"), ["tool"]), "site_joint"),
    (lambda: moved(method="dopri8_adaptive", tolerance=0.0), "tolerance"),
    *((lambda every=every: moved(every=every), "every is") for every in (3, 0)),
    (lambda: moved(1e-3, 10**12), "4.8e+04 GB"),
    (lambda: tmt.acceleration(tmt.ARM, np.zeros((10**5, 1, 1, 3)), np.zeros((10**5, 1, 3)), np.zeros((10**5, 3))), "memory"),
]  # fmt: skip


@pytest.mark.parametrize("call, word", SAID)
def test_what_is_wrong_is_said(call, word):
    assert word in refused(call)


class NoArray:
    """Neither an array nor a text can be made of it."""

    def __array__(self, *arguments, **named):
        raise RuntimeError("no array")

    def __repr__(self):
        raise RuntimeError("no\ntext")


ITSELF = []
ITSELF.append(ITSELF)
MASKED = np.ma.array([1.0, 2.0, 3.0], mask=[False, True, False])
# for no argument any of these will do
NONSENSE = [
    b"x", 1j, {"q": 1}, {1, 2}, object(), NoArray(), [NoArray()] * 3, ITSELF, [1, 2, "x"], [[1, 2, 3], [1, 2]],
    [True, False, True], np.array([1j, 0, 0]), np.array([None] * 3), 10**400, [10**5000] * 3, np.nan, [np.inf, 0, 0], MASKED,
    [MASKED], [np.ma.masked, 1, 2], np.zeros(0), np.zeros((3, 2)), np.datetime64("2020"), np.array(["2020"] * 3, "M8[D]"),
    [Decimal(1)] * 3, ..., np.zeros(3, [("a", float)]), np.full(3, np.longdouble("1e4000")), "no such name", "two\nlines",
]  # fmt: skip


PLACES = {
    **{name: partial(getattr(tmt, name), tmt.ARM, *[REST] * (len(QUANTITIES[name].takes) - 1)) for name in PLAIN},
    "name of a frame": lambda name: tmt.frame(tmt.ARM, name, REST),
    "speeds of a frame": lambda qd: tmt.frame(tmt.ARM, "forearm", REST, qd),
    **{f"{name} of a step": partial(stepped, name) for name in ("q", "qd", "tau", "dt", "method", "model")},
    **{name: lambda value, name=name: moved(**{name: value}) for name in ("q", "qd", "tau", "dt", "steps", "method", "model")},
    "tolerance": lambda value: moved(method="dopri8_adaptive", tolerance=value),
    "model of a quantity": lambda model: tmt.mass_matrix(model, REST),
    "lock": tmt.ARM.lock,
    "angle": lambda angle: tmt.ARM.lock({"beta": angle}),
    **{f"Tree.{field.name}": with_field(TOOL, field.name) for field in dataclasses.fields(tmt.Tree)},
    **{f"method.{part}": with_field(METHODS["dopri8_adaptive"], part) for part in ("order", "A", "b", "c", "errors")},
    "A of an implicit method": with_field(METHODS["implicit_midpoint"], "A"),
    "tree of an evaluator": lambda tree: Evaluator(tree, "acceleration"),
    "quantity": lambda quantity: Evaluator(tmt.ARM, quantity),
    "tree of a runner": lambda tree: runner_of(tree, "rk4"),
    "method of a runner": lambda name: runner_of(tmt.ARM, name),
    "model of prepare": tmt.prepare,
    "quantity of prepare": lambda name: tmt.prepare(tmt.ARM, name),
    **{
        f"{of} of equations": lambda value, of=of: tmt.equations(**{"model": tmt.ARM, of: value})
        for of in signature(tmt.equations).parameters
    },
}  # fmt: skip


@pytest.mark.parametrize("call", PLACES.values(), ids=PLACES)
def test_nonsense_is_refused_in_one_line(call):
    for value in NONSENSE:
        refused(call, value)


@pytest.mark.filterwarnings("error")
@settings(max_examples=25)
@given(arrays(float, (3, 3), elements=st.floats(allow_nan=False, allow_infinity=False)))
def test_finite_numbers_give_finite_results_or_a_reason(state):
    q, qd, tau = state
    for call, arguments in ((tmt.bias, (q, qd)), (tmt.convective_terms, (q, qd)), (tmt.acceleration, state)):
        try:
            assert np.isfinite(call(tmt.ARM, *arguments)).all()
        except ValueError as error:
            assert "beyond the largest double" in str(error) and np.abs(state).max() > 1e100
    assert not np.isnan(tmt.energy(tmt.ARM, q, qd))
    motion = tmt.simulate(tmt.ARM, q, qd, tau, 0.01, 3)
    assert (motion.ended is None) == bool(np.isfinite(motion.q).all() and np.isfinite(motion.qd).all())


@pytest.mark.parametrize("q", [[np.nan, 0.0, 0.0], [[np.nan, np.nan, np.nan], [0.0, np.nan, 0.0]]])
def test_the_energy_of_a_state_of_which_some_is_no_number_is_refused(q):
    """Where all of it is NaN a run has ended, and so has its energy."""
    with pytest.raises(ValueError):
        tmt.energy(tmt.ARM, q, np.zeros(np.shape(q)))
    assert np.isnan(tmt.energy(tmt.ARM, np.full(np.shape(q), np.nan), np.zeros(np.shape(q)))).all()
