"""Mbar, h and gravity of a Tree as SymPy expressions: the method over polynomials in named parameters."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

import sympy
from sympy.printing.str import StrPrinter

from tmt.arm import ARM
from tmt.derivation.quantities import State
from tmt.derivation.vectors import Rows, Scalar, Values
from tmt.model.tree import Tree

from .names import Names, Parameter, Symbols, number
from .shortest import Forms
from .trigonometry import Angle, Expression, Ring, TooLong, Trig

TITLES = {
    "mass_matrix": ("M", "mass matrix"),
    "bias": ("h", "bias: Coriolis, centrifugal and gravity terms"),
    "gravity_balance": ("G", "torque or force that balances gravity"),
}
QUANTITIES = tuple(TITLES)
NOISE = 1e-16  # of the largest coefficient of an entry: left over where terms cancel


class Symbolic(NamedTuple):
    """Equations of a Tree in SymPy.

    parameters: {symbol: (value, unit, meaning)}; {} where numbers are in the expressions (`named` is False).
    entries: {quantity: Matrix}. display: {symbol: LaTeX}. note: "", or why parameters have no names.
    """

    q: list[Expression]
    qd: list[Expression]
    joint_names: tuple[str, ...]
    joints: list[str]
    parameters: dict[Expression, Parameter]
    named: bool
    entries: dict[str, Expression]
    display: dict[Expression, str]
    note: str


@lru_cache(maxsize=4)  # one for all files
def symbolic(
    tree: Tree = ARM, quantities: tuple[str, ...] = QUANTITIES, limit: float = 60.0, named: bool = True
) -> Symbolic:
    """Mbar, h and the torque that balances gravity of a Tree of hinges and slides, simplified.

    limit: the work that it may take, s of a processor core of 2026, counted and not measured; where half of
    it does not do with named parameters, they are numbers. Raises ValueError for a ball, and where it takes
    more.
    """
    for name, kind in zip(tree.joint_names, tree.kind):
        if kind == "ball":
            raise ValueError(f"symbolic equations need hinges and slides; joint {name} is a ball")
    note = ""
    for has_names in (True, False) if named else (False,):
        try:
            return derived(Names(tree, has_names), quantities, limit / 2, note)
        except TooLong:
            note = f"numbers in place of named parameters, which would take more work than {limit / 2:g} s"
    raise ValueError(f"symbolic equations of these {len(tree.kind)} joints take more work than {limit:g} s")


def derived(names: Names, quantities: Sequence[str], limit: float, note: str) -> Symbolic:
    tree = names.source
    places = {i: sympy.Dummy() for i, kind in enumerate(tree.kind) if kind == "slide"}
    hinges = [i for i, kind in enumerate(tree.kind) if kind == "hinge"]
    from_reference = [symbol - number(value) for symbol, value in zip(names.q, tree.reference)]
    symbols = sorted(names.parameters, key=str)
    angles = [from_reference[i] for i in hinges]
    ring = Ring([*symbols, *places.values(), *names.qd], len(angles), names.is_exact, limit)
    forms = Forms(ring, names, angles)
    variables = [
        ring.scalar(places[i]) if i in places else ring.angle(hinges.index(i)) for i in range(len(tree.kind))
    ]

    def expression(scalar: Scalar) -> Expression:
        ring.count(0.0)
        poly = ring.without_noise((ring.scalar(0) + scalar).poly, 0 if names.is_exact else NOISE)
        return forms.shortest(poly).xreplace({place: from_reference[i] for i, place in places.items()})

    def column(entries: Values) -> Expression:
        return sympy.Matrix([expression(entry) for entry in entries])

    state = State(names.mechanism(ring.scalar), {"q": variables})
    derivations: dict[str, Callable[[], Expression]] = {
        "mass_matrix": lambda: symmetric(state.mass_matrix, expression),
        "gravity_balance": lambda: column(state.gravity_balance),
        "bias": lambda: column(coriolis(ring, state.mass_matrix, variables, names.qd)),
    }
    needed = {"gravity_balance", *quantities} if "bias" in quantities else {*quantities}
    entries = {name: derive() for name, derive in derivations.items() if name in needed}
    if "bias" in needed:
        entries["bias"] += entries["gravity_balance"]
    entries = {name: entries[name] for name in quantities}
    used = set().union(*(matrix.free_symbols for matrix in entries.values()))
    parameters = {symbol: row for symbol, row in names.parameters.items() if symbol in used}
    display = {s: names.display[s] for s in (*names.q, *names.qd, *parameters)}
    joints = tree.joint_names, names.joints
    return Symbolic(names.q, names.qd, *joints, parameters, names.named, entries, display, note)


def symmetric(M: Rows, expression: Callable[[Scalar], Expression]) -> Expression:
    n = range(len(M))
    upper = {(i, j): expression(M[i][j]) for i in n for j in n if i <= j}
    return sympy.Matrix([[upper[min(i, j), max(i, j)] for j in n] for i in n])


def coriolis(ring: Ring, mass_matrix: Rows, q: Sequence[Angle | Trig], speeds: Symbols) -> Values:
    """The bias without gravity: sum over j, k of (dM_ij/dq_k - dM_jk/dq_i / 2) qd_j qd_k."""
    zero, n = ring.scalar(0), range(len(q))
    M = [[zero + entry for entry in row] for row in mass_matrix]
    rates = [[[M[i][j].derivative(q[k]) for k in n] for j in n] for i in n]
    qd = [ring.scalar(symbol) for symbol in speeds]
    products = {(j, k): qd[j] * qd[k] for j in n for k in n}

    def entry(i: int) -> Scalar:
        terms = [products[j, k] * (rates[i][j][k] - rates[j][k][i] * 0.5) for j in n for k in n]
        return sum(terms, zero)

    return [entry(i) for i in n]


class Printer(StrPrinter):  # type: ignore[misc]  # SymPy has no types
    def _print_Float(self, expression: Expression) -> str:
        return repr(float(expression))


def python_source(symbolic: Symbolic, head_lines: Sequence[str] = ()) -> str:
    """Python text with SymPy: symbols, `parameters` {symbol: value}, matrices M, h and G.

    mass_matrix, bias and gravity are pairs of a matrix with numbers and the list of its symbols.
    """
    printed = Printer().doprint
    q, qd = (list(map(str, symbols)) for symbols in (symbolic.q, symbolic.qd))
    lines = [
        *(f"# {line}" for line in head_lines),
        "import sympy",
        "from sympy import cos, sin",
        "",
        f"q = {', '.join(q)}, = sympy.symbols({' '.join(q)!r}, seq=True)",
        f"qd = {', '.join(qd)}, = sympy.symbols({' '.join(qd)!r}, seq=True)",
        f"joint_names = {list(symbolic.joint_names)!r}",
    ]
    for symbol, row in symbolic.parameters.items():
        lines.append(f"{symbol} = sympy.Symbol({str(symbol)!r})  # {row.meaning}, {row.unit}")
    values = ", ".join(f"{symbol}: {row.value!r}" for symbol, row in symbolic.parameters.items())
    lines.append(f"parameters = {{{values}}}")
    for name, matrix in symbolic.entries.items():
        letter, title = TITLES[name]
        rows = [f"    [{', '.join(map(printed, row))}]," for row in matrix.tolist()]
        lines += [f"# {title}", f"{letter} = sympy.Matrix([", *rows, "])"]
        variables = "[*q, *qd]" if name == "bias" else "[*q]"
        lines.append(f"{name.removesuffix('_balance')} = ({letter}.subs(parameters), {variables})")
    return "\n".join(lines) + "\n"
