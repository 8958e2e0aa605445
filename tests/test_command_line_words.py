"""What the command line answers at once: what can be asked, help, and one line for what is mistyped."""

import re
import subprocess
import sys

import pytest
from runs import ENVIRONMENT, compare

from compare import version
from compare.__main__ import main
from compare.command_line import OPTIONS_OF_ALL
from compare.engines.mujoco.flags import integrator_by_name
from compare.experiments import EXPERIMENTS


def answered(arguments, capsys):
    """Exit status, stdout and stderr of what runs nothing."""
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    return stop.value.code, *capsys.readouterr()


def test_who_asks_nothing_is_told_what_can_be_asked_in_ten_lines(tmp_path, capsys):
    run = compare(cwd=tmp_path)
    assert (run.returncode, run.stderr) == (0, "")
    lines = run.stdout.splitlines()
    assert len(lines) == 10 and max(map(len, lines)) <= 80
    assert all(name in run.stdout for name in EXPERIMENTS) and "--mjcf robot.xml" in run.stdout
    assert list(tmp_path.iterdir()) == []
    for line in lines:
        if line.startswith("  python -m compare "):
            words = re.split(" {2,}", line)[1].split()[3:]
            assert answered([*words, "--help"], capsys)[0] == 0, line


@pytest.mark.parametrize("arguments, says", [
    (["mas"], "'mas' is no experiment; did you mean mass?"),
    (["Trajectories"], "'Trajectories' is no experiment; did you mean trajectory?"),
    (["al", "--quick"], "'al' is no experiment; did you mean all?"),
    (["help"], "'help' is no experiment; did you mean --help?"),
    (["mas", "--help"], "'mas' is no experiment; did you mean mass?"),
    (["xyz"], f"'xyz' is no experiment; one of {', '.join(EXPERIMENTS)} or all is expected"),
    (["two\nlines"], r"'two\nlines' is no experiment; one of "),
    (["mass", "--quik"], "'--quik' is no option; did you mean --quick?"),
    (["mass", "-quick"], "'-quick' is no option; did you mean --quick?"),
    (["--mjfc", "robot.xml", "mass"], "'--mjfc' is no option; did you mean --mjcf?"),
    (["mass", "--mjfc=robot.xml"], "'--mjfc=robot.xml' is no option; did you mean --mjcf?"),
    (["mass", "--xyz"], f"'--xyz' is no option; one of {' '.join(OPTIONS_OF_ALL)} is expected"),
    (["mass", "gravity"], "'gravity' is one word too many; one experiment, or all, is expected"),
    (["--quick"], "no experiment is named; one of parameters, "),
    (["--mjcf", "my robot.xml"], "or all is expected, as in python -m compare all --mjcf 'my robot.xml'"),
    (["mass", "--reference", "modle"], "argument --reference: 'modle' is no reference; did you mean model?"),
    (["mass", "--reference", "x"], "'x' is no reference; one of arm, model, FILE.xml, FILE.py:OBJECT or MODULE:OBJECT"),
    (["mass", "--reference", "my.py"],
     "'my.py' is no reference; a colon is missing: my.py:OBJECT, or my.py: for the file itself"),
    (["mass", "--out"], "argument --out: expected one argument"),
])  # fmt: skip
def test_a_mistyped_word_gets_status_2_and_one_line_with_the_nearest(arguments, says, capsys):
    status, out, err = answered(arguments, capsys)
    assert (status, out) == (2, "") and len(err.splitlines()) == 1
    assert err.startswith("python -m compare: ") and says in err


def test_a_mistyped_integrator_gets_the_nearest():
    for given, near in (("euler", "Euler"), ("rk4", "RK4"), ("implicitfst", "implicitfast")):
        with pytest.raises(ValueError, match=rf"^'{given}' is no integrator of MuJoCo; did you mean {near}\? Euler, "):
            integrator_by_name(given)
    with pytest.raises(ValueError, match=r"^'midpoint' is no integrator of MuJoCo; Euler, .* are expected$"):
        integrator_by_name("midpoint")


def test_help_has_examples_and_every_option(capsys):
    for arguments in (["--help"], ["-h"], ["all", "--help"]):
        status, text, err = answered(arguments, capsys)
        assert (status, err) == (0, "")
        assert "python -m compare all --quick" in text and "exit status" in text
        assert all(f"  {name} " in text for name in (*EXPERIMENTS, *OPTIONS_OF_ALL))
        assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize("arguments", [["--version"], ["all", "--version"]])
def test_the_version_is_that_of_a_report(arguments, capsys):
    assert main(arguments) == 0
    assert tuple(capsys.readouterr()) == (f"{version.OURS} {version.own_version()}\n", "")
    assert re.fullmatch(r"\d+(\.\d+)+", version.own_version())
    assert "--version" in answered(["--help"], capsys)[1]
    assert answered(["mas", "--version"], capsys)[0] == 2


TAKEN = {"--scenes": {"trajectory", "speed", "reduction"}, "--dt": {"stability"},
         "--joints": {"kinematics", "mass", "gravity", "acceleration", "trajectory", "diagnosis"},
         "--integrator": {"stability"}, "--workers": {"diagnosis"}, "--dask": {"diagnosis"}}  # fmt: skip


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_the_help_of_an_experiment_has_the_options_that_it_takes_and_no_others(name, capsys):
    status, text, _ = answered([name, "--help"], capsys)
    assert status == 0 and text.startswith(f"usage: python -m compare {name} [options]\n")
    options = text[text.index("\noptions:") :]
    for option in OPTIONS_OF_ALL:
        assert (f"  {option} " in options) == (name in TAKEN.get(option, EXPERIMENTS)), option


def test_help_is_read_without_what_computes(tmp_path):
    """Nothing heavy is imported: a stranger who asks does not wait."""
    text = (
        "import sys; from compare.__main__ import main\n"
        "try: main(['speed', '--help'])\n"
        "except SystemExit: print(sorted({'numpy', 'mujoco', 'tmt', 'rich', 'compare.experiments.speed'} & set(sys.modules)))"
    )
    run = subprocess.run([sys.executable, "-c", text], cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True)
    assert run.stdout.splitlines()[-1] == "[]", run.stderr
