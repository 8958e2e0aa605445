"""Numbers of a model that are arguments of the exported functions: gravity, bodies, a payload."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmt.derivation.mechanism import Mechanism
from tmt.derivation.vectors import Matrix, Values, Vector
from tmt.model.tree import Tree

MEANINGS = {
    "mass": "mass of {}, kg",
    "com": "centre of mass of {} in its frame, m",
    "inertia": "inertia of {} about its centre of mass, axes of its frame, xx yy zz xy xz yz, kg m2",
}
PARTS = tuple(MEANINGS)
PLACES = (0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)  # of the six numbers of an inertia
PAYLOAD = "payload"
OF_BODIES = {"com_positions", "angular_velocities", "jacobians", "convective_terms"}  # a row for each body


Frame = tuple[NDArray[np.float64], NDArray[np.float64]]  # its origin and its axes in the frame of a joint


class Parameters:
    """The arguments that stand for chosen numbers of a Tree.

    words: "gravity"; a body, or BODY.mass, BODY.com, BODY.inertia; "payload" and a body: what that carries
    besides. They are in the frame that is the site of the body's name on its joint, else in that of its
    joint. values: by the names of the arguments, those of the Tree. meanings: of each. ValueError for another
    word.
    """

    def __init__(self, tree: Tree, words: Sequence[str]):
        self.words, self.has_payload = tuple(words), False
        self.values: dict[str, tuple[float, ...]] = {}
        self.meanings: dict[str, str] = {}
        self.places: dict[str, tuple[str, int]] = {}  # part and body of an argument
        self.numbers: dict[str, Any] = {field.name: getattr(tree, field.name) for field in fields(Mechanism)}
        carrier, left = dict(zip(tree.body_names, tree.body_joint)), list(words)
        sites = zip(tree.site_names, tree.site_joint, tree.site_offset, tree.site_rotation)
        # a site of a body's name on another joint is no frame of the body
        own = {name: (np.array(x), np.array(R)) for name, joint, x, R in sites if carrier.get(name) == joint}
        self.frames: list[Frame] = [own.get(name, (np.zeros(3), np.eye(3))) for name in tree.body_names]
        while left:
            word = left.pop(0)
            body, _, part = word.rpartition(".")
            if word in carrier:
                self.add_body(tree.body_names.index(word), PARTS)
            elif body in carrier and part in PARTS:
                self.add_body(tree.body_names.index(body), (part,))
            elif word == "gravity":
                self.values[word], self.meanings[word] = tree.gravity, "gravity, inertial frame, m/s2"
            elif word == PAYLOAD and left and left[0] in carrier and not self.has_payload:
                self.add_payload(tree, left.pop(0))
            else:
                expected = f"gravity, payload,BODY, BODY or BODY.mass, .com, .inertia; {tree.body_names}"
                raise ValueError(f"{word!r} is no parameter; expected {expected}")

    def add_body(self, b: int, parts: Sequence[str], frame: str = "its frame") -> None:
        name, (origin, axes) = self.numbers["body_names"][b], self.frames[b]
        plain = re.sub(r"\W", "_", name, flags=re.ASCII)
        tensor = axes.T @ np.array(self.numbers["inertia"][b]) @ axes
        numbers: dict[str, Any] = {
            "mass": [self.numbers["mass"][b]],
            "com": (np.array(self.numbers["com"][b]) - origin) @ axes + 0.0,
            "inertia": [tensor[place] for place in PLACES],
        }
        for part in parts:
            argument = f"{plain if plain[:1].isalpha() else f'body_{plain}'}_{part}"
            if self.places.setdefault(argument, (part, b)) != (part, b):
                raise ValueError(f"two bodies have the parameter {argument}")
            self.values[argument] = tuple(map(float, numbers[part]))
            self.meanings[argument] = MEANINGS[part].format(name).replace("its frame", frame)

    def add_payload(self, tree: Tree, carrier: str) -> None:
        b, self.has_payload = tree.body_names.index(carrier), True
        self.frames.append(self.frames[b])
        nothing = {"mass": 0.0, "com": tuple(self.frames[b][0]), "inertia": ((0.0,) * 3,) * 3}
        for field, value in {"body_names": PAYLOAD, "body_joint": tree.body_joint[b], **nothing}.items():
            self.numbers[field] += (value,)
        self.add_body(len(tree.mass), PARTS, f"the frame of {carrier}")

    def applied(self, values: Mapping[str, Values]) -> Mechanism:
        """The Tree with these values of the arguments, and the payload."""
        numbers = self.numbers | {part: list(self.numbers[part]) for part in PARTS}
        for argument, (part, b) in self.places.items():
            numbers[part][b] = placed(part, values[argument], self.frames[b])
        numbers |= {part: tuple(numbers[part]) for part in PARTS}
        return Mechanism(**numbers | {"gravity": tuple(values.get("gravity", numbers["gravity"]))})


def placed(part: str, values: Values, frame: Frame) -> Any:
    origin, axes = frame
    rotation = Matrix(np.where(np.abs(axes) < 1e-15, 0.0, axes).tolist())
    if part == "mass":
        return values[0]
    if part == "com":
        return tuple(Vector(*origin.tolist()) + rotation @ Vector(*values))
    xx, yy, zz, xy, xz, yz = values
    tensor = rotation @ Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.transposed
    return tuple(map(tuple, tensor))
