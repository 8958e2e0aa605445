"""The parts of the project and their directions, and the commands that the README promises."""

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from compare.experiments import EXPERIMENTS

ROOT = Path(__file__).resolve().parent.parent
FILES = sorted((ROOT / "compare").rglob("*.py"))

# what each part of compare may import of the others; of its own part: anything that makes no circle
DIRECTIONS = {
    "": {"agreement"},
    "agreement": {
        "tmt",
        "case",
        "coordinates",
        "diagnosis",
        "engines",
        "given",
        "joint_map",
        "judge",
        "robots",
        "states",
    },
    "coordinates": {"tmt"},
    "given": set(),
    "actuators": set(),
    "controller": {"actuators"},
    "scene": {"given"},
    "case": {"tmt", "controller", "coordinates", "given", "scene"},
    "joint_map": {"coordinates", "judge"},
    "diagnosis": {"tmt", "coordinates", "joint_map", "judge"},
    "states": {"tmt", "robots", "case"},
    "robots": {"tmt", "case", "actuators", "controller", "given"},
    "scene_file": {"case", "given", "robots"},
    "own_file": {"process", "judge"},
    "reference": {"robots", "engines", "process", "case", "given", "joint_map", "own_file"},
    "engines": {"tmt", "case", "coordinates", "joint_map", "actuators", "controller"},
    "truth": {"tmt", "case", "actuators"},
    "judge": {"tmt", "case"},
    "process": set(),
    "report": {"version", "judge", "process"},
    "setup": {"tmt", "case", "states", "robots", "engines"},
    "experiments": {
        "diagnosis",
        "joint_map",
        "tmt",
        "truth",
        "engines",
        "judge",
        "given",
        "case",
        "states",
        "robots",
        "setup",
    },
    "drawing": {"robots", "judge", "process", "report", "experiments"},
    "experiment": {"drawing", "robots", "setup", "judge", "process", "report", "experiments"},
    "command_line": {"experiments", "process"},
    "fleet": {
        "tmt",
        "case",
        "command_line",
        "drawing",
        "engines",
        "experiment",
        "experiments",
        "judge",
        "process",
        "reference",
        "report",
        "setup",
        "version",
    },
    "__main__": {
        "fleet",
        "version",
        "case",
        "command_line",
        "drawing",
        "engines",
        "own_file",
        "reference",
        "scene_file",
        "process",
        "report",
        "setup",
        "experiment",
        "experiments",
    },
}


def dotted(path) -> str:
    """A file's name as a module."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def imports(path) -> frozenset[str]:
    """Full names of what a file imports, wherever in it: a module, or a name in one."""
    package = dotted(path) if path.name == "__init__.py" else dotted(path).rpartition(".")[0]
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
    """The modules of this project that a file imports."""
    known = {dotted(file) for file in FILES}
    return {name if name in known else name.rpartition(".")[0] for name in imports(path)} & known - {dotted(path)}


def part(module) -> str:
    """The part of compare that a module belongs to."""
    return (module.split(".") + [""])[1]


@pytest.mark.parametrize("path", sorted((ROOT / "tmt").rglob("*.py")), ids=lambda path: path.name)
def test_tmt_knows_nothing_of_the_engine_or_the_judge(path):
    outer = {name.split(".")[0] for name in imports(path)}
    assert not outer & {"mujoco", "matplotlib", "pandas", "scipy", "rich", "compare", "mjcf"}


@pytest.mark.parametrize("path", FILES, ids=dotted)
def test_every_file_imports_in_the_directions_of_the_house(path):
    mine = part(dotted(path))
    allowed = DIRECTIONS.get(mine, set())
    for name in modules_imported(path):
        of = part(name)
        is_figure = path.stem.startswith("figures")
        assert of == mine or of in allowed or (is_figure and name == "compare.report.style"), f"{dotted(path)}: {name}"
    if "tmt" not in allowed and mine not in ("experiment", "__main__"):
        assert not any(name.split(".")[0] == "tmt" for name in imports(path))


@pytest.mark.parametrize("path", FILES, ids=dotted)
def test_libraries_are_imported_where_they_belong(path):
    outer = {name.split(".")[0] for name in imports(path)}
    name = dotted(path)
    assert "mujoco" not in outer or name.startswith("compare.engines.mujoco")
    assert "heyoka" not in outer or name == "compare.engines.heyoka"
    assert "pinocchio" not in outer or name == "compare.engines.pinocchio"
    assert "pandas" not in outer or name.startswith("compare.report")
    assert "matplotlib" not in outer or path.stem.startswith("figures") or name == "compare.report.style"
    assert "PIL" not in outer or path.stem.startswith("figures") or name == "compare.report.images"
    assert "distributed" not in outer or name in ("compare.fleet.cluster", "compare.fleet.worker")
    assert "rich" not in outer or name == "compare.report.terminal"


def test_there_is_no_circle():
    edges = {dotted(path): modules_imported(path) for path in FILES}
    left = dict(edges)
    while free := [name for name, needs in left.items() if not needs & left.keys()]:
        for name in free:
            del left[name]
    assert not left


def test_no_experiment_imports_anothers_inside():
    for path in (ROOT / "compare" / "experiments").rglob("*.py"):
        own = dotted(path).split(".")[:3]
        for name in modules_imported(path):
            inside = name.split(".")
            if inside[1] == "experiments":
                shared = name == "compare.experiments" or name.startswith("compare.experiments.figures")
                assert inside[:3] == own or shared, f"{dotted(path)}: {name}"


def test_experiments_are_imported_by_name_only():
    for path in FILES:
        if part(dotted(path)) != "experiments":
            assert all(not name.startswith("compare.experiments.") for name in modules_imported(path)), path


def test_mujocos_names_are_spoken_only_by_the_engine():
    spoken = re.compile(r"\.(qpos|qvel|qacc|qfrc_\w+|xipos|cvel)\b")
    for path in [*FILES, *(ROOT / "tmt").rglob("*.py")]:
        if not dotted(path).startswith("compare.engines.mujoco"):
            assert not spoken.search(path.read_text(encoding="utf-8")), path


def test_only_the_arms_own_file_knows_the_assignment():
    postures = r"\"(hanging|upright|zero)\"|[αβγ]"
    names = re.compile(
        r"\b((?<!grid\.)alpha|beta|gamma|ball catch|bent|forearm|upper arm|elbow|shoulder)\b|" + postures
    )
    for path in FILES:
        if dotted(path) != "compare.robots.arm":
            found = names.search(path.read_text(encoding="utf-8"))
            assert not found, f"{dotted(path)}: {found.group()}"


def test_a_constant_has_one_meaning_in_all_of_compare():
    """Public names in capitals that are assigned in several files, but for what every experiment or engine says of itself."""
    of_all = {"TITLE", "METHODS"}
    places = {}
    for path in FILES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            targets = (
                node.targets
                if isinstance(node, ast.Assign)
                else [node.target]
                if isinstance(node, ast.AnnAssign)
                else []
            )
            for target in (name for t in targets for name in ast.walk(t) if isinstance(name, ast.Name)):
                if target.id.isupper() and target.id not in of_all:
                    places.setdefault(target.id, set()).add(dotted(path))
    several = {name: sorted(files) for name, files in places.items() if len(files) > 1}
    assert not several


def test_a_function_has_one_meaning_in_all_of_compare():
    """Public functions of several files, but for what every experiment has."""
    of_all = {"rows", "figures", "claim", "tolerance", "begin", "skipped", "main"}
    places = {}
    for path in FILES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and node.name not in of_all:
                places.setdefault(node.name, set()).add(dotted(path))
    several = {name: sorted(files) for name, files in places.items() if len(files) > 1}
    assert not several


def test_no_file_is_long():
    """Its code: the docstring of an experiment is its help, and does not count."""
    for path in [*FILES, *(ROOT / "tmt").rglob("*.py")]:
        text = path.read_text(encoding="utf-8")
        is_help = dotted(path).removeprefix("compare.experiments.") in EXPERIMENTS
        lines = len(text.splitlines()) - (ast.parse(text).body[0].end_lineno if is_help else 0)
        assert lines <= 300, f"{dotted(path)}: {lines} lines"


def test_tmt_runs_without_mujoco():
    program = (
        "import sys; sys.modules.update(dict.fromkeys(['mujoco', 'matplotlib', 'pandas', 'scipy', 'rich', 'compare']))\n"
        "import tmt; t, q, qd = tmt.simulate([0.1, 0.2, 0.3], [0, 0, 0], [0, 0, 0], 0.01, 10); print(q[-1])"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert run.returncode == 0, run.stderr


def test_every_experiment_has_the_same_shape():
    for name in EXPERIMENTS:
        file = ROOT / "compare" / "experiments" / f"{name}.py"
        tree = ast.parse((file if file.exists() else file.with_suffix("") / "__init__.py").read_text(encoding="utf-8"))
        functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        assert {"claim", "tolerance", "rows", "figures"} <= functions


def test_the_package_list_has_every_folder():
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    listed = set(re.findall(r'"([\w.]+)"', re.search(r"packages = \[([^\]]*)\]", text)[1]))
    folders = {dotted(file) for top in ("compare", "tmt") for file in (ROOT / top).rglob("__init__.py")}
    assert listed == folders | {"mjcf"}


def test_ci_runs_the_commands_of_the_readme():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    commands = re.findall(r"^(?:python3 -m venv|\.venv/bin/python).*$", readme, re.MULTILINE)
    main_job, tests = commands[:2]
    assert main_job.endswith("python -m compare all") and tests.endswith("python -m pytest")
    assert tests in script
    assert main_job + " --quick" in script
