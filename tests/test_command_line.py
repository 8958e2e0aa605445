"""python -m compare from end to end: files, exit status, error lines."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from compare.__main__ import EXPERIMENTS, main
from compare.engine_file import ARM_XML

ROOT = Path(__file__).resolve().parent.parent
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT)}


def compare(*arguments, cwd, **options):
    command = [sys.executable, "-m", "compare", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, env=ENVIRONMENT, **options)


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """One quick run of everything, from a folder that is not the project's."""
    folder = tmp_path_factory.mktemp("anywhere")
    return compare("all", "--quick", cwd=folder), folder


def test_all_passes_and_says_so_at_a_glance(ran):
    run, _ = ran
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""  # in a pipe: no progress
    lines = run.stdout.splitlines()
    assert [line.split()[:2] for line in lines[: len(EXPERIMENTS)]] == [[name, "ok"] for name in EXPERIMENTS]
    assert re.match(r"The two models agree: all \d+ checks pass\.", lines[-2])
    assert "reports/latest/index.html" in lines[-1]


def test_all_writes_the_files_that_are_promised_and_nothing_else(ran):
    _, folder = ran
    assert [p.name for p in folder.iterdir()] == ["reports"]
    report = folder / "reports" / "latest"
    assert {p.name for p in report.iterdir()} == {"report.md", "index.html", "results.json", "tables", "figures"}
    assert {p.stem for p in (report / "tables").iterdir()} >= {
        *EXPERIMENTS, "evaluations", "departure", "stability_growth", "reduction_subsets", "cost_in_mujoco",
    }  # fmt: skip
    assert all(p.suffix == ".png" and p.stat().st_size > 5000 for p in (report / "figures").iterdir())


def test_results_have_the_promised_fields(ran):
    _, folder = ran
    results = json.loads((folder / "reports/latest/results.json").read_text())
    assert set(results) == {"passed", "checks", "provenance"}
    assert results["passed"] is True
    fields = {"experiment", "scene", "quantity", "value", "tolerance", "unit", "passed", "note"}
    assert all(set(check) == fields for check in results["checks"])
    assert {check["experiment"] for check in results["checks"]} == set(EXPERIMENTS)
    assert results["provenance"]["command"] == "python -m compare all --quick"
    assert {"mujoco", "numpy", "python", "cpu", "seed", "commit"} <= set(results["provenance"])


def test_tables_are_tidy(ran):
    _, folder = ran
    for path in (folder / "reports/latest/tables").iterdir():
        table = pd.read_csv(path)
        assert len(table) > 0
        assert all(re.fullmatch(r"[a-z0-9_]+", str(c)) or str(c).endswith("_J") for c in table.columns), path.name
        assert "nan" not in path.read_text().lower()
    columns = set(pd.read_csv(folder / "reports/latest/tables/trajectory.csv").columns)
    assert {
        "scene", "engine_integrator", "twin", "dt_s", "level", "worst_difference", "band", "judged_until_s", "diverged_at_s",
    } <= columns  # fmt: skip
    promised = {
        "stability": "scene engine method damping mode_per_s predicted_dt_s observed_dt_s limit criterion",
        "departure": "scene engine method dt_s perturbation_rad predicted_s observed_s",
    }
    for name, columns in promised.items():
        assert " ".join(pd.read_csv(folder / f"reports/latest/tables/{name}.csv").columns) == columns


def test_page_is_one_file_and_markdown_finds_its_figures(ran):
    _, folder = ran
    report = folder / "reports" / "latest"
    page = (report / "index.html").read_text()
    assert not re.search(r'(src|href)="(?!data:|#)', page)
    assert page.count("data:image/png;base64,") == len(list((report / "figures").iterdir()))
    text = (report / "report.md").read_text()
    linked = set(re.findall(r"\((figures/[^)]+|tables/[^)]+)\)", text))
    assert linked == {str(p.relative_to(report)) for p in report.glob("*/*")}
    for part in "abcdefghi":
        assert f"\n| {part} |" in text
    assert "not run" not in text and "nan" not in text.lower().split()


def test_another_arm_fails_and_is_named(tmp_path):
    model = tmp_path / "heavy.xml"
    model.write_text(ARM_XML.read_text().replace('mass="1.5"', 'mass="1.6"'))
    run = compare("mass", "--quick", "--mjcf", model, "--out", "report", cwd=tmp_path)
    assert run.returncode == 1
    assert re.search(r"mass: Mbar, zero: 0\.0\d+ kg m2, must be at most \d\.\d+e-15 kg m2", run.stdout)
    assert "do not agree" in run.stdout and run.stderr == ""
    results = json.loads((tmp_path / "report/results.json").read_text())
    assert results["passed"] is False
    assert "Checks that fail" in (tmp_path / "report/report.md").read_text()


@pytest.mark.parametrize(
    "arguments, says",
    [
        (["nothing"], "invalid choice: 'nothing' (choose from"),
        ([], "required: EXPERIMENT"),
        (["mass", "--fast"], "unrecognized arguments: --fast"),
        (["mass", "--mjcf", ""], "--mjcf: it is empty"),
        (["mass", "--out", ""], "--out: it is empty"),
        (["mass", "--mjcf", "missing.xml"], "cannot read missing.xml: No such file or directory"),
        (["mass", "--mjcf", str(ROOT / "pyproject.toml")], "is not MJCF"),
        (["mass", "--mjcf", str(ROOT)], "Is a directory"),
        (["mass", "--out", str(ROOT / "pyproject.toml")], "a folder that can be written is expected"),
    ],
)
def test_what_cannot_be_done_gets_one_line_and_status_2(arguments, says, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    try:
        status = main(arguments)
    except SystemExit as stop:
        status = stop.code
    out, err = capsys.readouterr()
    assert status == 2
    assert out == "" and len(err.splitlines()) == 1 and says in err
    assert list(tmp_path.iterdir()) == []


def test_other_hinges_get_status_2(tmp_path, capsys):
    model = tmp_path / "other.xml"
    model.write_text(ARM_XML.read_text().replace('name="gamma"', 'name="wrist"'))
    assert main(["mass", "--mjcf", str(model), "--out", str(tmp_path / "out")]) == 2
    assert "wrist (hinge); hinges alpha, beta, gamma and no others are expected" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="permissions bind only who is not root")
def test_a_read_only_folder_gets_status_2(tmp_path, capsys):
    tmp_path.chmod(0o500)
    assert main(["mass", "--out", str(tmp_path / "out")]) == 2
    assert "Permission denied" in capsys.readouterr().err


def test_help_has_examples(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    text = capsys.readouterr().out
    assert "python -m compare all --quick" in text and all(name in text for name in EXPERIMENTS)


def started(cwd, *arguments):
    """A run in a process group of its own, as a terminal's."""
    command = [sys.executable, "-m", "compare", *arguments, "--quick"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}

    def hearing():  # a shell starts what runs in its background deaf to Ctrl-C
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    return subprocess.Popen(command, cwd=cwd, env=ENVIRONMENT, start_new_session=True, preexec_fn=hearing, **pipes)


@pytest.mark.parametrize(
    "number, moment",
    [(signal.SIGINT, 0.7), (signal.SIGINT, 1.2), (signal.SIGINT, "a line"), (signal.SIGTERM, "a line")],
)
def test_ctrl_c_leaves_the_old_report_whole(ran, number, moment):
    _, folder = ran
    report = folder / "reports" / "latest"
    before = {p: p.read_bytes() for p in report.rglob("*") if p.is_file()}
    run = started(folder, "all")
    if moment == "a line":
        run.stdout.readline()
    else:
        time.sleep(moment)
    os.killpg(run.pid, number)
    _, err = run.communicate(timeout=60)
    assert run.returncode == 2
    assert err.splitlines() == ["interrupted; a report that was there is unchanged"]
    assert {p: p.read_bytes() for p in report.rglob("*") if p.is_file()} == before
    assert {p.name for p in report.iterdir()} == {"report.md", "index.html", "results.json", "tables", "figures"}


def test_a_reader_who_leaves_early_stops_nothing(tmp_path):
    run = started(tmp_path, "mass", "--out", "report")
    assert run.stdout.readline().startswith("mass")
    run.stdout.close()
    err = run.stderr.read()
    assert run.wait(timeout=60) == 0
    assert err == ""
    assert (tmp_path / "report" / "results.json").exists()
