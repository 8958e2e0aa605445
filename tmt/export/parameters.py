"""Numbers of a model that are arguments of the exported functions: gravity, bodies, a payload."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tmt.derivation.mechanism import Mechanism
from tmt.derivation.vectors import Matrix, Values, Vector
from tmt.model.tree import Tree

SIZES = {"mass": 1, "com": 3, "inertia": 6}
MEANINGS = {
    "mass": "mass of {}, kg",
    "com": "centre of mass of {} in its frame, m",
    "inertia": "inertia of {} about its centre of mass, axes of its frame, xx yy zz xy xz yz, kg m2",
}
PLACES = (0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)  # of the six numbers of an inertia
PAYLOAD = "payload"
OF_BODIES = {"com_positions", "angular_velocities", "jacobians", "convective_terms"}  # a row for each body


class Frame(NamedTuple):
    origin: NDArray[np.float64]
    axes: NDArray[np.float64]


class Parameters:
    """The arguments that stand for chosen numbers of a Tree.

    words: "gravity"; a body, or BODY.mass, BODY.com, BODY.inertia; "payload" and a body: what that carries
    besides. They are in the frame that is the site of the body's name on its joint, else in that of its
    joint. values: by the names of the arguments, those of the Tree. meanings: of each. ValueError for a word that is none of
    these.
    """

    def __init__(self, tree: Tree, words: Sequence[str]):
        self.values: dict[str, tuple[float, ...]] = {}
        self.meanings: dict[str, str] = {}
        self.places: dict[str, tuple[str, int]] = {}  # part and body of an argument
        carrier, sites = dict(zip(tree.body_names, tree.body_joint)), zip(tree.site_names, tree.site_joint)
        axes = zip(tree.site_offset, tree.site_rotation)
        # a site of a body's name on another joint is no frame of the body
        self.sites = {name: own for (name, joint), own in zip(sites, axes) if carrier.get(name) == joint}
        self.carriers, self.words = list(range(len(tree.mass))), tuple(words)
        self.has_payload, remaining = False, list(words)
        while remaining:
            word = remaining.pop(0)
            body, _, part = word.rpartition(".")
            if word in tree.body_names:
                self.add_body(tree, word, tuple(SIZES))
            elif body in tree.body_names and part in SIZES:
                self.add_body(tree, body, (part,))
            elif word == "gravity":
                self.add(word, tree.gravity, "gravity, inertial frame, m/s2")
            elif word == PAYLOAD and remaining and remaining[0] in tree.body_names and not self.has_payload:
                self.add_payload(tree, remaining.pop(0))
            else:
                expected = f"gravity, payload,BODY, BODY or BODY.mass, .com, .inertia; {tree.body_names}"
                raise ValueError(f"{word!r} is no parameter; expected {expected}")

    def add(self, name: str, values: Sequence[float], meaning: str) -> None:
        self.values[name], self.meanings[name] = tuple(map(float, values)), meaning

    def add_body(self, tree: Tree, name: str, parts: Sequence[str]) -> None:
        b = tree.body_names.index(name)
        frame, plain = self.frame(name), re.sub(r"\W", "_", name, flags=re.ASCII)
        tensor = frame.axes.T @ np.array(tree.inertia[b]) @ frame.axes
        numbers: dict[str, Any] = {
            "mass": [tree.mass[b]],
            "com": (np.array(tree.com[b]) - frame.origin) @ frame.axes,
            "inertia": [tensor[place] for place in PLACES],
        }
        for part in parts:
            argument = f"{plain if plain[:1].isalpha() else f'body_{plain}'}_{part}"
            if self.places.get(argument, (part, b)) != (part, b):
                raise ValueError(f"two bodies have the parameter {argument}")
            self.places[argument] = part, b
            self.add(argument, numbers[part], MEANINGS[part].format(name))

    def add_payload(self, tree: Tree, carrier: str) -> None:
        self.has_payload = True
        self.carriers.append(tree.body_names.index(carrier))
        for part, size in SIZES.items():
            self.places[f"{PAYLOAD}_{part}"] = part, len(tree.mass)
            meaning = MEANINGS[part].format(PAYLOAD).replace("its frame", f"the frame of {carrier}")
            self.add(f"{PAYLOAD}_{part}", [0.0] * size, meaning)

    def frame(self, name: str) -> Frame:
        origin, axes = self.sites.get(name, (np.zeros(3), np.eye(3)))
        return Frame(np.array(origin, dtype=float), np.array(axes, dtype=float))

    def applied(self, tree: Tree, values: Mapping[str, Values]) -> Mechanism:
        numbers: dict[str, Any] = {field.name: getattr(tree, field.name) for field in fields(Mechanism)}
        bodies = {part: list(numbers[part]) for part in SIZES}
        if self.has_payload:
            numbers["body_names"] += (PAYLOAD,)
            numbers["body_joint"] += (tree.body_joint[self.carriers[-1]],)
            for part, nothing in (("mass", 0.0), ("com", (0.0,) * 3), ("inertia", ((0.0,) * 3,) * 3)):
                bodies[part].append(nothing)
        for argument, (part, b) in self.places.items():
            frame = self.frame(tree.body_names[self.carriers[b]])
            bodies[part][b] = placed(part, values[argument], frame)
        numbers |= {part: tuple(entries) for part, entries in bodies.items()}
        numbers["gravity"] = tuple(values.get("gravity", tree.gravity))
        return Mechanism(**numbers)


def placed(part: str, values: Values, frame: Frame) -> Any:
    rotation = Matrix(np.where(np.abs(frame.axes) < 1e-15, 0.0, frame.axes).tolist())
    if part == "mass":
        return values[0]
    if part == "com":
        return tuple(Vector(*frame.origin.tolist()) + rotation @ Vector(*values))
    xx, yy, zz, xy, xz, yz = values
    tensor = rotation @ Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.transposed
    return tuple(map(tuple, tensor))
