"""Motions in compiled code: the loops over runs, records and steps around the traced step of a method.

run(q, qd, tau, dt, tolerance, info, carried, stop, every, records, runs): paths q (runs, records, nq) and qd
(runs, records, nv) are filled from their first states, of which each `every`-th is kept; tau (runs, nv). info
(runs, 3) of whole numbers: why each run ended, 0 where it did not, after how many steps, and how many
evaluations. carried (runs, 4), of an adaptive method: the step that it tries first, s, and how many
evaluations are left; then both at the end. stop: a whole number, which ends all runs once it is not 0.
"""

from collections.abc import Callable
from typing import Any

from tmt.derivation.vectors import Values
from tmt.methods.implicit import CLOSE, ITERATIONS
from tmt.methods.stepping import DIVERGED, MANY, NEWTON, SMALL
from tmt.model.tree import Tree

from . import forms, linear
from .ir import DOUBLE, FLAG, INDEX, POINTER, Code, Value, Variable, module, wide
from .straight import LIMIT, Traced, functions, trace

# (code, state, new state, dt, evaluations): why it ends
Advance = Callable[[Code, Value, Value, Value, Variable], Value]
INLINED = 1_500  # nodes of the slopes of a step that are put in the place of their calls
# of an adaptive method, in units of dt and of the step before
SHORTEST_STEP, GROWTH, SHRINKING, SAFETY = 1e-9, 6.0, 0.333, 0.9


def source(tree: Tree, stepping: Any, width: int) -> str:
    step = Step(tree, stepping, width)
    make = step.solving if stepping.solves_stages else step.adaptive if stepping.adaptive else step.explicit
    advance = make()
    return module([*step.functions, run(step, advance)])


class Step:
    # stepping: a Method, with what NEEDS says of its kind
    def __init__(self, tree: Tree, stepping: Any, width: int):
        self.tree, self.stepping, self.width = tree, stepping, width
        self.nq, self.n = tree.coordinates.nq, tree.coordinates.nv
        self.functions: list[Code] = []
        # of an adaptive method: the step that its tolerance wants, and how many evaluations are left
        self.wanted: Variable
        self.left: Variable

    def add(self, traced: Traced, width: int, inline: bool = False) -> None:
        self.functions += functions(traced, width, inline)
        operations = [traced.tape.nodes[i] for i in traced.nodes]
        is_solved = any(kind == "call" and arguments[0] == "solution" for kind, arguments in operations)
        if is_solved and "solve" not in {code.name for code in self.functions}:
            self.functions += [linear.solve(), linear.solution(self.n)]

    def add_step(self, name: str) -> int:
        nq, n, stepping = self.nq, self.n, self.stepping
        slope = forms.slope(self.tree, stepping)
        self.add(slope, self.width, inline=len(slope.nodes) * stepping.stages <= INLINED)

        def function(q: Values, qd: Values, tau: Values, dt: Values) -> Values:
            def called_slope(q: Values, qd: Values) -> Values:
                return q[0].tape.call("slope", [*q, *qd, *tau, *dt], n)

            return forms.flat(
                list(getattr(stepping, name)(called_slope, q, qd, dt[0], self.tree.coordinates))
            )

        traced = trace(name, (nq, n, n, 1), function)
        self.add(traced, self.width, inline=True)
        return len(traced.outputs)

    def explicit(self) -> Advance:
        self.add_step("step")

        def advance(code: Code, state: Value, new: Value, dt: Value, evaluations: Variable) -> Value:
            code.call("step", state, new)
            return unsound(code, self.tree, new, self.width)

        return advance

    def adaptive(self) -> Advance:
        nq, n, order = self.nq, self.n, self.stepping.order
        count = self.add_step("attempt")
        # for each component of an error the number of the state in whose units it is; None: an angle
        scales: list[int | None] = []
        for joint in self.tree.coordinates.joints:
            scales += [None] * 3 if joint.kind == "ball" else [joint.q.start]
        scales += range(nq, nq + n)

        def advance(code: Code, state: Value, new: Value, dt: Value, evaluations: Variable) -> Value:
            wanted, left, why = self.wanted, Variable(code, DOUBLE, dt), Variable(code, INDEX, 0)
            result = code.reserve(DOUBLE, count)
            with code.loop(2**62) as loop:
                loop.leave(left.get().compare("le", 0.0))
                loop.leave(why.get().compare("ne", 0))
                loop.leave(is_stopped(code))
                pieces = (left.get() / wanted.get()).function("ceil")
                h = left.get() / pieces
                state.store(h, nq + 2 * n)
                code.call("attempt", state, result)
                evaluations.set(evaluations.get() + self.stepping.stages)
                self.left.set(self.left.get() - self.stepping.stages)
                e5 = squares(state, result, nq + n, scales, code["tolerance"])
                e3 = squares(state, result, nq + 3 * n, scales, code["tolerance"])
                root = (2.0 * n * (e5 + 0.01 * e3)).function("sqrt")
                is_number = (e5 + e3).compare("lt", float("inf"))
                share = e5.compare("eq", 0.0).choose(code.number(0.0), e5 / root)
                error = is_number.choose(share, float("inf"))
                is_accepted, flaw = error.compare("lt", 1.0), unsound(code, self.tree, result, 1)
                with code.when(is_accepted):
                    for k in code.each(nq + n):
                        state.store(result.load(k), k)
                    left.set(pieces.compare("gt", 1.0).choose(left.get() - h, 0.0))
                # infinite where there is no error
                factor = SAFETY * code.intrinsic("pow", error, code.number(-1.0 / order))
                factor = factor.compare("gt", SHRINKING).choose(factor, SHRINKING)
                factor = factor.compare("lt", GROWTH).choose(factor, GROWTH)
                wanted.set(h * factor)
                short = flaw.compare("ne", 0).choose(flaw, SMALL)
                ends = h.compare("gt", dt * SHORTEST_STEP).choose(code.number(0, INDEX), short)
                ends = self.left.get().compare("gt", 0.0).choose(ends, MANY)
                why.set(flaw.compare("ne", 0).bits("and", is_accepted).choose(flaw, ends))
            for k in code.each(nq + n):
                new.store(state.load(k), k)
            state.store(dt, nq + 2 * n)
            return why.get()

        return advance

    def solving(self) -> Advance:
        nq, n, stepping, width = self.nq, self.n, self.stepping, linear.WIDTH
        unknown = n * stepping.stages
        columns = -(-unknown // width) * width
        directional = forms.directional(self.tree, stepping)
        self.add(directional, width, inline=len(directional.nodes) * stepping.stages <= INLINED)
        for made_linear in (False, True):
            self.add(forms.residual(self.tree, stepping, made_linear), width, inline=not made_linear)
        if "solve" not in {code.name for code in self.functions}:
            self.functions.append(linear.solve())

        def finish(q: Values, qd: Values, dt: Values, a: Values) -> Values:
            return forms.flat(list(stepping.finish(q, qd, dt[0], a, self.tree.coordinates)))

        self.add(trace("finish", (nq, n, 1, unknown), finish), 1, inline=True)

        def advance(code: Code, state: Value, new: Value, dt: Value, evaluations: Variable) -> Value:
            inputs = nq + 2 * n + 1
            arguments = code.reserve(wide(DOUBLE, width), inputs + 2 * unknown)
            residuals = code.reserve(wide(DOUBLE, width), 2 * unknown)
            matrix, right = code.reserve(DOUBLE, unknown * columns), code.reserve(DOUBLE, unknown)
            last = code.reserve(DOUBLE, nq + n + 1 + unknown)  # what `finish` takes
            a = last.at(nq + n + 1)
            length = code.number(unknown, INDEX)
            why = Variable(code, INDEX, NEWTON)
            for k in code.each(inputs):
                arguments.store(state.load(k).everywhere(width), k * width)
            with code.loop(length) as loop:
                a.store(0.0, loop.index)
            with code.loop(ITERATIONS + 1) as iteration:
                is_linear = iteration.index.compare("eq", 0)
                with code.loop(length) as loop:
                    arguments.store(a.load(loop.index).everywhere(width), (loop.index + inputs) * width)
                with code.loop(length, width) as loop:
                    linear.put_directions(arguments, inputs + unknown, unknown, loop.index, width)
                    with code.when(is_linear):
                        code.call("linear_residual", arguments, residuals)
                    with code.when(is_linear.negated()):
                        code.call("residual", arguments, residuals)
                    with code.loop(length) as rows:
                        change = residuals.load((rows.index + unknown) * width, wide(DOUBLE, width))
                        matrix.store(-change, rows.index * columns + loop.index)
                with code.loop(length) as rows:
                    right.store(residuals.load(rows.index * width), rows.index)
                code.call("solve", matrix, code.number(columns, INDEX), right, length)
                evaluations.set(evaluations.get() + stepping.stages)
                size, most = Variable(code, DOUBLE, 0.0), Variable(code, DOUBLE, 0.0)
                with code.loop(length) as loop:
                    change = right.load(loop.index)
                    a.store(a.load(loop.index) + change, loop.index)
                    for largest, value in ((size, a.load(loop.index)), (most, change)):
                        value, so_far = value.function("fabs"), largest.get()
                        # not a number stays so
                        largest.set(value.compare("le", so_far).choose(so_far, value))
                close = most.get().compare("le", CLOSE * (1.0 + size.get()))
                close = close.bits("and", is_linear.negated())
                with code.when(close):
                    why.set(0)
                iteration.leave(close)
                iteration.leave(size.get().compare("lt", float("inf")).negated())
            with code.when(why.get().compare("eq", 0)):
                for k in code.each(nq + n):
                    last.store(state.load(k), k)
                last.store(dt, nq + n)
                code.call("finish", last, new)
                why.set(unsound(code, self.tree, new, 1))
            return why.get()

        return advance


def squares(state: Value, result: Value, first: int, scales: list[int | None], tolerance: Value) -> Value:
    """The sum of the squares of an error from number `first` on, in units of tolerance (1 + |value|)."""
    total = state.code.number(0.0)
    for k, scale in enumerate(scales):
        unit: Value | float = 2.0
        if scale is not None:
            before, after = state.load(scale).function("fabs"), result.load(scale).function("fabs")
            unit = 1.0 + after.compare("gt", before).choose(after, before)
        share = result.load(first + k) / (tolerance * unit)
        total = total + share * share
    return total


def run(step: Step, advance: Advance) -> Code:
    names = {"q": POINTER, "qd": POINTER, "tau": POINTER, "dt": DOUBLE, "tolerance": DOUBLE}
    names |= dict.fromkeys(("info", "carried", "stop"), POINTER)
    code = Code("run", names | dict.fromkeys(("every", "records", "runs"), INDEX))
    nq, n, width = step.nq, step.n, step.width
    kind, flags = wide(DOUBLE, width), wide(FLAG, width)
    state, new = code.reserve(kind, nq + 2 * n + 1), code.reserve(kind, nq + n)
    paths, info = (("q", nq, 0), ("qd", n, nq)), code["info"]
    state.store(code["dt"].everywhere(width), (nq + 2 * n) * width)
    with code.loop(code["runs"], width) as runs:
        rows = linear.rows_of(runs.index, code["runs"], width)
        alive, evaluations = Variable(code, flags, True), Variable(code, INDEX, 0)
        step.wanted, step.left = (
            Variable(code, DOUBLE, code["carried"].load(runs.index * 4 + k)) for k in (0, 1)
        )
        for lane, run in enumerate(rows):
            for name, size, first in paths:
                for k in code.each(size):
                    state.store(code[name].load(run * code["records"] * size + k), (k + first) * width + lane)
            for k in code.each(n):
                state.store(code["tau"].load(run * n + k), (k + nq + n) * width + lane)
        with code.loop(code["records"] - 1) as records:
            with code.loop(code["every"]) as steps:
                why = advance(code, state, new, code["dt"], evaluations)
                for k in code.each(nq + n):
                    state.store(new.load(k * width, kind), k * width)
                ends = why.compare("ne", 0).bits("and", alive.get())
                with code.when(linear.any_of(ends, width)):
                    for lane, run in enumerate(rows):
                        with code.when(ends.lane(lane)):
                            info.store(why.lane(lane), run * 3)
                            info.store(records.index * code["every"] + steps.index, run * 3 + 1)
                    alive.set(alive.get().bits("and", ends.negated()))
                steps.leave(linear.any_of(alive.get(), width).negated())
                steps.leave(is_stopped(code))
            records.leave(linear.any_of(alive.get(), width).negated())
            records.leave(is_stopped(code))
            for lane, run in enumerate(rows):
                for name, size, first in paths:
                    place = (run * code["records"] + records.index + 1) * size
                    for k in code.each(size):
                        code[name].store(state.load((k + first) * width + lane), place + k)
        if width == 1:
            info.store(evaluations.get(), runs.index * 3 + 2)
            for k, variable in ((2, step.wanted), (3, step.left)):
                code["carried"].store(variable.get(), runs.index * 4 + k)
        runs.leave(is_stopped(code))
    code.ret()
    return code


def is_stopped(code: Code) -> Value:
    """Read anew each time: another thread writes it."""
    return code.put(INDEX, f"load volatile {INDEX}, ptr {code['stop'].name}, align 8").compare("ne", 0)


def unsound(code: Code, tree: Tree, state: Value, width: int) -> Value:
    kind = wide(DOUBLE, width)
    total, angles = Variable(code, kind, 0.0), code.number(0.0, kind)
    for k in code.each(tree.coordinates.nq + tree.coordinates.nv):
        total.set(total.get() + state.load(k * width, kind))
    for joint in tree.coordinates.joints:
        if joint.kind == "hinge":
            angles = angles + state.load(joint.q.start * width, kind).function("fabs")
    sound = total.get().function("fabs").compare("lt", float("inf"))
    sound = sound.bits("and", angles.compare("lt", LIMIT))
    return sound.choose(code.number(0, wide(INDEX, width)), DIVERGED)
