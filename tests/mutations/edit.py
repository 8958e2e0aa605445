"""One edit of a source file, found by module, function and expression; formatting does not matter."""

import ast
import copy
import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from .pattern import Filled, found, read

PACKAGES = ("compare", "tmt")


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
    """Where an edit applies."""

    path: Path
    before: str
    after: str


class Hit(NamedTuple):
    """A node that matches, with the way to it from the root: a field and an index in it, or None, of each parent."""

    node: ast.AST
    way: tuple
    holes: dict


def applied(project: Path, edit: Edit) -> Place:
    """The file that the edit changes, with its text before and after."""
    paths = [path for package in PACKAGES for path in sorted((project / package).rglob("*.py"))]
    named = [path for path in paths if is_named(path.relative_to(project), edit.module) and scopes(path, edit.where)]
    holding = named or [path for path in paths if scopes(path, edit.where)]  # moved to another file
    if not holding:
        raise DoesNotApply(f"{edit.name}: there is no {edit.where} below {' or '.join(PACKAGES)}")
    found = {path: hits for path in holding if (hits := matches(path, edit))}
    if not found:
        raise DoesNotApply(f"{edit.name}: {edit.where} has no {one_line(edit.old)}")
    count = sum(map(len, found.values()))
    if len(found) > 1 or (count > 1 and edit.nth is None):
        places = ", ".join(str(path.relative_to(project)) for path in found)
        raise DoesNotApply(f"{edit.name}: {count} times {one_line(edit.old)} in {places}; one is expected, or nth")
    ((path, hits),) = found.items()
    if not 1 <= (edit.nth or 1) <= count:
        raise DoesNotApply(f"{edit.name}: {one_line(edit.old)} number {edit.nth} of {count}")
    text = source(path)[0]
    return Place(path, text, edited(text, hits[(edit.nth or 1) - 1], edit))


def one_line(text) -> str:
    return " ".join(text.split())


def is_named(path: Path, module: str) -> bool:
    """Whether a file, or a folder above it, has this dotted name or one that ends so."""
    parts, wanted = path.with_suffix("").parts, tuple(module.split("."))
    ends = range(1, len(parts) + 1)
    return any(parts[:end][-len(wanted) :] == wanted for end in ends)


def source(path: Path) -> tuple[str, ast.Module]:
    """Text and tree of a file."""
    return parsed(path.read_text(encoding="utf-8"))


@lru_cache(maxsize=256)
def parsed(text):
    return text, ast.parse(text)


def scopes(path, where) -> list[Hit]:
    """The nodes of this qualified name: definitions, or statements that assign it."""
    text, tree = source(path)
    hits = [Hit(tree, (), {})] if where.split(".")[0] in text else []
    for name in where.split("."):
        hits = [inner for hit in hits for inner in named_inside(hit, name)]
    return hits


def named_inside(hit, name):
    """Definitions and assignments of a name in a node, not in the definitions inside it."""
    for child in children(hit):
        node = child.node
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            if node.name == name:
                yield child
            continue
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            if any(isinstance(n, ast.Name) and n.id == name for target in targets for n in ast.walk(target)):
                yield child
                continue
        yield from named_inside(child, name)


def children(hit):
    """The nodes directly below a node, in the order of the source."""
    for name, value in ast.iter_fields(hit.node):
        if isinstance(value, ast.AST):
            yield Hit(value, (*hit.way, (name, None)), {})
        elif isinstance(value, list):
            for k, item in enumerate(value):
                if isinstance(item, ast.AST):
                    yield Hit(item, (*hit.way, (name, k)), {})


def matches(path, edit) -> list[Hit]:
    """Every node in the edit's function or statement that matches its old expression."""
    try:
        patterns, _ = read(edit.old), read(edit.new)
    except SyntaxError:
        patterns = []
    if len(patterns) != 1:
        raise DoesNotApply(f"{edit.name}: old is one expression or statement")
    (pattern,) = patterns
    result = []

    def visit(hit):
        holes = found(pattern, hit.node)
        if holes is not None:
            result.append(hit._replace(holes=holes))
        for child in children(hit):
            visit(child)

    for scope in scopes(path, edit.where):
        visit(scope)
    return result


def edited(text, hit, edit) -> str:
    """The text of a file with the new expression in the place of the node; only that place changes."""
    number = hit.way[0][1]
    root = ast.Module([copy.deepcopy(parsed(text)[1].body[number])], [])
    nodes = [root]  # from the root to the node
    way = (("body", 0), *hit.way[1:])
    for name, k in way:
        nodes.append(getattr(nodes[-1], name) if k is None else getattr(nodes[-1], name)[k])
    new = [Filled(hit.holes).visit(node) for node in read(edit.new)]
    if isinstance(hit.node, ast.keyword):
        new = [ast.keyword(arg=new[0].targets[0].id, value=new[0].value)]
    elif isinstance(hit.node, ast.stmt):
        new = [ast.Expr(node) if isinstance(node, ast.expr) else node for node in new]
    elif len(new) != 1:
        raise DoesNotApply(f"{edit.name}: new is one expression, as old is")
    (name, k), texts = way[-1], [ast.unparse(node) for node in new]
    if k is None:
        setattr(nodes[-2], name, new[0])
    else:
        getattr(nodes[-2], name)[k : k + 1] = new
    old = hit.node
    for node in nodes:  # before Python 3.12 the places inside an f-string are not known
        if isinstance(node, ast.JoinedStr):
            old, texts = node, [ast.unparse(node)]
            break
    if isinstance(old, ast.stmt):
        piece = ("\n" + " " * old.col_offset).join("\n".join(texts).splitlines())
    else:
        piece = texts[0] if isinstance(old, ast.keyword) else f"({texts[0]})"
    start, end = place(text, old.lineno, old.col_offset), place(text, old.end_lineno, old.end_col_offset)
    result = text[:start] + piece + text[end:]
    try:
        new_body = ast.parse(result).body[number : number + len(root.body)]
    except SyntaxError:
        new_body = []
    if written(ast.Module(new_body, [])) != written(root):
        raise DoesNotApply(f"{edit.name}: {one_line(edit.old)} cannot be replaced in the text")
    return result


def written(tree) -> str:
    """A tree as text, whether its names are read or assigned."""
    return re.sub(r", ctx=\w+\(\)", "", ast.dump(tree))


def place(text, line, column) -> int:
    """The index of a line and a column in bytes of UTF-8."""
    lines = text.split("\n")
    return sum(len(line) + 1 for line in lines[: line - 1]) + len(lines[line - 1].encode()[:column].decode())
