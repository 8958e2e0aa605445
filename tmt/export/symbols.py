"""Mbar, h and gravity of a Tree as SymPy expressions: the method of tmt.derivation over polynomials, with named parameters."""

import itertools
import operator
import re
import time
from types import SimpleNamespace
from typing import NamedTuple

from tmt.arm import ARM
from tmt.derivation.quantities import State
from tmt.model.tree import Tree

from .trigonometry import Ring, TooLong

QUANTITIES = ("mass_matrix", "bias", "gravity_balance")
GREEK = frozenset([
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "mu", "nu", "xi", "rho", "sigma", "tau",
    "phi", "chi", "psi", "omega",
])  # fmt: skip
EPS = 2.0**-52
ROUND = 16 * EPS  # relative: a number this close to one of 10 digits is meant to be that
TINY = 1e-12  # of the largest component of a vector or tensor: meant to be zero
DIGITS = 34  # of directions that are not along an axis
NOISE = 1e-16  # of the largest coefficient of an entry: left over where terms cancel


class Parameter(NamedTuple):
    value: float
    unit: str
    meaning: str


class Symbolic(NamedTuple):
    """Equations of a Tree in SymPy.

    q, qd: symbols of the joints and their speeds, in order. joint_names: as the Tree has them. joints: what each q is, in words.
    parameters: {symbol: (value, unit, meaning)}; {} where all numbers are in the expressions, then `named` is False.
    entries: {quantity: Matrix}. display: {symbol: LaTeX}. note: "", or why parameters have no names.
    """

    q: list
    qd: list
    joint_names: tuple
    joints: list
    parameters: dict
    named: bool
    entries: dict
    display: dict
    note: str

    def numbers(self, quantity: str):
        """The Matrix of a quantity with the values of the parameters in it."""
        return self.entries[quantity].subs({symbol: row.value for symbol, row in self.parameters.items()})

    def pair(self, quantity: str) -> tuple:
        """`numbers` and the list of its symbols, as compare.assert_agrees takes it."""
        return self.numbers(quantity), self.q + self.qd * (quantity == "bias")


def symbolic(tree: Tree = ARM, quantities=QUANTITIES, seconds: float = 60.0, named: bool = True) -> Symbolic:
    """Mbar, h and the torque that balances gravity of a Tree of hinges and slides, simplified.

    quantities: some of QUANTITIES. seconds: the time that it may take; parameters that have no names by half of it are numbers.
    Raises ValueError for a ball, an unknown quantity, without SymPy, and where it takes longer.
    """
    try:
        import sympy  # noqa: F401
    except ImportError:
        raise ValueError("symbolic equations need SymPy: pip install sympy") from None
    if unknown := [name for name in quantities if name not in QUANTITIES]:
        raise ValueError(f"unknown quantity {unknown[0]!r}; known: {', '.join(QUANTITIES)}")
    for name, kind in zip(tree.hinge_names, tree.kind):
        if kind == "ball":
            raise ValueError(f"symbolic equations need hinges and slides; joint {name} is a ball")
    start, note = time.monotonic(), ""
    if named:
        try:
            return derived(tree, quantities, Names(tree, True), start + seconds / 2, note)
        except TooLong:
            note = f"numbers in place of named parameters: with names it takes more than {seconds / 2:g} s"
    try:
        return derived(tree, quantities, Names(tree, False), start + seconds, note)
    except TooLong:
        joints = f"{len(tree.parent)} joints"
        raise ValueError(f"the symbolic equations of this model ({joints}) take more than {seconds:g} s") from None


def derived(tree, quantities, names: "Names", deadline, note) -> Symbolic:
    """The equations with the parameters that `names` has; TooLong at the deadline."""
    import sympy

    places = {i: sympy.Dummy() for i, kind in enumerate(tree.kind) if kind == "slide"}
    hinges = [i for i, kind in enumerate(tree.kind) if kind == "hinge"]
    from_reference = [symbol - number(value) for symbol, value in zip(names.q, tree.reference)]
    parallel = {hinges.index(i): (hinges.index(j), sign) for i, (j, sign) in parallel_hinges(tree).items()}
    symbols = sorted(names.parameters, key=str)
    masses = [symbol for symbol in symbols if names.parameters[symbol].unit == "kg"]
    angles = [from_reference[i] for i in hinges]
    ring = Ring([*symbols, *places.values(), *names.qd], masses, names.qd, angles, parallel, names.is_exact, deadline)
    zero, joints = ring.scalar(0), range(len(tree.kind))
    variables = [ring.scalar(places[i]) if i in places else ring.angle(hinges.index(i)) for i in joints]
    state = State(names.tree(ring.scalar), variables)

    def expression(scalar):
        ring.check_time()
        form = ring.shortest(ring.without_noise((zero + scalar).poly, 0 if names.is_exact else NOISE))
        return form.xreplace({place: from_reference[i] for i, place in places.items()})

    entries = {}
    if "mass_matrix" in quantities:
        upper = {(i, j): expression(state.mass_matrix[i][j]) for i in joints for j in joints if i <= j}
        entries["mass_matrix"] = sympy.Matrix([[upper[min(i, j), max(i, j)] for j in joints] for i in joints])
    if set(quantities) - {"mass_matrix"}:
        entries["gravity_balance"] = sympy.Matrix([expression(entry) for entry in state.gravity_balance])
    if "bias" in quantities:
        M = [[zero + entry for entry in row] for row in state.mass_matrix]
        rates = [[[M[i][j].derivative(variables[k]) for k in joints] for j in joints] for i in joints]
        qd = [ring.scalar(symbol) for symbol in names.qd]
        h = list(entries["gravity_balance"])
        for i in joints:  # h_i = sum over j, k of (dM_ij/dq_k - dM_jk/dq_i / 2) qd_j qd_k, and gravity
            terms = [qd[j] * qd[k] * (rates[i][j][k] - rates[j][k][i] * 0.5) for j in joints for k in joints]
            h[i] += expression(sum(terms, zero))
        entries["bias"] = sympy.Matrix(h)
    entries = {name: entries[name] for name in quantities}
    used = set().union(*(matrix.free_symbols for matrix in entries.values()))
    parameters = {symbol: row for symbol, row in names.parameters.items() if symbol in used}
    display = names.joint_display | {s: names.display[s] for s in parameters}
    return Symbolic(names.q, names.qd, tree.hinge_names, names.joints, parameters, names.named, entries, display, note)


class Names:
    """Symbols of a Tree's joints and numbers, and the Tree with them; `parameters` is {} where they are not `named`."""

    def __init__(self, tree: Tree, named: bool):
        import sympy

        self.of, self.named, self.parameters, self.display = tree, named, {}, {}
        joints, bodies = identifiers(tree.hinge_names), identifiers(tree.body_names)
        greek = GREEK.issuperset(tree.hinge_names)
        self.q = [sympy.Symbol(name if greek else f"q_{name}") for name in joints]
        self.qd = [sympy.Symbol(f"{name}dot" if greek else f"qd_{name}") for name in joints]
        self.joint_display, self.joints = {}, []
        for i, (q, qd, name, kind) in enumerate(zip(self.q, self.qd, tree.hinge_names, tree.kind)):
            plain = f"\\{name}" if greek else f"q_{{{i + 1}}}"
            self.joint_display |= {q: plain, qd: f"\\dot{{{plain}}}" if greek else f"\\dot{{q}}_{{{i + 1}}}"}
            self.joints.append(f"angle of {name}, rad" if kind == "hinge" else f"position of {name}, m")
        self.axes = [[number(meant(x)) for x in without_tiny(axis)] for axis in tree.axis]
        self.gravity = self.vector(tree.gravity, "g", "g", "m/s2", "gravity")
        self.offsets, lengths = [], 0
        for i, (offset, before) in enumerate(zip(tree.offset, tree.parent)):
            moved = before >= 0 and any(without_tiny(offset))  # of the first joints the place has no effect
            lengths += moved
            origin = tree.hinge_names[before]
            meaning = f"from {origin} to {tree.hinge_names[i]}"
            nothing = (0, 0, 0)
            self.offsets.append(
                self.vector(offset, f"l_{lengths}", f"l_{{{lengths}}}", "m", meaning) if moved else nothing
            )
        self.mass, self.com, self.inertia = [], [], []
        for b, (name, body) in enumerate(zip(bodies, tree.body_names)):
            at = b + 1
            self.mass.append(self.symbol(tree.mass[b], f"m_{name}", f"m_{{{at}}}", "kg", f"mass of {body}"))
            meaning = f"centre of mass of {body} from {tree.hinge_names[tree.body_hinge[b]]}"
            self.com.append(self.vector(tree.com[b], f"c_{name}", f"c_{{{at}}}", "m", meaning))
            tensor = without_tiny([x for row in tree.inertia[b] for x in row])
            moments = {}
            for k, (i, j) in enumerate(itertools.product(range(3), repeat=2)):
                if i <= j:
                    axes, meaning = "xyz"[i] + "xyz"[j], f"moment of inertia of {body} about its centre of mass"
                    tex = f"I_{{{at},{axes}}}"
                    moments[i, j] = moments[j, i] = self.symbol(tensor[k], f"I_{name}_{axes}", tex, "kg m2", meaning)
            self.inertia.append([[moments[i, j] for j in range(3)] for i in range(3)])
        self.armature = []
        for i, (name, rotor) in enumerate(zip(joints, tree.armature)):
            unit, meaning = "kg" if tree.kind[i] == "slide" else "kg m2", f"armature of {tree.hinge_names[i]}"
            self.armature.append(self.symbol(rotor, f"J_{name}", f"J_{{{i + 1}}}", unit, meaning))

    def symbol(self, value, name, tex, unit, meaning):
        """The symbol of a new parameter, or the number; 0 where it is zero."""
        import sympy

        value = meant(value)
        if not self.named or not value:
            return number(value)
        symbol = sympy.Symbol(name)
        self.parameters[symbol], self.display[symbol] = Parameter(value, unit, meaning), tex
        return symbol

    def vector(self, values, name, tex, unit, meaning) -> list:
        """Symbols of components with their signs; of a vector along an axis that of its length."""
        values = without_tiny(values)
        if sum(map(bool, values)) == 1:
            along = next(i for i, value in enumerate(values) if value)
            direction = ("-" if values[along] < 0 else "") + "xyz"[along]
            length = self.symbol(abs(values[along]), name, tex, unit, f"{meaning}, along {direction}")
            return [0 if not value else length if value > 0 else -length for value in values]
        return [
            self.symbol(
                value, f"{name}_{x}", f"{tex[:-1]}{x}}}" if tex[-1] == "}" else f"{tex}_{x}", unit, f"{meaning}, {x}"
            )
            for x, value in zip("xyz", values)
        ]

    @property
    def is_exact(self) -> bool:
        """Whether all numbers are integers."""
        return self.named and all(x in (-1, 0, 1) for axis in self.axes for x in axis)

    def tree(self, scalar) -> SimpleNamespace:
        """What the method asks of a Tree, its numbers and symbols as scalars, from the reference position."""
        of = self.of

        def lifted(values):
            return [lifted(value) for value in values] if isinstance(values, list | tuple) else scalar(values)

        return SimpleNamespace(
            axis=lifted([axis if self.is_exact else unit(axis) for axis in self.axes]),
            offset=lifted(self.offsets),
            mass=lifted(self.mass),
            com=lifted(self.com),
            inertia=lifted(self.inertia),
            gravity=lifted(self.gravity),
            armature=[scalar(rotor) if rotor else 0 for rotor in self.armature],
            reference=[0] * len(of.kind),
            parent=of.parent,
            kind=of.kind,
            body_hinge=of.body_hinge,
            coordinates=of.coordinates,
            moves=of.moves,
        )


def identifiers(names) -> list[str]:
    """The names as parts of identifiers, each different."""
    result = []
    for name in names:
        plain = re.sub(r"\W", "_", name)
        result.append(plain if plain not in result else f"{plain}_{len(result) + 1}")
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


def parallel_hinges(tree) -> dict:
    """{i: (j, sign)} of hinges i that turn, with no other hinge between them, on hinge j about sign times its axis."""
    found = {}
    for i, kind in enumerate(tree.kind):
        j = tree.parent[i]
        while j >= 0 and tree.kind[j] == "slide":
            j = tree.parent[j]
        cosine = sum(map(operator.mul, tree.axis[i], tree.axis[j])) if j >= 0 else 0.0
        if kind == "hinge" and abs(cosine) > 1.0 - 4 * EPS:
            found[i] = j, 1 if cosine > 0.0 else -1
    return found
