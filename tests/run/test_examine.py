"""What breaks inside a run is a failed check, and the rest goes on; what is timed comes last."""

import json
import sys
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import pytest
from helpers.in_process import InProcess, without_workers
from helpers.sections import GOOD, row_of, section
from jinja2 import ChoiceLoader, DictLoader
from matplotlib.figure import Figure

from compare.__main__ import main
from compare.cli import command_line
from compare.core.check import Result
from compare.core.finding import Finding
from compare.core.text import environment
from compare.experiments import EXPERIMENTS, Experiment
from compare.experiments.options import AllOptions, Options
from compare.process.workers import Clock
from compare.report.terminal import Terminal
from compare.robots.arm import ARM
from compare.run import command
from compare.run import drawing as drawings
from compare.run import examine as experiment


def made(monkeypatch, name, **functions):
    """An experiment of this name with these functions, in place of what every experiment has, and its template."""
    usual = {"rows": lambda setup: Result(name, shown=[]), "figures": lambda result, robot: ()}
    macros = ("title(robot)", "claim(robot, values)", "tolerance(robot, values)", "summary()")
    template = "".join(f"{{% macro {macro} %}}{name}{{% endmacro %}}" for macro in macros)
    loaders = [DictLoader({f"{name}.md.jinja": template}), environment().loader]
    monkeypatch.setattr(environment(), "loader", ChoiceLoader(loaders))
    monkeypatch.setitem(sys.modules, f"compare.experiments.{name}", SimpleNamespace(**usual | functions))
    if name in EXPERIMENTS:  # whose functions may be another module's
        monkeypatch.setitem(EXPERIMENTS, name, replace(EXPERIMENTS[name], module=name))


def only(monkeypatch, *names):
    for module in (command, command_line, experiment):
        records = {name: EXPERIMENTS.get(name, Experiment()) for name in names}
        monkeypatch.setattr(module, "EXPERIMENTS", records)


def ran(tmp_path, *arguments):
    """Exit status and results.json, None if there is no report."""
    path = tmp_path / "out" / "results.json"
    status = main([*arguments, "--quick", "--out", str(path.parent)])
    return status, json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def raises(*_):
    raise ValueError("two\nlines")


def unsendable(setup):
    result = Result("sending", shown=[])
    result.for_figures = lambda: None
    return result


BROKEN = {  # functions of the experiment; the check that fails, and the error that it names
    "begin": ({"begin": raises}, "runs to its end", "ValueError: two lines"),
    "rows": ({"rows": raises}, "runs to its end", "ValueError: two lines"),
    "background": ({"rows": lambda setup: list(setup.map(divmod, [1], [0]))}, "runs to its end", "ZeroDivisionError"),
    "sending": ({"rows": unsendable}, "figures are drawn", "pickle"),
}  # fmt: skip


def test_what_raises_is_one_failed_check(tmp_path, capsys, monkeypatch):
    for name, (functions, *_) in BROKEN.items():
        made(monkeypatch, name, **functions)
    only(monkeypatch, *BROKEN, "published")
    status, results = ran(tmp_path, "all")
    out, err = capsys.readouterr()
    assert (status, err) == (1, "") and "published     ok" in out and not results["passed"]
    failed = [check for check in results["checks"] if not check["passed"] and check["experiment"] in BROKEN]
    for check, (name, (_, quantity, error)) in zip(failed, BROKEN.items(), strict=True):
        expected = {"experiment": name, "quantity": quantity, "value": None, "rule": "equal"}
        assert check.items() >= expected.items()
        assert error in check["note"]
    assert f"Not finished: {next(iter(BROKEN))}" in out and f"; {len(failed) - 1} more." in out


@pytest.mark.parametrize("asked, run", [
    ({}, set()), ({"write": "small.xml"}, {"reduction"}), ({"engines": "drake"}, {"engines"}), ({"out": "elsewhere"}, set()),
])  # fmt: skip
def test_a_quick_run_of_a_larger_robot_has_the_long_experiments_that_an_option_asks_for(asked, run):
    robot = SimpleNamespace(coordinates=SimpleNamespace(nv=9))
    setup = SimpleNamespace(robot=robot, options=AllOptions(**asked), alone=False, is_quick=True)
    late = "reduction", "engines", "derivatives"
    parts = experiment.Run([*late, "mass"], setup, None, Terminal(), None, Clock())
    assert {name for name in parts.names if not parts.too_long(name)} == {"mass", *run}


def test_a_report_that_cannot_be_made_is_one_line_and_the_earlier_one_is_whole(tmp_path, capsys, monkeypatch):
    rows = [row_of(a=1.5)]
    made(monkeypatch, "odd", rows=lambda setup: Result("odd", rows=rows))
    only(monkeypatch, "odd")
    with without_workers():
        assert ran(tmp_path, "odd")[0] == 1  # nothing was checked
        before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        rows.append(3)
        capsys.readouterr()
        status, _ = ran(tmp_path, "odd")
    assert status == 2 and "AttributeError" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("is_earlier", [False, True])
def test_after_an_interrupt_what_is_finished_is_reported_and_an_earlier_report_stays(
    tmp_path, monkeypatch, is_earlier
):
    def first(setup):
        result = Result("first", shown=[])
        result.check("zero", "a", 0.5, 1.0, "m")
        return result

    def second(setup):
        raise KeyboardInterrupt

    for name, rows in {"first": first, "second": second}.items():
        made(monkeypatch, name, rows=rows)
    only(monkeypatch, "first", "second")
    earlier, place = tmp_path / "out" / "results.json", tmp_path / "out"
    if is_earlier:
        place.mkdir()
        earlier.write_text('{"provenance": {"files": ["results.json"]}}')
        place = place / "interrupted"
    before = earlier.read_text() if is_earlier else ""
    with without_workers(), pytest.raises(KeyboardInterrupt):
        ran(tmp_path, "all")
    results = json.loads((place / "results.json").read_text())
    assert [check["experiment"] for check in results["checks"]] == ["first"] and not results["passed"]
    assert [skipped["experiment"] for skipped in results["skipped"]] == ["second"]
    assert not is_earlier or earlier.read_text() == before
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == ({"results.json", "interrupted"} if is_earlier else names) and not any(
        ".new" in name for name in names
    )


def test_a_problem_of_a_users_function_is_told_once_by_an_experiment_that_asks_it():
    problems = [SimpleNamespace(quantity=name, text="NaN") for name in ("bias", "mass_matrix")]
    reported = set()
    for name, told in (("mass", ["mass_matrix"]), ("mass", []), ("acceleration", ["bias"])):
        result = Result(name)
        experiment.add_problems(result, problems, reported)
        assert [check.quantity.split()[0] for check in result.checks if check.failed] == told


def test_progress_counts_from_one():
    clock = SimpleNamespace(ended={"start": 0.1, "mass": 0.5}, under_way="")
    assert experiment.progress(clock, ["mass", "gravity", "speed"]) == []
    clock.under_way = "gravity"
    assert experiment.progress(clock, ["mass", "gravity", "speed"]) == ["2 of 3", "gravity"]
    clock.ended |= {"gravity": 0.2, "speed": 1.0}
    assert experiment.progress(clock, ["mass", "gravity", "speed"]) == [
        "3 of 3",
        "gravity",
    ]  # while figures are drawn


def test_the_line_of_progress_is_of_one_experiment_until_the_next_text_is_shown():
    terminal, clock = Terminal(), SimpleNamespace(ended={}, under_way="mass")
    terminal.show("kg m2", experiment.progress(clock, ["mass", "gravity"]))
    clock.ended["mass"], clock.under_way = 0.5, "gravity"
    assert terminal.line() == "1 of 2, mass: kg m2"
    terminal.show("N m", experiment.progress(clock, ["mass", "gravity"]))
    assert terminal.line() == "2 of 2, gravity: N m"


class Writing(InProcess):
    """Draws in this process at once, and writes down when that is asked for."""

    def __init__(self, log):
        self.log = log

    def submit(self, function, /, name, *more):
        self.log.append(("figures", name))
        return super().submit(function, name, *more)


def plot(result, name):
    return name, Figure(), "A caption."


def test_short_experiments_come_first_and_timed_ones_last_and_are_drawn_last(tmp_path, monkeypatch):
    names, log = ["mass", "trajectory", "speed", "stability", "derivatives"], []

    def rows(name, setup):
        log.append(("rows", name))
        return Result(name)

    def figures(name, result, robot):
        yield from (partial(plot, result, f"{name}_{k}") for k in range(3))

    for name in names:
        made(monkeypatch, name, rows=partial(rows, name), figures=partial(figures, name))
    setup = SimpleNamespace(own=None, robot=ARM, progress=lambda text: None, is_quick=False, alone=True)
    setup.options = Options()
    run = experiment.Run(names, setup, tmp_path, Terminal(), Writing(log)).examined()
    assert log == [
        ("rows", "mass"), ("figures", "mass"), ("rows", "stability"), ("figures", "stability"),
        ("rows", "trajectory"), ("figures", "trajectory"), ("rows", "speed"), ("rows", "derivatives"),
        ("figures", "speed"), ("figures", "derivatives"),
    ]  # fmt: skip
    assert [section.name for section in run.sections] == names and (run.causes, run.needless) == ([], {})
    for section_of_name, name in zip(run.sections, names):
        assert [figure.file for figure in section_of_name.figures] == [f"{name}_{k}" for k in range(3)]


def test_after_an_interrupt_there_is_what_has_ended_with_the_figures_that_are_drawn(tmp_path):
    (tmp_path / "figures").mkdir()
    setup = SimpleNamespace(own=None, robot=ARM, is_quick=False, alone=True, options=Options())
    names = ["mass", "gravity", "acceleration", "speed"]
    run = experiment.Run(names, setup, tmp_path, Terminal(), None, Clock())
    drawn, broken, under_way = (Future() for _ in names[:3])
    drawn.set_result([experiment.Figure("mass", "A caption.")])
    broken.set_exception(ValueError("no room"))
    for name, drawing in zip(names, (drawn, broken, under_way)):
        run.sections.append(section(name, GOOD))
        run.clock.ends(name)
        run.drawings.append((run.sections[-1], drawing))
        (tmp_path / "figures" / f"{name}.png").touch()
    run.sections.append(section("speed", GOOD))  # which has rows, and has not ended
    sections = run.finished().sections
    assert [[figure.file for figure in part.figures] for part in sections] == [["mass"], [], []]
    assert [path.name for path in (tmp_path / "figures").iterdir()] == ["mass.png"]


def test_no_figure_overwrites_one_whose_name_differs_in_its_case_alone(tmp_path, monkeypatch):
    caption = Finding("mass", "summary", {})
    calls = [lambda file=file: (file, None, caption) for file in ("m_a", "M_A", "m_a")]
    experiment = SimpleNamespace(figures=lambda result, robot: calls, overview=lambda results, robot: ())
    monkeypatch.setattr(drawings, "functions", lambda name: experiment)
    monkeypatch.setattr(drawings.images, "save_figure", lambda figure, path: path.touch())
    drawn = drawings.draw("mass", Result("mass"), ARM, tmp_path, {})
    assert len({figure.file.casefold() for figure in drawn}) == len([*tmp_path.iterdir()]) == 3
