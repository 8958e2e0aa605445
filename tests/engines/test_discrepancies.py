"""The scripts of reports/engines/discrepancies.md print what stands below them; RENEW=1 writes it anew."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from compare.engines import RECORDS
from compare.engines.outside import Outside

TEXT = Path(__file__).parents[2] / "reports/engines/discrepancies.md"
BLOCK = re.compile(r"^## (.*?)$(?:(?!^## ).)*?^```python\n(.*?)^```\n\n```text\n(.*?)^```$", re.M | re.S)
BLOCKS = BLOCK.findall(TEXT.read_text())
PACKAGES = {"pydrake": "drake", "mujoco_warp": "warp"} | {
    name: name for name in ("newton", "pinocchio", "mjx")
}
# what engines themselves print is left out
RUN = """import functools, sys
with open(sys.argv[2], "w") as out:
    exec(sys.argv[1], {"print": functools.partial(print, file=out), "__name__": "__main__"})
"""
SILENT = {"TF_CPP_MIN_LOG_LEVEL": "3", "JAX_PLATFORMS": "cpu"}


@pytest.mark.slow
@pytest.mark.parametrize("title, script, printed", BLOCKS, ids=[block[0] for block in BLOCKS])
def test_a_script_prints_what_stands_below_it(title, script, printed, tmp_path):
    needed = {engine for package, engine in PACKAGES.items() if package in script and engine in RECORDS}
    if missing := [engine for engine in needed if Outside(engine).unavailable()]:
        pytest.skip(f"{missing[0]} is not installed")
    file = tmp_path / "printed.txt"
    command = [sys.executable, "-c", RUN, script, str(file)]
    subprocess.run(command, env=os.environ | SILENT, capture_output=True, check=True)
    said = file.read_text()
    if os.environ.get("RENEW"):
        before, after = (f"{script}```\n\n```text\n{shown}" for shown in (printed, said))
        TEXT.write_text(TEXT.read_text().replace(before, after))
    else:
        assert said == printed
