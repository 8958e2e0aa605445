"""Runs the experiments one after the other; long work and drawing go to other processes."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType

from ..core.check import ENDS, About, Result
from ..core.errors import described
from ..core.finding import Finding
from ..core.text import block, say
from ..experiments import EXPERIMENTS, TIMED, Experiment, module
from ..experiments.setup import Setup, engines
from ..process.workers import Clock, WorkerEnded, Workers, load_modules
from ..report.terminal import Terminal
from ..report.verdict import STATES_CAUSES, Section, failures
from ..robots.states import MOST_SPEEDS
from .drawing import draw, quiet, results_needed
from .explained import explained
from .reference import Compared

START, END = (
    "start",
    "figures",
)  # tasks of the clock: what comes before the first experiment and after the last
DIAGNOSED = tuple(name for name, record in EXPERIMENTS.items() if record.diagnosed)
# the numbers on which Mbar and h depend, by their names in `parameters`
IN_EQUATIONS = (
    "order", "parent", "ref", "axis", "anchor", "com", "mass", "inertia", "gravity", "armature", "flag gravity",
)  # fmt: skip
SHOWN = 5  # lines on the terminal about an experiment that fails


def setup_of(compared: Compared, is_quick: bool, **more: object) -> Setup:
    """What the experiments need. more: further fields of Setup."""
    make = Setup.quick if is_quick else Setup
    return make(
        compared.robot, engines(compared.mujoco, compared.reference.own), reading=compared.reading, **more
    )


def examine(
    names: Sequence[str],
    setup: Setup,
    folder: Path,
    terminal: Terminal,
    workers: Workers,
    clock: Clock | None = None,
) -> tuple[list[Section], list[dict], dict[str, str]]:
    """The section of each experiment with its figures, the causes of failing checks, and the skipped experiments with reasons.

    An experiment that raises is one failed check; the others go on. Among other experiments the diagnosis runs only if one of
    them fails. clock: of the workers, it measures each experiment.
    """
    clock = clock or Clock()
    (folder / "figures").mkdir()
    sections, drawings, waiting, causes, reasons = [], [], [], [], {}
    own, reported, crashed, work = setup.engines.get("own"), set(), {}, {}
    is_large = setup.robot.coordinates.nv > MOST_SPEEDS  # its first answers come before any long work begins
    for name in names:
        if hasattr(module(name), "begin") and not is_large:
            with clock.of(name):
                work[name], crashed[name] = attempt(name, module(name).begin, setup)
    clock.ends(START)
    last = ("kinematics", *TIMED) if is_large else TIMED
    order = sorted(names, key=last.__contains__)
    for name in order:
        is_needed = any(failures([section])[0] for section in sections if section.name in DIAGNOSED)
        needless = {"diagnosis": "nothing failed"} if len(names) > 1 and not is_needed else {}
        if setup.is_quick and not setup.alone and not EXPERIMENTS[name].in_quick:
            needless[name] = "not in a quick run"
        if name in needless:
            reasons[name] = needless[name]
            terminal.say(f"{name:<13} skipped: {reasons[name]}")
            clock.ends(name)
            continue
        clock.under_way = name
        with clock.of(name):
            setup.progress(block(name, "summary"))
            section, crash = None, crashed.get(name)
            if not crash:
                section, crash = attempt(name, partial(section_of, name, work=work.get(name)), setup)
            sections.append(section or Section(name, name, "", "", crash))
            if own:
                add_problems(sections[-1].result, own.equations.problems, reported)
            new = [{"experiment": name, **cause} for cause in new_causes(setup, sections, causes)]
            causes = new + causes
            if causes:
                sections[-1].explained = (
                    attempt("explained", partial(explained, section=sections[-1]), setup)[0] or []
                )
        clock.ends(name)
        if section:
            few = setup.is_quick and not setup.alone and not any(failures([section]))
            others = results_needed(name, order, sections)
            drawing = draw, name, section.result, setup.robot, folder / "figures", others, few
            with clock.of(END):
                if name in TIMED:  # no drawing delays a timing
                    waiting.append((section, drawing))
                else:
                    drawings.append((section, workers.submit(*drawing)))
        say_outcome(terminal, sections[-1], clock.seconds_of(name), new, bool(causes))
        for text in sections[-1].result.top if len(names) > 1 else ():  # else it is the last line of the run
            terminal.say(f"  {say(text)}")
    with clock.of(END):
        setup.progress("figures")
        drawings += [(section, workers.submit(*drawing)) for section, drawing in waiting]
        load_modules("compare.report.files")  # it takes long; meanwhile workers draw
        for section, drawing in drawings:
            try:
                section.figures = drawing.result()
            except OSError:  # of the disk
                raise
            except Exception as error:
                add_crash(section.result, "figures are drawn", error)
                terminal.say(f"  FAIL {section.result.checks[-1]}", "red")
    clock.ends(END)
    return sorted(sections, key=lambda section: names.index(section.name)), causes, reasons


def section_of(name: str, setup: Setup, work: object = None) -> Section:
    experiment = module(name)
    result = experiment.rows(setup) if work is None else experiment.rows(setup, work)
    return Section(name, *texts(name, experiment, setup), with_headline(experiment, result))


def with_headline(experiment: ModuleType, result: Result) -> Result:
    if result.headline is None and hasattr(experiment, "headline"):
        result.headline = experiment.headline(result)
    return result


def add_problems(result: Result, problems: Sequence, reported: set) -> None:
    """Add a failed check for each problem of the user's own equations that an experiment calls, before its other checks.

    problems: with quantity and text, see engines.own; reported: their numbers, so that each is reported once.
    """
    others, result.checks = result.checks, []
    asked = EXPERIMENTS.get(result.experiment, Experiment(0)).asks_of_own
    for k, problem in enumerate(problems):
        if k not in reported and (asked is None or problem.quantity in asked):
            reported.add(k)
            result.check(
                "", f"{problem.quantity} returns valid values", None, 0.0, "", problem.text, rule="equal"
            )
    result.checks += others


def texts(name: str, experiment: ModuleType, setup: Setup) -> tuple[str, str, str]:
    """The title, the claim and the tolerance of an experiment."""
    values = getattr(experiment, "claim_values", lambda robot: {})(setup.robot)
    of_robot = {"robot": setup.robot, "values": values}
    claim, tolerance = (say(Finding(name, kind, of_robot)) for kind in ("claim", "tolerance"))
    return block(name, "title", robot=setup.robot), claim, tolerance


def new_causes(setup: Setup, sections: Sequence[Section], known: Sequence[dict]) -> list[dict]:
    """The causes of the failures in the last section, if it is the first that fails, or the first of DIAGNOSED that does.

    Where numbers are stated, the causes are the numbers that differ, or what explains several of them at once. Else they are
    also what the diagnosis finds at other places than the causes that are known.
    """
    failed = [section.name for section in sections if failures([section])[0]]
    if not failed or failed[-1] != sections[-1].name:
        return []
    of_numbers = []
    if len(failed) == 1 and not setup.robot.own:
        result, _ = attempt("parameters", module("parameters").rows, setup)
        of_numbers = result.curves["causes"] if result else []
    if (known or of_numbers) and setup.robot.is_stated:
        return in_one(setup, of_numbers)
    is_first = failed[-1] in DIAGNOSED and not any(name in DIAGNOSED for name in failed[:-1])
    if not (not known if failed[-1] == "diagnosis" else is_first):
        return of_numbers
    diagnosis, places = module("diagnosis"), [cause["place"] for cause in known]
    found, _ = attempt("diagnosis", diagnosis.diagnosed, setup)
    causes = [cause for cause in found.causes if cause.place not in places] if found else []
    return [cause.record() for cause in causes] + of_numbers


def in_one(setup: Setup, of_numbers: Sequence[dict]) -> list[dict]:
    """The causes; one option, convention, number or error of two replaces several numbers of Mbar and h if it explains them."""
    replaced = [cause["quantity"] for cause in of_numbers if cause["quantity"] in IN_EQUATIONS]
    diagnosis = module("diagnosis")
    found = attempt("diagnosis", diagnosis.diagnosed, setup)[0] if len(replaced) > 1 else None
    explaining = [cause for cause in found.diagnosis.causes if cause.rank < 3] if found else []
    if not explaining:
        return list(of_numbers)
    first = explaining[0].record() | {"quantity": min(replaced, key=IN_EQUATIONS.index)}
    return [first, *(cause for cause in of_numbers if cause["quantity"] not in IN_EQUATIONS)]


def attempt(name: str, act: Callable, setup: Setup) -> tuple:
    """The return value of act(setup), and None; if it raises, None and a Result with one failed check."""
    try:
        with quiet(setup.robot):
            return act(setup), None
    except WorkerEnded:
        raise
    except Exception as error:
        result = Result(name, shown=[])
        add_crash(result, ENDS, error)
        return None, result


def add_crash(result: Result, quantity: str, error: Exception) -> None:
    result.check("", quantity, None, 0.0, "", described(error), rule="equal", about=About.PROGRAM)


def say_outcome(
    terminal: Terminal, section: Section, seconds: float, new: Sequence, known: bool = False
) -> None:
    """One line for an experiment, then the causes that are new, and the first failing checks that no cause explains.

    seconds: of the processor, for the experiment itself; known: whether there are causes, new ones or others.
    """
    checks, of_cause = section.result.checks, section.explained
    failed, open_checks = (
        [check for check in checks if check.failed],
        [check for check in checks if not check.judged],
    )
    used = [check.over_tolerance for check in checks if check.over_tolerance is not None]
    most = f"{len(of_cause)} explained by the cause" if of_cause else ""
    if any(used) and not failed:
        most = f"at most {100.0 * max(used):.2g} % of tolerance"
    many = f"{len(checks):>3} check{' ' if len(checks) == 1 else 's'}"
    fails = "DIFFER" if section.name in STATES_CAUSES else "FAILED"
    word = "ok" if checks else "nothing"
    if failed or open_checks:
        word = f"{len(failed)} {fails}" if failed else "NOT JUDGED"
    style = "red" if failed else "yellow" if open_checks else ""
    terminal.say(f"{section.name:<13} {word:<10} {many}  {most:<27} {seconds:5.1f} s CPU", style)
    lines = [f"  CAUSE {cause['text']}" for cause in new]
    if not (known and section.name in STATES_CAUSES):  # there the causes are the checks
        lines += [f"  FAIL {check}" for check in failed if check not in of_cause]
    lines += [f"  {check}" for check in open_checks]
    lines[SHOWN:] = [f"  and {len(lines) - SHOWN} more: in the report"] * (len(lines) > SHOWN)
    for line in lines:
        terminal.say(line, "red")


def progress(clock: Clock, names: Sequence[str]) -> list[str]:
    """How far a run of these experiments is: "4 of 11", "acceleration"."""
    number = 1 + sum(name in clock.ended for name in names)
    return [f"{number} of {len(names)}", clock.under_way] if clock.under_way in names else []
