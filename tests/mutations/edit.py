"""One edit of a source file, found by module, function and expression; formatting does not matter."""

import ast
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

from .pattern import Filled, found, read

PACKAGES = ("compare", "tmt")
DEFINITIONS = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


@dataclass(frozen=True)
class Edit:
    """A wrong judge: in `where` of `module` stands `new` instead of `old`.

    module: a file by the end of its dotted name, "verdict" or "trajectory.rows", or the name of a folder of files;
    where: a function, Class.method, function.inner function, or a name that is assigned in the module or a class.
    old: an expression, a keyword argument (name=value) or a statement; new: what replaces it (statements: any number).
    In both _1, _2 stand for any expression (on a line of its own: statement), *_1 at the end of a call for all other arguments.
    nth: which one, from 1, if there are several. breaks: what the edited judge does. harmless: why it may survive.
    """

    module: str
    where: str
    old: str
    new: str
    breaks: str
    nth: int | None = None
    harmless: str = ""

    @property
    def name(self) -> str:
        return f"{self.module}.{self.where}: {self.breaks}"


class DoesNotApply(ValueError):
    """An edit whose place is missing or ambiguous."""


class Place(NamedTuple):
    """Where an edit applies: the file, and its text without and with the edit, both without comments."""

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
    if len(old) != 1:
        raise DoesNotApply(f"{edit.name}: old is one expression or statement")
    hits = [(path, node) for path in holding for scope in scopes(path, edit.where) for node in matches(scope, old[0])]
    if not 1 <= (edit.nth or 1) <= len(hits) or (edit.nth is None and len(hits) > 1):
        raise DoesNotApply(f"{edit.name}: {len(hits)} times {edit.old} in {edit.where}; one is expected, or nth")
    path, node = hits[(edit.nth or 1) - 1]
    body = parsed(text_of(path)).body
    texts = [written(statement) for statement in body]
    k = next(k for k, statement in enumerate(body) if node.lineno <= statement.end_lineno)
    after = "\n".join([*texts[:k], edited(body[k], node, edit), *texts[k + 1 :]])
    return Place(path, "\n".join(texts) + "\n", after + "\n")


@cache
def sources(project: Path) -> dict[Path, str]:
    """The files, each with its dotted name between dots."""
    paths = [path for package in PACKAGES for path in sorted((project / package).rglob("*.py"))]
    return {path: f".{'.'.join(path.relative_to(project).with_suffix('').parts)}." for path in paths}


written, parsed = cache(ast.unparse), cache(ast.parse)


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


def named_inside(node, name):
    """Definitions and assignments of a name in a node, not in the definitions inside it."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, DEFINITIONS):
            if child.name == name:
                yield child
        elif isinstance(child, ast.Assign | ast.AnnAssign) and name in assigned(child):
            yield child
        else:
            yield from named_inside(child, name)


def assigned(statement) -> set[str]:
    targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
    return {node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name)}


def matches(node, pattern):
    """Every node in a function or statement that matches a pattern, in the order of the source."""
    if found(pattern, node) is not None:
        yield node
    for child in ast.iter_child_nodes(node):
        yield from matches(child, pattern)


def edited(statement: ast.stmt, node: ast.AST, edit: Edit) -> str:
    """A statement with the new expression or statements in the place of a node."""
    new = [Filled(found(read(edit.old)[0], node)).visit(one) for one in read(edit.new)]
    if isinstance(node, ast.keyword):
        new = [ast.keyword(arg=new[0].targets[0].id, value=new[0].value)]
    elif isinstance(node, ast.stmt):
        new = [ast.Expr(one) if isinstance(one, ast.expr) else one for one in new]
    elif len(new) != 1:
        raise DoesNotApply(f"{edit.name}: new is one expression, as old is")
    root = ast.Module([statement], [])
    fields = ((parent, *field) for parent in ast.walk(root) for field in ast.iter_fields(parent))
    parent, name, value = next(field for field in fields if any(one is node for one in listed(field[-1])))
    changed = [other for one in listed(value) for other in (new if one is node else [one])]
    setattr(parent, name, changed if isinstance(value, list) else changed[0])
    try:
        text = ast.unparse(root)
        ast.parse(text)
    except SyntaxError:
        raise DoesNotApply(f"{edit.name}: {edit.old} cannot be replaced") from None
    finally:
        setattr(parent, name, value)
    return text


def listed(value) -> list:
    return value if isinstance(value, list) else [value]
