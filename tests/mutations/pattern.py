"""Expressions with holes: whether a node of a source matches one, and what fills the holes."""

import ast
import copy
import re
import textwrap

ONE, REST = re.compile(r"_\d+$"), ast.Starred


def read(text) -> list[ast.AST]:
    """Statements, or the expression that the text is."""
    body = ast.parse(textwrap.dedent(text).strip()).body
    return [body[0].value] if len(body) == 1 and isinstance(body[0], ast.Expr) else body


def found(pattern, node) -> dict | None:
    """What the holes of a pattern stand for if the node matches, else None."""
    holes = {}
    if isinstance(node, ast.keyword) and isinstance(pattern, ast.Assign):
        same_name = isinstance(pattern.targets[0], ast.Name) and pattern.targets[0].id == node.arg
        return holes if same_name and equal(pattern.value, node.value, holes) else None
    return holes if equal(pattern, node, holes) else None


def equal(pattern, node, holes) -> bool:
    """Whether a node is what the pattern says; fills the holes."""
    if isinstance(pattern, ast.Name) and ONE.match(pattern.id) and isinstance(node, ast.expr):
        known = holes.setdefault(pattern.id, node)
        return known is node or ast.dump(known) == ast.dump(node)
    if isinstance(pattern, ast.Expr) and isinstance(pattern.value, ast.Name) and ONE.match(pattern.value.id):
        holes[pattern.value.id] = node
        return isinstance(node, ast.stmt)
    if type(pattern) is not type(node):
        return False
    if isinstance(pattern, ast.Call) and pattern.args and is_rest(pattern.args[-1]):
        given = pattern.args[:-1]
        if not equal(pattern.func, node.func, holes) or len(node.args) < len(given):
            return False
        wanted = {keyword.arg: keyword.value for keyword in pattern.keywords}
        own = {keyword.arg: keyword.value for keyword in node.keywords if keyword.arg in wanted}
        holes[pattern.args[-1].value.id] = (
            node.args[len(given) :],
            [keyword for keyword in node.keywords if keyword.arg not in wanted],
        )
        return set(own) == set(wanted) and all(
            equal(*pair, holes)
            for pair in [*zip(given, node.args), *((value, own[name]) for name, value in wanted.items())]
        )
    for name in pattern._fields:
        if name in ("ctx", "kind", "type_comment"):
            continue
        mine, theirs = getattr(pattern, name, None), getattr(node, name, None)
        pairs = zip(mine, theirs) if isinstance(mine, list) and isinstance(theirs, list) else [(mine, theirs)]
        if isinstance(mine, list) and len(mine) != len(theirs):
            return False
        for a, b in pairs:
            if isinstance(a, ast.AST):
                if not (isinstance(b, ast.AST) and equal(a, b, holes)):
                    return False
            elif a != b or type(a) is not type(b):
                return False
    return True


def is_rest(argument) -> bool:
    return isinstance(argument, REST) and isinstance(argument.value, ast.Name) and bool(ONE.match(argument.value.id))


class Filled(ast.NodeTransformer):
    """The new expression with what the holes stand for."""

    def __init__(self, holes):
        self.holes = holes

    def visit_Name(self, node):
        return copy.deepcopy(self.holes.get(node.id, node))

    def visit_Expr(self, node):
        value = self.visit(node.value)
        return value if isinstance(value, ast.stmt) else ast.Expr(value)

    def visit_Call(self, node):
        if node.args and is_rest(node.args[-1]):
            args, keywords = copy.deepcopy(self.holes[node.args[-1].value.id])
            node.args, node.keywords = [*node.args[:-1], *args], [*node.keywords, *keywords]
        return self.generic_visit(node)
