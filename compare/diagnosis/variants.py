"""Explanations without a number to be found: an option, a convention of a joint, a slip in the derivation.

Each gives what Mbar and h would be: values as those of `Equations`. Options and conventions are of rank 1, and equations
themselves, so that a number can be sought beside them; slips are of rank 2.
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
MOST_PERMUTED = 6  # of which every order and every set of senses is tried; of more two exchanged, and one turned


class Variant(NamedTuple):
    """An explanation that is so or not."""

    rank: int
    kind: str  # "option", "order", "sign", "unit" or "slip"
    name: str
    stated: str
    explains: str
    equations: Callable[[], Equations]
    joints: JointMap | None = None  # of a convention of the joints
    is_simple: bool = True  # it is tried together with one number too


class Recast:
    """Equations whose values are handed on changed: values -> values."""

    def __init__(self, equations: Equations, change: Callable[[np.ndarray], np.ndarray]):
        self.equations, self.change = equations, change

    def values(self, changes: dict | None = None) -> np.ndarray:
        return self.change(self.equations.values(changes))


def program_options(equations: Equations) -> Iterator[Variant]:
    """What an option or a convention of the whole file or program changes."""
    tree, nv = equations.tree, equations.nv
    terms = {
        "gravity": (BODY_TERMS.index("gravity"),),
        "rates": tuple(map(BODY_TERMS.index, ("convective", "Euler", "gyroscopic"))),
    }

    def with_factor(of: str, factor: float) -> Callable:
        def made() -> Equations:
            changed = Equations(tree, equations.q, equations.qd)
            changed.stated["factor"][:, terms[of]] = factor
            return changed

        return made

    def with_bias(change: Callable) -> Callable:
        return lambda: Recast(
            equations, lambda values: np.concatenate([values[..., :-nv], change(values[..., -nv:])], -1)
        )

    def without_rotors() -> Equations:
        changed = Equations(tree, equations.q, equations.qd)
        changed.stated["armature"][:] = 0.0
        return changed

    yield Variant(1, "option", "gravity", "on", "off", with_factor("gravity", 0.0))
    yield Variant(1, "option", "sign of gravity", "+", "-", with_factor("gravity", -1.0))
    yield Variant(1, "option", "velocity terms in h", "there", "left out", with_factor("rates", 0.0))
    yield Variant(1, "option", "bias", "there", "left out", with_bias(np.zeros_like))
    negative = with_bias(lambda h: -h)
    yield Variant(1, "option", "sign of the bias", "Mbar qdd + h = tau", "Mbar qdd = tau + h", negative)
    if equations.q.shape == equations.qd.shape:
        exchanged = with_bias(lambda h: 0.0 * h + Equations(tree, equations.qd, equations.q).values()[0][:, -nv:])
        yield Variant(
            1, "option", "arguments of bias", "bias(q, qd)", "exchanged, bias(qd, q)", exchanged, is_simple=False
        )
    if any(tree.damping):
        drag = np.array(tree.damping) * equations.qd
        yield Variant(1, "option", "damping D qd", "not in h", "in h", with_bias(lambda h: h + drag))
        opposite = with_bias(lambda h: h - drag)
        yield Variant(1, "option", "damping D qd", "not in h", "in h, of the other sign", opposite)
    if tree.has_springs:
        pull = literal.spring_torque(equations.q, tree)
        yield Variant(1, "option", "springs k (q - rest)", "not in h", "in h", with_bias(lambda h: h + pull))
    if any(tree.armature):
        yield Variant(1, "option", "armature", "on the diagonal of Mbar", "left out", without_rotors)
    if (turns := absolute_angles(tree)) is not None:
        yield Variant(1, "option", "angles", "between a body and the one before", "between a body and the world", partial(
            Absolute, tree, equations.q, equations.qd, turns
        ))  # fmt: skip


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
    """Other orders of joints, in which balls stand where balls stood."""
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

    given, weight: (states, entries), the weight 0 where nothing is given. There are tens of thousands of six joints: they are
    evaluated as states.
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
    """What the first states give with each map of the joints, (states, entries): evaluated together."""
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
