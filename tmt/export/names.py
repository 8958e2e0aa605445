"""Names of a Tree's numbers, with units and meanings, and the mechanism in which they stand for them."""

import itertools
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import sympy

from tmt.derivation.mechanism import Mechanism
from tmt.derivation.vectors import Scalar
from tmt.model.tree import Tree

from .trigonometry import Expression

GREEK = frozenset((
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "mu", "nu", "xi", "rho",
    "sigma", "tau", "phi", "chi", "psi", "omega",
))  # fmt: skip
Symbols = list[Expression]
AXES = "xyz"
EPS = 2.0**-52
ROUND = 16 * EPS  # relative: a number this close to one of 10 digits is meant to be that
TINY = 4 * EPS  # of the largest component of a vector or tensor: meant to be zero
DIGITS = 34  # of directions that are not along an axis


class Parameter(NamedTuple):
    value: float
    unit: str
    meaning: str


class Names:
    """Symbols of a Tree's joints and numbers.

    parameters: {symbol: Parameter}, {} where numbers are not `named`. display: {symbol: LaTeX}, with
    the number of the body or joint in place of its name. joints: what each q is, in words.
    """

    def __init__(self, tree: Tree, named: bool):
        self.source, self.named = tree, named
        self.parameters: dict[Expression, Parameter] = {}
        self.display: dict[Expression, str] = {}
        self.axes = [[number(meant(x)) for x in without_tiny(axis)] for axis in tree.axis]
        joints, bodies = identifiers(tree.joint_names), identifiers(tree.body_names)
        self.add_joints(joints)
        self.gravity = self.vector(tree.gravity, "g", "g", "m/s2", "gravity")
        self.offsets = self.named_offsets()
        self.mass, self.com, self.inertia = [], [], []
        for b, (name, body) in enumerate(zip(bodies, tree.body_names)):
            index, carrier = f"{{{b + 1}}}", tree.body_joint[b]
            origin = tree.joint_names[carrier] if carrier >= 0 else "the world"
            centre = f"centre of mass of {body} from {origin}"
            self.mass.append(self.symbol(tree.mass[b], f"m_{name}", f"m_{index}", "kg", f"mass of {body}"))
            self.com.append(self.vector(tree.com[b], f"c_{name}", f"c_{index}", "m", centre))
            self.inertia.append(self.tensor(b, name))
        self.armature = []
        for i, (joint, rotor) in enumerate(zip(joints, tree.armature)):
            unit, meaning = "kg" if tree.kind[i] == "slide" else "kg m2", f"armature of {tree.joint_names[i]}"
            self.armature.append(self.symbol(rotor, f"J_{joint}", f"J_{{{i + 1}}}", unit, meaning))

    def add_joints(self, names: Sequence[str]) -> None:
        greek = GREEK.issuperset(self.source.joint_names)
        self.q = [sympy.Symbol(name if greek else f"q_{name}") for name in names]
        self.qd = [sympy.Symbol(f"{name}dot" if greek else f"qd_{name}") for name in names]
        self.joints = []
        for i, name in enumerate(self.source.joint_names):
            letter, index = (f"\\{name}", "") if greek else ("q", f"_{{{i + 1}}}")
            self.display |= {self.q[i]: letter + index, self.qd[i]: f"\\dot{{{letter}}}{index}"}
            hinge = self.source.kind[i] == "hinge"
            words = "angle of {} about {}, rad" if hinge else "position of {} along {}, m"
            self.joints.append(words.format(name, direction(self.axes[i])))

    def named_offsets(self) -> list[Symbols]:
        offsets, count, joints = [], itertools.count(1), self.source.joint_names
        for name, before, values in zip(joints, self.source.parent, self.source.offset):
            if before < 0 or not any(values):
                offsets.append([0, 0, 0])
                continue
            k = next(count)
            meaning = f"from {joints[before]} to {name}"
            offsets.append(self.vector(values, f"l_{k}", f"l_{{{k}}}", "m", meaning))
        return offsets

    def tensor(self, b: int, name: str) -> list[Symbols]:
        body, values = self.source.body_names[b], without_tiny(sum(self.source.inertia[b], ()))
        tensor: list[Symbols] = [[0] * 3 for _ in AXES]
        for i, j in itertools.combinations_with_replacement(range(3), 2):
            axes = AXES[i] + AXES[j]
            kind = f"entry {axes} of the inertia tensor of {body}"
            if i == j:
                kind = f"moment of inertia of {body} about {AXES[i]}"
            tex, meaning = f"I_{{{b + 1},{axes}}}", f"{kind}, at its centre of mass"
            entry = self.symbol(values[3 * i + j], f"I_{name}_{axes}", tex, "kg m2", meaning)
            tensor[i][j] = tensor[j][i] = entry
        return tensor

    def vector(self, values: Sequence[float], name: str, tex: str, unit: str, meaning: str) -> Symbols:
        """Symbols of components with their signs; of a vector along an axis that of its length."""
        values = without_tiny(values)
        if sum(map(bool, values)) == 1:
            meaning = f"{meaning}, along {direction(values)}"
            length = self.symbol(max(map(abs, values)), name, tex, unit, meaning)
            return [sign * length for sign in np.sign(values).astype(int).tolist()]
        stem = tex.rstrip("}") if "_" in tex else f"{tex}_{{"
        components = zip(AXES, values)
        return [self.symbol(v, f"{name}_{x}", f"{stem}{x}}}", unit, f"{meaning}, {x}") for x, v in components]

    def symbol(self, value: float, name: str, tex: str, unit: str, meaning: str) -> Expression:
        """The symbol of a new parameter, or the number; 0 where it is zero."""
        value = meant(value)
        if not self.named or not value:
            return number(value)
        symbol = sympy.Symbol(name)
        while symbol in self.parameters:  # of a body whose name ends like a component
            symbol = sympy.Symbol(f"{symbol}_")
        self.parameters[symbol], self.display[symbol] = Parameter(value, unit, meaning), tex
        return symbol

    @property
    def masses(self) -> set[Expression]:
        return {symbol for symbol, parameter in self.parameters.items() if parameter.unit == "kg"}

    @property
    def is_exact(self) -> bool:
        return self.named and all(x in (-1, 0, 1) for axis in self.axes for x in axis)

    def mechanism(self, scalar: Callable[[Expression], Scalar]) -> Mechanism:
        def lifted(values: Any) -> Any:
            return tuple(map(lifted, values)) if isinstance(values, list) else scalar(values)

        axes = self.axes
        if not self.is_exact:
            many = [sympy.Matrix([sympy.Rational(x) for x in axis]) for axis in axes]
            axes = [list(axis.normalized().evalf(DIGITS)) for axis in many]
        numbers = {"axis": axes, "offset": self.offsets, "mass": self.mass, "com": self.com}
        numbers |= {"inertia": self.inertia, "gravity": self.gravity}
        fields = vars(self.source) | {name: lifted(values) for name, values in numbers.items()}
        armature = tuple(scalar(rotor) if rotor else 0 for rotor in self.armature)
        return Mechanism(**fields | {"armature": armature, "reference": (0,) * len(self.source.kind)})


def identifiers(names: Iterable[str]) -> list[str]:
    result: list[str] = []
    for name in names:
        plain = re.sub(r"\W", "_", name, flags=re.ASCII)
        others = (f"{plain}_{k}" for k in itertools.count(2))
        result.append(next(x for x in itertools.chain([plain], others) if x not in result))
    return result


def meant(value: float) -> float:
    """The number of at most 10 digits that a double was before a few roundings, else the double."""
    short = float(f"{value:.10g}")
    return short if abs(short - value) <= ROUND * abs(value) else value


def without_tiny(values: Sequence[float]) -> list[float]:
    """The components of a vector or tensor; those that only rounding keeps from zero are zero."""
    least = TINY * max(map(abs, values))
    return [value if abs(value) > least else 0.0 for value in values]


def number(value: float) -> Expression:
    return sympy.Integer(int(value)) if float(value).is_integer() else sympy.Float(value)


def direction(vector: Sequence[Expression]) -> str:
    along = [i for i, x in enumerate(vector) if x]
    if len(along) == 1:
        return ("-" if vector[along[0]] < 0 else "") + AXES[along[0]]
    return f"({', '.join(f'{float(x):.4g}' for x in vector)})"
