"""One edit of a source file, found by module, function and expression; how the source is laid out does not matter."""

import ast
import copy
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

PACKAGES = ("compare", "tmt")
DEFINITIONS = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
NOT_COMPARED = ("ctx", "kind", "type_comment")


@dataclass(frozen=True)
class Edit:
    """A wrong program: in `where` of `module` stands `new` instead of `old`.

    module: a file by the end of its dotted name, "verdict" or "trajectory.rows", or the name of a folder of files;
    where: a function, Class.method, function.inner function, or a name that is assigned in the module or a class.
    old: an expression, a keyword argument (name=value) or a statement; new: what replaces it (statements: any number).
    In both _1, _2 stand for any expression (on a line of its own: statement), *_1 at the end of a call for all other arguments.
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
    """Where an edit applies: the file, and its text without and with the edit."""

    path: Path
    before: str
    after: str


def applied(project: Path, edit: Edit) -> Place:
    """The file that the edit changes, with its text before and after."""
    paths, module = sources(project), f".{edit.module}."
    named = [path for path, name in paths.items() if module in name and scopes(path, edit.where)]
    holding = named or [path for path in paths if scopes(path, edit.where)]  # moved to another file
    if not holding:
        raise DoesNotApply(f"{edit.name}: there is no {edit.where} below {' or '.join(PACKAGES)}")
    old = read(edit.old)
    hits = [
        (path, *hit) for path in holding for scope in scopes(path, edit.where) for hit in matches(scope, old)
    ]
    if not 1 <= (edit.nth or 1) <= len(hits) or (edit.nth is None and len(hits) > 1):
        raise DoesNotApply(
            f"{edit.name}: {len(hits)} times {edit.old} in {edit.where}; one is expected, or nth"
        )
    path, node, holes = hits[(edit.nth or 1) - 1]
    before = text_of(path)
    lines = before.encode().splitlines(keepends=True)
    places = (node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset)
    start, end = (sum(map(len, lines[: line - 1])) + column for line, column in places)
    new = ast.unparse(Filled(holes).visit(ast.parse(textwrap.dedent(edit.new).strip())))
    if isinstance(node, ast.stmt):
        new = textwrap.indent(new, " " * node.col_offset).lstrip()
    elif isinstance(node, ast.expr) and not isinstance(node, ast.Starred):
        new = f"({new})"
    after = (before.encode()[:start] + new.encode() + before.encode()[end:]).decode()
    try:
        ast.parse(after)
    except SyntaxError:
        raise DoesNotApply(f"{edit.name}: {edit.old} cannot be replaced") from None
    return Place(path, before, after)


@cache
def sources(project: Path) -> dict[Path, str]:
    """The files, each with its dotted name between dots."""
    paths = [path for package in PACKAGES for path in sorted((project / package).rglob("*.py"))]
    return {path: f".{'.'.join(path.relative_to(project).with_suffix('').parts)}." for path in paths}


parsed = cache(ast.parse)


@cache
def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def scopes(path: Path, where: str) -> list[ast.AST]:
    """The nodes of this qualified name: definitions, or statements that assign it."""
    text = text_of(path)
    nodes = [parsed(text)] if where.split(".")[0] in text else []
    for name in where.split("."):
        nodes = [inner for node in nodes for inner in named_inside(node, name)]
    return nodes


def named_inside(node: ast.AST, name: str) -> Iterator[ast.AST]:
    """Definitions and assignments of a name in a node, not in the definitions inside it."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, DEFINITIONS):
            if child.name == name:
                yield child
        elif isinstance(child, ast.Assign | ast.AnnAssign) and assigns(child, name):
            yield child
        else:
            yield from named_inside(child, name)


def assigns(statement: ast.Assign | ast.AnnAssign, name: str) -> bool:
    targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
    return any(getattr(node, "id", None) == name for target in targets for node in ast.walk(target))


def read(text: str) -> ast.AST:
    """The statement or the expression that the text is."""
    (statement,) = ast.parse(textwrap.dedent(text).strip()).body
    return statement.value if isinstance(statement, ast.Expr) else statement


def matches(node: ast.AST, pattern: ast.AST) -> Iterator[tuple[ast.AST, dict]]:
    """Every node in a function or statement that matches a pattern, in the order of the source, with what the holes stand for."""
    holes, wanted = {}, pattern
    if (
        isinstance(node, ast.keyword)
        and isinstance(pattern, ast.Assign)
        and isinstance(pattern.targets[0], ast.Name)
    ):
        wanted = ast.keyword(arg=pattern.targets[0].id, value=pattern.value)
    if fits(wanted, node, holes):
        yield node, holes
    for child in ast.iter_child_nodes(node):
        yield from matches(child, pattern)


def fits(pattern: object, node: object, holes: dict) -> bool:
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
        fields = [name for name in pattern._fields if name not in NOT_COMPARED]
        return all(fits(getattr(pattern, name), getattr(node, name), holes) for name in fields)
    return pattern == node


def hole_of(pattern: object) -> str | None:
    """The name of the hole that an expression or a statement is."""
    name = pattern.value if isinstance(pattern, ast.Expr) else pattern
    return name.id if isinstance(name, ast.Name) and re.fullmatch(r"_\d+", name.id) else None


def rest_of(call: ast.Call) -> str | None:
    """The hole for all other arguments of a call."""
    return hole_of(call.args[-1].value) if call.args and isinstance(call.args[-1], ast.Starred) else None


class Filled(ast.NodeTransformer):
    """The new expression with what the holes stand for."""

    def __init__(self, holes: dict):
        self.holes = holes

    def visit_Name(self, node):
        return copy.deepcopy(self.holes.get(node.id, node))

    def visit_Expr(self, node):
        value = self.visit(node.value)
        return value if isinstance(value, ast.stmt) else ast.Expr(value)

    def visit_Call(self, node):
        if rest := rest_of(node):
            others = copy.deepcopy(self.holes[rest])
            node.args[-1:] = [one for one in others if not isinstance(one, ast.keyword)]
            node.keywords += [one for one in others if isinstance(one, ast.keyword)]
        return self.generic_visit(node)
