"""Terms of sines and cosines that are wrong: named with both numbers, in the joints' names; else which coefficients differ."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosed import states, tolerance

import tmt
from compare.diagnosis import diagnose, packed

# two rods in a plane: Mbar and h below
TREE = tmt.Tree(
    hinge_names=("hip", "knee"),
    parent=(-1, 0),
    offset=((0.0, 0.0, 0.0), (0.0, 0.0, -1.0)),
    axis=((0.0, 1.0, 0.0),) * 2,
    damping=(0.0, 0.0),
    body_names=("upper", "lower"),
    body_hinge=(0, 1),
    mass=(1.0, 1.0),
    com=((0.0, 0.0, -0.5),) * 2,
    inertia=(np.diag([0.1, 0.1, 0.01]).tolist(),) * 2,
    gravity=(0.0, 0.0, -9.81),
)
Q, QD = states(TREE)


def mass_matrix(q, of_hip=1.0, of_both=0.5, last=0.35):
    c = np.cos(q[:, 1])
    rows = [[1.7 + of_hip * c, 0.35 + of_both * c], [0.35 + of_both * c, last + 0.0 * c]]
    return np.moveaxis(np.array(rows), 2, 0)


def weight(q, of_both=np.sin, sign=1.0):
    lower = 4.905 * of_both(q[:, 0] + sign * q[:, 1])
    return np.stack([14.715 * np.sin(q[:, 0]) + lower, lower], axis=1)


def velocity(q, qd):
    s = 0.5 * np.sin(q[:, 1])
    return np.stack([-s * (qd[:, 1] ** 2 + 2.0 * qd[:, 0] * qd[:, 1]), s * qd[:, 0] ** 2], axis=1)


def told(M=None, bias=None, tree=TREE, asks=True):
    """What is said of Mbar at q and of a function of q and qd."""
    M = mass_matrix(Q) if M is None else M
    bias = bias or (lambda q, qd: weight(q) + velocity(q, qd))
    of_speeds = (lambda qd: bias(Q, qd)) if asks else None
    given = packed(M, bias(Q, QD), 2, len(Q))
    return diagnose(tree, tree.hinge_names, Q, QD, given, tolerance(tree, Q, QD), bias=of_speeds)


def test_these_equations_are_right():
    assert not told().differs


CASES = {
    "a factor": (mass_matrix(Q, of_hip=0.5), None, "M[hip][hip]: the factor of cos(knee) is 0.5 in yours, the right one is 1"),
    "a factor of two entries": (
        mass_matrix(Q, of_both=1.0), None, "M[hip][knee]: the factor of cos(knee) is 1 in yours, the right one is 0.5",
    ),
    "cos for sin": (
        None, lambda q, qd: weight(q, np.cos) + velocity(q, qd),
        "sin and cos exchanged: h[hip], gravity: yours has 4.905 cos(hip + knee) in place of 4.905 sin(hip + knee); "
        "h[knee], gravity: yours has 4.905 cos(hip + knee) in place of 4.905 sin(hip + knee)",
    ),
    "another angle": (
        None, lambda q, qd: weight(q, sign=-1.0) + velocity(q, qd),
        "h[hip], gravity: yours has 4.905 sin(hip - knee) in place of 4.905 sin(hip + knee); "
        "h[knee], gravity: yours has 4.905 sin(hip - knee) in place of 4.905 sin(hip + knee)",
    ),
    "an angle for its sine": (
        None, lambda q, qd: weight(q) + velocity(q, qd) + 14.715 * (q - np.sin(q))[:, :1] * [1.0, 0.0],
        "h[hip], gravity: yours has 14.715 hip in place of 14.715 sin(hip)",
    ),
    "a term of the speeds": (
        None, lambda q, qd: weight(q) + velocity(q, qd) + (0.2 * np.cos(q[:, 0]) * qd[:, 0] * qd[:, 1])[:, None] * [0.0, 1.0],
        "h[knee], coefficient of hip' knee': yours has 0.2 cos(hip) too much",
    ),
}  # fmt: skip


@pytest.mark.parametrize("M, bias, text", CASES.values(), ids=CASES)
def test_a_wrong_term_is_named(M, bias, text):
    (cause,) = told(M, bias).causes
    assert (cause.rank, cause.kind, cause.text) == (2, "term", text)


def test_the_arguments_of_bias_exchanged():
    (cause,) = told(bias=lambda q, qd: weight(qd) + velocity(qd, q)).causes
    assert (cause.place, cause.explains) == ("arguments of bias", "exchanged, bias(qd, q)")


@pytest.mark.parametrize("body, last, first", [("lower", 0.1, 1.45), ("every body", 0.1, 1.2)])
def test_a_parallel_axis_term_left_out(body, last, first):
    """Of one rod or both, in a plane: nothing of h depends on it."""
    M = mass_matrix(Q, last=last) - np.array([[1.7 - first, 0.25], [0.25, 0.0]])
    (cause,) = told(M).causes
    assert cause.text == f"parallel-axis term m (c'c 1 - c c') of {body} left out"


def test_a_parallel_axis_term_left_out_of_one_entry_and_of_the_arms_mass_matrix_alone():
    assert {cause.text for cause in told(mass_matrix(Q, last=0.1)).causes} == {
        "M[knee][knee]: yours is 0.1, the right one 0.35",
        "parallel-axis term m (c'c 1 - c c') of lower left out in M[knee][knee] alone",
    }
    q, qd = states(tmt.ARM)
    com, mass = np.array(tmt.ARM.com), np.array(tmt.ARM.mass)
    turns = tmt.jacobians(q)[1]
    moved = mass[:, None, None] * (
        np.einsum("bi,bi->b", com, com)[:, None, None] * np.eye(3) - com[:, :, None] * com[:, None]
    )
    M = tmt.mass_matrix(q) - np.einsum("sbci,bcd,sbdj->sij", turns, moved, turns)
    given = packed(M, tmt.bias(q, qd), 3, len(q))
    (cause,) = diagnose(tmt.ARM, tmt.ARM.hinge_names, q, qd, given, tolerance(tmt.ARM, q, qd)).causes
    assert cause.text == "parallel-axis term m (c'c 1 - c c') of every body left out in M alone"


def test_what_no_term_explains_is_told_with_both_numbers_and_its_part():
    found = told(bias=lambda q, qd: weight(q) * [1.0, 1.0] + np.exp(q / 3.0) * [0.0, 0.1] + velocity(q, qd))
    assert found.causes == () and "Only gravity differs; M and the velocity terms of h agree." in found.sentence
    assert "h[knee], gravity: yours is " in found.details and ", the right one " in found.details
    assert "hip'" not in found.details and "M[" not in found.details
    found = told(bias=lambda q, qd: weight(q) + velocity(q, qd) * np.exp(q[:, :1] / 9.0))
    assert "Only the velocity terms of h differ; M and gravity agree." in found.sentence
    assert "h[hip], coefficient of hip' knee': yours is " in found.details
    assert told(M=mass_matrix(Q) * np.exp(Q / 9.0)[:, :1, None]).details.startswith("Only M differs; gravity and the ")


def test_rounded_constants_are_told_where_all_is_small_alone():
    """All terms are off by a little, or one that is small beside h by half."""
    small = told(
        M=mass_matrix(Q, 1.0003, 0.50004, 0.3502), bias=lambda q, qd: 1.0004 * weight(q) + 0.9997 * velocity(q, qd)
    )
    assert small.causes == () and small.is_small and "rounded constants, or noise" in small.sentence
    slip = told(bias=lambda q, qd: weight(q) + velocity(q, qd) + 1e-4 * np.tanh(q) * qd[:, :1] ** 2)
    assert slip.causes == () and not slip.is_small and "rounded constants" not in slip.sentence and slip.digits > 2.0


@pytest.mark.parametrize("asks", [True, False])
def test_values_without_a_function_are_told_of_in_M(asks):
    (cause,) = told(mass_matrix(Q, of_hip=0.5), asks=asks).causes
    assert cause.text.startswith("M[hip][hip]: the factor of cos(knee) is 0.5")


def test_slides_have_powers():
    """A cart with a rod: M[slide][slide] is the constant, M[slide][hinge] has cos(hinge)."""
    tree = replace(TREE, hinge_names=("cart", "rod"), kind=("slide", "hinge"), axis=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
                   offset=((0.0,) * 3,) * 2)  # fmt: skip
    M, h = tmt.mass_matrix(Q, tree), tmt.bias(Q, QD, tree)
    M[:, 0, 0] += 0.3 * Q[:, 0] * np.cos(Q[:, 1])
    given = packed(M, h, 2, len(Q))
    (cause,) = diagnose(tree, tree.hinge_names, Q, QD, given, tolerance(tree, Q, QD)).causes
    assert cause.text == "M[cart][cart]: yours has 0.3 cart cos(rod) too much"
