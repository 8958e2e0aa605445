"""What breaks inside a run is a failed check, and the rest goes on; what is timed comes last; what was computed is kept."""

import json
import os
import re
import sys
from concurrent.futures import Future
from functools import partial
from types import SimpleNamespace

import pandas as pd
import pytest
from matplotlib.figure import Figure
from sections import GOOD, section

from compare import __main__ as entry
from compare import command_line, drawing, experiment
from compare.__main__ import main
from compare.judge.check import Result
from compare.process.workers import WorkerEnded
from compare.report import images
from compare.report.terminal import Terminal
from compare.robots.arm import ARM

# what breaks inside is a failed check, and the rest goes on


def broken(at):
    """An experiment that breaks there."""

    def breaks(name):
        if at == name:
            raise ValueError("two\nlines")

    def rows(setup):
        breaks("rows")
        for value in setup.map(divmod, [1], [0 if at == "background" else 1]):
            assert value == (1, 0)
        return Result(at, shown=[], curves={"locked": lambda: None})  # which cannot be sent to where it is drawn

    return SimpleNamespace(**asked(at), begin=lambda setup: breaks("begin"), rows=rows)


def asked(name):
    """What every experiment says of itself."""
    return {"TITLE": name, "claim": lambda robot: "None.", "tolerance": lambda robot: "None."}


def only(monkeypatch, *names):
    """These are all experiments that there are."""
    for module in (entry, command_line, experiment):
        monkeypatch.setattr(module, "EXPERIMENTS", dict.fromkeys(names, ""))


@pytest.mark.parametrize("size, said", [(1_900_000, ""), (2_600_000, "now 3 MB; to clear it, delete that folder.")])
def test_what_a_run_adds_to_the_cache_folder_is_said(size, said, tmp_path, capsys, monkeypatch):
    folder = tmp_path / "cache"
    folder.mkdir()
    (folder / "kernel_0.py").write_bytes(b"0" * 1_000_000)

    def rows(setup):
        (folder / "kernel_1.py").write_bytes(b"1" * (size - 1_000_000))
        return Result("grows")

    monkeypatch.setenv("TMT_CACHE", str(folder))
    monkeypatch.setitem(
        sys.modules,
        "compare.experiments.grows",
        SimpleNamespace(rows=rows, figures=lambda result, robot: (), **asked("grows")),
    )
    only(monkeypatch, "grows")
    main(["grows", "--quick", "--out", str(tmp_path / "out")])
    words = [line for line in capsys.readouterr().out.splitlines() if "Compiled code" in line]
    assert len(words) == bool(said) and all(line.endswith(said) and str(folder) in line for line in words)


def test_a_folder_at_home_is_said_with_a_tilde():
    home = entry.Path.home()
    assert entry.in_home(home / "a" / "b") == os.path.join("~", "a", "b") and entry.in_home(home.parent) == str(
        home.parent
    )


def test_an_experiment_that_raises_is_one_failed_check(tmp_path, capsys, monkeypatch):
    expected = {
        "begin": ("runs to its end", r"ValueError: two lines"),
        "rows": ("runs to its end", r"ValueError: two lines"),
        "background": ("runs to its end", r"ZeroDivisionError: integer (division or )?modulo by zero"),
        "sending": ("figure number 1 is drawn", r".*pickle.*"),
    }
    for name in expected:
        monkeypatch.setitem(sys.modules, f"compare.experiments.{name}", broken(name))
    only(monkeypatch, *expected, "published")
    monkeypatch.setattr(experiment, "find_causes", lambda setup: [])
    assert main(["all", "--quick", "--out", str(tmp_path / "out")]) == 1
    results = json.loads((tmp_path / "out/results.json").read_text())
    failed = [check for check in results["checks"] if not check["passed"]]
    assert [check["experiment"] for check in failed] == list(expected)
    out, err = capsys.readouterr()
    assert "published     ok" in out and err == ""
    page = (tmp_path / "out/report.md").read_text(encoding="utf-8")
    for check, (name, (quantity, note)) in zip(failed, expected.items()):
        found = [check[part] for part in ("scene", "quantity", "value", "tolerance", "unit", "rule")]
        assert found == ["", quantity, None, 0, "", "equal"]
        assert re.fullmatch(note + r"( \(compare/[\w/]+\.py:\d+\))?", check["note"])
        assert f"FAIL {name}: {quantity}" in out and f"## {name}" in page


def plot(result, name):
    return name, Figure(), "A caption."


def half(result, name):
    return name, SimpleNamespace(savefig=lambda path: path.write_bytes(b"a half") / 0), "A caption."


def late(result, robot):
    yield partial(plot, result, "first")
    yield partial(plot, result, "second")
    yield partial(plot, None)  # one argument too few
    yield partial(half, result, "third")
    yield partial(plot, result, "First")
    raise ValueError("no more")


class Here:
    """Draws in this process at once, and writes down when that is asked for."""

    def __init__(self, log):
        self.log = log

    def submit(self, function, /, name, *more):
        self.log.append(("figures", name, *more[4:]))
        future = Future()
        future.set_result(function(name, *more))
        return future


def test_what_is_timed_comes_last_and_is_drawn_when_nothing_is_timed_any_more(tmp_path, monkeypatch):
    names, log = ["mass", "speed", "stability", "reduction"], []

    def plot_other(result, name):
        return plot(result, name)

    def rows(name, setup):
        log.append(("rows", name))
        return Result(name)

    def figures(name, result, robot):
        yield partial(plot, result, f"{name}_first")
        yield partial(plot_other, result, f"{name}_other")
        yield partial(plot, result, f"{name}_second")

    for name in names:
        module = SimpleNamespace(**asked(name), rows=partial(rows, name), figures=partial(figures, name))
        monkeypatch.setitem(sys.modules, f"compare.experiments.{name}", module)
    setup = SimpleNamespace(engines={}, robot=ARM, progress=lambda text: None, faults=False, is_quick=False, alone=True)
    sections, causes, skipped = experiment.examine(names, setup, tmp_path, Terminal(), Here(log))
    assert log == [
        ("rows", "mass"), ("figures", "mass", None), ("rows", "stability"), ("figures", "stability", None), ("rows", "speed"),
        ("rows", "reduction"), *[("figures", name, part) for name in ("speed", "reduction") for part in drawing.HALVES],
    ]  # fmt: skip
    assert [section.name for section in sections] == names and (causes, skipped) == ([], {})  # as they are asked for
    for one in sections:
        assert sorted(file for file, _ in one.figures) == [f"{one.name}_{k}" for k in ("first", "other", "second")]
        assert not one.result.checks


def test_a_figure_that_raises_leaves_the_others_alone(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "compare.experiments.broken", SimpleNamespace(figures=late))
    drawn, failed = drawing.draw("broken", None, None, tmp_path)
    assert drawn == [
        (name, "A caption.") for name in ("first", "second", "First_")
    ]  # one file where capitals do not count
    assert [name for name, _ in failed] == ["plot", "half third", "number 6"]
    assert failed[0][1].startswith("TypeError: plot() missing") and failed[2][1].startswith("ValueError: no more")
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["First_.png", "first.png", "second.png"]
    images.clear_webp(tmp_path)
    assert {path.suffix for path in tmp_path.iterdir()} == {".png"}


def test_a_model_that_an_experiment_does_not_expect_gets_a_report(tmp_path, capsys):
    text = ARM.mjcf.read_text().replace("<flag contact", '<flag gravity="disable" contact')
    actuator = '<actuator><general joint="gamma" dyntype="integrator"/></actuator>'
    (tmp_path / "model.xml").write_text(text.replace("</mujoco>", f"{actuator}</mujoco>"))
    assert main(["stability", "--quick", "--mjcf", str(tmp_path / "model.xml"), "--out", str(tmp_path / "out")]) == 1
    results = json.loads((tmp_path / "out/results.json").read_text())
    assert not results["passed"] and "runs to its end" not in {check["quantity"] for check in results["checks"]}
    assert capsys.readouterr().err == ""


def test_a_report_of_which_a_part_breaks_is_kept_and_not_complete(tmp_path, capsys, monkeypatch):
    def rows(setup):
        result = Result("odd", shown=["a", "b"], rows=[{"a": 1.5}])
        result.check("zero", "a", 0.5, 1.0, "m")
        return result

    experiments = SimpleNamespace(rows=rows, figures=lambda result, robot: (), **asked("odd"))
    monkeypatch.setitem(sys.modules, "compare.experiments.odd", experiments)
    only(monkeypatch, "odd", "published")
    assert main(["all", "--quick", "--out", str(tmp_path / "out")]) == 1
    out, err = capsys.readouterr()
    assert "odd           ok" in out and "published     ok" in out
    for line, name in zip(err.splitlines(), ("report.md", "index.html"), strict=True):
        said = f"This report is not complete: odd in {name} could not be made, KeyError: "
        assert line.startswith(f"python -m compare: {said}") and "(compare/report/tables.py:" in line
        assert said in (tmp_path / "out" / name).read_text(encoding="utf-8").replace("&quot;", '"').replace("\\", "")
    assert pd.read_csv(tmp_path / "out/tables/odd.csv")["a"].tolist() == [1.5]
    results = json.loads((tmp_path / "out/results.json").read_text())
    assert not results["passed"] and results["checks"][0]["passed"]
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"report.md", "index.html", "figures"}


def test_an_experiment_that_cannot_say_what_it_asks_keeps_its_numbers(tmp_path, monkeypatch):
    def rows(setup):
        return Result("mute", rows=[{"a": 1.5}])

    experiments = SimpleNamespace(rows=rows, figures=lambda result, robot: (), **asked("mute"))
    experiments.claim = lambda robot: robot.wings
    monkeypatch.setitem(sys.modules, "compare.experiments.mute", experiments)
    only(monkeypatch, "mute")
    assert main(["mute", "--quick", "--out", str(tmp_path / "out")]) == 1
    assert pd.read_csv(tmp_path / "out/tables/mute.csv")["a"].tolist() == [1.5]
    check = json.loads((tmp_path / "out/results.json").read_text())["checks"][0]
    assert check["quantity"] == "runs to its end" and "wings" in check["note"]


def test_a_process_that_is_ended_from_outside_is_no_failed_check(tmp_path, capsys, monkeypatch):
    def killed(setup):
        return list(setup.map(os._exit, [3]))

    monkeypatch.setitem(sys.modules, "compare.experiments.broken", SimpleNamespace(rows=killed, **asked("broken")))
    only(monkeypatch, "broken")
    assert main(["broken", "--quick", "--out", str(tmp_path / "out")]) == 2
    assert "a process that computes beside was ended from outside" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_what_was_computed_is_kept_though_the_process_that_draws_is_ended(capsys):
    drawn = section("mass", GOOD)
    drawing = Future()
    drawing.set_exception(WorkerEnded("no longer there"))
    experiment.take_figures(Terminal(), drawn, drawing)
    assert [check.passed for check in drawn.result.checks] == [True, False]
    said = "FAIL mass: figure number 1 is drawn: no, the process that draws was ended from outside"
    assert said in " ".join(capsys.readouterr().out.split())


def test_an_experiment_that_cannot_serve_a_robot_is_skipped_or_refused(tmp_path, capsys, monkeypatch):
    serving = SimpleNamespace(
        **asked("never"), rows=lambda setup: 1 / 0, skipped=lambda robot: f"{robot.name} has no wings"
    )
    monkeypatch.setitem(sys.modules, "compare.experiments.never", serving)
    only(monkeypatch, "never", "published")
    assert main(["all", "--quick", "--out", str(tmp_path / "out")]) == 0
    results = json.loads((tmp_path / "out/results.json").read_text())
    assert results["skipped"] == [{"experiment": "never", "reason": "arm has no wings"}]
    assert {check["experiment"] for check in results["checks"]} == {"published"}
    assert "arm has no wings" in capsys.readouterr().out
    assert main(["never", "--quick", "--out", str(tmp_path / "other")]) == 2
    assert "never cannot serve arm: arm has no wings" in capsys.readouterr().err
    assert not (tmp_path / "other").exists()
