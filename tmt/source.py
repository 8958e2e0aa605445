"""The source of compiled modules: straight-line code that is traced, in the loops of templates.py."""

from tmt.compiled.trace import Code, Tape
from tmt.equations import composite
from tmt.equations.method import acceleration
from tmt.implicit_source import step_source
from tmt.kept import kept
from tmt.model.values import shown
from tmt.templates import (
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

LANES = 32  # states in a block


def slope_code(tree, stepping, terms=composite.mass_matrix_and_bias) -> Code:
    """Straight-line source of slope(q, qd, tau, dt)."""
    tape = Tape()
    q, qd, tau, dt = _inputs(tape, tree)
    return tape.function("slope", [*q, *qd, *tau, dt], stepping.slope(tree, q, qd, tau, dt, terms))


@kept
def run_source(tree, stepping) -> str:
    """The module that follows one state at a time: slope, step, and the loop over both."""
    nq, n = tree.coordinates.nq, tree.coordinates.nv
    if stepping.solves_stages:
        words = _words(tree) | {"why": f"{NEWTON} if math.isnan({_sum('q', nq)}) else {_why(tree)}"}
        loop = RUN.format(**words, used=", used", cost=f"1 + used * {stepping.stages}")
        *functions, step = step_source(tree, stepping, composite.mass_matrix_and_bias)
        return "\n\n".join([HEADER, *map(written, functions), step]) + loop
    tape = Tape()
    q, qd, tau, dt = _inputs(tape, tree)

    def slope(q, qd):
        return tape.call("slope", [*q, *qd, *tau, dt], n)

    name, joints = "attempt" if stepping.adaptive else "step", tree.coordinates
    results = getattr(stepping, name)(slope, q, qd, dt, *([joints] if joints.balls else []))
    step = tape.function(name, [*q, *qd, *tau, dt], [value for part in results for value in part])
    return "\n\n".join([HEADER + written(slope_code(tree, stepping)), written(step), _loop(stepping, tree)])


def written(code: Code, inline: bool = False) -> str:
    """The source of a function for a module, see written.py; inline: in the place of its calls."""
    return f"@written({code.results}{', inline=True' * inline})\n{code.text}"


def _loop(stepping, tree) -> str:
    """The loop of `run_source` over the states of a tree."""
    words, coordinates = _words(tree), tree.coordinates
    if not stepping.adaptive:
        return RUN.format(**words, used="", cost=stepping.stages)
    states = [f"{name}{i}" for name, count in (("q", coordinates.nq), ("qd", coordinates.nv)) for i in range(count)]
    # each component of an error, and the state in whose units it is: a ball's movement is an angle, of a turn of about 1
    errors = {}
    for kind, at, by in coordinates.joints:
        for k in range(by.start, by.stop):
            errors[f"q{k}"] = None if kind == "ball" else f"q{at.start}"
    errors |= {f"qd{k}": f"qd{k}" for k in range(coordinates.nv)}

    def squares(error):
        scale = "(tolerance * (1.0 + max(abs({s}), abs(new_{s}))))"
        return " + ".join(
            f"({error}_{e} / {scale.format(s=s) if s else '(tolerance * 2.0)'}) ** 2" for e, s in errors.items()
        )

    return ADAPTIVE.format(
        **words,
        new=", ".join(f"new_{s}" for s in states),
        **{name: ", ".join(f"{name}_{e}" for e in errors) for name in ("errors5", "errors3")},
        squares5=squares("errors5"),
        squares3=squares("errors3"),
        stages=stepping.stages,
        small=SMALL,
        components=len(errors),
        exponent=-1.0 / stepping.order,
    )


@kept
def lanes_source(tree, stepping) -> str:
    """The module that follows LANES states side by side, stage by stage."""
    nq, n, joints = tree.coordinates.nq, tree.coordinates.nv, tree.coordinates
    tape = Tape()
    q, qd, _, dt = _inputs(tape, tree)
    asked, answers = [], []

    def slope(q, qd):
        asked.append([*q, *qd])
        answers.append(tape.inputs(*(f"k{len(answers)}_{i}" for i in range(n))))
        return answers[-1]

    results = stepping.step(slope, q, qd, dt, *([joints] if joints.balls else []))
    functions, stages = [slope_code(tree, stepping)], []
    own = [_lane("y", i) for i in range(nq + n)] + ["dt"]
    for j in range(len(asked) + 1):
        inputs = [*q, *qd, dt, *(value for answer in answers[:j] for value in answer)]
        known = ", ".join(own + [_lane("k", i) for i in range(j * n)])
        if j == len(asked):
            functions.append(tape.function("combined", inputs, [*results[0], *results[1]]))
        else:
            functions.append(tape.function(f"stage_{j}", inputs, asked[j]))
            arguments = ", ".join(_lane("x", i) for i in range(nq + n))
            stages.append(STAGE.format(W=LANES, j=j, arguments=arguments, known=known, offset=j * n * LANES))
    places = [("q", i) for i in range(nq)] + [("qd", i) for i in range(n)]
    words = _words(tree) | {
        "W": LANES,
        "cost": stepping.stages,
        "size_x": (nq + 2 * n) * LANES,
        "size_y": (nq + n) * LANES,
        "size_k": len(asked) * n * LANES,
        "first": ", ".join(f"{name}[b + l, 0, {i}]" for name, i in places),
        "given": ", ".join(f"tau[b + l, {i}]" for i in range(n)),
        "store": ", ".join(f"{name}[b + l, record, {i}]" for name, i in places),
        "rows_x": ", ".join(_row("x", i) for i in range(nq + n)),
        "rows_y": ", ".join(_row("y", i) for i in range(nq + n)),
        "rows_tau": ", ".join(_row("x", nq + n + i) for i in range(n)),
        "lane_new": ", ".join(_lane("x", i) for i in range(nq + n)),
        "known": known,
        "stages": "".join(stages).rstrip(),
    }
    arguments = ", ".join([_lane("x", i) for i in range(nq + 2 * n)] + ["dt"])
    slopes = SLOPES.format(W=LANES, arguments=arguments, results=_sequence(lambda i: _lane("k", i, "o + "), n))
    return "\n\n".join([HEADER, *(written(code, inline=True) for code in functions), slopes, RUN_LANES.format(**words)])


@kept
def evaluator_source(tree, quantity, terms, sine) -> str:
    """The module of kernels.evaluator."""
    nq, n = tree.coordinates.nq, tree.coordinates.nv
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
    code = tape.function("quantity", [*q, *qd, *tau], outputs)
    inputs = [(name, i) for name, count in (("q", nq), ("qd", n), ("tau", n)) for i in range(count)]
    places = ", ".join(f"{name}[i, {k}]" for name, k in inputs)

    words = {
        "W": LANES,
        "size_y": m * LANES,
        "row_in": places,
        "row_out": _sequence(lambda k: f"out[i, {k}]", m),
        "nq": nq,
        "n": n,
        "m": m,
        "sound_row": " + ".join(f"abs(out[i, {k}])" for k in range(m)) + " < np.inf",
        "lane_sizes": " + ".join(f"abs({_lane('y', k)})" for k in range(m)),
        "sound_column": " + ".join(f"abs(out[{k}, i])" for k in range(m)) + " < np.inf",
        "chained": ", ".join(f"{name}[{k}] + 1e-300 * last" for name, k in inputs),
        "last": " + ".join(f"results[{k}]" for k in range(m)),
        "results": _sequence(lambda k: _lane("y", k), m),
        "arguments": ", ".join(f"flat_{name}[b{k} + l]" for name, k in inputs),
        "scatter": "; ".join(f"flat_out[b{k} + l] = {_lane('y', k)}" for k in range(m)),
        "begins": "; ".join(f"b{k} = np.uint64({k} * count + b)" for k in range(max(m, nq))),
        "column_in": ", ".join(f"{name}[{k}, i]" for name, k in inputs),
        "column_out": _sequence(lambda k: f"out[{k}, i]", m),
    }
    fast = written(code, inline=True).replace("sincos(", f"{sine}(")
    sure = written(code).replace("def quantity(", "def by_library(").replace("sincos(", "library_sincos(")
    text = "\n\n".join([HEADER + fast, sure, EVALUATE.format(**words)])
    if quantity != "forward_dynamics":
        return text
    given = _sequence(lambda k: f"y[{k}]", nq + n) + ", " + _sequence(lambda k: f"tau[{k}]", n)
    rates = _sequence(lambda k: f"result[{nq + k}]", n)
    sound = " + ".join(f"abs(result[{nq + k}])" for k in range(n)) + " < np.inf"
    moving = f"result[:{nq}] = y[{nq}:]"
    if tree.coordinates.balls:
        turns = tape.function("moving", [*q, *qd], tree.coordinates.component_rates(q, qd))
        text += "\n\n" + written(turns)
        moving = f"{_sequence(lambda k: f'result[{k}]', nq)} = moving({_sequence(lambda k: f'y[{k}]', nq + n)})"
    words = {"n": n, "all": nq + n, "moving": moving, "rates": rates, "given": given, "sound_rates": sound}
    return text + RATE.format(**words)


def _inputs(tape, tree):
    sizes = {"q": tree.coordinates.nq, "qd": tree.coordinates.nv, "tau": tree.coordinates.nv}
    return *(tape.inputs(*(f"{name}{i}" for i in range(n))) for name, n in sizes.items()), tape.inputs("dt")[0]


def _words(tree) -> dict:
    """What the templates say of the states of a tree, one scalar after the other."""
    sizes = {"q": tree.coordinates.nq, "qd": tree.coordinates.nv, "tau": tree.coordinates.nv}

    def sequence(pattern, names=("q", "qd")):
        return ", ".join(pattern.format(name=name, i=i) for name in names for i in range(sizes[name]))

    angles = [f"abs(q{joint.q.start})" for joint in tree.coordinates.joints if joint.kind == "hinge"]
    rest = [
        f"q{k}"
        for joint in tree.coordinates.joints
        if joint.kind != "hinge"
        for k in range(joint.q.start, joint.q.stop)
    ]
    finite = " + ".join([*rest, _sum("qd", sizes["qd"])])
    limited = f"{' + '.join(angles)} < LIMIT and " if angles else ""
    return {
        "state": sequence("{name}{i}"),
        "torque": sequence("{name}{i}", ["tau"]),
        "first": sequence("{name}[b, 0, {i}]"),
        "given": sequence("{name}[b, {i}]", ["tau"]),
        "store": sequence("{name}[b, k, {i}]"),
        "sound": f"({limited}math.isfinite({finite}))",
        "why": _why(tree),
        "check": CHECK.format(nq=sizes["q"], n=sizes["qd"]),
    }


def _sequence(pattern, count) -> str:
    """What stands on the left of an assignment of so many results, or in a call: a single one is a tuple too."""
    return ", ".join(pattern(i) for i in range(count)) + "," * (count == 1)


def _sum(name, n) -> str:
    return " + ".join(f"{name}{i}" for i in range(n))


def _why(tree) -> str:
    """Why a state is not sound."""
    sums = f"{_sum('q', tree.coordinates.nq)} + {_sum('qd', tree.coordinates.nv)}"
    return f"({TURNED} if math.isfinite({sums}) else {OVERFLOW})"


def _row(name, i) -> str:
    """Component i of lane l in a block, for a loop over signed l."""
    return f"{name}[np.uint64({i * LANES} + l)]"


def _lane(name, i, before="") -> str:
    """The same for unsigned l, as the compiler needs it to put lanes into one register."""
    return f"{name}[{before}np.uint64({i * LANES}) + l]"
