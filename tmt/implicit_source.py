"""The source of the compiled step of an implicit method: straight-line code inside, Newton's loop around it."""

from tmt.compiled.trace import Code, Tape
from tmt.equations.dual import jacobian
from tmt.methods.implicit import CLOSE, ITERATIONS, directions
from tmt.model.coordinates import FLAT

STEP = '''
@njit(error_model="numpy")
def step({state}, {torque}, dt):
    """The state one dt later and how often Newton's method was applied; NaN where it does not find the stages."""
    {unknown}, = start({state}, {torque}, dt)
    for used in range(1, {iterations} + 1):
        {change}, = newton({state}, {torque}, dt, {unknown})
        {update}
        size = max(0.0, {unknown_sizes})
        change = max(0.0, {change_sizes})
        if change <= {close!r} * (1.0 + size):
            return finish({state}, dt, {unknown}) + (used,)
        if not math.isfinite(size):
            break
    return ({nothing}, used)
'''


def step_source(tree, stepping, terms) -> list[Code | str]:
    """Straight-line functions for the compiled `step` of an implicit method, and at last its source.

    terms: the form of the dynamics that is traced.
    """
    joints, nq, n = tree.coordinates, tree.coordinates.nq, tree.coordinates.nv
    place = joints if joints.balls else FLAT

    def fresh():
        tape = Tape()
        sizes = {"q": nq, "qd": n, "tau": n, "a": n * stepping.stages}
        q, qd, tau, a = (tape.inputs(*(f"{name}{i}" for i in range(size))) for name, size in sizes.items())
        return tape, q, qd, tau, tape.inputs("dt")[0], a

    tape, q, qd, tau, dt, _ = fresh()
    value = stepping.slope(tree, q, qd, tau, dt, terms)
    rows = jacobian(lambda x: stepping.slope(tree, x[:nq], x[nq:], tau, dt, terms), [*q, *qd], directions(place, q, n))
    outputs = [*value, *(entry for row in rows for entry in row)]
    functions = [tape.function("slope_and_jacobian", [*q, *qd, *tau, dt], outputs)]

    tape, q, qd, tau, dt, a = fresh()

    def called(q, qd):
        found = tape.call("slope_and_jacobian", [*q, *qd, *tau, dt], n + 2 * n * n)
        rows = [found[n + 2 * n * k : n + 2 * n * (k + 1)] for k in range(n)]
        return found[:n], [row[:n] for row in rows], [row[n:] for row in rows]

    change = stepping.newton(called, q, qd, dt, a, place)
    functions.append(tape.function("newton", [*q, *qd, *tau, dt, *a], change))
    tape, q, qd, tau, dt, _ = fresh()
    functions.append(tape.function("start", [*q, *qd, *tau, dt], stepping.start(called, q, qd, dt, place)))
    tape, q, qd, tau, dt, a = fresh()
    new_q, new_qd = stepping.finish(q, qd, dt, a, place)
    functions.append(tape.function("finish", [*q, *qd, dt, *a], [*new_q, *new_qd]))

    count = len(a)

    def list_of(pattern, count=count):
        return ", ".join(pattern.format(i=i) for i in range(count))

    step = STEP.format(
        state=", ".join([list_of("q{i}", nq), list_of("qd{i}", n)]),
        torque=list_of("tau{i}", n),
        unknown=list_of("a{i}"),
        iterations=ITERATIONS,
        change=list_of("d{i}"),
        update="; ".join(f"a{i} += d{i}" for i in range(count)),
        unknown_sizes=list_of("abs(a{i})"),
        change_sizes=list_of("abs(d{i})"),
        close=CLOSE,
        nothing=list_of("np.nan", nq + n),
    )
    return [*functions, step.lstrip("\n")]
