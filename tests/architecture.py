"""The imports of the project, for test_structure; run as a module, this draws them anew in ARCHITECTURE.md."""

import ast
import re
from collections import Counter
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FILES = sorted((ROOT / "compare").rglob("*.py"))
OF_TMT = sorted((ROOT / "tmt").rglob("*.py"))
PAGE = ROOT / "ARCHITECTURE.md"
DIAGRAM = re.compile(r"(?<=```mermaid\n).*?(?=```)", re.DOTALL)


def dotted(path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


TMT = {dotted(file) for file in OF_TMT}
MODULES = {dotted(file) for file in FILES} | TMT


@cache
def imports(path, for_types=True) -> frozenset[str]:
    """Full names of what a file imports, wherever in it: a module, or a name in one. for_types: also if for annotations alone."""
    package, tree = dotted(path if path.name == "__init__.py" else path.parent / "__init__.py"), parsed(path)
    blocks = [node for node in ast.walk(tree) if isinstance(node, ast.If)]
    of_types = [block for block in blocks if ast.unparse(block.test) == "TYPE_CHECKING" and not for_types]
    left_out = {node for block in of_types for node in ast.walk(block)}
    found = set()
    for node in set(ast.walk(tree)) - left_out:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            start = ".".join([*base, *filter(None, [node.module])])
            found |= {f"{start}.{alias.name}" for alias in node.names}
    return frozenset(found)


@cache
def parsed(path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def modules_imported(path, for_types=True) -> set[str]:
    names = imports(path, for_types)
    return {name if name in MODULES else name.rpartition(".")[0] for name in names} & MODULES - {dotted(path)}


def folder(module: str) -> str:
    first = ".".join(module.split(".")[:2])
    return first if ROOT.joinpath(*first.split(".")).is_dir() else module.split(".")[0]


def folder_imports() -> dict[tuple[str, str], int]:
    pairs = [(path, name) for path in [*FILES, *OF_TMT] for name in modules_imported(path)]
    counts = Counter((folder(dotted(path)), folder(name)) for path, name in pairs)
    return {pair: count for pair, count in counts.items() if pair[0] != pair[1]}


def reached(pairs, start: str) -> set[str]:
    """What a folder imports, and what that imports."""
    found, waiting = set(), [start]
    while waiting:
        at = waiting.pop()
        new = {other for one, other in pairs if one == at} - found
        found |= new
        waiting += new
    return found


def arrows(counts: dict[tuple[str, str], int]) -> list[tuple[str, str]]:
    """The imports without those that follow from others: a to c, if a imports b and b imports c. The rare ones go first."""
    kept = sorted(counts, key=lambda pair: (counts[pair], pair))
    for pair in list(kept):
        rest = [other for other in kept if other != pair]
        if pair[1] in reached(rest, pair[0]):
            kept = rest
    return kept


def diagram() -> str:
    """The arrows in Mermaid's language, each on its line, the folders of each package in a frame."""
    pairs = arrows(folder_imports())
    lines = ["flowchart TD"]
    for package in ("compare", "tmt"):
        names = sorted({name for pair in pairs for name in pair if name.split(".")[0] == package})
        nodes = [f"    {name}[{name.split('.')[-1]}]" for name in names]
        lines += [f"  subgraph {package}_folders [{package}]", *nodes, "  end"]
    return "\n".join([*lines, *(f"  {one} --> {other}" for one, other in sorted(pairs))]) + "\n"


def drawn() -> list[tuple[str, str]]:
    """The arrows of the diagram in ARCHITECTURE.md."""
    (text,) = DIAGRAM.findall(PAGE.read_text(encoding="utf-8"))
    return re.findall(r"^  (\S+) --> (\S+)$", text, re.MULTILINE)


if __name__ == "__main__":
    PAGE.write_text(DIAGRAM.sub(lambda _: diagram(), PAGE.read_text(encoding="utf-8")), encoding="utf-8")
