"""python -m compare from end to end: files, exit status, first lines; bad requests get one line and status 2."""

import hashlib
import json
import re
from argparse import ArgumentTypeError

import pandas as pd
import pytest
from helpers.in_process import answered, without_workers
from helpers.runs import ROOT, on_terminal, readable_lines, words
from models import PATHS

from compare.__main__ import main
from compare.cli import command_line
from compare.core import options
from compare.experiments import EXPERIMENTS, TIMED
from compare.experiments.options import stated_reference
from compare.report.folder import OWN
from compare.robots.arm import ARM
from compare.run import command
from compare.run import examine as experiment

XML = ARM.mjcf.read_text(encoding="utf-8")
STATIC = ("parameters", "published", "kinematics", "diagnosis")  # which take little time
FIELDS = {"experiment", "scene", "quantity", "rule", "value", "tolerance", "unit", "judged", "passed", "note"}


def results_in(folder):
    return json.loads((folder / "results.json").read_text(encoding="utf-8"))


def quick_run(folder):
    folder.mkdir()
    return on_terminal(["all", "--quick"], 80, "xterm", folder)


@pytest.fixture(scope="module")
def of_the_terminal(shared, common):
    """A quick run of everything on a terminal, in a folder that is not the project's, and that."""
    folder = common / "anywhere"
    return shared(quick_run, folder), folder


@pytest.fixture(scope="module", params=["static", pytest.param("all", marks=pytest.mark.slow)])
def report(request, tmp_path_factory):
    """The folder of a report and its experiments: of those that take little time, in this process; of all, as a user runs it."""
    if request.param == "all":
        _, folder = request.getfixturevalue("of_the_terminal")
        return folder / "reports" / "latest", list(EXPERIMENTS)
    folder = tmp_path_factory.mktemp("static")
    with without_workers(), pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for module in (command, command_line, experiment):
            patch.setattr(module, "EXPERIMENTS", {name: EXPERIMENTS[name] for name in STATIC})
        assert main(["all", "--quick"]) == 0
    assert [path.name for path in folder.iterdir()] == ["reports"]
    return folder / "reports" / "latest", list(STATIC)


@pytest.mark.slow
def test_a_quick_run_of_all_passes_with_a_line_for_each_experiment(of_the_terminal):
    run, _ = of_the_terminal
    assert run.status == 0, run.output
    lines = readable_lines(run)
    # there is nothing to diagnose, and a quick run has no other engines, whether they are installed or not
    # the answers of stability come before the long runs of trajectory
    late, others = ("trajectory", *TIMED), set(EXPERIMENTS) - {"engines", "diagnosis"}
    order = sorted([name for name in EXPERIMENTS if name in others], key=late.__contains__)
    beginnings = [line.split()[:2] for line in lines if line.strip()]
    assert [line for line in beginnings if line[1:] == ["ok"]] == [[name, "ok"] for name in order]
    last = words(lines[len(order) :])
    assert "arm.xml and the arm's stated numbers agree: all" in last
    assert "Report: reports/latest/index.html (" in last and len(lines) <= len(order) + 6


def test_a_report_has_its_files_and_no_others_and_its_links_lead_to_them(report):
    folder, names = report
    assert {path.name for path in folder.iterdir()} == {*OWN}
    found = (folder.glob(of) for of in ("tables/*", "figures/*"))
    tables, figures = ({str(path.relative_to(folder)): path for path in paths} for paths in found)
    assert {path.stem for path in tables.values()} >= {*names} - {"diagnosis", "engines", "reduction"}
    for path in tables.values():  # tidy
        table = pd.read_csv(path)
        assert len(table) > 0 and "nan" not in path.read_text().lower()
        assert all(re.fullmatch(r"[a-z0-9_]+(_J)?", name) for name in table.columns), path.name
    assert all(path.suffix in (".png", ".gif") and path.stat().st_size > 5000 for path in figures.values())
    page, text = ((folder / name).read_text(encoding="utf-8") for name in ("index.html", "report.md"))
    links = {link.partition("#")[0] for link in re.findall(r'(?:src|href)="(?!data:|#)([^"]+)"', page)}
    assert links == {*tables, "tolerances.html", "results.json", "reproduce.py"}
    assert len(re.findall("data:image/(?:png|gif);base64,", page)) == len(figures)
    assert set(re.findall(r'[("](figures/[^)"]+|tables/[^)]+)[)"]', text)) == {*tables, *figures}
    assert "nan" not in text.lower().split()


def test_results_have_their_fields(report):
    folder, names = report
    ran, results = {*names} - {"diagnosis", "engines"}, results_in(folder)  # a quick run, where nothing fails
    assert set(results) == {"passed", "reference", "checks", "causes", "skipped", "provenance"}
    assert results["reference"] == {"kind": "arm", "name": "arm"}
    assert results["passed"] and results["causes"] == []
    assert {skip["experiment"] for skip in results["skipped"]} == {"diagnosis", "engines"} & {*names}
    assert all(set(check) == FIELDS for check in results["checks"])
    assert {check["experiment"] for check in results["checks"]} == ran
    origin = results["provenance"]
    assert origin["command"] == "python -m compare all --quick"
    assert origin["model_sha256"] == hashlib.sha256(ARM.mjcf.read_bytes()).hexdigest()
    assert {"mujoco", "numpy", "python", "cpu", "seed", "commit", "arm-tmt-mujoco"} <= set(origin)
    assert set(origin["seconds_of"]) == {*ran, "figures"} and min(origin["seconds_of"].values()) > 0.0
    ended = origin["ended_after_s"]
    assert set(ended) | {"engines"} == {"start", *names, "figures", "engines"}
    assert list(ended.values()) == sorted(ended.values())


def test_a_wrong_file_differs_from_the_stated_numbers_and_not_from_its_own(inside, tmp_path, capsys):
    path, out = tmp_path / "two.xml", tmp_path / "out"
    path.write_text(XML.replace('mass="1.5"', 'mass="1.6"').replace("-9.81", "-9.8"))
    of_model = ["--reference", "model"], 0, "model", str(path)
    for asked, status, kind, name in (([], 1, "arm", "arm"), of_model):
        assert main(["parameters", "--quick", "--mjcf", str(path), *asked, "--out", str(out)]) == status
        empty, first, *lines = capsys.readouterr().out.splitlines()
        other = "the arm's stated numbers" if kind == "arm" else "tmt's equations for it"
        assert not empty and first.startswith(
            f"two.xml and {other} {'differ' if status else 'agree'} in parameters"
        )
        results = results_in(out)
        assert results["reference"] == {"kind": kind, "name": name}
        assert [cause["place"] for cause in results["causes"]] == ["mass of forearm", "gravity z"] * status
        title, _, line = (out / "report.md").read_text(encoding="utf-8").splitlines()[:3]
        assert title.startswith("# ") and line.startswith(f'<p class="reference">reference: {kind}; ')
        assert (out / "tables" / "inventory.csv").exists() == bool(asked)
        assert ("mass (forearm)" in lines[-2]) == bool(status)  # the answer, after the verdict
        said = [line for line in lines if line.startswith("  CAUSE gravity z")]
        assert len(said) == status and all("-9.8 m/s2 in two.xml, -9.81" in line for line in said)


def test_the_answer_as_json_is_all_that_is_printed_and_the_page_is_opened(
    inside, tmp_path, capsys, monkeypatch
):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    path, out = tmp_path / "two.xml", tmp_path / "out"
    path.write_text(XML.replace('mass="1.5"', 'mass="1.6"'))
    for more, status in (["--json"], 1), (["--json", "--open", "--reference", "model"], 0):
        assert main(["parameters", "--quick", "--mjcf", str(path), "--out", str(out), *more]) == status
        answer, results = json.loads(capsys.readouterr().out), results_in(out)
        assert answer["passed"] == results["passed"] == (not status) and answer["causes"] == results["causes"]
        assert ("mass (forearm)" in answer["answer"][0]) == bool(status)
    assert opened == [(out / "index.html").as_uri()] and answer["report"] == str(out / "index.html")


SERVO = """<mujoco model="tail"><option timestep="0.002"/><worldbody><body><joint name="swing" axis="0 1 0" damping="0.01"/>
  <geom type="sphere" size="0.1" pos="0 0 -0.5" mass="2"/></body></worldbody>
  <actuator><position joint="swing" kp="50" kv="800"/></actuator></mujoco>"""


def test_a_robot_that_is_not_stable_at_its_own_step_agrees_and_fails(inside, tmp_path, capsys):
    path, out = tmp_path / "tail.xml", tmp_path / "out"
    path.write_text(SERVO)
    words = ["stability", "--quick", "--mjcf", str(path), "--out", str(out)]
    assert main(words) == 1
    lines = capsys.readouterr().out.splitlines()
    empty, first, *_, last = lines
    assert not empty and first.startswith('Not stable: 2 ms with Euler, from "qpos0"')
    assert last.startswith("Report: ") and len(lines) <= 13
    report = (out / "report.md").read_text(encoding="utf-8")
    assert 0 < report.index("Not stable") < report.index("0 of 1 check")
    results = results_in(out)
    assert not results["passed"] and results["causes"] == []
    failed = [(check["quantity"], check["scene"]) for check in results["checks"] if not check["passed"]]
    assert failed == [("stable at its own step", "qpos0")]
    assert main([*words, "--dt", "0.001", "--integrator", "Euler"]) == 0  # another step is asked for
    assert "Stable: 1 ms with Euler" in capsys.readouterr().out


ARM7, MIXED = (str(PATHS[name]) for name in ("arm7", "mixed"))
WRONG = {
    "mas --version": "did you mean mass?", "help": "did you mean --help?", "xyz": f"{', '.join(EXPERIMENTS)} or all",
    "mass -quick": "did you mean --quick?", "mass --xyz": "--reference --joints", "mass gravity": "'gravity'",
    "--mjcf robot.xml": "all --mjcf robot.xml", "mass --reference modle": "did you mean model?",
    "--quick fleet x": "fleet must come first", "mass --reference my.py": "no such file",
    "engines --engines dark": "--engines: dark is not an engine", "speed --engines drake,": "one or more of drake,",
    "mass --reference cut.xml:foo": "takes no name after a colon; expected cut.xml",
    f"stability --mjcf {ARM7} --controls no.csv": "no.csv: No such file or directory\n",
    "mass --mjcf arm.xml --mjcf=other.xml": "--mjcf is stated twice",
    "mass --out": "--out: expected one argument", "mass --mjcf=": "--mjcf: the name is empty",
    "stability --dt nan": "'nan'", "stability --dt=-0.5": "'-0.5'", "MASS": "did you mean mass?",
    "stability --dt 5.1": "'5.1'", "stability --dt 9e-7": "'9e-7'", "mass --scenes my.toml": "mass",
    "mass --dask tcp://x:1": "--dask", "diagnosis": "--mjcf", "diagnosis --mjcf arm.xml --workers 2": "--workers",
    "stability --integrator Euler": "--integrator", "mass --joints hip,knee --reference model": "--joints",
    "speed --scenes my.toml": "my.toml", "all --push 1": "--push is an option of stability",
    "--version=1": "expected an experiment", "mass --mjcf missing.xml": "missing.xml", f"mass --mjcf {ROOT}": "directory",
    f"mass --out {ROOT / 'pyproject.toml'}": "pyproject.toml", f"mass --reference arm --mjcf {ARM7}": "joint4 (hinge)",
    f"published --mjcf {ARM7}": "arm7", "stability --dt 0.1": "arm",
    f"stability --integrator euler --mjcf {ARM7}": "expected one of Euler",
    "stability --posture zero --push 0.1": "--posture and --push need a robot's file",
    f"stability --posture reach --mjcf {ARM7}": "expected ready", f"stability --posture=-1,2 --mjcf {ARM7}": "or 7 numbers",
    f"stability --delay 0.01 --mjcf {ARM7}": "--control-period", f"stability --kp 5 --mjcf {ARM7}": "--control-period",
    f"stability --kp 0 --mjcf {ARM7}": "--control-period", "stability --kp=-1": "'-1'",
    "stability --control-period x": "'x'", "mass --push 1": "--push is an option of stability", "stability --push 0": "'0'",
    f"trajectory --mjcf {MIXED} --scenes wrong.toml": "17", "gravity --mjcf cut.xml": "cut.xml",
    "gravity --mjcf empty.xml": "empty", "gravity --mjcf mesh.xml": "none.stl", "all --mjcf still.xml": "joint",
    "gravity --mjcf light.xml": "mass", "gravity --mjcf heavy.xml": "inf kg",
}  # fmt: skip
BODY = '<mujoco><worldbody><body name="a"><joint name="j" axis="0 1 0"/>{}</body></worldbody></mujoco>'
MESH = '<asset><mesh name="m" file="none.stl"/></asset>'
FILES = {
    "cut.xml": "<mujoco><worldbody>", "empty.xml": "", "light.xml": BODY.format(""),
    "mesh.xml": BODY.format('<geom type="mesh" mesh="m"/>').replace("<worldbody>", f"{MESH}<worldbody>"),
    "still.xml": '<mujoco><worldbody><body><geom size="1"/></body></worldbody></mujoco>',
    "heavy.xml": BODY.format('<inertial pos="0 0 0" mass="inf" diaginertia="1 1 1"/>'),
    "wrong.toml": '[[scene]]\nname = "mine"\nq = [1.0]',
}  # fmt: skip


@pytest.mark.parametrize("arguments", WRONG)
def test_a_bad_request_gets_one_line_and_status_2(arguments, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    status, out, err = answered(arguments.split(), capsys)
    assert (status, out, len(err.splitlines())) == (2, "", 1) and WRONG[arguments] in err, err
    assert err.startswith("python -m compare: ")
    assert {path.name for path in tmp_path.iterdir()} == FILES.keys()


def test_values_at_the_edge_are_accepted_and_those_beyond_are_not():
    command, asked = command_line.request(["mass", "--reference", "a.py:b", "--joints", "-knee,hip"])
    assert (command, asked.joints) == ("mass", "-knee,hip") and stated_reference("A.XML") == "A.XML"
    assert [options.process_count(text) for text in ("1", "1024")] == [1, 1024]
    for text in ("0", "1025", "-1", "two"):
        with pytest.raises(ArgumentTypeError):
            options.process_count(text)
