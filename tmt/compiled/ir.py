"""Functions in LLVM's language: their text is written by operators on values and by loops and branches that are contexts.

A value has a kind, as LLVM writes it: "double", "i64", "i1", "ptr", or "<8 x double>" and so on for several side by side. Plain
numbers become constants of the other operand's kind. Nothing is regrouped and no product is fused into a sum unless `fma` says
so: every processor does the same arithmetic, and several side by side do what one does.
"""

import struct
from collections.abc import Iterator
from contextlib import contextmanager

FEW = 24  # repetitions that are written out
DOUBLE, INDEX, FLAG, POINTER = "double", "i64", "i1", "ptr"


def wide(kind: str, width: int) -> str:
    """The kind of `width` values of a kind side by side; of one the kind itself."""
    return kind if width == 1 else f"<{width} x {kind}>"


def element(kind: str) -> str:
    """The kind of one of the values of a kind."""
    return kind.rpartition("x ")[2].rstrip(">")


def width_of(kind: str) -> int:
    return int(kind[1:].partition(" ")[0]) if kind.startswith("<") else 1


def constant(kind: str, number) -> str:
    """The text of a constant."""
    one = element(kind)
    if one == DOUBLE:
        number = f"0x{struct.unpack('>Q', struct.pack('>d', number))[0]:016X}"
    elif one == FLAG:
        number = str(bool(number)).lower()
    width = width_of(kind)
    return str(number) if width == 1 else "<" + ", ".join([f"{one} {number}"] * width) + ">"


class Value:
    """A value of one kind in the code of one function."""

    __array_ufunc__ = None
    __slots__ = ("code", "kind", "name")

    def __init__(self, code: "Code", kind: str, name: str):
        self.code, self.kind, self.name = code, kind, name

    def like(self, x) -> "Value":
        """Another value, or a number as a constant of this kind."""
        return x if isinstance(x, Value) else Value(self.code, self.kind, constant(self.kind, x))

    def two(self, operation: str, a, b) -> "Value":
        a, b = self.like(a), self.like(b)
        if element(self.kind) == DOUBLE:
            operation = {"sdiv": "fdiv"}.get(operation, f"f{operation}")
        return self.code.put(self.kind, f"{operation} {self.kind} {a.name}, {b.name}")

    def __add__(self, other):
        return self.two("add", self, other)

    def __radd__(self, other):
        return self.two("add", other, self)

    def __sub__(self, other):
        return self.two("sub", self, other)

    def __rsub__(self, other):
        return self.two("sub", other, self)

    def __mul__(self, other):
        return self.two("mul", self, other)

    def __rmul__(self, other):
        return self.two("mul", other, self)

    def __truediv__(self, other):
        return self.two("sdiv", self, other)

    def __rtruediv__(self, other):
        return self.two("sdiv", other, self)

    def __mod__(self, other):
        return self.two("srem", self, other)

    def __neg__(self):
        return self.code.put(self.kind, f"fneg {self.kind} {self.name}")

    def fma(self, b, c) -> "Value":
        """self b + c, rounded once."""
        return self.code.intrinsic("fma", self, self.like(b), self.like(c))

    def function(self, name: str) -> "Value":
        """One of LLVM's functions of one number: fabs, sqrt, ceil, rint."""
        return self.code.intrinsic(name, self)

    def bits(self, operation: str, other) -> "Value":
        """and, or, xor, shl of whole numbers or flags."""
        return self.code.put(self.kind, f"{operation} {self.kind} {self.name}, {self.like(other).name}")

    def compare(self, how: str, other) -> "Value":
        """A flag: lt, le, gt, ge, eq, ne; false where a double is not a number, except ne."""
        if element(self.kind) == DOUBLE:
            how = f"fcmp {'une' if how == 'ne' else 'o' + how}"
        else:
            how = f"icmp {how if how in ('eq', 'ne') else 's' + how}"
        return self.code.put(
            wide(FLAG, width_of(self.kind)), f"{how} {self.kind} {self.name}, {self.like(other).name}"
        )

    def choose(self, yes, no) -> "Value":
        """Of a flag: yes where it is true, else no, at least one of which is a value."""
        kind = (yes if isinstance(yes, Value) else no).kind
        yes, no = (
            x if isinstance(x, Value) else Value(self.code, kind, constant(kind, x)) for x in (yes, no)
        )
        return self.code.put(kind, f"select {self.kind} {self.name}, {kind} {yes.name}, {kind} {no.name}")

    def cast(self, how: str, kind: str) -> "Value":
        """bitcast, sitofp, fptosi, zext ..."""
        return self.code.put(kind, f"{how} {self.kind} {self.name} to {kind}")

    def lane(self, l: int) -> "Value":
        """One of several side by side; of a single one itself."""
        if width_of(self.kind) == 1:
            return self
        return self.code.put(element(self.kind), f"extractelement {self.kind} {self.name}, i32 {l}")

    def with_lane(self, l: int, x: "Value") -> "Value":
        return self.code.put(self.kind, f"insertelement {self.kind} {self.name}, {x.kind} {x.name}, i32 {l}")

    def everywhere(self, width: int) -> "Value":
        """The value in each of `width` lanes."""
        if width == 1:
            return self
        kind = wide(self.kind, width)
        one = Value(self.code, kind, "undef").with_lane(0, self)
        return self.code.put(
            kind, f"shufflevector {kind} {one.name}, {kind} undef, <{width} x i32> zeroinitializer"
        )

    def backward(self) -> "Value":
        """The last lane first."""
        order = ", ".join(f"i32 {l}" for l in reversed(range(width_of(self.kind))))
        lanes = f"<{width_of(self.kind)} x i32> <{order}>"
        return self.code.put(self.kind, f"shufflevector {self.kind} {self.name}, {self.kind} undef, {lanes}")

    def at(self, index, kind: str = DOUBLE) -> "Value":
        """Of a pointer: the place of a number of an array."""
        index = index if isinstance(index, Value) else Value(self.code, INDEX, str(index))
        return self.code.put(POINTER, f"getelementptr {kind}, ptr {self.name}, i64 {index.name}")

    def load(self, index=0, kind: str = DOUBLE) -> "Value":
        """A value that begins at number `index` of an array of doubles (or of whole numbers)."""
        place = self.at(index, element(kind))
        return self.code.put(kind, f"load {kind}, ptr {place.name}, align 8")

    def store(self, value, index=0) -> None:
        value = value if isinstance(value, Value) else Value(self.code, DOUBLE, constant(DOUBLE, value))
        place = self.at(index, element(value.kind))
        self.code.lines.append(f"  store {value.kind} {value.name}, ptr {place.name}, align 8")


class Variable:
    """A value that changes, of one function; `first` from where it is made on."""

    def __init__(self, code: "Code", kind: str, first):
        self.kind, self.place = kind, code.reserve(kind)
        self.set(first)

    def get(self) -> Value:
        return self.place.code.put(self.kind, f"load {self.kind}, ptr {self.place.name}, align 8")

    def set(self, value) -> None:
        code = self.place.code
        value = value if isinstance(value, Value) else Value(code, self.kind, constant(self.kind, value))
        code.lines.append(f"  store {value.kind} {value.name}, ptr {self.place.name}, align 8")


class Code:
    """The lines of one function.

    arguments: {name: kind}; `self[name]` is the value. attributes: LLVM's, such as "alwaysinline".
    """

    def __init__(
        self, name: str, arguments: dict, result: str = "void", attributes: str = "", own: bool = False
    ):
        self.name, self.arguments, self.result, self.attributes, self.own = (
            name,
            arguments,
            result,
            attributes,
            own,
        )
        self.lines, self.first, self.count, self.intrinsics, self.block = [], [], 0, set(), "entry"

    def __getitem__(self, name: str) -> Value:
        return Value(self, self.arguments[name], f"%{name}")

    def put(self, kind: str, right: str) -> Value:
        self.count += 1
        self.lines.append(f"  %v{self.count} = {right}")
        return Value(self, kind, f"%v{self.count}")

    def number(self, x, kind: str = DOUBLE) -> Value:
        return Value(self, kind, constant(kind, x))

    def intrinsic(self, name: str, *values: Value) -> Value:
        kind = values[0].kind
        suffix = f"{f'v{width_of(kind)}' * (width_of(kind) > 1)}f64"
        self.intrinsics.add(f"declare {kind} @llvm.{name}.{suffix}({', '.join([kind] * len(values))})")
        return self.put(
            kind, f"call {kind} @llvm.{name}.{suffix}({', '.join(f'{kind} {v.name}' for v in values)})"
        )

    def library(self, name: str, *values: Value) -> Value:
        """A function of C's library, of each lane."""
        self.intrinsics.add(
            f"declare double @{name}({', '.join(['double'] * len(values))}) nounwind memory(none)"
        )
        if width_of(values[0].kind) == 1:
            return self.call(name, *values, kind=DOUBLE)
        result = values[0]
        for l in range(width_of(result.kind)):
            result = result.with_lane(l, self.call(name, *(v.lane(l) for v in values), kind=DOUBLE))
        return result

    def call(self, name: str, *values: Value, kind: str = "void") -> Value | None:
        text = f"call {kind} @{name}({', '.join(f'{v.kind} {v.name}' for v in values)})"
        if kind != "void":
            return self.put(kind, text)
        self.lines.append(f"  {text}")
        return None

    def reserve(self, kind: str, count: int = 1) -> Value:
        """A place of the function's own for `count` values."""
        self.count += 1
        name = f"%v{self.count}"
        self.first.append(f"  {name} = alloca {kind}, i64 {count}, align 64")
        return Value(self, POINTER, name)

    def label(self) -> str:
        self.count += 1
        return f"b{self.count}"

    def begin(self, label: str) -> None:
        """A block begins; the one before it goes on to it, unless it went elsewhere."""
        self.lines += [f"  br label %{label}", f"{label}:"]

    @contextmanager
    def loop(self, count, step: int = 1) -> Iterator["Loop"]:
        """The lines are run for index = 0, step, 2 step ... below count."""
        count = count if isinstance(count, Value) else self.number(count, INDEX)
        index, (head, body, done) = Variable(self, INDEX, 0), (self.label() for _ in range(3))
        self.begin(head)
        i = index.get()
        self.branch(i.compare("lt", count), body, done)
        yield Loop(self, i, done)
        index.set(i + step)
        self.lines += [f"  br label %{head}", f"{done}:"]

    def each(self, count: int) -> Iterator:
        """0, 1 ... below a number that is known: line after line where they are few, else in a loop."""
        if count <= FEW:
            yield from range(count)
            return
        with self.loop(count) as loop:
            yield loop.index

    def branch(self, flag: Value, yes: str, no: str) -> None:
        """Go on in one of two blocks, of which the first begins here."""
        self.lines += [f"  br i1 {flag.name}, label %{yes}, label %{no}", f"{yes}:"]

    @contextmanager
    def when(self, flag: Value) -> Iterator[None]:
        """The lines are run where the flag is true."""
        yes, done = self.label(), self.label()
        self.branch(flag, yes, done)
        yield
        self.begin(done)

    def give_back(self, value=None) -> None:
        """Return, at the end of the function."""
        self.lines.append("  ret void" if value is None else f"  ret {self.result} {value.name}")

    @property
    def text(self) -> str:
        given = ", ".join(
            f"{kind} {'noalias ' * (kind == POINTER)}%{name}" for name, kind in self.arguments.items()
        )
        lines = "\n".join(["entry:", *self.first, *self.lines])
        linkage = "internal " if self.own else ""
        return (
            f"define {linkage}{self.result} @{self.name}({given}) nounwind {self.attributes} "
            f'"prefer-vector-width"="512" {{\n{lines}\n}}\n'
        )


class Loop:
    """A loop that is being written: its index, and the ways out of it."""

    def __init__(self, code: Code, index: Value, done: str):
        self.code, self.index, self.done = code, index, done

    def leave(self, flag: Value) -> None:
        """End the loop where the flag is true."""
        on = self.code.label()
        self.code.lines += [f"  br i1 {flag.name}, label %{self.done}, label %{on}", f"{on}:"]


def module(functions: list[Code]) -> str:
    """The text of a module."""
    declared = sorted(set().union(*(f.intrinsics for f in functions)))
    return "\n".join([*declared, *(f.text for f in functions)])
