"""A model and a method as compiled code: traced to straight lines, compiled by numba, kept on disk.

Traced is the composite form of the dynamics, with a sine of our own. One trace serves two loops: one state at a time, and
LANES states side by side, which the compiler turns into SIMD instructions. Both give the same bits.
"""

from collections.abc import Callable
from functools import lru_cache

from . import composite
from .cache import load
from .calls import Evaluator, checked_evaluator, checked_run
from .given import checked_model
from .implicit import ImplicitRungeKutta, step_source
from .method import acceleration
from .methods import AdaptiveRungeKutta, RungeKutta, method_named
from .templates import (
    ADAPTIVE,
    CHECK,
    EVALUATE,
    HEADER,
    NEWTON,
    OVERFLOW,
    RATE,
    RUN,
    RUN_LANES,
    SLOPES,
    SMALL,
    STAGE,
    TURNED,
)
from .trace import Code, Tape
from .tree import Tree, shown

LANES = 32  # states in a block
TRACED = 12  # hinges up to which straight-line code is worth its compilation
QUANTITIES, SINES = ("forward_dynamics", "mass_matrix_and_bias"), ("sincos", "library_sincos")
WORTH = 10_000_000  # steps of all runs together from which lanes are worth their compilation


def stepper(tree: Tree, method_name: str) -> Callable:
    """Compiled `run(q, qd, tau, dt)` of a Tree and one of METHODS: fills the paths q and qd from their first states.

    q, qd: (runs, steps + 1, n), of which [:, 0] is given; tau (runs, n); all contiguous, float64; rad, s, N m. It returns how
    often the dynamics were evaluated (an implicit method: with their Jacobian). An adaptive method takes its tolerance too:
    `run(q, qd, tau, dt, tolerance)`. A last argument (runs,) of int8, zeros, is told why each run ended, see templates.
    For many hinges an explicit method of fixed step takes the generic loop, which needs no compilation.
    """
    checked_model(tree)
    stepping = method_named(method_name)
    return _stepper(tree, stepping, len(tree.parent) > TRACED and type(stepping) is RungeKutta)


@lru_cache(maxsize=64)
def _stepper(tree, stepping, large):
    if large:
        from . import generic  # here, because it is compiled when it is imported for the first time

        compiled = generic.stepper(tree, stepping)
    else:
        compiled = load(source(tree, stepping)).run
    return checked_run(compiled, len(tree.parent), isinstance(stepping, AdaptiveRungeKutta))


def lane_stepper(tree: Tree, method_name: str) -> Callable:
    """`run(q, qd, tau, dt)` for a batch that is a multiple of LANES; the same bits. Not for adaptive and implicit methods."""
    checked_model(tree)
    stepping = method_named(method_name)
    if isinstance(stepping, (AdaptiveRungeKutta, ImplicitRungeKutta)):
        raise ValueError(f"method {method_name!r} has no lanes; an explicit one with a fixed step is expected")
    return _lane_stepper(tree, stepping)


@lru_cache(maxsize=64)
def _lane_stepper(tree, stepping):
    return checked_run(load(lanes_source(tree, stepping)).run, len(tree.parent), adaptive=False)


def evaluator(
    tree: Tree, quantity: str, terms: Callable = composite.mass_matrix_and_bias, sine: str = "sincos"
) -> Evaluator:
    """Compiled evaluation of many states: `each(q, qd, tau, out)`, `lanes(q, qd, tau, out)` and `chain`.

    quantity: "forward_dynamics", the n of qdd, and besides `rate(y, tau)` for solvers; or "mass_matrix_and_bias", the rows of
    the upper triangle of Mbar, then h. Arrays are contiguous: for each of shape (N, n), out (N, m); for lanes, component by
    component as registers want them, (n, N) and (m, N). rad, s, kg, m, N m.
    terms: the form of the dynamics that is traced; sine: "sincos" or "library_sincos".
    """
    checked_model(tree)
    for name, value, accepted in (("quantity", quantity, QUANTITIES), ("sine", sine, SINES)):
        if not isinstance(value, str) or value not in accepted:
            raise ValueError(f"{name} is {shown(value)}; known are {', '.join(accepted)}")
    if not callable(terms) or terms.__hash__ is None:
        raise ValueError(f"terms is {shown(terms)}; a function terms(tree, q, qd) -> (Mbar, h) is expected")
    return _evaluator(tree, quantity, terms, sine)


@lru_cache(maxsize=64)
def _evaluator(tree, quantity, terms, sine):
    n = len(tree.parent)
    m = n if quantity == "forward_dynamics" else n * (n + 3) // 2
    return checked_evaluator(load(evaluator_source(tree, quantity, terms, sine)), n, m)


for _public, _cached in ((stepper, _stepper), (lane_stepper, _lane_stepper), (evaluator, _evaluator)):
    _public.cache_clear = _cached.cache_clear


def slope_source(tree, method_name, terms=composite.mass_matrix_and_bias) -> Code:
    """Straight-line source of slope(q, qd, tau, dt), with its number of operations."""
    return _slope(tree, method_named(method_name), terms)


def _slope(tree, stepping, terms=composite.mass_matrix_and_bias) -> Code:
    tape = Tape()
    q, qd, tau, dt = _inputs(tape, tree)
    return tape.function("slope", [*q, *qd, *tau, dt], stepping.slope(tree, q, qd, tau, dt, terms))


def source(tree, stepping) -> str:
    """The module that follows one state at a time: slope, step, and the loop over both."""
    n = len(tree.parent)
    if isinstance(stepping, ImplicitRungeKutta):
        words = _words(n) | {"why": f"{NEWTON} if math.isnan({_sum('q', n)}) else {_why(n)}"}
        loop = RUN.format(**words, used=", used", cost=f"1 + used * {len(stepping.b)}")
        return HEADER + step_source(tree, stepping, composite.mass_matrix_and_bias) + loop
    tape = Tape()
    q, qd, tau, dt = _inputs(tape, tree)

    def slope(q, qd):
        return tape.call("slope", [*q, *qd, *tau, dt], n)

    adaptive = isinstance(stepping, AdaptiveRungeKutta)
    results = (stepping.attempt if adaptive else stepping.step)(slope, q, qd, dt)
    name = "attempt" if adaptive else "step"
    step = tape.function(name, [*q, *qd, *tau, dt], [value for part in results for value in part])
    inline = '@njit(forceinline=True, error_model="numpy")\n'
    return "\n\n".join(
        [
            HEADER + inline + _slope(tree, stepping).text,
            f'@njit(error_model="numpy")\n{step.text}',
            _loop(stepping, n),
        ]
    )


def _loop(stepping, n) -> str:
    """The loop of `source` over the states of n hinges."""
    words = _words(n)
    if not isinstance(stepping, AdaptiveRungeKutta):
        return RUN.format(**words, used="", cost=_stages(stepping))
    states = [f"{name}{i}" for name in ("q", "qd") for i in range(n)]

    def squares(error):
        scale = "(tolerance * (1.0 + max(abs({s}), abs(new_{s}))))"
        return " + ".join(f"({error}_{s} / {scale.format(s=s)}) ** 2" for s in states)

    return ADAPTIVE.format(
        **words,
        **{name: ", ".join(f"{name}_{s}" for s in states) for name in ("new", "errors5", "errors3")},
        squares5=squares("errors5"),
        squares3=squares("errors3"),
        stages=len(stepping.b),
        small=SMALL,
        components=2 * n,
        exponent=-1.0 / stepping.order,
    )


def _stages(stepping) -> int:
    """Evaluations of the dynamics in one step."""
    return len(getattr(stepping, "b", "1"))


def lanes_source(tree, stepping) -> str:
    """The module that follows LANES states side by side, stage by stage."""
    n = len(tree.parent)
    tape = Tape()
    q, qd, _, dt = _inputs(tape, tree)
    asked, answers = [], []

    def slope(q, qd):
        asked.append([*q, *qd])
        answers.append(tape.inputs(*(f"k{len(answers)}_{i}" for i in range(n))))
        return answers[-1]

    results = stepping.step(slope, q, qd, dt)
    functions, stages = [_slope(tree, stepping).text], []
    own = [_lane("y", i) for i in range(2 * n)] + ["dt"]
    for j in range(len(asked) + 1):
        inputs = [*q, *qd, dt, *(value for answer in answers[:j] for value in answer)]
        known = ", ".join(own + [_lane("k", i) for i in range(j * n)])
        if j == len(asked):
            functions.append(tape.function("combined", inputs, [*results[0], *results[1]]).text)
        else:
            functions.append(tape.function(f"stage_{j}", inputs, asked[j]).text)
            arguments = ", ".join(_lane("x", i) for i in range(2 * n))
            stages.append(STAGE.format(W=LANES, j=j, arguments=arguments, known=known, offset=j * n * LANES))
    words = _words(n) | {
        "W": LANES,
        "cost": _stages(stepping),
        "size_x": 3 * n * LANES,
        "size_y": 2 * n * LANES,
        "size_k": len(asked) * n * LANES,
        "first": ", ".join(f"{name}[b + l, 0, {i}]" for name in ("q", "qd") for i in range(n)),
        "given": ", ".join(f"tau[b + l, {i}]" for i in range(n)),
        "store": ", ".join(f"{name}[b + l, s, {i}]" for name in ("q", "qd") for i in range(n)),
        "rows_x": ", ".join(_row("x", i) for i in range(2 * n)),
        "rows_y": ", ".join(_row("y", i) for i in range(2 * n)),
        "rows_tau": ", ".join(_row("x", i) for i in range(2 * n, 3 * n)),
        "lane_new": ", ".join(_lane("x", i) for i in range(2 * n)),
        "known": known,
        "stages": "".join(stages).rstrip(),
    }
    arguments = ", ".join([_lane("x", i) for i in range(3 * n)] + ["dt"])
    slopes = SLOPES.format(W=LANES, arguments=arguments, results=", ".join(_lane("k", i, "o + ") for i in range(n)))
    inline = '@njit(forceinline=True, error_model="numpy")\n'
    return "\n\n".join([HEADER + inline + functions[0], *(inline + text for text in functions[1:]), slopes,
                        RUN_LANES.format(**words)])  # fmt: skip


def evaluator_source(tree, quantity, terms, sine) -> str:
    """The module of `evaluator`."""
    n = len(tree.parent)
    tape = Tape()
    q, qd, tau, _ = _inputs(tape, tree)
    try:
        M, h = terms(tree, q, qd)
        for values, count in ((M, n), (h, n), *((row, n) for row in M)):
            if len(values) != count:
                raise ValueError(f"{len(values)} where {count} are expected")
    except Exception as error:  # a function of the user's own
        raise ValueError(f"terms {shown(terms)} does not give (Mbar, h) of traced numbers: {shown(error)}") from error
    if quantity == "forward_dynamics":
        outputs = acceleration(tree, q, qd, tau, lambda *_: (M, h))
    else:
        outputs = [*(M[i][j] for i in range(n) for j in range(i, n)), *h]
    m = len(outputs)
    text = tape.function("quantity", [*q, *qd, *tau], outputs).text
    inputs = [(name, i) for name in ("q", "qd", "tau") for i in range(n)]
    places = ", ".join(f"{name}[i, {k}]" for name, k in inputs)

    def sequence(pattern, count):
        return ", ".join(pattern(i) for i in range(count))

    words = {
        "W": LANES,
        "size_x": 3 * n * LANES,
        "size_y": m * LANES,
        "row_in": places,
        "row_out": sequence(lambda k: f"out[i, {k}]", m),
        "n": n,
        "m": m,
        "sound_row": " + ".join(f"abs(out[i, {k}])" for k in range(m)) + " < np.inf",
        "sound_lane": " + ".join(f"abs({_row('y', k)})" for k in range(m)) + " < np.inf",
        "sound_column": " + ".join(f"abs(out[{k}, i])" for k in range(m)) + " < np.inf",
        "chained": ", ".join(f"{name}[{k}] + 1e-300 * last" for name, k in inputs),
        "last": " + ".join(f"results[{k}]" for k in range(m)),
        "gather": "; ".join(f"{_lane('x', r)} = flat_{a}[b{k} + l]" for r, (a, k) in enumerate(inputs)),
        "results": sequence(lambda k: _lane("y", k), m),
        "arguments": sequence(lambda k: _lane("x", k), 3 * n),
        "scatter": "; ".join(f"flat_out[b{k} + l] = {_lane('y', k)}" for k in range(m)),
        "lane_in": ", ".join(f"{name}[{k}, b + l]" for name, k in inputs),
        "lane_out": sequence(lambda k: f"out[{k}, b + l]", m),
        "begins": "; ".join(f"b{k} = np.uint64({k} * count + b)" for k in range(max(m, n))),
        "column_in": ", ".join(f"{name}[{k}, i]" for name, k in inputs),
        "column_out": sequence(lambda k: f"out[{k}, i]", m),
    }
    fast = '@njit(forceinline=True, error_model="numpy")\n' + text.replace("sincos(", f"{sine}(")
    sure = '@njit(error_model="numpy")\n' + text.replace("def quantity(", "def by_library(").replace(
        "sincos(", "library_sincos("
    )
    text = "\n\n".join([HEADER + fast, sure, EVALUATE.format(**words)])
    if quantity != "forward_dynamics":
        return text
    given = sequence(lambda k: f"y[{k}]", 2 * n) + ", " + sequence(lambda k: f"tau[{k}]", n)
    rates = sequence(lambda k: f"result[{n + k}]", n)
    sound = " + ".join(f"abs(result[{n + k}])" for k in range(n)) + " < np.inf"
    return text + RATE.format(n=n, twice=2 * n, rates=rates, given=given, sound_rates=sound)


def _inputs(tape, tree):
    n = len(tree.parent)
    return *(tape.inputs(*(f"{name}{i}" for i in range(n))) for name in ("q", "qd", "tau")), tape.inputs("dt")[0]


def _words(n) -> dict:
    """What the templates say of the states of n hinges, one scalar after the other."""

    def sequence(pattern, names=("q", "qd"), glue=", "):
        return glue.join(pattern.format(name=name, i=i) for name in names for i in range(n))

    angles = sequence("abs({name}{i})", ["q"], " + ")
    return {
        "state": sequence("{name}{i}"),
        "torque": sequence("{name}{i}", ["tau"]),
        "first": sequence("{name}[b, 0, {i}]"),
        "given": sequence("{name}[b, {i}]", ["tau"]),
        "store": sequence("{name}[b, k, {i}]"),
        "sound": f"({angles} < LIMIT and math.isfinite({_sum('qd', n)}))",
        "why": _why(n),
        "check": CHECK.format(n=n),
    }


def _sum(name, n) -> str:
    return " + ".join(f"{name}{i}" for i in range(n))


def _why(n) -> str:
    """Why a state is not sound."""
    return f"({TURNED} if math.isfinite({_sum('q', n)} + {_sum('qd', n)}) else {OVERFLOW})"


def _row(name, i) -> str:
    """Component i of lane l in a block, for a loop over signed l."""
    return f"{name}[np.uint64({i * LANES} + l)]"


def _lane(name, i, before="") -> str:
    """The same for unsigned l, as the compiler needs it to put lanes into one register."""
    return f"{name}[{before}np.uint64({i * LANES}) + l]"
