"""A fleet is run in the process of the test: rows, reports, what is computed again, and what becomes of files that break."""

import os
from concurrent.futures import Future
from contextlib import chdir
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import pytest

from compare.core.errors import Refused, described
from compare.fleet import cache as module
from compare.fleet.cache import locked, write_whole
from compare.fleet.command import solution_of
from compare.fleet.executors import Outcome
from compare.fleet.models import found_models, place_of_report
from compare.fleet.run import Run
from compare.fleet.table import AGREE, BROKE, DIFFER, ITSELF, REFUSED, FileRow
from compare.fleet.task import FleetOptions

PENDULUM = ("<mujoco><worldbody><body name='b'><joint name='j' axis='0 1 0'/><inertial pos='0 0 {}' mass='1' "
            "diaginertia='1 1 1'/></body></worldbody></mujoco>")  # fmt: skip
ONE, TWO = {"a.xml": PENDULUM.format(0.1)}, {"a.xml": PENDULUM.format(0.1), "b.xml": PENDULUM.format(0.2)}


class Inside:
    """An executor in this process, whose calls are made as their outcome is asked for. answer: in place of the call."""

    workers = 2

    def __init__(self, folder, answer=None):
        self.folder, self.answer, self.calls, self.under_way, self.most = folder, answer, [], 0, 0

    def submit(self, function, *arguments):
        self.calls.append(arguments[0])
        self.under_way += 1
        self.most = max(self.most, self.under_way)
        future = Future()
        future.set_result((function, arguments))
        return future

    def outcome(self, future):
        self.under_way -= 1
        function, arguments = future.result()
        if self.answer:
            return self.answer(*arguments)
        with TemporaryDirectory(dir=self.folder) as place, chdir(place):
            try:
                return Outcome(function(*arguments), "")
            except Exception as error:
                return Outcome(None, described(error))

    def check(self):
        """Always there."""


@pytest.fixture
def fleet(tmp_path, monkeypatch):
    """fleet(files, names of experiments): a fleet of files in a folder, run to its end."""
    monkeypatch.chdir(tmp_path)
    for name in ("out", "places"):
        (tmp_path / name).mkdir()

    def run(files, names=("mass",), answer=None, paths=("m",), is_quick=True, reference=None):
        for name, text in files.items():
            (tmp_path / "m" / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / "m" / name).write_text(text)
        solution = solution_of(reference)
        options = FleetOptions(tuple(names), is_quick, reference, solution and str(solution.path.resolve()))
        executor = Inside(tmp_path / "places", answer)
        of = Run(found_models(paths)[0], options, executor, tmp_path / "out", solution)
        rows = {os.path.basename(row.file): row for row in of.carried_out()}
        verdicts = {name: row.verdict for name, row in rows.items()}
        return SimpleNamespace(of=of, executor=executor, rows=rows, verdicts=verdicts)

    return run


def report(tmp_path, name):
    return tmp_path / "out" / place_of_report(f"m/{name}")


def test_files_agree_or_are_refused_with_the_reason(fleet, tmp_path):
    found = fleet({
        "good.xml": PENDULUM.format(0.1), "broken.xml": "<mujoco><worldbody>", "none.xml": "<mujoco/>", "words.xml": "no model",
        "page.xml": "<!DOCTYPE html>\n<html><p>Sign in<br></html>",
    }, ["parameters"])  # fmt: skip
    refused = dict.fromkeys(["broken.xml", "none.xml", "page.xml", "words.xml"], REFUSED)
    assert found.verdicts == {"good.xml": ITSELF, **refused} and "<html>" in found.rows["page.xml"].reason
    assert "joint" in found.rows["none.xml"].reason and len(found.rows["broken.xml"].sha256) == 64
    assert found.rows["good.xml"].joints == 1 and found.rows["good.xml"].seconds > 0.0 and found.of.is_good
    assert (report(tmp_path, "good.xml") / "index.html").is_file() and not found.rows["none.xml"].has_report
    assert fleet(ONE, ["published"]).rows["a.xml"].verdict == REFUSED  # which serves the arm alone


def agrees(shown, path, place, options):
    os.makedirs(place, exist_ok=True)
    Path(place, "index.html").write_text("all")
    return Outcome(FileRow(file=shown, verdict=AGREE, seconds=1.0, has_report=True), "")


def edit(path):
    path.write_text("edited")


def test_what_has_changed_is_computed_anew_and_nothing_else(fleet, tmp_path):
    first, second = fleet(TWO, answer=agrees), fleet(TWO, answer=agrees)
    assert len(first.executor.calls) == 2 and second.executor.calls == [] and second.rows == first.rows
    third = fleet({"b.xml": PENDULUM.format(0.3), "b/a.xml": PENDULUM.format(0.4)}, answer=agrees)
    assert set(third.executor.calls) == {"m/b.xml", "m/b/a.xml"}
    for name, act in (
        (".fleet", Path.unlink),
        ("index.html", Path.unlink),
        ("index.html", edit),
        (".fleet", edit),
    ):
        act(report(tmp_path, "b.xml") / name)  # a saved result that is gone or edited is made anew
        assert fleet({}, answer=agrees).executor.calls == ["m/b.xml"], name
    for more in ({"is_quick": False}, {"names": ("gravity",)}):
        assert fleet({}, answer=agrees, paths=["m/a.xml"], **more).executor.calls == ["m/a.xml"]
    for place, computed in ((0.1, 1), (0.1, 0), (0.2, 1)):
        (tmp_path / "solution.xml").write_text(PENDULUM.format(place))
        found = fleet({}, answer=agrees, paths=["m/a.xml"], reference="solution.xml")
        assert len(found.executor.calls) == computed


def test_a_copy_has_the_row_of_the_first_file_and_is_not_computed(fleet):
    whole, of_parts = PENDULUM.format(0.1), "<mujoco><include file='part.xml'/></mujoco>"
    same = {"a.xml": whole, "b.xml": whole, "c.mjcf": whole}  # MuJoCo reads a file by the end of its name
    parts = {f"{name}/part.xml": PENDULUM.format(0.2 if name == "z" else 0.1) for name in "xyz"}
    first = fleet(same | parts | {f"{name}/whole.xml": of_parts for name in "xyz"}, answer=agrees)
    assert first.executor.calls == ["m/a.xml", "m/c.mjcf", "m/x/whole.xml", "m/z/whole.xml"]
    copies = {row.file: row.same_as for row in first.of.rows if row.same_as}
    assert copies == {"m/b.xml": "m/a.xml", "m/y/whole.xml": "m/x/whole.xml"} and len(first.of.rows) == 6
    assert (first.rows["a.xml"].seconds, first.rows["b.xml"].seconds) == (1.0, 0.0)
    assert "m/a.xml" in first.rows["b.xml"].reason and first.rows["b.xml"].verdict == AGREE
    assert fleet({}, answer=agrees).rows["b.xml"] == first.rows["b.xml"]


def test_a_file_that_breaks_off_keeps_its_earlier_report_and_is_tried_again(fleet, tmp_path):
    fleet(ONE, answer=agrees)
    found = fleet({"a.xml": PENDULUM.format(0.2)}, answer=lambda *_: Outcome(None, "killed by SIGKILL"))
    row = found.rows["a.xml"]
    assert row.verdict == BROKE and "SIGKILL" in row.reason and not row.has_report and not found.of.is_good
    assert (report(tmp_path, "a.xml") / "index.html").read_bytes() == b"all"
    assert fleet({}, answer=agrees).executor.calls == ["m/a.xml"]


def test_all_files_are_compared_with_a_solution_and_joints_of_other_names_are_matched(fleet, tmp_path):
    right = PENDULUM.format(0.1)
    (tmp_path / "solution.xml").write_text(right)
    files = {"heavy.xml": right.replace("mass='1'", "mass='2'")}
    files |= {"renamed.xml": right.replace("name='j' ", "")}
    files |= {"slide.xml": right.replace("axis", "type='slide' axis"), "right.xml": right}
    mesh = "<asset><mesh name='g' file='gone.stl'/></asset><worldbody><geom type='mesh' mesh='g'/>"
    files |= {"mesh.xml": right.replace("<worldbody>", mesh)}
    found = fleet(files, ["parameters"], reference="solution.xml")
    named = {
        "heavy.xml": (DIFFER, "mass of b: 2 kg in heavy.xml, 1 kg in solution.xml"),
        "renamed.xml": (AGREE, "joint 0 as j"), "slide.xml": (DIFFER, "solution.xml"), "right.xml": (AGREE, ""),
        "mesh.xml": (AGREE, "gone.stl"),
    }  # fmt: skip
    assert found.verdicts == {name: verdict for name, (verdict, _) in named.items()}
    assert all(word in found.rows[name].reason for name, (_, word) in named.items())
    assert [name for name, row in found.rows.items() if not row.has_report] == ["slide.xml"]
    text = (report(tmp_path, "renamed.xml") / "report.md").read_text()
    assert "--only parameters --reference solution.xml" in text


def test_a_folder_is_for_one_fleet_at_a_time_and_what_cannot_be_written_is_said(tmp_path):
    with locked(tmp_path / "out"), pytest.raises(Refused, match="another"), locked(tmp_path / "out"):
        pass
    for text in "12":
        write_whole(tmp_path / "out" / "a", text)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"a", "files"}
    with pytest.raises(Refused, match=f"{tmp_path / 'none' / 'a'}: "):
        write_whole(tmp_path / "none" / "a", "1")


def test_a_source_that_changes_or_moves_and_another_version_make_another_program(tmp_path, monkeypatch):
    sources = "compare/a.py", "compare/deep/page.html.jinja", "mjcf/arm.xml", "tmt/b.py"
    for path in (tmp_path / name for name in (*sources, "compare/a.pyc", "tests/test_a.py")):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    which = module.program.__wrapped__
    found = [which()]
    for path in (tmp_path / name for name in sources):
        path.write_text("2")
        found.append(which())
        path.rename(path.with_stem("other"))
        found.append(which())
    monkeypatch.setattr(module, "installed", lambda name: str(name == "mujoco"))
    found.append(which())
    assert len(set(found)) == len(found)
    (tmp_path / "compare" / "a.pyc").unlink()
    (tmp_path / "tests" / "test_a.py").write_text("2")
    assert which() == found[-1]
