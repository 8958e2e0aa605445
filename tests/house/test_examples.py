"""The scripts in examples, each in a folder of its own, and the docstrings of public functions: what they show is right."""

import dataclasses
import doctest
import inspect
import json
import re
import runpy
import shutil
import sys

import numpy as np
import pytest
from helpers.runs import ROOT

import compare
import tmt
from compare.agreement import Difference
from compare.fleet.models import place_of_report

EXAMPLES = sorted((ROOT / "tests" / "examples").glob("*.py"))
SLOW = dict.fromkeys(("many_files", "first_hour"), pytest.mark.slow)  # which start runs
TABLE = ROOT / "reports" / "example" / "tables" / "speed.csv"
GIVEN = {"time_against_error": [TABLE], "marks": ["class"]}
# what is printed, and the files that are left
EXPECTED = {
    "controller": (r"after 2 s: 0\.00\d* deg", set()),
    "exported_c": (r"difference from tmt: \d(\.\d)?e-1\d|difference from tmt: 0$", {"arm.c", "arm.h", "arm.so"}),
    "first_hour": (r"^h\[hip\]: .*\n.* h\[hip\], coefficient of knee'\^2: yours is -1 times(.*\n)+the equations agree\n(.*\n)+"
                   r" RK4 +1[12]0 ms(.*\n)+time over error: mujoco, tmt$", {"robot.xml", "report", "time_over_error.png"}),
    "many_files": (r"status 1.*\n.*ben.xml: differ com z of rod.*\n.*anna.xml: agree$",
                   {"class", "solution.xml", "submissions"}),
    "marks": (r"anna.xml: 7 of 7\n/submitted/ben.xml: 3 of 7\ncopy.xml: 7 of 7\nbroken.xml: 0 of 7$", {"class"}),
    "own_equations": (r"equations agree; .* h\[pole\] is .*\nprobable cause: gravity has the other sign in your h", set()),
    "stable_step": (r" Euler +2\.\d ms +\S+ ms +elbow\n.*fast +5\d ms(.*\n)+.* not stable\n.* elbow 8\.0: 0\.002", set()),
    "time_against_error": ("6 methods", {"time_against_error.png"}),
}  # fmt: skip
CASES = [pytest.param(path, marks=SLOW.get(path.stem, ()), id=path.stem) for path in EXAMPLES]


def write_fleet(folder):
    """A fleet whose second file has one number that differs, and a mass matrix and a bias that pass and fail."""
    for name, passes in {"anna.xml": True, "/submitted/ben.xml": False}.items():
        found = [("parameters", "com", True), ("parameters", "mass", passes), ("mass", "Mbar", True)]
        found += [("gravity", "torque", True), ("mass", "other", passes)]
        fields = [dict(zip(("experiment", "quantity", "passed"), check)) for check in found]
        place = folder / place_of_report(name)
        place.mkdir(parents=True)
        (place / "results.json").write_text(json.dumps({"checks": fields}))
    files = "anna.xml,", "/submitted/ben.xml,", "copy.xml,anna.xml", "broken.xml,"
    (folder / "fleet.csv").write_text("\n".join(["file,same_as", *files]))


@pytest.mark.parametrize("path", CASES)
def test_an_example_runs_and_says_what_it_finds(path, tmp_path, monkeypatch, capsys):
    if path.stem == "exported_c" and not shutil.which("gcc"):
        pytest.skip("needs gcc")
    if path.stem == "marks":
        write_fleet(tmp_path / "class")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setattr(sys, "argv", [str(path), *map(str, GIVEN.get(path.stem, ()))])
    runpy.run_path(str(path), run_name="__main__")
    (printed, left), (out, err) = EXPECTED[path.stem], capsys.readouterr()
    assert err == "" and re.search(printed, out, re.MULTILINE), out
    assert {file.name for file in tmp_path.iterdir()} == left
    text = path.read_text(encoding="utf-8")
    is_notebook = path.with_suffix(".ipynb").exists()
    assert is_notebook or (len(text.partition('"""\n')[0].splitlines()) == 2 and len(text.splitlines()) <= 40)


def test_the_notebook_has_the_cells_of_its_source():
    """As jupytext pairs them: a cell begins with "# %%", and its text, if it is Markdown, is in comments."""
    source = ROOT / "tests" / "examples" / "first_hour.py"
    cells = json.loads(source.with_suffix(".ipynb").read_text(encoding="utf-8"))["cells"]
    parts = re.split(r"(?m)^# %%", source.read_text(encoding="utf-8"))[1:]
    assert len(parts) == len(cells) and not any(cell.get("outputs") for cell in cells)
    for part, cell in zip(parts, cells):
        head, _, body = part.partition("\n")
        is_text = "[markdown]" in head
        text = re.sub(r"(?m)^# ?", "", body) if is_text else body
        assert "".join(cell["source"]) == text.strip("\n") and (cell["cell_type"] == "markdown") == is_text


SECTION = re.compile(r"(?ms)^ *(?:Parameters|Attributes)\n *-+\n(.*?)(?=\n *\n *(?:\w+\n *-+\n|>>>)|\Z)")
FUNCTIONS = [getattr(tmt, name) for name in tmt.__all__ if inspect.isroutine(getattr(tmt, name))]
OTHERS = [tmt.Tree, tmt.Tree.lock, tmt.Tree.from_joints, tmt.Motion, Difference]
OTHERS += [getattr(compare, name) for name in compare.__all__]


@pytest.mark.parametrize("public", [*FUNCTIONS, *OTHERS], ids=lambda public: public.__qualname__)
def test_examples_are_right_and_every_argument_is_described(public):
    names = {"compare": compare, "tmt": tmt, "np": np, "dataclasses": dataclasses}
    (found,) = doctest.DocTestFinder(recurse=False).find(public, public.__qualname__, globs=names)
    assert doctest.DocTestRunner().run(found).failed == 0 and (found.examples or public is Difference)
    arguments = {*inspect.signature(public).parameters} - {"self"}
    if isinstance(public, type) and issubclass(public, tuple):  # which has attributes besides
        arguments |= {*public.__annotations__}
    (section,) = SECTION.findall(public.__doc__)
    lines = inspect.cleandoc("\n" + section).splitlines()
    described = [line.split(" : ")[0] for line in lines if not line.startswith(" ")]
    assert {name.strip("* ") for names in described for name in names.split(",")} == arguments
