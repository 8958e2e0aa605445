"""One edit of a source file, found by module, function and expression; how the source is laid out does not matter."""

import ast
import copy
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

PACKAGES = ("compare", "tmt")
DEFINITIONS = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
Holes = dict[str, ast.AST | list[ast.AST]]  # what they stand for


@dataclass(frozen=True)
class Edit:
    """A wrong program: in `where` of `module` stands `new` instead of `old`.

    module: a file by the end of its dotted name, "verdict" or "trajectory.rows", or the name of a folder of files;
    where: a function, Class.method, function.inner function, or a name that is assigned in the module or a class.
    old: an expression, a keyword argument (name=value) or a statement; new: what replaces it.
    In both _1, _2 stand for any expression (on a line of its own: statement), *_1 at the end of a call for all other arguments;
    in new _0 is all that stood there.
    nth: which one, from 1, if there are several. breaks: what the edited program does.
    """

    module: str
    where: str
    old: str
    new: str
    breaks: str
    nth: int | None = None

    @property
    def name(self) -> str:
        return f"{self.module}.{self.where}: {self.breaks}"


class DoesNotApply(ValueError):
    """An edit whose place is missing or ambiguous."""


class Place(NamedTuple):
    """Where an edit applies: a node of a file, and what stands in its place."""

    path: Path
    old: ast.AST
    new: ast.AST

    @property
    def before(self) -> str:
        return self.path.read_text(encoding="utf-8")

    @property
    def after(self) -> str:
        """The text with the edit; the definition around it is in the layout of `ast`."""
        statement = next(part for part in parsed(self.path).body if self.old in ast.walk(part))
        start = min(part.lineno for part in (statement, *getattr(statement, "decorator_list", ())))
        lines = self.before.splitlines(keepends=True)
        edited = copy.deepcopy(statement, {id(self.old): self.new})  # the new node passes for a copy
        return "".join([*lines[: start - 1], ast.unparse(edited), "\n", *lines[statement.end_lineno :]])


def applied(project: Path, edit: Edit) -> Place:
    """Where the edit applies in the sources of a project."""
    paths, module = sources(project), f".{edit.module}."
    named = [path for path, name in paths.items() if module in name and scopes(path, edit.where)]
    holding = named or [path for path in paths if scopes(path, edit.where)]  # moved to another file
    if not holding:
        raise DoesNotApply(f"{edit.name}: there is no {edit.where} below {' or '.join(PACKAGES)}")
    old = read(edit.old)
    places = [(path, scope) for path in holding for scope in scopes(path, edit.where)]
    hits = [(path, *hit) for path, scope in places for hit in matches(scope, old)]
    if not 1 <= (edit.nth or 1) <= len(hits) or (edit.nth is None and len(hits) > 1):
        what = f"{len(hits)} times {edit.old} in {edit.where}"
        raise DoesNotApply(f"{edit.name}: {what}; one is expected, or nth")
    path, node, holes = hits[(edit.nth or 1) - 1]
    new = filled(read(edit.new), holes | {"_0": node})
    if isinstance(node, ast.keyword):
        new = as_keyword(new)
    elif isinstance(node, ast.stmt) and isinstance(new, ast.expr):
        new = ast.Expr(new)
    return Place(path, node, new)


@cache
def sources(project: Path) -> dict[Path, str]:
    """The files, each with its dotted name between dots."""
    paths = [path for package in PACKAGES for path in sorted((project / package).rglob("*.py"))]
    return {path: f".{'.'.join(path.relative_to(project).with_suffix('').parts)}." for path in paths}


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def scopes(path: Path, where: str) -> list[ast.AST]:
    """The nodes of this qualified name: definitions, or statements that assign it."""
    nodes: list[ast.AST] = [parsed(path)]
    for name in where.split("."):
        nodes = [inner for node in nodes for inner in named_inside(node, name)]
    return nodes


def named_inside(node: ast.AST, name: str) -> Iterator[ast.AST]:
    """Definitions and assignments of a name in a node, not in the definitions inside it."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, DEFINITIONS):
            if child.name == name:
                yield child
        elif isinstance(child, ast.Assign | ast.AnnAssign):
            targets = child.targets if isinstance(child, ast.Assign) else [child.target]
            assigned = [getattr(part, "id", None) for target in targets for part in ast.walk(target)]
            if name in assigned:
                yield child
        else:
            yield from named_inside(child, name)


def read(text: str) -> ast.AST:
    """The statement or the expression that the text is."""
    (statement,) = ast.parse(text).body
    return statement.value if isinstance(statement, ast.Expr) else statement


def as_keyword(node: ast.AST) -> ast.AST:
    """The argument name=value of an assignment; anything else as it is."""
    if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
        return ast.keyword(arg=node.targets[0].id, value=node.value)
    return node


def matches(node: ast.AST, pattern: ast.AST) -> Iterator[tuple[ast.AST, Holes]]:
    """Every node in a function or statement that matches a pattern, in the order of the source, with what the holes stand for."""
    holes: Holes = {}
    if fits(as_keyword(pattern) if isinstance(node, ast.keyword) else pattern, node, holes):
        yield node, holes
    for child in ast.iter_child_nodes(node):
        yield from matches(child, pattern)


def fits(pattern: object, node: object, holes: Holes) -> bool:
    """Whether a node is what the pattern says; fills the holes."""
    if (hole := hole_of(pattern)) and isinstance(node, ast.AST):
        return ast.dump(holes.setdefault(hole, node)) == ast.dump(node)
    if isinstance(pattern, ast.Call) and isinstance(node, ast.Call) and (rest := rest_of(pattern)):
        first = pattern.args[:-1]
        holes[rest] = [*node.args[len(first) :], *node.keywords]
        return fits(pattern.func, node.func, holes) and fits(first, node.args[: len(first)], holes)
    if isinstance(pattern, list) and isinstance(node, list):
        return len(pattern) == len(node) and all(fits(*pair, holes) for pair in zip(pattern, node))
    if type(pattern) is not type(node):
        return False
    if isinstance(pattern, ast.AST):
        fields = [name for name in pattern._fields if name != "ctx"]
        return all(fits(getattr(pattern, name), getattr(node, name), holes) for name in fields)
    return pattern == node


def hole_of(pattern: object) -> str | None:
    """The name of the hole that an expression or a statement is."""
    name = pattern.value if isinstance(pattern, ast.Expr) else pattern
    return name.id if isinstance(name, ast.Name) and re.fullmatch(r"_\d+", name.id) else None


def rest_of(call: ast.Call) -> str | None:
    """The hole for all other arguments of a call."""
    return hole_of(call.args[-1].value) if call.args and isinstance(call.args[-1], ast.Starred) else None


def filled(new: ast.AST, holes: Holes) -> ast.AST:
    """The new expression or statement with what the holes stand for."""
    copies = {}  # of nodes, by their id: what deepcopy takes for their copies
    for node in ast.walk(new):
        hole = hole_of(node)
        if hole in holes and isinstance(node, ast.stmt) == isinstance(holes[hole], ast.stmt):
            copies[id(node)] = holes[hole]
        if isinstance(node, ast.Call) and (rest := rest_of(node)):
            keywords = [argument for argument in holes[rest] if isinstance(argument, ast.keyword)]
            node.args[-1:] = [argument for argument in holes[rest] if argument not in keywords]
            node.keywords += keywords
    return copy.deepcopy(new, copies)
