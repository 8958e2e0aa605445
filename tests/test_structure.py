"""The parts of the project and the directions of their imports."""

import re
import sys
from graphlib import TopologicalSorter

import architecture
from architecture import FILES, OF_TMT, ROOT, dotted, imports, modules_imported

# what each part of compare may import of the others; of its own part: anything that makes no circle
DIRECTIONS = {
    "": "agreement core", "core": "", "process": "core", "robots": "tmt core", "judge": "tmt core robots",
    "agreement": "tmt core diagnosis engines judge robots",
    "engines": "tmt core robots judge process", "truth": "tmt core robots", "diagnosis": "tmt core robots judge",
    "report": "core process engines experiments",
    "experiments": "tmt core robots engines truth judge diagnosis",
    "run": "tmt core robots engines judge process report experiments", "cli": "core experiments process report",
    "fleet": "tmt core robots engines judge process report experiments run cli",
    "export": "tmt core robots engines judge process report experiments run cli",
    "__main__": "tmt core robots engines judge process report experiments run cli fleet export",
}  # fmt: skip
# the modules, or beginnings of their names, that may import a library
LIBRARIES = {
    "mujoco": ("compare.engines.mujoco", "compare.engines.mjx"),
    "mujoco_warp": ("compare.engines.warp",), "warp": ("compare.engines.newton", "compare.engines.warp"),
    "jax": ("compare.engines.mjx",), "heyoka": ("compare.engines.heyoka",),
    "dartpy": ("compare.engines.dart",), "pybullet": ("compare.engines.pybullet",),
    "newton": ("compare.engines.newton",), "pinocchio": ("compare.engines.pinocchio",),
    "pydrake": ("compare.engines.drake",), "pandas": ("compare.report",),
    "matplotlib": ("compare.report.style",), "PIL": ("compare.report.images",),
    "distributed": ("compare.fleet.executors",), "rich": ("compare.report.terminal",),
}  # fmt: skip
DRAWING = ("matplotlib", "PIL")  # for modules whose name begins with figures, too


def libraries(path) -> set[str]:
    return {name.split(".")[0] for name in imports(path)}


def modules_of_compare(path) -> set[str]:
    return {name for name in modules_imported(path) if name.startswith("compare")}


def part(module) -> str:
    return (module.split(".") + [""])[1]


def test_tmt_imports_three_libraries_alone():
    """And its symbolic equations SymPy, which need not be installed."""
    allowed = {*sys.stdlib_module_names, "tmt", "numpy", "llvmlite", "mpmath"}
    for path in OF_TMT:
        assert (
            not libraries(path) - allowed - ({"sympy"} if dotted(path).startswith("tmt.export.") else set())
        ), path


def test_imports_keep_their_directions():
    """Those of libraries too; experiments are imported by name only, and not by each other."""
    for path in FILES:
        mine, own = part(dotted(path)), dotted(path).split(".")[:3]
        allowed = {mine, *DIRECTIONS.get(mine, "").split()}
        for name in modules_of_compare(path):
            said = f"{dotted(path)} imports {name}"
            is_style = path.stem.startswith("figures") and name == "compare.report.style"
            assert part(name) in allowed or is_style or name == "compare.core.text", said
            shared = tuple(
                f"compare.experiments.{name}" for name in ("figures", "followed", "quantities", "setup")
            )
            is_free = name.startswith(shared) or name.split(".")[:3] == own
            assert is_free or not name.startswith("compare.experiments."), said
        assert "tmt" not in libraries(path) or "tmt" in allowed, path
        for library in libraries(path) & LIBRARIES.keys():
            drawn = library in DRAWING and path.stem.startswith("figures")
            assert drawn or dotted(path).startswith(LIBRARIES[library]), f"{dotted(path)} imports {library}"


def test_there_is_no_circle():
    TopologicalSorter({dotted(path): modules_of_compare(path) for path in FILES}).prepare()


def test_the_diagram_shows_the_imports_of_all_folders():
    """An import that has no arrow follows from arrows; and no arrow is without an import."""
    counts, pairs = architecture.folder_imports(), architecture.drawn()
    assert counts.keys() >= {*pairs}, "python -m tests.architecture draws it anew"
    for folder in {folder for pair in counts for folder in pair}:
        assert architecture.reached(pairs, folder) == architecture.reached(counts, folder), folder


def test_ci_runs_the_commands_of_the_readme():
    readme, script = ((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", ".ci/run"))
    main_job, tests = re.findall(r"^(?:python3 -m venv|\.venv/bin/python).*$", readme, re.MULTILINE)[:2]
    assert main_job.endswith("python -m compare all") and tests.endswith("python -m pytest")
    assert tests in script and main_job + " --quick" in script


def test_no_module_of_an_experiment_hides_one_of_its_functions():
    """Importing a submodule sets the package's attribute of that name."""
    functions = {"rows", "figures", "headline", "overview", "skipped", "begin", "claim_values"}
    assert not {path for path in FILES if path.stem in functions and path.parent.parent.name == "experiments"}
