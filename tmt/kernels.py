"""A model and a method as compiled code: traced to straight lines, compiled by numba, kept on disk.

Traced is the composite form of the dynamics, with a sine of our own. One trace serves two loops: one state at a time, and
LANES states side by side, which the compiler turns into SIMD instructions. Both give the same bits.
"""

from functools import lru_cache

from . import composite
from .cache import load
from .implicit import ImplicitRungeKutta, step_source
from .method import acceleration
from .methods import METHODS, AdaptiveRungeKutta, RungeKutta
from .templates import ADAPTIVE, EVALUATE, HEADER, RATE, RUN, RUN_LANES, SLOPES, STAGE
from .trace import Code, Tape

LANES = 32  # states in a block
TRACED = 12  # hinges up to which straight-line code is worth its compilation
WORTH = 10_000_000  # steps of all runs together from which lanes are worth their compilation


@lru_cache(maxsize=64)
def stepper(tree, method_name):
    """Compiled `run(q, qd, tau, dt)` of a Tree and one of METHODS, for arrays of shape (batch, ...).

    It returns how often the dynamics were evaluated (an implicit method: with their Jacobian). An adaptive method takes
    its tolerance too: `run(q, qd, tau, dt, tolerance)`.
    For many hinges an explicit method of fixed step takes the generic loop, which needs no compilation.
    """
    if len(tree.parent) > TRACED and type(METHODS[method_name]) is RungeKutta:
        from . import generic  # here, because it is compiled when it is imported for the first time

        return generic.stepper(tree, METHODS[method_name])
    return load(source(tree, method_name)).run


@lru_cache(maxsize=64)
def lane_stepper(tree, method_name):
    """`run(q, qd, tau, dt)` for a batch that is a multiple of LANES; the same bits. Not for adaptive and implicit methods."""
    return load(lanes_source(tree, method_name)).run


@lru_cache(maxsize=64)
def evaluator(tree, quantity, terms=composite.mass_matrix_and_bias, sine="sincos"):
    """Compiled evaluation of many states: a module with `each(q, qd, tau, out)`, `lanes(q, qd, tau, out)` and `chain`.

    quantity: "forward_dynamics", the n of qdd, and besides `rate(y, tau)` for solvers; or "mass_matrix_and_bias", the rows of
    the upper triangle of Mbar, then h. Arrays are contiguous: for each of shape (N, n), out (N, m); for lanes, component by
    component as registers want them, (n, N) and (m, N). rad, s, kg, m, N m.
    terms: the form of the dynamics that is traced; sine: "sincos" or "library_sincos".
    """
    return load(evaluator_source(tree, quantity, terms, sine))


def slope_source(tree, method_name, terms=composite.mass_matrix_and_bias) -> Code:
    """Straight-line source of slope(q, qd, tau, dt), with its number of operations."""
    tape = Tape()
    q, qd, tau, dt = _inputs(tape, tree)
    return tape.function("slope", [*q, *qd, *tau, dt], METHODS[method_name].slope(tree, q, qd, tau, dt, terms))


def source(tree, method_name) -> str:
    """The module that follows one state at a time: slope, step, and the loop over both."""
    stepping, n = METHODS[method_name], len(tree.parent)
    if isinstance(stepping, ImplicitRungeKutta):
        loop = RUN.format(**_words(n), used=", used", cost=f"1 + used * {len(stepping.b)}")
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
            HEADER + inline + slope_source(tree, method_name).text,
            f'@njit(error_model="numpy")\n{step.text}',
            _loop(stepping, n),
        ]
    )


def _loop(stepping, n) -> str:
    """The loop of `source` over the states of n hinges."""
    words = _words(n)
    if not isinstance(stepping, AdaptiveRungeKutta):
        return RUN.format(**words, used="", cost=len(getattr(stepping, "b", "1")))
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
        components=2 * n,
        exponent=-1.0 / stepping.order,
    )


def lanes_source(tree, method_name) -> str:
    """The module that follows LANES states side by side, stage by stage."""
    stepping, n = METHODS[method_name], len(tree.parent)
    tape = Tape()
    q, qd, _, dt = _inputs(tape, tree)
    asked, answers = [], []

    def slope(q, qd):
        asked.append([*q, *qd])
        answers.append(tape.inputs(*(f"k{len(answers)}_{i}" for i in range(n))))
        return answers[-1]

    results = stepping.step(slope, q, qd, dt)
    functions, stages = [slope_source(tree, method_name).text], []
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
    if quantity == "forward_dynamics":
        outputs = acceleration(tree, q, qd, tau, terms)
    else:
        M, h = terms(tree, q, qd)
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
        "sound": f"({angles} < LIMIT and math.isfinite({sequence('{name}{i}', ['qd'], ' + ')}))",
    }


def _row(name, i) -> str:
    """Component i of lane l in a block, for a loop over signed l."""
    return f"{name}[np.uint64({i * LANES} + l)]"


def _lane(name, i, before="") -> str:
    """The same for unsigned l, as the compiler needs it to put lanes into one register."""
    return f"{name}[{before}np.uint64({i * LANES}) + l]"
