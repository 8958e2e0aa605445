"""How many floating-point operations an evaluation has: its own source is run on numbers that count them.

An addition, a subtraction, a multiplication, a division, a root or an arc tangent is one, a fused multiply-add two; a sine with
its cosine has those of sine.py. Changes of sign, comparisons and what is done with bits or whole numbers are none.
"""

import math
import struct
from collections.abc import Callable
from functools import lru_cache
from types import FunctionType

import numpy as np

import tmt
from tmt import inlined, kernels, loop_joints, loop_trees, loops, sine
from tmt.equations.vectors import arctan, sqrt
from tmt.inlined import zero

from .affordable import straight_line


class Counted(float):
    """A number that counts the operations in which it takes part.

    counts: {"operations": so many}, which it has in common with what is made of it. If it has "left_out" too, adding a plain 0.0
    or multiplying by a plain 1.0 or -1.0 counts nothing, as compiled loops do not do it (see eight.py).
    """

    def __new__(cls, value, counts):
        made = super().__new__(cls, value)
        made.counts = counts
        return made

    def after(self, value, operations=1) -> "Counted":
        """The number that so many operations make of this one."""
        self.counts["operations"] += operations
        return Counted(value, self.counts)

    def __neg__(self):
        return Counted(-float(self), self.counts)


def counting(name, changes_nothing, reflected=False) -> Callable:
    """The operation of a Counted of that name; changes_nothing: plain second operands with which it can be left out."""
    of_floats = getattr(float, f"__{name}__")

    def operate(a, b):
        plain = not reflected and b.__class__ is float and b in changes_nothing
        a, b = (b, a) if reflected else (a, b)
        one = a if isinstance(a, Counted) else b
        return one.after(of_floats(float(a), float(b)), not (plain and "left_out" in one.counts))

    return operate


for _name, _changes_nothing in {"add": (0.0,), "sub": (0.0,), "mul": (1.0, -1.0), "truediv": (1.0,)}.items():
    setattr(Counted, f"__{_name}__", counting(_name, _changes_nothing))
    setattr(Counted, f"__r{_name}__", counting(_name, (), reflected=True))
sqrt.register(Counted, lambda x: x.after(math.sqrt(x)))
arctan.register(Counted, lambda x: x.after(math.atan(x)))


def fma(a, b, c):
    """a b + c: two operations."""
    return next(x for x in (a, b, c) if isinstance(x, Counted)).after(float(a) * float(b) + float(c), 2)


def sincos(x: Counted) -> tuple[Counted, Counted]:
    """The sine and the cosine by the source of sine.py."""
    known = vars(sine) | {
        "fma": fma,
        "bits": lambda y: struct.unpack("q", struct.pack("d", y))[0],
        # only 64 bits of a shifted whole number are kept
        "from_bits": lambda i: x.after(struct.unpack("d", struct.pack("Q", i % 2**64))[0], 0),
    }
    return FunctionType(sine.sincos.py_func.__code__, known)(x)


def of_source(text: str, name: str, values: list[float]) -> tuple[int, list[float]]:
    """How many operations straight-line code has, from its text, and its results."""
    counts, known = {"operations": 0}, {"sincos": sincos, "fma": fma, "sqrt": sqrt, "arctan": arctan}
    exec(text, known)
    results = known[name](*(Counted(value, counts) for value in values))
    return counts["operations"], list(results)


def of_loop(tree: tmt.Tree, q, qd, tau) -> tuple[int, list[float]]:
    """How many operations the loop over any tree has for the forward dynamics of one state, and its result."""
    counts = {"operations": 0, "left_out": True}

    def counted(value):
        """The same with all of its doubles counted."""
        if isinstance(value, (tuple, list, np.ndarray)):
            return [counted(part) for part in value]
        return Counted(value, counts) if isinstance(value, float) else value

    known = {zero.__name__: lambda w: Counted(0.0, counts), put_sines.__name__: put_sines}
    for module in (inlined, loop_joints, loops):
        for name, value in vars(module).items():
            function = getattr(value, "py_func", value)
            if isinstance(function, FunctionType) and function.__module__.startswith("tmt.loop"):
                known[name] = FunctionType(function.__code__, known, name, function.__defaults__)
            known.setdefault(name, value)
    numbers = loop_trees.arrays(tree)
    joints = [Row(zip(loop_trees.JOINT.names, counted(row))) for row in loop_trees.rows(tree)]
    gains = {name: np.array(counted(getattr(numbers, name)), object) for name in ("position_gain", "speed_gain")}
    numbers = numbers._replace(joints=joints, gravity=counted(numbers.gravity), **gains)
    w, qdd = [None] * known["workspace"](numbers), [None] * len(tree.axis)
    known["forward_dynamics"](numbers, *(counted(list(map(float, values))) for values in (q, qd, tau)), w, qdd)
    return counts["operations"], qdd


class Row(dict):
    """One joint, its numbers by their names."""

    __getattr__ = dict.__getitem__


def put_sines(q, at, reference, w, k):
    """As loops put them."""
    w[k], w[k + 1] = sincos(q[at] - reference)


OF_SINE = sum(x.counts["operations"] for x in sincos(Counted(1.0, {"operations": 0}))[:1])  # with its cosine


@lru_cache(maxsize=8)
def operations_of(tree: tmt.Tree) -> dict[str, int]:
    """Of the forward dynamics of one state in the loop, "loop", and where straight-line code is made in that, "straight_line"."""
    n = len(tree.axis)
    state = [*tree.zero], [0.1] * n, [0.1] * n
    found = {"loop": of_loop(tree, *state)[0]}
    if kernels.is_evaluated_straight(tree):
        found["straight_line"] = of_source(
            straight_line(tree).text, "slope", [x for part in state for x in part] + [0.0]
        )[0]
    return found
