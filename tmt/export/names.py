"""Names of a Tree's numbers, with units and meanings, and the Tree in which they stand for them."""

import itertools
import re
from types import SimpleNamespace
from typing import NamedTuple

from tmt.model.tree import Tree

GREEK = frozenset((
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "mu", "nu", "xi", "rho", "sigma", "tau", "phi",
    "chi", "psi", "omega",
))  # fmt: skip
EPS = 2.0**-52
ROUND = 16 * EPS  # relative: a number this close to one of 10 digits is meant to be that
TINY = 4 * EPS  # of the largest component of a vector or tensor: meant to be zero
DIGITS = 34  # of directions that are not along an axis


class Parameter(NamedTuple):
    value: float
    unit: str
    meaning: str


class Names:
    """Symbols of a Tree's joints and numbers; `parameters`, {symbol: Parameter}, is {} where numbers are not `named`.

    Masses, centres of mass and inertias are named after their body, armatures after their joint, offsets l_1, l_2 and so on.
    display: {symbol: LaTeX}, with the number of the body or joint in place of its name. joints: what each q is, in words.
    """

    def __init__(self, tree: Tree, named: bool):
        self.of, self.named, self.parameters, self.display, self.joints = tree, named, {}, {}, []
        self.axes = [[number(meant(x)) for x in without_tiny(axis)] for axis in tree.axis]
        self.add_joints(identifiers(tree.joint_names), GREEK.issuperset(tree.joint_names))
        self.gravity = self.vector(tree.gravity, "g", "g", "m/s2", "gravity")
        count = itertools.count(1)
        self.offsets = [self.offset(i, count) for i in range(len(tree.kind))]
        joints, bodies = identifiers(tree.joint_names), identifiers(tree.body_names)
        self.mass, self.com, self.inertia = [], [], []
        for b, (name, body) in enumerate(zip(bodies, tree.body_names)):
            index, joint = f"{{{b + 1}}}", tree.body_joint[b]
            meaning = f"centre of mass of {body} from {tree.joint_names[joint]}" if joint >= 0 else ""
            self.mass.append(self.symbol(tree.mass[b], f"m_{name}", f"m_{index}", "kg", f"mass of {body}"))
            self.com.append(self.vector(tree.com[b], f"c_{name}", f"c_{index}", "m", meaning))
            self.inertia.append(self.tensor(b, name))
        self.armature = []
        for i, (joint, rotor) in enumerate(zip(joints, tree.armature)):
            unit, meaning = "kg" if tree.kind[i] == "slide" else "kg m2", f"armature of {tree.joint_names[i]}"
            self.armature.append(self.symbol(rotor, f"J_{joint}", f"J_{{{i + 1}}}", unit, meaning))

    def add_joints(self, names, greek):
        """Symbols of positions and speeds: Greek letters if all joints are called so."""
        import sympy

        self.q = [sympy.Symbol(name if greek else f"q_{name}") for name in names]
        self.qd = [sympy.Symbol(f"{name}dot" if greek else f"qd_{name}") for name in names]
        for i, (q, qd, axis) in enumerate(zip(self.q, self.qd, self.axes)):
            name, hinge = self.of.joint_names[i], self.of.kind[i] == "hinge"
            letter, index = (f"\\{name}", "") if greek else ("q", f"_{{{i + 1}}}")
            self.display |= {q: letter + index, qd: f"\\dot{{{letter}}}{index}"}
            words = "angle of {} about {}, rad" if hinge else "position of {} along {}, m"
            self.joints.append(words.format(name, direction(axis)))

    def offset(self, i, count):
        """From the joint before joint i; where the first joints are in the world has no effect."""
        before, values = self.of.parent[i], self.of.offset[i]
        if before < 0 or not any(values):
            return [0, 0, 0]
        at, meaning = next(count), f"from {self.of.joint_names[before]} to {self.of.joint_names[i]}"
        return self.vector(values, f"l_{at}", f"l_{{{at}}}", "m", meaning)

    def tensor(self, b, name):
        """The inertia of body b."""
        values, symbols = without_tiny([x for row in self.of.inertia[b] for x in row]), {}
        for i, j in itertools.combinations_with_replacement(range(3), 2):
            axes, tex = "xyz"[i] + "xyz"[j], f"I_{{{b + 1},{'xyz'[i]}{'xyz'[j]}}}"
            kind = f"moment of inertia of {self.of.body_names[b]} about {'xyz'[i]}"
            kind = kind if i == j else f"entry {axes} of the inertia tensor of {self.of.body_names[b]}"
            meaning = f"{kind}, at its centre of mass"
            symbols[i, j] = symbols[j, i] = self.symbol(
                values[3 * i + j], f"I_{name}_{axes}", tex, "kg m2", meaning
            )
        return [[symbols[i, j] for j in range(3)] for i in range(3)]

    def vector(self, values, name, tex, unit, meaning) -> list:
        """Symbols of components with their signs; of a vector along an axis that of its length."""
        values = without_tiny(values)
        if sum(map(bool, values)) == 1:
            length = self.symbol(
                max(map(abs, values)), name, tex, unit, f"{meaning}, along {direction(values)}"
            )
            return [0 if not value else length if value > 0 else -length for value in values]
        stem = tex.rstrip("}") if "_" in tex else f"{tex}_{{"
        return [
            self.symbol(value, f"{name}_{x}", f"{stem}{x}}}", unit, f"{meaning}, {x}")
            for x, value in zip("xyz", values)
        ]

    def symbol(self, value, name, tex, unit, meaning):
        """The symbol of a new parameter, or the number; 0 where it is zero."""
        import sympy

        value = meant(value)
        if not self.named or not value:
            return number(value)
        symbol = sympy.Symbol(name)
        while symbol in self.parameters:  # of a body whose name ends like a component
            symbol = sympy.Symbol(f"{symbol}_")
        self.parameters[symbol], self.display[symbol] = Parameter(value, unit, meaning), tex
        return symbol

    @property
    def is_exact(self) -> bool:
        """Whether all numbers that have no names are integers."""
        return self.named and all(x in (-1, 0, 1) for axis in self.axes for x in axis)

    def tree(self, scalar) -> SimpleNamespace:
        """What the method asks of a Tree, its numbers and symbols as scalars; q is from the reference position."""

        def lifted(values):
            return [lifted(value) for value in values] if isinstance(values, list) else scalar(values)

        same = {
            name: getattr(self.of, name) for name in ("parent", "kind", "body_joint", "coordinates", "moves")
        }
        return SimpleNamespace(
            **same,
            axis=lifted([axis if self.is_exact else unit(axis) for axis in self.axes]),
            offset=lifted(self.offsets),
            mass=lifted(self.mass),
            com=lifted(self.com),
            inertia=lifted(self.inertia),
            gravity=lifted(self.gravity),
            armature=[scalar(rotor) if rotor else 0 for rotor in self.armature],
            reference=[0] * len(self.of.kind),
        )


def identifiers(names) -> list[str]:
    """The names as parts of identifiers in ASCII, each different."""
    result = []
    for name in names:
        plain = re.sub(r"\W", "_", name, flags=re.ASCII)
        others = (f"{plain}_{k}" for k in itertools.count(2))
        result.append(next(x for x in itertools.chain([plain], others) if x not in result))
    return result


def meant(value: float) -> float:
    """The number of at most 10 digits that a double was before it was rounded a few times, else the double."""
    short = float(f"{value:.10g}")
    return short if abs(short - value) <= ROUND * abs(value) else value


def without_tiny(values) -> list[float]:
    """The components of a vector or tensor; those that are zero but for rounding are zero."""
    least = TINY * max(map(abs, values))
    return [value if abs(value) > least else 0.0 for value in values]


def number(value: float):
    import sympy

    return sympy.Integer(int(value)) if float(value).is_integer() else sympy.Float(value)


def unit(axis) -> list:
    """A direction of length 1 in more digits than a double has."""
    import sympy

    return list(sympy.Matrix([sympy.Rational(x) for x in axis]).normalized().evalf(DIGITS))


def direction(vector) -> str:
    """A direction in words."""
    if sum(map(bool, vector)) == 1:
        along = next(i for i, x in enumerate(vector) if x)
        return ("-" if vector[along] < 0 else "") + "xyz"[along]
    return f"({', '.join(f'{float(x):.4g}' for x in vector)})"
