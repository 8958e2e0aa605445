"""The rooms and their directions, and the commands that the README promises."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def imports(path) -> set[str]:
    """Top-level names that a module imports, wherever it does so."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            found.add(node.module.split(".")[0])
        elif isinstance(node, ast.ImportFrom) and node.level > 1:
            found.add("..")
    return found


@pytest.mark.parametrize("path", sorted((ROOT / "tmt").glob("*.py")), ids=lambda path: path.name)
def test_tmt_knows_nothing_of_the_engine_or_the_judge(path):
    assert not imports(path) & {"mujoco", "matplotlib", "pandas", "scipy", "rich", "compare", "mjcf", ".."}


def test_only_the_engine_imports_mujoco():
    importing = {p.name for p in (ROOT / "compare").glob("*.py") if "mujoco" in imports(p)}
    assert "engine.py" in importing and all(name.startswith("engine") for name in importing)


def test_mujocos_names_are_spoken_only_by_the_engine():
    spoken = re.compile(r"\.(qpos|qvel|qacc|qfrc_\w+|xipos|cvel)\b")
    for path in [*(ROOT / "compare").glob("*.py"), *(ROOT / "tmt").glob("*.py")]:
        if not path.name.startswith("engine"):
            assert not spoken.search(path.read_text()), path.name


def test_tmt_runs_without_mujoco():
    program = (
        "import sys; sys.modules.update(dict.fromkeys(['mujoco', 'matplotlib', 'pandas', 'scipy', 'rich', 'compare']))\n"
        "import tmt; t, q, qd = tmt.simulate([0.1, 0.2, 0.3], [0, 0, 0], [0, 0, 0], 0.01, 10); print(q[-1])"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert run.returncode == 0, run.stderr


def test_every_experiment_has_the_same_shape():
    from compare.__main__ import EXPERIMENTS

    for name in EXPERIMENTS:
        tree = ast.parse((ROOT / "compare" / f"{name}.py").read_text())
        functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        assert {"rows", "figures"} <= functions


def test_ci_runs_the_commands_of_the_readme():
    readme = (ROOT / "README.md").read_text()
    script = (ROOT / ".ci" / "run").read_text()
    commands = re.findall(r"^(?:python3 -m venv|\.venv/bin/python).*$", readme, re.MULTILINE)
    main_job, tests = commands[:2]
    assert main_job.endswith("python -m compare all") and tests.endswith("python -m pytest")
    assert tests in script
    assert main_job + " --quick" in script
