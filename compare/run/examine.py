"""Runs the experiments one after the other; long work and drawing go to other processes."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from functools import partial
from pathlib import Path
from types import ModuleType

from ..experiments import EXPERIMENTS, TIMED, Experiment, module
from ..experiments.setup import Setup, engines
from ..judge.check import ENDS, About, Result
from ..judge.finding import Finding
from ..process.clock import Clock
from ..process.crash import described
from ..process.workers import WorkerEnded, Workers
from ..report.terminal import Terminal
from ..report.text import block, has, say
from ..report.verdict import STATES_CAUSES, Section, explained, failures
from .drawing import draw, quiet, results_needed
from .reference import Compared

START, END = "start", "figures"  # tasks of the clock: what comes before the first experiment and after the last

DIAGNOSED = tuple(name for name, record in EXPERIMENTS.items() if record.diagnosed)
# the numbers on which Mbar and h depend, by their names in `parameters`
IN_EQUATIONS = (
    "order", "parent", "ref", "axis", "anchor", "com", "mass", "inertia", "gravity", "armature", "flag gravity",
)  # fmt: skip
NOTHING_FAILED = "nothing failed"
SHOWN, SHOWN_BESIDE_CAUSE = 5, 2  # lines on the terminal about an experiment that fails; where a cause explains some


def setup_of(compared: Compared, is_quick: bool, **more: object) -> Setup:
    """What the experiments need. more: further fields of Setup."""
    make = Setup.quick if is_quick else Setup
    return make(compared.robot, engines(compared.mujoco, compared.reference.own), reading=compared.reading, **more)


def examine(
    names: Sequence[str], setup: Setup, folder: Path, terminal: Terminal, workers: Workers, clock: Clock | None = None
) -> tuple[list[Section], list[dict], dict[str, str]]:
    """The section of each experiment with its figures, the causes of failing checks, and the skipped experiments with reasons.

    An experiment that raises is one failed check; the others go on. Among other experiments the diagnosis runs only if one of
    them fails. clock: of the workers, it measures each experiment.
    """
    clock = clock or Clock()
    (folder / "figures").mkdir()
    sections, drawings, waiting, causes, reasons = [], [], [], [], {}
    own, reported = setup.engines.get("own"), set()
    modules, crashed = {name: module(name) for name in names}, {}
    for name, experiment in modules.items():
        if hasattr(experiment, "begin"):
            with clock.of(name):
                _, crashed[name] = attempt(name, experiment.begin, setup)
    clock.ends(START)
    order = sorted(modules, key=TIMED.__contains__)
    for name in order:
        experiment = modules[name]
        is_needed = any(failures([section])[0] for section in sections if section.name in DIAGNOSED)
        if name == "diagnosis" and len(modules) > 1 and not is_needed:
            reasons[name] = NOTHING_FAILED
            terminal.say(f"{name:<13} skipped: {NOTHING_FAILED}")
            clock.ends(name)
            continue
        clock.under_way = name
        with clock.of(name):
            setup.progress(block(name, "summary"))
            result, crash = None, crashed.get(name)
            if not crash:
                result, crash = attempt(name, partial(result_of, experiment), setup)
            words, without_words = attempt(name, partial(texts, name, experiment), setup)
            if own:
                add_problems(crash or result, own.equations.problems, reported)
            sections.append(Section(name, *(words or (name, "", "")), crash or result))
            sections[-1].result.checks += without_words.checks if without_words else []
            new = [{"experiment": name, **cause} for cause in new_causes(setup, sections, causes)]
            causes = new + causes
        clock.ends(name)
        with clock.of(END):
            others = results_needed(name, order, sections)
            drawing = partial(workers.submit, draw, name, result, setup.robot, folder / "figures", others)
            # all figures; in a quick run of several experiments the first one, unless a check fails
            drawing = partial(drawing, setup.is_quick and not setup.alone and not any(failures(sections[-1:])))
            if name in TIMED and not crash:  # no drawing delays a timing
                waiting.append((sections[-1], drawing))
            elif not crash:
                drawings.append((sections[-1], drawing()))
        say_outcome(terminal, sections[-1], clock.seconds_of(name), new, causes)
    with clock.of(END):
        setup.progress("figures")
        drawings += [(section, drawing()) for section, drawing in waiting]
        for section, drawing in drawings:
            take_figures(terminal, section, drawing)
    clock.ends(END)
    return sorted(sections, key=lambda section: names.index(section.name)), causes, reasons


def result_of(experiment: ModuleType, setup: Setup) -> Result:
    return with_headline(experiment, experiment.rows(setup))


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
            result.check("", f"{problem.quantity} returns valid values", None, 0.0, "", problem.text, rule="equal")
    result.checks += others


def texts(name: str, experiment: ModuleType, setup: Setup) -> tuple[str, str, str]:
    """The title, the claim and the tolerance of an experiment."""
    values = getattr(experiment, "claim_values", lambda robot: {})(setup.robot)
    claim, tolerance = (
        say(Finding(name, kind, {"robot": setup.robot, "values": values}))
        if has(name, kind)
        else getattr(experiment, kind)(setup.robot)
        for kind in ("claim", "tolerance")
    )
    return block(name, "title", robot=setup.robot), claim, tolerance


def new_causes(setup: Setup, sections: Sequence[Section], known: Sequence[dict]) -> list[dict]:
    """The causes of the failures in the last section, if it is the first that fails, or the first of DIAGNOSED that does.

    Where numbers are stated, the causes are the numbers that differ, or what explains several of them at once.
    """
    failed = [section.name for section in sections if failures([section])[0]]
    if not failed or failed[-1] != sections[-1].name:
        return []
    of_numbers = find_causes(setup) if len(failed) == 1 and not setup.robot.own else []
    asks = failed[-1] in DIAGNOSED and not any(name in DIAGNOSED for name in failed[:-1])
    if failed[-1] == "diagnosis":
        asks = not known
    if (known or of_numbers) and setup.robot.is_stated:
        return in_one(setup, of_numbers)
    if not asks:
        return of_numbers
    return of_values(setup, [cause["place"] for cause in known]) + of_numbers


def diagnosed(setup: Setup) -> object | None:
    return attempt("diagnosis", module("diagnosis").diagnosed, setup)[0]


def in_one(setup: Setup, of_numbers: Sequence[dict]) -> list[dict]:
    """The causes; one option, convention, number or error of two replaces several numbers of Mbar and h if it explains them."""
    replaced = [cause["quantity"] for cause in of_numbers if cause["quantity"] in IN_EQUATIONS]
    found = diagnosed(setup) if len(replaced) > 1 else None
    explaining = [cause for cause in found.diagnosis.causes if cause.rank < 3] if found else []
    if not explaining:
        return list(of_numbers)
    first = module("diagnosis").record(explaining[0]) | {"quantity": min(replaced, key=IN_EQUATIONS.index)}
    return [first, *(cause for cause in of_numbers if cause["quantity"] not in IN_EQUATIONS)]


def of_values(setup: Setup, known: Sequence[str]) -> list[dict]:
    """The causes of differences of Mbar, h and accelerations, except for places that are known as causes."""
    found = diagnosed(setup)
    causes = [cause for cause in found.causes if cause.place not in known] if found else []
    return [module("diagnosis").record(cause, bool(setup.robot.own)) for cause in causes]


def find_causes(setup: Setup) -> list[dict]:
    result, _ = attempt("parameters", module("parameters").rows, setup)
    return result.curves["causes"] if result else []


def attempt(name: str, act: Callable, setup: Setup) -> tuple:
    """The return value of act(setup), and None; if it raises, None and a Result with one failed check."""
    try:
        with quiet(setup.robot):
            return act(setup), None
    except WorkerEnded:
        raise
    except Exception as error:
        result = Result(name, shown=[])
        result.check("", ENDS, None, 0.0, "", described(error), rule="equal", about=About.PROGRAM)
        return None, result


def take_figures(terminal: Terminal, section: Section, drawing: Future) -> None:
    """Wait for a section's figures. One that raised is a failed check; an error of the disk is raised."""
    try:
        figures, failed = drawing.result()
        section.figures = [*section.figures, *figures]
    except OSError:
        raise
    except Exception as error:  # the drawing process was killed, or the result cannot be sent there
        failed = [("number 1", described(error))]
    for name, line in failed:
        quantity = f"figure {name} is drawn"
        check = section.result.check("", quantity, None, 0.0, "", line, rule="equal", about=About.PROGRAM)
        terminal.say(f"  FAIL {check}", "red")


def largest_share_in_words(share: float) -> str:
    """The largest share of a tolerance, in at most 26 characters."""
    percent = 100.0 * share
    if percent < 0.1:
        return "below 0.1 % of tolerance"
    return f"at most {float(f'{percent:.2g}' if percent >= 1.0 else f'{percent:.1g}'):g} % of tolerance"


def say_outcome(
    terminal: Terminal, section: Section, seconds: float, new: Sequence[dict], causes: Sequence[dict] = ()
) -> None:
    """One line for an experiment; then the causes that are new, and the first failing checks that no cause explains.

    seconds: of the processor, for the experiment itself; causes: all that are known.
    """
    checks, of_cause = section.result.checks, explained(section, causes)
    failed = [check for check in checks if not check.passed]
    used = [check.over_tolerance for check in checks if check.over_tolerance is not None]
    most = largest_share_in_words(max(used)) if any(used) and not failed else ""
    if of_cause:
        some = f"{len(of_cause)} " if len(of_cause) < len(failed) else ""
        most = f"{some}explained by the cause"
    word = f"{len(failed)} FAILED" if failed else "ok" if checks else "nothing"
    many = f"{len(checks):>3} check{'s' if len(checks) != 1 else ' '}"
    terminal.say(f"{section.name:<13} {word:<10} {many}  {most:<26} {seconds:5.1f} s", "red" if failed else "")
    lines = [f"  CAUSE {cause['text']}" for cause in new]
    if not (causes and section.name in STATES_CAUSES):  # there the causes are the checks
        lines += [f"  FAIL {check}" for check in failed if check not in of_cause]
    shown = SHOWN_BESIDE_CAUSE if of_cause else SHOWN
    for line in lines[:shown]:
        terminal.say(line, "red")
    if len(lines) > shown:
        terminal.say(f"  and {len(lines) - shown} more: in the report", "red")


def progress(clock: Clock, names: Sequence[str]) -> list[str]:
    """How far a run of these experiments is: "4 of 11", "acceleration"."""
    number = 1 + sum(name in clock.ended for name in names)
    return [f"{number} of {len(names)}", clock.under_way] if clock.under_way in names else []
