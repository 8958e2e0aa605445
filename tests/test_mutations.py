"""The command that tests the judge: its edits apply to the sources as they are, and it sees which ones no test notices."""

import os
import re
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest
from mutations import campaign, trial
from mutations.__main__ import main
from mutations.campaign import Stage
from mutations.edit import DoesNotApply, Edit, applied
from mutations.edits import EDITS
from mutations.stages import stages

PROJECT = Path(__file__).resolve().parent.parent


def test_every_edit_applies_and_says_what_it_breaks():
    lost = []
    for edit in EDITS:
        try:
            place = applied(PROJECT, edit)
            assert place.after != place.before
        except DoesNotApply as error:
            lost.append(str(error))
    assert lost == []
    assert len({edit.name for edit in EDITS}) == len(EDITS)
    assert all(edit.breaks for edit in EDITS)


def test_every_test_is_in_one_stage_but_those_that_judge_nothing():
    judge, rest = (stage.files for stage in stages(PROJECT))
    assert "tests/judge/test_judge_check.py" in judge and "tests/test_command_line.py" in rest
    every = {str(path.relative_to(PROJECT)) for path in (PROJECT / "tests").rglob("test_*.py")}
    aside = {f"tests/{name}.py" for name in ("test_mutations", "test_structure", "process/test_interrupt")}
    assert every - {*judge} - {*rest} == aside and not {*judge} & {*rest}


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """A project of one judge, one model and their tests; nothing is compiled yet."""
    monkeypatch.setenv("TMT_CACHE", str(tmp_path / "compiled"))
    files = {
        "compare/rules.py": '''
            """Verdicts."""

            WIDTH = 0.5  # half


            class Check:
                width = 3

                def passed(self, value, tolerance=1.0):
                    # the rule
                    return (abs( value )
                            <= tolerance)

                def text(self, value):
                    return f"at most {max(value, 2):.3g} " f'of {value}'


            def rows(result, x):
                """A row."""
                result.check("scene", 'size', x, 1.0, note="a", rounding=True)
                if x > 1.0:
                    result.check("scene", "order", x, 2.0)
                    result.done = True
                return [x, x + 1, x + 1]
            ''',
        "tmt/rules_of_motion.py": "def slope(x):\n    return 2.0 * x\n",
        "compare/pages/first.py": "def rows(x):\n    return -x\n",
        "compare/pages/second.py": "def page(x):\n    return x - 1\n",
        "tests/test_toy.py": """
            from compare.rules import Check


            def test_a_value_above_its_tolerance_fails():
                assert Check().passed(0.5) and not Check().passed(1.5)
            """,
        "tests/test_late.py": """
            import subprocess, sys


            def test_a_process_of_its_own_has_the_copy_too():
                program = "from tmt.rules_of_motion import slope; print(slope(3.0))"
                assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout == "6.0\\n"
            """,
    }
    for name, text in files.items():
        path = tmp_path / "toy" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(textwrap.dedent(text).lstrip())
    return tmp_path / "toy"


@pytest.mark.parametrize(
    "where, old, new, line",
    [
        ("Check.passed", "abs(value) <= tolerance", "True", "        return ((True))"),
        ("Check.passed", "1.0", "9.0", "    def passed(self, value, tolerance=(9.0)):"),
        ("Check.width", "3", "4", "    width = (4)"),
        ("WIDTH", "0.5", "5", "WIDTH = (5)  # half"),
        ("Check.text", "max(_1, 2)", "min(_1, 2)", "        return (f'at most {min(value, 2):.3g} of {value}')"),
        ("rows", "rounding=True", "rounding=False", """    result.check("scene", 'size', x, 1.0, note="a", rounding=False)"""),
        ("rows", "result.check(_1, 'size', *_2)", "None", "    (None)"),
        ("rows", "result.check(_1, 'size', _2, *_3)", "result.check(_1, 'size', 0, *_3)",
         "    (result.check('scene', 'size', 0, 1.0, note='a', rounding=True))"),
        ("rows", "result.check(_1, _2, *_3, rounding=True)", "print(_2)", "    (print('size'))"),
        ("rows", "result.done = True", "pass\nreturn []", "        pass\n        return []"),
    ],
)  # fmt: skip
def test_expressions_are_found_in_spite_of_their_formatting(toy, where, old, new, line):
    place = applied(toy, Edit("rules", where, old, new, "test"))
    compile(place.after, "edited", "exec")
    changed = set(place.after.split("\n")) - set(place.before.split("\n"))
    assert changed == set(line.split("\n"))  # what surrounds it is as it was


@pytest.mark.parametrize(
    "edit, says",
    [
        (Edit("rules", "rows", "x + 1", "x", ""), "2 times x \\+ 1"),
        (Edit("rules", "rows", "x + 1", "x", "", nth=3), "number 3 of 2"),
        (Edit("rules", "rows", "x + 2", "x", ""), "rows has no x \\+ 2"),
        (Edit("rules", "columns", "x", "y", ""), "there is no columns"),
        (Edit("elsewhere", "rows", "x", "y", ""), "in compare/pages/first.py, compare/rules.py"),
        (Edit("rules", "rows", "x; x", "y", ""), "old is one expression"),
        (Edit("rules", "rows", "x > 1.0", "x; x", ""), "new is one expression"),
    ],
)
def test_what_is_missing_or_ambiguous_is_refused(toy, edit, says):
    with pytest.raises(DoesNotApply, match=says):
        applied(toy, edit)


def test_an_edit_survives_the_move_of_its_function(toy):
    assert applied(toy, Edit("rules", "rows", "x + 1", "x", "", nth=2)).after.count("x + 1") == 1
    for module in ("first", "pages", "pages.first", "compare.pages"):
        assert applied(toy, Edit(module, "rows", "-x", "x", "")).path.name == "first.py"
    assert applied(toy, Edit("first", "page", "x - 1", "x", "")).path.name == "second.py"  # moved to the next file
    (toy / "compare/rules.py").rename(toy / "compare/verdicts.py")
    assert applied(toy, Edit("rules", "Check.width", "3", "4", "")).path.name == "verdicts.py"


def two_stages(project):
    return [Stage(["tests/test_toy.py"]), Stage(["tests/test_late.py"])]


def runs(pid) -> bool:
    """Whether a process is there and has not ended, as one that nobody waits for has."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


PROGRAM = """
import sys
sys.path.insert(0, {tests!r})
from pathlib import Path
from mutations.__main__ import main
from mutations.campaign import Stage
from mutations.edit import Edit
edits = [Edit("rules", "WIDTH", "0.5", "5", "wide")]
sys.exit(main([], Path({toy!r}), edits, lambda project: [Stage(["tests/test_long.py"])]))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_it_at_once_and_leaves_nothing(toy, tmp_path, number):
    asleep = tmp_path / "asleep"
    (toy / "tests/test_long.py").write_text(
        "import os, subprocess, time\n\n\ndef test_long():\n"
        "    child = subprocess.Popen(['sleep', '60'], start_new_session=True)\n"
        f"    open({str(asleep)!r}, 'w').write(f'{{os.getpid()}} {{child.pid}}\\n')\n    time.sleep(60)\n"
    )
    (tmp_path / "scratch").mkdir()
    program = PROGRAM.format(tests=str(PROJECT / "tests"), toy=str(toy))
    environment = os.environ | {"TMPDIR": str(tmp_path / "scratch")}
    run = subprocess.Popen([sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, text=True)
    while not (asleep.exists() and asleep.read_text().endswith("\n")):
        assert run.poll() is None
        time.sleep(0.02)
    began = time.monotonic()
    run.send_signal(number)
    assert run.communicate(timeout=30)[0].strip() == "interrupted" and run.returncode == 2
    while any(map(runs, asleep.read_text().split())):
        assert time.monotonic() - began < 5.0
        time.sleep(0.02)
    assert list((tmp_path / "scratch").iterdir()) == [] and time.monotonic() - began < 5.0


def test_one_edit_is_caught_and_one_survives(toy, capfd, monkeypatch):
    monkeypatch.setattr(campaign, "PATIENCE", (1.0, 1.0))
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")  # as fast as may be
    edits = (
        Edit("rules", "Check.passed", "abs(value) <= tolerance", "True", "always passes"),
        Edit("rules", "Check.width", "3", "4", "wider"),
        Edit("rules", "WIDTH", "0.5", "5", "wide", harmless="nobody uses it"),
        Edit("rules_of_motion", "slope", "2.0", "3.0", "steeper"),
        Edit("rules_of_motion", "slope", "return _1", "while True:\n    pass", "endless"),
    )
    before = {path: path.read_text() for path in toy.rglob("*.py")}
    assert main(["--jobs", "2"], toy, edits, two_stages) == 1
    out = capfd.readouterr().out
    assert "always passes: caught by tests/test_toy.py::test_a_value_above_its_tolerance_fails" in out
    assert "steeper: caught by tests/test_late.py::test_a_process_of_its_own_has_the_copy_too" in out
    assert re.search(r"endless: caught by no end after \d s", out)
    assert "wider: SURVIVED" in out and "wide: harmless" in out
    assert (
        "survived: rules.Check.width: wider\n--- a/compare/rules.py" in out
        and "-    width = 3\n+    width = (4)" in out
    )
    assert out.index("+    width = (4)") < out.index("(harmless: nobody uses it)")
    assert out.endswith("5 edits: 3 caught, 1 declared harmless, 1 survived\n")
    assert {path: path.read_text() for path in toy.rglob("*.py")} == before


def test_other_packages_for_tests_are_no_finding():
    expected = trial.versions()
    assert expected["pytest"] and trial.check_versions(expected) is None
    with pytest.raises(RuntimeError, match="other packages for tests are installed"):
        trial.check_versions(expected | {"hypothesis": None})


def test_an_edit_that_could_not_be_tried_is_neither_caught_nor_survives(toy, capfd, monkeypatch):
    """The disk is full, but was not yet when the unedited copy was tried."""
    text = Path(trial.__file__).read_text(encoding="utf-8")
    full = text.replace(
        "    folder, started, caught =", "    raise OSError('the disk is full')\n    folder, started, caught ="
    )
    (toy.parent / "trial.py").write_text(full, encoding="utf-8")
    monkeypatch.setattr(trial, "__file__", str(toy.parent / "trial.py"))
    edits = [Edit("rules", "WIDTH", "0.5", "5", "wide", harmless="nobody uses it")]
    assert main(["--jobs", "1"], toy, edits, lambda project: two_stages(project)[:1]) == 2
    out = capfd.readouterr().out
    assert "wide: could not be tried: OSError: the disk is full" in out
    assert out.endswith("1 edits: 0 caught, 0 declared harmless, 0 survived, 1 could not be tried\n")


def test_what_cannot_start_gets_a_line_and_status_2(toy, capfd):
    edits = [Edit("rules", "WIDTH", "0.5", "5", "wide")]
    assert main(["--dask", "nowhere"], toy, edits, two_stages) == 2
    assert "no scheduler answers at nowhere: " in capfd.readouterr().out
    with pytest.raises(SystemExit) as ended:
        main(["--dask", "nowhere", "--jobs", "2"], toy, edits, two_stages)
    assert ended.value.code == 2 and "--jobs is for runs on this machine" in capfd.readouterr().err
