"""The parts of the project, and the directions of their imports."""

import ast
import re
import sys
from functools import cache

from helpers.runs import ROOT

FILES, OF_TMT = (sorted((ROOT / package).rglob("*.py")) for package in ("compare", "tmt"))
DIAGRAM = re.compile(r"^  (\S+) --> (\S+)$", re.MULTILINE)

# the modules of compare, or beginnings of their names, that may import a library
LIBRARIES = {
    "mujoco": "engines.mujoco engines.mjx engines.newton engines.warp engines.outside.as_it_runs stability",
    "mujoco_warp": "engines.warp", "warp": "engines.newton engines.warp",
    "jax": "engines.mjx export.programs", "heyoka": "engines.heyoka",
    "newton": "engines.newton", "pinocchio": "engines.pinocchio", "pydrake": "engines.drake", "pandas": "report stability.api",
    "matplotlib": "report.style", "PIL": "report.images", "distributed": "fleet.executors", "rich": "report.terminal",
}  # fmt: skip
SHARED = tuple(
    f"compare.experiments.{name}" for name in ("figures", "options", "quantities", "runs", "setup")
)
DRAWING = ("matplotlib", "PIL")  # for modules whose name begins with figures, too
FOR_DOCSTRINGS = {"tmt.export", "tmt"}  # exported functions have those of the public ones


def dotted(path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


TMT = {dotted(file) for file in OF_TMT}
MODULES = {dotted(file) for file in FILES} | TMT


@cache
def imports(path) -> frozenset[str]:
    """Full names of what a file imports, wherever in it: a module, or a name in one."""
    package = dotted(path if path.name == "__init__.py" else path.parent / "__init__.py")
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            start = ".".join([*base, *filter(None, [node.module])])
            found |= {f"{start}.{alias.name}" for alias in node.names}
    return frozenset(found)


def modules_imported(path) -> set[str]:
    names = imports(path)
    return {name if name in MODULES else name.rpartition(".")[0] for name in names} & MODULES - {dotted(path)}


def folder(module: str) -> str:
    first = ".".join(module.split(".")[:2])
    return first if ROOT.joinpath(*first.split(".")).is_dir() else module.split(".")[0]


def libraries(path) -> set[str]:
    return {name.split(".")[0] for name in imports(path)}


def test_tmt_imports_three_libraries_alone():
    """And its symbolic equations SymPy, which need not be installed."""
    always = {*sys.stdlib_module_names, "tmt", "numpy", "llvmlite", "mpmath"}
    for path in OF_TMT:
        allowed = always | {"sympy"} if dotted(path).startswith("tmt.export.") else always
        assert not libraries(path) - allowed, path


def test_experiments_and_libraries_are_imported_where_they_belong():
    """Experiments by name only, and not by each other."""
    for path in FILES:
        for name in modules_imported(path) - TMT:
            is_free = name.startswith(SHARED) or name.split(".")[:3] == dotted(path).split(".")[:3]
            said = f"{dotted(path)} imports {name}"
            assert is_free or not name.startswith("compare.experiments."), said
        for library in libraries(path) & LIBRARIES.keys():
            drawn = library in DRAWING and path.stem.startswith("figures")
            homes = tuple(f"compare.{home}" for home in LIBRARIES[library].split())
            assert drawn or dotted(path).startswith(homes), f"{dotted(path)} imports {library}"


def test_the_diagram_shows_the_imports_of_all_folders():
    """One that has no arrow follows from arrows; no arrow is without an import, and there is no circle."""
    pairs = {(dotted(path), name) for path in FILES + OF_TMT for name in modules_imported(path)}
    imported = {(folder(a), folder(b)) for a, b in pairs if folder(a) != folder(b)}
    arrows = set(DIAGRAM.findall((ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")))
    assert arrows <= imported
    reached = set(arrows)
    while more := {(a, d) for a, b in reached for c, d in arrows if b == c} - reached:
        reached |= more
    assert imported <= reached, "arrows are missing"
    assert {a for a, b in reached if a == b} == FOR_DOCSTRINGS
