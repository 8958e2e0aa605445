"""The scripts in examples: each runs in a folder of its own, says what is expected, and writes nothing elsewhere."""

import re
import shutil
import subprocess
import sys

import pytest
from runs import ENVIRONMENT, ROOT

EXAMPLES = sorted((ROOT / "tests" / "examples").glob("*.py"))
SLOW = {"many_files": pytest.mark.slow}  # which starts runs
TABLE = ROOT / "reports" / "example" / "tables" / "speed.csv"
# what is printed, and the files that are left
EXPECTED = {
    "controller": (r"after 2 s: 0\.00\d* deg", set()),
    "exported_c": (r"difference from tmt: \d(\.\d)?e-1\d|difference from tmt: 0$", {"arm.c", "arm.h", "arm.so"}),
    "many_files": (r"status 1.*\n.*ben.xml: differ com z of rod.*\n.*anna.xml: agree$",
                   {"class", "solution.xml", "submissions"}),
    "own_equations": (r"equations agree; .* h\[pole\] is .*\nprobable cause: gravity has the other sign in your h", set()),
    "stable_step": (r"Euler: 0\.00\d+ s, elbow; .* not stable\n.*fast: 0\.0[56]\d+ s(.*\n)+.* elbow 8\.0: 0\.002", set()),
    "time_against_error": ("6 methods", {"time_against_error.png"}),
}  # fmt: skip
CASES = [pytest.param(path, marks=SLOW.get(path.stem, ()), id=path.stem) for path in EXAMPLES]


@pytest.mark.parametrize("path", CASES)
def test_an_example_runs_and_says_what_it_finds(path, tmp_path):
    if path.stem == "exported_c" and not shutil.which("gcc"):
        pytest.skip("needs gcc")
    words = [sys.executable, path, *[TABLE] * (path.stem == "time_against_error")]
    run = subprocess.run(words, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True)
    printed, left = EXPECTED[path.stem]
    assert run.returncode == 0 and run.stderr == ""
    assert re.search(printed, run.stdout, re.MULTILINE), run.stdout
    assert {file.name for file in tmp_path.iterdir()} == left
    text = path.read_text(encoding="utf-8")
    assert len(text.partition('"""\n')[0].splitlines()) == 2 and len(text.splitlines()) <= 40
