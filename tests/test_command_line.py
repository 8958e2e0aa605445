"""python -m compare from end to end: files, exit status, error lines."""

import json
import os
import re
import tomllib

import pandas as pd
import pytest
from runs import ROOT, readable_lines, words
from small_runs import quick_run

from compare import experiment
from compare.__main__ import main
from compare.experiments import EXPERIMENTS
from compare.robots.arm import ARM

RAN = [name for name in EXPERIMENTS if name != "diagnosis"]  # where nothing fails


@pytest.fixture(scope="module")
def ran(beside):
    """One quick run of everything, and its folder."""
    folder = beside.folder / "anywhere"
    return beside.result(quick_run, folder), folder


def test_all_passes_and_says_so_at_a_glance(ran):
    run, _ = ran
    assert run.status == 0, run.output
    first, *lines = readable_lines(run)
    assert first == "reference: arm; mjcf/arm.xml compared with the stated numbers"
    # there is nothing to diagnose
    order = sorted(EXPERIMENTS, key=experiment.TIMED_LAST.__contains__)
    expected = [[name, "skipped:" if name == "diagnosis" else "ok"] for name in order]
    assert [line.split()[:2] for line in lines[: len(EXPERIMENTS)]] == expected
    text = words(lines[len(EXPERIMENTS) :])
    assert re.match(r"The two models agree: all \d+ checks pass\..*Report: reports/latest/index\.html \(", text)


def test_a_terminal_shows_how_far_and_how_long_still(ran):
    run, _ = ran
    shown = re.findall(
        r"(\d+) of 11, (\w+), about \d+ (?:s|min) left", re.sub(r"\x1b\[[\d;?]*[a-zA-Z]", "", run.output)
    )
    numbers = [int(number) for number, _ in shown]
    assert len(set(numbers)) > 3 and numbers == sorted(numbers) and {name for _, name in shown} <= set(RAN)
    assert len(set(shown)) == len(set(numbers))


def test_all_writes_the_files_that_are_promised_and_nothing_else(ran):
    _, folder = ran
    assert [p.name for p in folder.iterdir()] == ["reports"]
    report = folder / "reports" / "latest"
    assert {p.name for p in report.iterdir()} == {"report.md", "index.html", "results.json", "tables", "figures"}
    assert {p.stem for p in (report / "tables").iterdir()} >= {
        *RAN, "evaluations", "departure", "stability_growth", "reduction_subsets", "cost_in_mujoco",
    }  # fmt: skip
    assert all(p.suffix in (".png", ".gif") and p.stat().st_size > 5000 for p in (report / "figures").iterdir())


def test_results_have_the_promised_fields(ran):
    _, folder = ran
    results = json.loads((folder / "reports/latest/results.json").read_text())
    assert set(results) == {"passed", "reference", "checks", "causes", "skipped", "provenance"}
    assert results["reference"] == {"kind": "arm", "name": "arm"}
    assert (results["passed"], results["causes"]) == (True, [])
    assert results["skipped"] == [{"experiment": "diagnosis", "reason": "nothing failed"}]
    fields = {"experiment", "scene", "quantity", "rule", "value", "tolerance", "unit", "passed", "note"}
    assert all(set(check) == fields for check in results["checks"])
    assert {check["experiment"] for check in results["checks"]} == set(RAN)
    assert results["provenance"]["command"] == "python -m compare all --quick"
    origin = results["provenance"]
    assert {"mujoco", "numpy", "python", "cpu", "seed", "commit"} <= set(origin)
    assert origin["arm-tmt-mujoco"] == tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert set(origin["seconds_of"]) == {*RAN, "figures"} and min(origin["seconds_of"].values()) > 0.0
    ended = origin["ended_after_s"]
    assert set(ended) == {"start", *EXPERIMENTS, "figures"} and list(ended.values()) == sorted(ended.values())
    assert next(iter(ended)) == "start" and max(ended, key=ended.get) == "figures"
    assert ended["figures"] < origin["seconds"]


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
    linked = set(re.findall(r'(?:src|href)="(?!data:|#)([^"]+)"', page))
    assert linked == {str(path.relative_to(report)) for path in (report / "tables").iterdir()}
    figures = list((report / "figures").iterdir())
    assert {path.suffix for path in figures} == {".png"} and 'id="motion"' in page
    assert len(re.findall("data:image/(?:png|webp);base64,", page)) == len(figures)
    text = (report / "report.md").read_text()
    linked = set(re.findall(r"\((figures/[^)]+|tables/[^)]+)\)", text))
    assert linked == {str(p.relative_to(report)) for p in report.glob("*/*")}
    for part in "abcdefghi":
        assert f"\n| {part} |" in text
    assert "not run" not in text and "nan" not in text.lower().split()


@pytest.mark.parametrize(
    "arguments, says",
    [
        (["nothing"], "'nothing' is no experiment; one of parameters, published, "),
        (["mass", "--fast"], "'--fast' is no option; one of --out --quick "),
        (["mass", "--mjcf", ""], "--mjcf: it is empty"),
        (["mass", "--reference", "robot"], "argument --reference: 'robot' is no reference; one of arm, model, "),
        (["mass", "--out", ""], "--out: it is empty"),
        (
            ["mass", "--scenes", "my.toml"],
            "--scenes is for trajectory, speed, reduction and all; mass follows no scene",
        ),
        (
            ["mass", "--dask", "tcp://x:1"],
            "--dask is for diagnosis without --mjcf and --reference,",
        ),
        (["all", "--workers", "2"], "--workers is for diagnosis without --mjcf"),
        (["speed", "--dask", "tcp://x:1"], "--dask is for diagnosis"),
        (
            ["diagnosis", "--mjcf", "a.xml", "--dask", "tcp://x:1"],
            "--dask is for diagnosis without --mjcf",
        ),
        (
            ["diagnosis", "--reference", "model", "--workers", "2"],
            "for diagnosis without --mjcf and --reference, and for fleet",
        ),
        (
            ["diagnosis", "--workers", "2", "--dask", "tcp://x:1"],
            "--workers is for processes on this machine; a cluster",
        ),
        (["diagnosis", "--workers", "0"], "--workers: '0' is no number of processes; 1 or more are expected"),
        (["diagnosis", "--dask", "nowhere"], "no scheduler answers at nowhere: "),
        (["speed", "--scenes", ""], "--scenes: it is empty"),
        (["speed", "--scenes", "my.toml"], "cannot read my.toml: No such file or directory"),
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


def test_a_hinge_of_another_name_is_matched_and_one_of_another_axis_gets_status_2_where_the_arm_is_asked_for(
    tmp_path, capsys
):
    model, out = tmp_path / "other.xml", tmp_path / "out"
    named = ARM.mjcf.read_text().replace('name="gamma"', 'name="wrist"')
    missing = named.replace('type="hinge"', 'type="slide"')
    for text, status in ((missing, 2), (named, 0)):
        model.write_text(text)
        assert not out.exists()
        assert main(["mass", "--quick", "--reference", "arm", "--mjcf", str(model), "--out", str(out)]) == status
        printed = capsys.readouterr()
        assert "wrist" in (printed.err if status else printed.out)


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="permissions bind only who is not root")
def test_a_read_only_folder_gets_status_2(tmp_path, capsys):
    tmp_path.chmod(0o500)
    assert main(["mass", "--out", str(tmp_path / "out")]) == 2
    assert "Permission denied" in capsys.readouterr().err


def test_every_cause_is_in_the_results(tmp_path, capsys):
    model = tmp_path / "two.xml"
    model.write_text(ARM.mjcf.read_text().replace('mass="1.5"', 'mass="1.6"').replace("-9.81", "-9.8"))
    assert main(["gravity", "--quick", "--mjcf", str(model), "--out", str(tmp_path / "out")]) == 1
    results = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert [cause["place"] for cause in results["causes"]] == ["mass of forearm", "gravity z"]
    assert "  CAUSE gravity z: stated -9.81 m/s2, compiled -9.8 m/s2" in capsys.readouterr().out


def test_a_full_run_takes_more_states_and_a_report_says_whose_place_it_takes(tmp_path, capsys):
    for quick, states, said in (
        (["--quick"], 1000, ""),
        ([], 10_000, " in place of that of `python -m compare gravity"),
    ):
        assert main(["gravity", *quick, "--out", str(tmp_path)]) == 0
        assert pd.read_csv(tmp_path / "tables" / "gravity.csv")["states"].max() == states
        assert f"index.html{said}" in " ".join(capsys.readouterr().out.split())
