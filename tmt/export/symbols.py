"""Mbar, h and gravity of a Tree as SymPy expressions: the method of tmt.derivation over polynomials, with named parameters."""

import operator
import time
from collections.abc import Sequence
from typing import NamedTuple

from tmt.arm import ARM
from tmt.derivation.quantities import State
from tmt.model.tree import Tree

from .names import EPS, Names, number
from .shortest import Forms
from .trigonometry import Ring, TooLong

QUANTITIES = ("mass_matrix", "bias", "gravity_balance")
TITLES = {
    "mass_matrix": ("M", "mass matrix"),
    "bias": ("h", "bias: Coriolis, centrifugal and gravity terms"),
    "gravity_balance": ("G", "torque or force that balances gravity"),
}
NOISE = 1e-16  # of the largest coefficient of an entry: left over where terms cancel


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
    for name, kind in zip(tree.joint_names, tree.kind):
        if kind == "ball":
            raise ValueError(f"symbolic equations need hinges and slides; joint {name} is a ball")
    start, note = time.monotonic(), ""
    if named:
        try:
            return derived(tree, quantities, Names(tree, True), start + seconds / 2, note)
        except TooLong:
            note = f"numbers in place of named parameters, which would take more than {seconds / 2:g} s"
    try:
        return derived(tree, quantities, Names(tree, False), start + seconds, note)
    except TooLong:
        raise ValueError(
            f"symbolic equations of these {len(tree.kind)} joints take more than {seconds:g} s"
        ) from None


def derived(tree, quantities, names: Names, deadline, note) -> Symbolic:
    """The equations with the parameters that `names` has; TooLong at the deadline."""
    import sympy

    places = {i: sympy.Dummy() for i, kind in enumerate(tree.kind) if kind == "slide"}
    hinges = [i for i, kind in enumerate(tree.kind) if kind == "hinge"]
    from_reference = [symbol - number(value) for symbol, value in zip(names.q, tree.reference)]
    parallel = {hinges.index(i): (hinges.index(j), sign) for i, (j, sign) in parallel_hinges(tree).items()}
    symbols = sorted(names.parameters, key=str)
    masses = [symbol for symbol in symbols if names.parameters[symbol].unit == "kg"]
    angles = [from_reference[i] for i in hinges]
    symbols = [*symbols, *places.values(), *names.qd]
    ring = Ring(symbols, len(angles), names.is_exact, deadline)
    forms = Forms(ring, symbols, masses, names.qd, angles, parallel)
    zero, joints = ring.scalar(0), range(len(tree.kind))
    variables = [ring.scalar(places[i]) if i in places else ring.angle(hinges.index(i)) for i in joints]
    state = State(names.tree(ring.scalar), variables)

    def expression(scalar):
        ring.check_time()
        form = forms.shortest(ring.without_noise((zero + scalar).poly, 0 if names.is_exact else NOISE))
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
    display = {s: names.display[s] for s in (*names.q, *names.qd, *parameters)}
    return Symbolic(
        names.q, names.qd, tree.joint_names, names.joints, parameters, names.named, entries, display, note
    )


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


PYTHON = """{comment}
import sympy
from sympy import cos, sin

q = {q} = sympy.symbols({q_names!r}, seq=True)
qd = {qd} = sympy.symbols({qd_names!r}, seq=True)
joint_names = {joint_names!r}
{parameters}
{matrices}
"""


def python_source(symbolic: Symbolic, head_lines: Sequence[str] = ()) -> str:
    """Python text with SymPy: symbols, `parameters` {symbol: value}, matrices M, h and G, and mass_matrix, bias and gravity.

    These are pairs of a matrix with numbers and the list of its symbols, as compare.assert_agrees and --reference take them.
    head_lines: lines of text, which become comments.
    """
    from sympy.printing.str import StrPrinter

    class Printer(StrPrinter):
        def _print_Float(self, expr):
            return repr(float(expr))

    lines = [
        f"{symbol} = sympy.Symbol({str(symbol)!r})  # {row.meaning}, {row.unit}"
        for symbol, row in symbolic.parameters.items()
    ]
    values = ", ".join(f"{symbol}: {row.value!r}" for symbol, row in symbolic.parameters.items())
    lines.append(f"parameters = {{{values}}}")
    matrices = []
    for name, matrix in symbolic.entries.items():
        letter, title = TITLES[name]
        rows = [
            ",\n".join(
                f"    [{', '.join(Printer().doprint(entry) for entry in row)}]" for row in matrix.tolist()
            )
        ]
        symbols = "[*q, *qd]" if name == "bias" else "[*q]"
        own = {"gravity_balance": "gravity"}.get(name, name)
        matrices.append(
            f"# {title}\n{letter} = sympy.Matrix([\n{rows[0]},\n])\n{own} = ({letter}.subs(parameters), {symbols})"
        )
    return PYTHON.format(
        comment="\n".join(f"# {line}" for line in head_lines),
        q=", ".join(map(str, symbolic.q)) + ",",
        qd=", ".join(map(str, symbolic.qd)) + ",",
        q_names=" ".join(map(str, symbolic.q)),
        qd_names=" ".join(map(str, symbolic.qd)),
        joint_names=list(symbolic.joint_names),
        parameters="\n".join(lines),
        matrices="\n".join(matrices),
    )
