"""Who answers the public functions: the literal form, or the compiled loops or straight-line code once they are worth getting.

Compiled code answers where nothing is wrong with what is given; whatever is, the literal form says. Which of them is asked
depends on how much was asked so far in this process, see choice.py, and never on a clock.
"""

import math
from contextlib import suppress
from functools import lru_cache

import numpy as np
from numpy import ndarray

from tmt import kernels, literal
from tmt.arm import ARM
from tmt.cache import is_kept
from tmt.calls import refused
from tmt.choice import USUAL_LINES, Form, chosen, loop_each, straight_line_each, straight_line_getting
from tmt.compiled.cores import side_by_side
from tmt.loop_trees import in_parts
from tmt.model import singular
from tmt.model.arguments import checked_model
from tmt.model.tree import Tree
from tmt.model.values import real_numbers
from tmt.source import LANES

# estimates, s: of the literal form an evaluation, for each body and pair of speeds and for each speed, and a call, in
# evaluations; of the loops their compilation, their reading from the cache folder with numba's import, and for each speed
# what it takes to write a Tree as they want it
LITERAL, LITERAL_JOINT, CALL, COMPILED, READ, WRITTEN = 1.2e-8, 4e-7, 220, 9.0, 0.6, 2e-3
BLOCK = 24_000  # numbers of one kind that are laid out for straight-line code at a time, and stay near the processor
SHAPES = {  # of a result, m bodies and n speeds
    "com_positions": ("m", 3), "angular_velocities": ("m", 3), "jacobians": (2, "m", 3, "n"), "convective_terms": (2, "m", 3),
    "potential_energy": (), "energy": (), "spring_torque": ("n",), "acceleration": ("n",), "mass_matrix": ("n", "n"),
    "bias": ("n",), "gravity_balance": ("n",),
}  # fmt: skip
OF_MASS = dict.fromkeys(("mass_matrix", "bias", "gravity_balance"), "mass_matrix_and_bias")
OF_STRAIGHT_LINES = {"acceleration": "forward_dynamics"} | OF_MASS
REMEMBERED = 64  # models
_known = {}


def answered(quantity: str, model: Tree, *given):
    """The quantity, one of SHAPES, of states of any batch shape: what the function of that name in literal.py returns.

    given: q, or q and qd, or q, qd and tau, as that function takes them.
    """
    known, found, q = _known.get(id(model)), None, given[0]
    if known is not None and type(q) is ndarray and q.ndim == 1:
        found = known.of_one(quantity, *given)
    if found is None and isinstance(model, Tree):
        try:
            found = remembered(model).of_any(quantity, *given)
        except MemoryError:
            found = None
    return getattr(literal, quantity)(*given, model) if found is None else found


def prepare(model: Tree = ARM) -> None:
    """Have compiled loops answer for a model from now on, so that no later call waits for them: in a controller, say.

    It takes a second or so, the first time on a machine some ten. ValueError if it is no Tree.
    """
    checked_model(model)
    remembered(model).get_loops()


class Known:
    """A Tree as compiled code takes it, and what was asked of it."""

    def __init__(self, tree):
        self.tree = tree  # held, so that no other has its id
        self.rest, self.may_be_singular, self.parts = np.zeros(len(tree.axis)), not tree.never_singular, None
        self.by_literal = 0.0  # evaluations so far, while there are no loops
        self.was_refused = False  # whether the loops were given what they do not take, which they say in milliseconds
        # of straight-line code: what is there, its lines and whether they are kept on disk, and evaluations so far
        self.lanes, self.lines, self.asked = {}, {}, {}
        sizes = {"m": len(tree.mass), "n": len(tree.axis)}
        self.shapes = {name: tuple(sizes.get(size, size) for size in shape) for name, shape in SHAPES.items()}
        self.sizes = {name: math.prod(shape) for name, shape in self.shapes.items()}

    def of_one(self, quantity, *given):
        """The quantity of one state; None where there are no loops yet, or they cannot take what is given."""
        q, qd, tau = (*given, self.rest, self.rest)[:3]
        if self.parts is None or (self.may_be_singular and quantity == "acceleration" and self.is_singular(q)):
            return None
        if not type(qd) is type(tau) is ndarray or (self.was_refused and not all(map(is_taken, given))):
            return None
        shape, size, number = self.shapes[quantity], self.sizes[quantity], self.numbers[quantity]
        out = np.empty(size)
        try:
            answers = self.loops.one(*self.parts, q, qd, tau, number, out)
        except refused():  # of another type, not contiguous
            self.was_refused = True
            return None
        if not answers:
            return None
        return out if len(shape) == 1 else as_returned(quantity, out, shape)

    def of_any(self, quantity, *given):
        """The quantity of states of any batch shape; None where the literal form is to answer."""
        with np.errstate(all="ignore"):  # of numbers beyond the largest double, which the literal form refuses
            arrays = [values if is_plain(values) else real_numbers(values) for values in given]
        sizes = len(self.tree.rest), len(self.rest), len(self.rest)
        if any(array is None or not array.ndim or array.shape[-1] != size for array, size in zip(arrays, sizes)):
            return None
        try:
            batch = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
        except ValueError:
            return None
        count = math.prod(batch)
        if not count or not self.has_loops(count):
            return None
        if not batch:
            return self.of_one(quantity, *map(np.array, arrays))
        q, *rates = arrays[0], *arrays[1:], self.rest, self.rest
        q, rates = rows_of(q, batch), [rows_of(rows, batch if rows.ndim > 1 else ()) for rows in rates[:2]]
        if quantity == "acceleration" and self.may_be_singular and self.is_singular(q):
            return None
        out = np.empty((count, self.sizes[quantity]))
        answers = self.by_lines if self.has_lines(quantity, count) else self.by_loops
        return as_returned(quantity, out, self.shapes[quantity], batch) if answers(quantity, q, *rates, out) else None

    def is_singular(self, q) -> bool:
        """Whether Mbar may be singular at a position among these, or cannot be told here."""
        M = self.of_one("mass_matrix", q) if q.ndim == 1 else self.of_any("mass_matrix", q)
        n = len(self.rest)
        return M is None or bool(singular.first(self.tree, q.reshape(-1, q.shape[-1]), M.reshape(-1, n, n)))

    def has_loops(self, count) -> bool:
        """Whether the loops are there, or are got now, as the literal form would have taken longer than that for all so far."""
        if self.parts is None:
            n, wanted = len(self.rest), CALL + count
            literally = Form("literal", 0.0, LITERAL * len(self.tree.mass) * n * n + LITERAL_JOINT * n)

            def pay(getting) -> bool:
                forms = literally, Form("loop", getting + WRITTEN * n, 0.0)
                return chosen(forms, wanted, self.by_literal) is not literally

            if pay(0.0) and (loops.cache_info().currsize or (pay(READ) and pay(getting_loops()))):
                self.get_loops()
            self.by_literal += wanted
        return self.parts is not None

    def get_loops(self) -> None:
        """Have the loops answer from now on."""
        self.loops = loops()
        self.numbers, parts = self.loops.QUANTITIES, in_parts(self.tree)
        self.parts = parts  # last: from here on other threads ask them

    def has_lines(self, quantity, count) -> bool:
        """Whether straight-line code is there for so many states, or is got now as the loops would have taken longer so far."""
        of = OF_STRAIGHT_LINES.get(quantity)
        if of is None or count < LANES:
            return False
        if of not in self.lanes and self.pays(USUAL_LINES * len(self.rest), True, False, of, count):
            if of not in self.lines:  # traced only where it could pay
                length = kernels.is_evaluated_straight(self.tree) and kernels.lines_of_evaluator(self.tree)
                self.lines[of] = length and (length, kernels.is_evaluator_on_disk(self.tree, of))
            if self.lines[of] and self.pays(*self.lines[of], True, of, count):
                self.lanes[of] = kernels.evaluator(self.tree, of).lanes
        self.asked[of] = self.asked.get(of, 0) + count
        return of in self.lanes

    def pays(self, lines, kept, traced, of, count) -> bool:
        """Whether so many lines of straight-line code are worth getting."""
        loop = Form("loop_lanes", 0.0, loop_each(len(self.rest), lanes=True))
        getting = straight_line_getting(lines, kept, lanes=True, traced=traced)
        straight = Form("straight_line_lanes", getting, straight_line_each(lines, lanes=True))
        return chosen((loop, straight), count, self.asked.get(of, 0)) is straight

    def by_loops(self, quantity, q, qd, tau, out) -> bool:
        """Fill rows of results; whether they are right."""

        def answers(part):
            rates = (rows if len(rows) == 1 else rows[part] for rows in (qd, tau))
            return self.loops.many(*self.parts, q[part], *rates, self.numbers[quantity], out[part])

        return all(side_by_side(answers, len(out), loop_each(len(self.rest), lanes=True)))

    def by_lines(self, quantity, q, qd, tau, out) -> bool:
        """The same by straight-line code, a block of states after the other."""
        of, nq, n = OF_STRAIGHT_LINES[quantity], len(self.tree.rest), len(self.rest)
        lanes, loops, number = self.lanes[of], self.loops, self.numbers[quantity]
        size = n if of == "forward_dynamics" else n * (n + 3) // 2

        def answers(part):
            columns, block = None, max(LANES, BLOCK // n // LANES * LANES)
            for first in range(part.start, part.stop, block):
                some = slice(first, min(first + block, part.stop))
                count = some.stop - first
                if columns is None or columns[0].shape[1] != count:
                    columns = [np.empty((rows, count)) for rows in (nq, n, n, size)]
                loops.to_columns(q, qd, tau, first, *columns[:3])
                lanes(*columns)
                loops.to_rows(columns[3], number, out, first)
                rates = (rows if len(rows) == 1 else rows[some] for rows in (qd, tau))
                if not loops.right(self.parts[0], q[some], *rates, out[some]):  # while they are near the processor
                    return False
            return True

        return all(side_by_side(answers, len(out), straight_line_each(self.lines[of][0], lanes=True)))


@lru_cache(maxsize=1)
def loops():
    """The compiled loops, read or compiled when they are first asked for."""
    from numba.core.compiler_lock import global_compiler_lock

    from tmt import loop_answers

    # of one state, and of none: compiled for these types and then for no others, which numba would take as they are
    of, zeros, out = in_parts(ARM), np.zeros(3), np.empty(3)
    with global_compiler_lock:  # until nothing is to be compiled another thread does not ask
        loop_answers.one(*of, zeros, zeros, zeros, loop_answers.BIAS, out)
        loop_answers.many(*of, *(rows[None] for rows in (zeros, zeros, zeros)), loop_answers.BIAS, out[None])
        loop_answers.one.disable_compile()
        loop_answers.many.disable_compile()
    return loop_answers


@lru_cache(maxsize=1)
def getting_loops() -> float:
    """What it takes until the loops are there, s."""
    return READ if is_kept("loop_answers.many-*") else COMPILED


def remembered(tree) -> Known:
    """What is known of a Tree; of the last ones only."""
    known = _known.get(id(tree))
    if known is None:
        known = Known(tree)
        while len(_known) >= REMEMBERED:
            with suppress(KeyError, RuntimeError, StopIteration):  # another thread was sooner
                del _known[next(iter(_known))]
        known = _known.setdefault(id(tree), known)
    return known


def is_plain(values) -> bool:
    return type(values) is ndarray and values.dtype == np.float64


def is_taken(array) -> bool:
    """Whether the loops take this array as the q, qd or tau of one state."""
    return array.ndim == 1 and is_plain(array) and array.flags.carray


def rows_of(array, batch) -> ndarray:
    """States of a batch one after the other, as compiled code takes them."""
    size = array.shape[-1]
    whole = array if array.shape[:-1] == batch else np.broadcast_to(array, (*batch, size))
    return np.require(whole.reshape(-1, size), requirements="CAW")


def as_returned(quantity, out, shape, batch=()):
    """Results as the function returns them."""
    if quantity not in ("jacobians", "convective_terms"):
        return out.reshape(batch + shape)
    first, second = np.moveaxis(out.reshape(batch + shape), len(batch), 0)
    return first.copy(), second.copy()
