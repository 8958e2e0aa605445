"""Terms of sines and cosines that are wrong: named with both numbers, in the joints' names; else which coefficients differ."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosed import diagnosis, states, values

import tmt
from compare.diagnosis import packed

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
PARALLEL_AXIS = "parallel-axis term m (c'c 1 - c c') of "


def mass_matrix(q=Q, of_hip=1.0, of_both=0.5, last=0.35):
    c = np.cos(q[:, 1])
    rows = [[1.7 + of_hip * c, 0.35 + of_both * c], [0.35 + of_both * c, last + 0.0 * c]]
    return np.moveaxis(np.array(rows), 2, 0)


def weight(q, sign=1.0):
    lower = 4.905 * np.sin(q[:, 0] + sign * q[:, 1])
    return np.stack([14.715 * np.sin(q[:, 0]) + lower, lower], axis=1)


def velocity(q, qd):
    s = 0.5 * np.sin(q[:, 1])
    return np.stack([-s * (qd[:, 1] ** 2 + 2.0 * qd[:, 0] * qd[:, 1]), s * qd[:, 0] ** 2], axis=1)


def right_bias(q, qd):
    return weight(q) + velocity(q, qd)


def told(M=None, bias=right_bias):
    """What is found of Mbar at Q and of a function of q and qd."""
    M = mass_matrix() if M is None else M
    return diagnosis(packed(M, bias(Q, QD), 2, len(Q)), TREE, bias=lambda qd: bias(Q, qd))


CASES = {  # Mbar, h: the coefficients that are named, and what is said of each: of yours, of the right one
    "a factor": (mass_matrix(of_hip=0.5), right_bias, ["M[hip][hip]"], [" cos(knee) ", " 0.5 ", " 1"]),
    "another angle": (
        None, lambda q, qd: weight(q, sign=-1.0) + velocity(q, qd), ["h[hip], gravity", "h[knee], gravity"],
        [" 4.905 sin(hip - knee) ", " 4.905 sin(hip + knee)"],
    ),
    "an angle for its sine": (
        None, lambda q, qd: right_bias(q, qd) + 14.715 * (q - np.sin(q))[:, :1] * [1.0, 0.0],
        ["h[hip], gravity"], [" 14.715 hip ", " 14.715 sin(hip)"],
    ),
    "a term of the speeds": (
        None, lambda q, qd: right_bias(q, qd) + (0.2 * np.cos(q[:, 0]) * qd[:, 0] * qd[:, 1])[:, None] * [0.0, 1.0],
        ["h[knee], coefficient of hip' knee'"], [" 0.2 cos(hip) "],
    ),
}  # fmt: skip


@pytest.mark.parametrize("M, bias, names, numbers", CASES.values(), ids=CASES)
def test_a_wrong_term_is_named(M, bias, names, numbers):
    (cause,) = told(M, bias).causes
    assert (cause.rank, cause.kind) == (2, "term") and all(name in cause.place for name in names)
    assert cause.place.count("[") == " ".join(names).count("[")  # and no other
    at = [cause.text.replace("the right one is", "").find(number) for number in numbers]
    assert -1 not in at and at == sorted(at)


def test_the_arguments_of_bias_exchanged():
    assert not told().differs
    (cause,) = told(bias=lambda q, qd: right_bias(qd, q)).causes
    assert (cause.place, cause.explains) == ("arguments of bias", "exchanged, bias(qd, q)")


def test_a_parallel_axis_term_left_out():
    """Of one entry; and of the arm's Mbar, but not of its h."""
    causes = {cause.place: cause for cause in told(mass_matrix(last=0.1)).causes}
    (of_entry,) = (place for place in causes if place.startswith(PARALLEL_AXIS))
    assert set(causes) == {of_entry, "M[knee][knee]"} and "lower" in of_entry and "M[knee][knee]" in of_entry
    q, _ = states(tmt.ARM)
    com, turns = np.array(tmt.ARM.com), tmt.jacobians(q)[1]
    moved = np.einsum("bi,bi->b", com, com)[:, None, None] * np.eye(3) - com[:, :, None] * com[:, None]
    given = values()
    of_bodies = np.einsum("b,sbci,bcd,sbdj->sij", np.array(tmt.ARM.mass), turns, moved, turns)
    given[:, :6] -= packed(of_bodies, None, 3, len(q))[:, :6]
    (cause,) = diagnosis(given).causes
    assert cause.place.startswith(f"{PARALLEL_AXIS}every body ") and cause.place.endswith(" in M alone")


def test_what_no_term_explains_is_told_by_its_part():
    found = told(bias=lambda q, qd: right_bias(q, qd) + np.exp(q / 3.0) * [0.0, 0.1])
    assert found.causes == () and "h[knee], gravity" in found.details
    assert not any(other in found.details for other in ("hip'", "M[", "h[hip]"))


def test_what_no_body_can_have_is_not_offered():
    assert not any("inertia yy of lower" in cause.place for cause in told(mass_matrix() - 0.2).causes)


def test_rounded_constants_are_told_where_all_is_small_alone():
    """All terms are off by a little, or one that is small beside h by half."""
    rounded = mass_matrix(of_hip=1.0003, of_both=0.50004, last=0.3502)
    small = told(rounded, lambda q, qd: 1.0004 * weight(q) + 0.9997 * velocity(q, qd))
    assert small.causes == () and small.is_small
    slip = told(bias=lambda q, qd: right_bias(q, qd) + 1e-4 * np.tanh(q) * qd[:, :1] ** 2)
    assert slip.causes == () and not slip.is_small and slip.digits > 2.0


@pytest.mark.parametrize("size", [1e-12, np.inf])
def test_neither_noise_nor_numbers_at_random_have_a_culprit(size):
    noise, right = np.random.default_rng(1).normal(size=(len(Q), 5)), values(TREE, Q, QD)
    found = diagnosis(right * (1.0 + size * noise) if size < 1.0 else noise, TREE)
    assert found.differs and found.causes == ()
    assert found.digits == pytest.approx(-np.log10(size), abs=1.5) if size < 1.0 else len(found.entries) == 5


def test_slides_have_powers():
    """A cart with a rod: M[slide][slide] is the constant, M[slide][hinge] has cos(hinge)."""
    tree = replace(TREE, hinge_names=("cart", "rod"), kind=("slide", "hinge"), axis=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
                   offset=((0.0,) * 3,) * 2)  # fmt: skip
    given = values(tree, Q, QD)
    given[:, 0] += 0.3 * Q[:, 0] * np.cos(Q[:, 1])
    (cause,) = diagnosis(given, tree).causes
    assert cause.place == "M[cart][cart]" and "0.3 cart cos(rod)" in cause.text
