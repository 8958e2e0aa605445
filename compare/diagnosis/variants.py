"""Explanations without a number to fit: options and conventions of joints; slips.py has those of the derivation.

Each gives Mbar and h as they would be, as `Equations.values` does. Options and conventions have rank 1; a number can be fitted
together with them. Slips have rank 2.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import combinations, permutations, product
from typing import NamedTuple

import numpy as np

import tmt
from tmt import literal

from ..judge.words import listed
from ..robots.coordinates import Coordinates
from ..robots.joint_map import PER_UNIT, Joint, JointMap
from .model import BODY_TERMS, Equations

MAPS_AT_ONCE = 2000  # maps of the joints in one evaluation
PARALLEL = 1e-9  # of a cosine from 1
MOST_PERMUTED = 6  # joints: with more, only exchanges of two and the sense of one are tried


class Variant(NamedTuple):
    """An explanation that applies or does not."""

    rank: int
    kind: str  # "option", "order", "sign", "unit" or "slip"
    name: str
    stated: str
    explains: str
    equations: Callable[[], Equations]
    joints: JointMap | None = None  # of a convention of the joints
    is_simple: bool = True  # whether it is tried together with one number


class Recast:
    """Equations with a function of their values."""

    def __init__(self, equations: Equations, change: Callable[[np.ndarray], np.ndarray]):
        self.equations, self.change = equations, change

    def values(self, changes: dict | None = None) -> np.ndarray:
        return self.change(self.equations.values(changes))


def program_options(equations: Equations) -> Iterator[Variant]:
    """What an option or a convention of the whole file or program changes."""
    tree, nv, q, qd = equations.tree, equations.nv, equations.q, equations.qd

    def option(name: str, stated: str, explains: str, made: Callable, is_simple: bool = True) -> Variant:
        return Variant(1, "option", name, stated, explains, made, is_simple=is_simple)

    def with_field(field: str, value: float, terms: Sequence[str] = ()) -> Callable:
        def made() -> Equations:
            changed = Equations(tree, q, qd)
            columns = [BODY_TERMS.index(term) for term in terms]
            changed.stated[field][(slice(None), columns) if terms else slice(None)] = value
            return changed

        return made

    def with_bias(change: Callable) -> Callable:
        return lambda: Recast(equations, lambda v: np.concatenate([v[..., :-nv], change(v[..., -nv:])], axis=-1))

    of_speeds = "convective", "Euler", "gyroscopic"
    yield option("gravity", "on", "off", with_field("factor", 0.0, ["gravity"]))
    yield option("sign of gravity", "+", "-", with_field("factor", -1.0, ["gravity"]))
    yield option("velocity terms in h", "there", "left out", with_field("factor", 0.0, of_speeds))
    yield option("bias", "there", "left out", with_bias(np.zeros_like))
    yield option("sign of the bias", "Mbar qdd + h = tau", "Mbar qdd = tau + h", with_bias(lambda h: -h))
    if q.shape == qd.shape:
        exchanged = with_bias(lambda h: 0.0 * h + Equations(tree, qd, q).values()[0][:, -nv:])
        yield option("arguments of bias", "bias(q, qd)", "exchanged, bias(qd, q)", exchanged, is_simple=False)
    if any(tree.damping):
        drag = np.array(tree.damping) * qd
        yield option("damping D qd", "not in h", "in h", with_bias(lambda h: h + drag))
        yield option("damping D qd", "not in h", "in h, of the other sign", with_bias(lambda h: h - drag))
    if tree.has_springs:
        pull = literal.spring_torque(q, tree)
        yield option("springs k (q - rest)", "not in h", "in h", with_bias(lambda h: h + pull))
    if any(tree.armature):
        yield option("armature", "on the diagonal of Mbar", "left out", with_field("armature", 0.0))
    if (turns := absolute_angles(tree)) is not None:
        absolute = partial(Absolute, tree, q, qd, turns)
        yield option("angles", "between a body and the one before", "between a body and the world", absolute)


def absolute_angles(tree: tmt.Tree) -> np.ndarray | None:
    """Joint angles from the angles of bodies to the world, (nv, nv), in a row of parallel hinges; None: there is none."""
    if set(tree.kind) != {"hinge"}:
        return None
    turns = np.eye(len(tree.axis))
    for i, parent in enumerate(tree.parent):
        along = float(np.dot(tree.axis[i], tree.axis[parent])) if parent >= 0 else 0.0
        if abs(abs(along) - 1.0) < PARALLEL:
            turns[i, parent] = -np.sign(along)
    return turns if (turns != np.eye(len(turns))).any() else None


class Absolute(Recast):
    """Equations in angles of the bodies to the world: joint angles are turns @ angles."""

    def __init__(self, tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, turns: np.ndarray):
        inner = Equations(tree, q @ turns.T, qd @ turns.T)
        i, j = inner.triangle

        def change(values: np.ndarray) -> np.ndarray:
            M = np.zeros((*values.shape[:-1], inner.nv, inner.nv), values.dtype)
            M[..., i, j] = M[..., j, i] = values[..., : len(i)]
            return np.concatenate([(turns.T @ M @ turns)[..., i, j], values[..., len(i) :] @ turns], axis=-1)

        super().__init__(inner, change)


def conventions(equations: Equations) -> Iterator[Variant]:
    """Order, senses and units of the joints."""
    tree, q, qd = equations.tree, equations.q, equations.qd
    names = tree.hinge_names
    coordinates = Coordinates(names, tree.kind)
    kinds, straight = dict(zip(names, tree.kind)), [name for name, kind in zip(names, tree.kind) if kind != "ball"]

    def variant(kind, name, stated, explains, joints, is_simple=True) -> Variant:
        joints = tuple(joint._replace(slides=kinds[joint.name] == "slide") for joint in joints)
        made = JointMap(coordinates, joints)
        return Variant(1, kind, name, stated, explains, lambda: Equations(tree, q, qd, made), made, is_simple)

    for order in other_orders(names, tree.kind):
        exchanged = [name for name, other in zip(names, order) if name != other]
        simple = len(exchanged) == 2
        yield variant("order", "order of the joints", ", ".join(names), ", ".join(order), map(Joint, order), simple)
    most = len(straight) if len(straight) <= MOST_PERMUTED else 1
    for count in range(1, most + 1):
        for turned in combinations(straight, count):
            joints = [Joint(name, -1.0 if name in turned else 1.0) for name in names]
            yield variant("sign", f"sense of {listed(turned)}", "+", "-", joints, count == 1)
    hinges = [name for name in straight if kinds[name] == "hinge"]
    for which in dict.fromkeys((*((name,) for name in hinges), tuple(hinges))):
        for unit in PER_UNIT:
            if unit and which:
                joints = [Joint(name, unit=unit if name in which else "") for name in names]
                name = f"unit of {which[0] if len(which) == 1 else 'all hinges'}"
                yield variant("unit", name, "rad", unit, joints)


def other_orders(names: tuple[str, ...], kinds: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Other orders of joints, with balls in the places of balls."""
    if len(names) <= MOST_PERMUTED:
        tried = permutations(range(len(names)))
    else:
        tried = [list(range(len(names)))[::-1]]
        for i, j in combinations(range(len(names)), 2):
            order = list(range(len(names)))
            order[i], order[j] = j, i
            tried.append(order)
    for order in tried:
        alike = all((kinds[i] == "ball") == (kind == "ball") for i, kind in zip(order, kinds))
        if alike and list(order) != sorted(order):
            yield tuple(names[i] for i in order)


def both(equations: Equations, given: np.ndarray, weight: np.ndarray) -> Iterator[Variant]:
    """An order and senses together, of up to six hinges and slides: those that explain the first state.

    given, weight: (states, entries), the weight 0 where nothing is given. Six joints have tens of thousands of combinations,
    which are evaluated as states.
    """
    tree, names = equations.tree, equations.tree.hinge_names
    n = len(names)
    if n > MOST_PERMUTED or "ball" in tree.kind:
        return
    places = {name: i for i, name in enumerate(names)}
    chosen = [[places[name] for name in order] for order in other_orders(names, tree.kind)]
    turned = list(product((1.0, -1.0), repeat=n))[1:]
    if not chosen:
        return
    order = np.repeat(chosen, len(turned), axis=0)
    sense = np.tile(turned, (len(chosen), 1))
    q, qd = np.empty_like(sense), np.empty_like(sense)
    np.put_along_axis(q, order, sense * equations.q[0], axis=1)
    np.put_along_axis(qd, order, sense * equations.qd[0], axis=1)
    i, j = equations.triangle
    for first in range(0, len(order), MAPS_AT_ONCE):
        part = slice(first, first + MAPS_AT_ONCE)
        values = Equations(tree, q[part], qd[part]).values()[0]
        P, S, rows = order[part], sense[part], np.arange(len(values))[:, None]
        M = np.zeros((len(values), n, n))
        M[:, i, j] = M[:, j, i] = values[:, : len(i)]
        M = M[rows, P[:, i], P[:, j]] * S[:, i] * S[:, j]
        h = values[:, len(i) :][rows, P] * S
        off = np.abs(np.concatenate([M, h], axis=1) - np.nan_to_num(given[0])) * weight[0]
        for k in np.flatnonzero(off.max(axis=1) <= 1.0):
            joints = [Joint(names[at], float(s)) for at, s in zip(P[k], S[k])]
            made = JointMap(Coordinates(names, tree.kind), joints)
            stated, explains = ", ".join(names), ", ".join(map(str, joints))
            how = partial(Equations, tree, equations.q, equations.qd, made)
            yield Variant(3, "order and sign", "order and senses of the joints", stated, explains, how, made, False)


def values_of(equations: Equations, maps: Sequence[JointMap], states: int) -> Iterator[np.ndarray]:
    """The values at the first states with each map of the joints, (states, entries), evaluated together."""
    q, qd = equations.q[:states], equations.qd[:states]
    for first in range(0, len(maps), MAPS_AT_ONCE):
        some = maps[first : first + MAPS_AT_ONCE]
        inner = Equations(
            equations.tree,
            *(np.concatenate([move(m) for m in some]) for move in (lambda m: m.positions(q), lambda m: m.speeds(qd))),
        )
        values = inner.values()[0].reshape(len(some), states, -1)
        i, j = inner.triangle
        M = np.zeros((len(some), states, inner.nv, inner.nv))
        M[..., i, j] = M[..., j, i] = values[..., : len(i)]
        for one, mass, h in zip(some, M, values[..., len(i) :]):
            yield np.concatenate([one.own_mass_matrix(mass)[:, i, j], one.own_forces(h)], axis=-1)
