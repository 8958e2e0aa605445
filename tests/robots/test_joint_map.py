"""How joints of one's own are stated, and what is mapped between them and those of a model."""

import numpy as np
import pytest

import tmt
from compare.robots.coordinates import Coordinates
from compare.robots.joint_map import JointsError, joint_map
from compare.robots.placement import matched_joints

ARM = Coordinates(("hip", "knee", "rail"), ("hinge", "hinge", "slide"))
MIXED = Coordinates(("rail", "turn", "knee"), ("slide", "ball", "hinge"))


def test_positions_speeds_and_forces_of_ones_own():
    assert joint_map(ARM, None).is_same and joint_map(ARM, ["hip", "knee", "rail"]).is_same
    of = joint_map(ARM, ["rail-0.5m", "-knee+90deg in deg", "hip in deg (rad/s)"])
    q, v = np.array([0.1, np.radians(30.0), 2.0]), np.array([1.0, 2.0, 3.0])
    assert np.allclose(of.own_positions(q), [1.5, 60.0, np.degrees(0.1)])
    assert np.allclose(of.own_speeds(v), [3.0, -np.degrees(2.0), 1.0])
    assert np.allclose(of.own_forces(v), [3.0, -2.0, 1.0])  # N m, whatever the unit of positions
    M = np.arange(9.0).reshape(3, 3)
    assert np.allclose(of.own_mass_matrix(M), [[8.0, -7.0, 6.0], [-5.0, 4.0, -3.0], [2.0, -1.0, 0.0]])


@pytest.mark.parametrize("coordinates, stated", [
    (ARM, ["knee", "hip", "rail"]), (ARM, ["hip", "knee-0.1rad", "rail+0.2m"]),
    (ARM, ["rail+0.25m", "-knee+90deg in deg", "hip in deg (rad/s)"]), (MIXED, ["-knee", "turn", "-rail+1m"]),
    (MIXED, ["turn", "knee in deg", "rail"]),
])  # fmt: skip
def test_what_is_stated_is_said_the_same_and_leads_there_and_back(coordinates, stated, rng):
    of = joint_map(coordinates, stated)
    again = joint_map(coordinates, [str(joint) for joint in of.joints])
    q, v = coordinates.random(rng, 20), rng.normal(size=(20, coordinates.nv))
    M = rng.normal(size=(20, coordinates.nv, coordinates.nv))
    assert not of.is_same and np.array_equal(again.own_positions(q), of.own_positions(q))
    assert np.allclose(of.positions(of.own_positions(q)), q, atol=1e-14)
    assert np.allclose(of.speeds(of.own_speeds(v)), v, atol=1e-14)
    assert np.array_equal(of.forces(of.own_forces(v)), v)
    assert np.array_equal(of.mass_matrix(of.own_mass_matrix(M)), M)
    power = np.einsum("si,si->s", v, v)
    assert np.allclose(np.einsum("si,si->s", of.own_forces(v), of.own_speeds(v) / of.of_v), power)


@pytest.mark.parametrize("coordinates, stated, word", [
    (ARM, ["hip", "knee"], "rail"), (ARM, ["hip", "hip", "rail"], "'hip' .* twice"), (ARM, ["hip", "knee", "foot"], "'foot'"),
    (ARM, "hip", "'hip'"), (ARM, [1, 2, 3], r"\[1, 2, 3\]"), (ARM, ["hip+1m", "knee", "rail"], "hip .*hinge"),
    (ARM, ["hip", "knee", "rail in deg"], "rail .*slide"),
    *((MIXED, ["rail", turn, "knee"], "turn is a ball") for turn in ("-turn", "turn+90deg", "turn in deg")),
])  # fmt: skip
def test_what_does_not_fit_is_one_line(coordinates, stated, word):
    with pytest.raises(JointsError, match=word) as error:
        joint_map(coordinates, stated)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("first", ["hip,knee-0.1rad,rail+0.2m", "-knee+170deg,-hip+0.3rad,-rail+5m"])
@pytest.mark.parametrize("second", ["rail-7m,-knee+20deg,hip", "-hip in deg,knee+90deg in deg (rad/s),-rail+3m"])  # fmt: skip
def test_two_maps_one_after_the_other_are_one(first, second, rng):
    inner, outer = joint_map(ARM, first.split(",")), joint_map(ARM, second.split(","))
    both, q, v = outer.after(inner, ARM), ARM.random(rng, 20), rng.normal(size=(20, 3))
    turns = (both.own_positions(q) - outer.own_positions(inner.own_positions(q))) / (2.0 * np.pi * both.of_q)
    slides = [joint.slides for joint in both.joints]
    assert np.allclose(turns, np.where(slides, 0.0, np.round(turns)), atol=1e-14)
    assert np.allclose(both.own_speeds(v), outer.own_speeds(inner.own_speeds(v)))


def test_what_follows_degrees_takes_them_as_they_are():
    """-(0.3 - 0.1) rad in deg, and 0.5; degrees of degrees cannot be stated."""
    inner, outer, again = (
        joint_map(ARM, [hip, "knee", "rail"]) for hip in ("hip-0.1rad in deg", "-hip+0.5rad", "hip in deg")
    )
    assert np.allclose(
        outer.after(inner, ARM).own_positions([0.3, 1.0, 2.0]), [0.5 - np.degrees(0.2), 1.0, 2.0]
    )
    assert again.after(inner, ARM) is None


def tree(names, kinds) -> tmt.Tree:
    """A chain of joints along y with a body of 1 kg on each."""
    n = len(names)
    of_bodies = names, range(n), [1.0] * n, [(0.1, 0.2, 0.3)] * n, [np.eye(3)] * n
    axes = [(0.0, 1.0, 0.0)] * n
    return tmt.Tree(names, range(-1, n - 1), [np.zeros(3)] * n, axes, [0.0] * n, *of_bodies, (0, 0, 0), kinds)


@pytest.mark.parametrize("stated, found, kinds, names", [
    (["a", "b", "c"], ["x", "y", "z"], "hhh", "xyz"), (["a", "b", "c"], ["x", "a", "z"], "hhh", "axz"),
    (["B", "b"], ["x", "B"], "hh", "Bx"),  # a capital is no other name
    (["aa", "aA"], ["Aa", "AA"], "hh", ("Aa", "AA")),  # either of two is
    (["a", "b", "c"], ["x", "y", "z"], "hsh", "yxz"),  # in the file the slide is the first
])  # fmt: skip
def test_joints_are_matched_by_name_then_by_order_and_kind(stated, found, kinds, names):
    kinds = [{"h": "hinge", "s": "slide"}[kind] for kind in kinds]
    of_file = sorted(kinds, reverse=True)
    assert matched_joints(tree(stated, kinds), tree(found, of_file), "it").names == tuple(names)
