"""Functions in LLVM's language, written by operators on values and by contexts for loops and branches.

A value has a kind, as LLVM writes it: "double", "i64", "i1", "ptr", or "<8 x double>" and so on for several
side by side. Plain numbers become constants of the other operand's kind. Nothing is regrouped and no product
is fused into a sum unless `fma` says so: every processor does the same arithmetic, and several side by side
do what one does. (llvmlite's IRBuilder writes the same text in three times the time: a third more until a
quantity of 30 speeds is compiled.)
"""

import struct
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

FEW = 24  # repetitions that are written out
DOUBLE, INDEX, FLAG, POINTER = "double", "i64", "i1", "ptr"
Number = float | int


def wide(kind: str, width: int) -> str:
    """The kind of `width` values of a kind side by side; of one the kind itself."""
    return kind if width == 1 else f"<{width} x {kind}>"


def element(kind: str) -> str:
    return kind.rpartition("x ")[2].rstrip(">")


def width_of(kind: str) -> int:
    return int(kind[1:].partition(" ")[0]) if kind.startswith("<") else 1


def constant(kind: str, number: Number) -> str:
    width, text = width_of(kind), str(number)
    if element(kind) == DOUBLE:
        text = f"0x{struct.unpack('>Q', struct.pack('>d', number))[0]:016X}"
    elif element(kind) == FLAG:
        text = str(bool(number)).lower()
    return text if width == 1 else "<" + ", ".join([f"{element(kind)} {text}"] * width) + ">"


def operator_of(operation: str, is_reflected: bool = False) -> "Callable[[Value, Value | Number], Value]":
    if is_reflected:
        return lambda self, other: self.two(operation, other, self)
    return lambda self, other: self.two(operation, self, other)


class Value:
    __array_ufunc__ = None
    __slots__ = ("code", "kind", "name")

    def __init__(self, code: "Code", kind: str, name: str):
        self.code, self.kind, self.name = code, kind, name

    def like(self, x: "Value | Number", kind: str = "") -> "Value":
        return x if isinstance(x, Value) else self.code.number(x, kind or self.kind)

    def two(self, operation: str, a: "Value | Number", b: "Value | Number") -> "Value":
        if element(self.kind) == DOUBLE:
            operation = "fdiv" if operation == "sdiv" else f"f{operation}"
        return self.code.put(self.kind, f"{operation} {self.kind} {self.like(a).name}, {self.like(b).name}")

    __add__, __radd__ = operator_of("add"), operator_of("add", is_reflected=True)
    __sub__, __rsub__ = operator_of("sub"), operator_of("sub", is_reflected=True)
    __mul__, __rmul__ = operator_of("mul"), operator_of("mul", is_reflected=True)
    __truediv__ = operator_of("sdiv")

    def __neg__(self) -> "Value":
        return self.code.put(self.kind, f"fneg {self.kind} {self.name}")

    def fma(self, b: "Value | Number", c: "Value | Number") -> "Value":
        return self.code.intrinsic("fma", self, self.like(b), self.like(c))

    def function(self, name: str) -> "Value":
        """One of LLVM's functions of one number: fabs, sqrt, ceil, rint."""
        return self.code.intrinsic(name, self)

    def bits(self, operation: str, other: "Value | Number") -> "Value":
        return self.code.put(self.kind, f"{operation} {self.kind} {self.name}, {self.like(other).name}")

    def negated(self) -> "Value":
        return self.bits("xor", True)

    def compare(self, how: str, other: "Value | Number") -> "Value":
        """A flag: lt, le, gt, ge, eq, ne; false where a double is not a number, except ne."""
        if element(self.kind) == DOUBLE:
            how = "fcmp une" if how == "ne" else f"fcmp o{how}"
        else:
            how = f"icmp {how}" if how in ("eq", "ne") else f"icmp s{how}"
        flags = wide(FLAG, width_of(self.kind))
        return self.code.put(flags, f"{how} {self.kind} {self.name}, {self.like(other).name}")

    def choose(self, yes: "Value | Number", no: "Value | Number") -> "Value":
        """Of a flag: yes where it is true, else no, at least one of which is a value."""
        kind = next(x.kind for x in (yes, no) if isinstance(x, Value))
        yes, no = self.like(yes, kind), self.like(no, kind)
        return self.code.put(kind, f"select {self.kind} {self.name}, {kind} {yes.name}, {kind} {no.name}")

    def cast(self, how: str, kind: str) -> "Value":
        return self.code.put(kind, f"{how} {self.kind} {self.name} to {kind}")

    def lane(self, l: int) -> "Value":
        if width_of(self.kind) == 1:
            return self
        return self.code.put(element(self.kind), f"extractelement {self.kind} {self.name}, i32 {l}")

    def with_lane(self, l: int, x: "Value") -> "Value":
        return self.code.put(self.kind, f"insertelement {self.kind} {self.name}, {x.kind} {x.name}, i32 {l}")

    def shuffled(self, lanes: list[int]) -> "Value":
        kind, order = wide(element(self.kind), len(lanes)), ", ".join(f"i32 {l}" for l in lanes)
        mask = f"<{len(lanes)} x i32> <{order}>"
        return self.code.put(kind, f"shufflevector {self.kind} {self.name}, {self.kind} undef, {mask}")

    def everywhere(self, width: int) -> "Value":
        if width == 1:
            return self
        return Value(self.code, wide(self.kind, width), "undef").with_lane(0, self).shuffled([0] * width)

    def at(self, index: "Value | int", kind: str = DOUBLE) -> "Value":
        place = self.like(index, INDEX)
        return self.code.put(POINTER, f"getelementptr {kind}, ptr {self.name}, i64 {place.name}")

    def load(self, index: "Value | int" = 0, kind: str = DOUBLE) -> "Value":
        """A value that begins at number `index` of an array of doubles (or of whole numbers)."""
        place = self.at(index, element(kind))
        return self.code.put(kind, f"load {kind}, ptr {place.name}, align 8")

    def store(self, value: "Value | Number", index: "Value | int" = 0) -> None:
        """Put a value to number `index` of an array of its kind; a plain number is a double."""
        value = self.like(value, DOUBLE)
        place = self.at(index, element(value.kind))
        self.code.lines.append(f"  store {value.kind} {value.name}, ptr {place.name}, align 8")


class Variable:
    def __init__(self, code: "Code", kind: str, first: Value | Number):
        self.kind, self.place = kind, code.reserve(kind)
        self.set(first)

    def get(self) -> Value:
        return self.place.code.put(self.kind, f"load {self.kind}, ptr {self.place.name}, align 8")

    def set(self, value: Value | Number) -> None:
        value = self.place.like(value, self.kind)
        self.place.code.lines.append(f"  store {value.kind} {value.name}, ptr {self.place.name}, align 8")


class Code:
    """The lines of one function; `self[name]` is an argument; attributes: LLVM's, of one for others here."""

    def __init__(self, name: str, arguments: Mapping[str, str], result: str = "void", attributes: str = ""):
        self.name, self.arguments, self.result, self.attributes = name, arguments, result, attributes
        self.lines: list[str] = []
        self.reserved: list[str] = []
        self.intrinsics: set[str] = set()
        self.count = 0

    def __getitem__(self, name: str) -> Value:
        return Value(self, self.arguments[name], f"%{name}")

    def put(self, kind: str, right: str) -> Value:
        self.count += 1
        self.lines.append(f"  %v{self.count} = {right}")
        return Value(self, kind, f"%v{self.count}")

    def number(self, x: Number, kind: str = DOUBLE) -> Value:
        return Value(self, kind, constant(kind, x))

    def intrinsic(self, name: str, *values: Value) -> Value:
        kind, width = values[0].kind, width_of(values[0].kind)
        name = f"llvm.{name}.f64" if width == 1 else f"llvm.{name}.v{width}f64"
        self.intrinsics.add(f"declare {kind} @{name}({', '.join([kind] * len(values))})")
        return self.call(name, *values, kind=kind)

    def call(self, name: str, *values: Value, kind: str = "void") -> Value:
        text = f"call {kind} @{name}({', '.join(f'{v.kind} {v.name}' for v in values)})"
        if kind != "void":
            return self.put(kind, text)
        self.lines.append(f"  {text}")
        return Value(self, kind, "")

    def reserve(self, kind: str, count: int = 1) -> Value:
        self.count += 1
        name = f"%v{self.count}"
        self.reserved.append(f"  {name} = alloca {kind}, i64 {count}, align 64")
        return Value(self, POINTER, name)

    def label(self) -> str:
        self.count += 1
        return f"b{self.count}"

    def begin(self, label: str) -> None:
        self.lines += [f"  br label %{label}", f"{label}:"]

    @contextmanager
    def loop(self, count: Value | int, step: int = 1) -> Iterator["Loop"]:
        """The lines are run for index = 0, step, 2 step ... below count."""
        index, head, body, done = Variable(self, INDEX, 0), *(self.label() for _ in range(3))
        self.begin(head)
        i = index.get()
        self.branch(i.compare("lt", count), body, done)
        yield Loop(self, i, done)
        index.set(i + step)
        self.lines += [f"  br label %{head}", f"{done}:"]

    def each(self, count: int) -> Iterator[Value | int]:
        """0, 1 ... below a number that is known: line after line where they are few, else in a loop."""
        if count <= FEW:
            yield from range(count)
            return
        with self.loop(count) as loop:
            yield loop.index

    def branch(self, flag: Value, yes: str, no: str) -> None:
        self.lines += [f"  br i1 {flag.name}, label %{yes}, label %{no}", f"{yes}:"]

    @contextmanager
    def when(self, flag: Value) -> Iterator[None]:
        yes, done = self.label(), self.label()
        self.branch(flag, yes, done)
        yield
        self.begin(done)

    def ret(self, value: Value | None = None) -> None:
        self.lines.append(f"  ret {value.kind} {value.name}" if value else "  ret void")

    @property
    def text(self) -> str:
        pointer = f"{POINTER} noalias"
        kinds = {name: pointer if kind == POINTER else kind for name, kind in self.arguments.items()}
        arguments = ", ".join(f"{kind} %{name}" for name, kind in kinds.items())
        linkage = "internal " if self.attributes else ""
        head = f"define {linkage}{self.result} @{self.name}({arguments}) nounwind {self.attributes}"
        lines = "\n".join(["entry:", *self.reserved, *self.lines])
        return f'{head} "prefer-vector-width"="512" {{\n{lines}\n}}\n'


class Loop:
    def __init__(self, code: Code, index: Value, done: str):
        self.code, self.index, self.done = code, index, done

    def leave(self, flag: Value) -> None:
        on = self.code.label()
        self.code.lines += [f"  br i1 {flag.name}, label %{self.done}, label %{on}", f"{on}:"]


def module(functions: list[Code]) -> str:
    declared = sorted(set().union(*(f.intrinsics for f in functions)))
    return "\n".join([*declared, *(f.text for f in functions)])
