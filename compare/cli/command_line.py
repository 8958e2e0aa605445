"""What can be asked on the command line: words, options, help, and one line for what is mistyped."""

import argparse
import shlex
from collections.abc import Sequence
from contextlib import suppress
from difflib import get_close_matches
from textwrap import fill

from ..experiments import EXPERIMENTS
from ..process.streams import in_one_line
from ..report.text import block

PROGRAM = "python -m compare"
FLEET = "fleet"  # the word that is no experiment: it is of many files
LONGEST_ASKED = 5.0  # s, that can be asked about
LINE_WIDTH = 80
SHORT = f"""\
{PROGRAM} compares equations of motion with MuJoCo, in a report.

  {PROGRAM} all                    all of it, for the assignment's arm
  {PROGRAM} all --quick            the same in seconds: fewer states
  {PROGRAM} all --mjcf robot.xml   your robot
  {PROGRAM} fleet models           every model in a folder, in a table
  {PROGRAM} --help                 all options; equations of your own

"""
EXAMPLES = """examples:
  python -m compare all                       everything, for the arm
  python -m compare all --quick               the same in seconds: fewer states
  python -m compare mass --out /tmp/mass      one experiment, report elsewhere
  python -m compare all --mjcf my_arm.xml     your arm and the stated numbers
  python -m compare all --mjcf robot.xml      any robot
  python -m compare all --mjcf robot.xml --reference my_equations.py:
                                              your own equations of that robot
  python -m compare stability --mjcf robot.xml --integrator Euler --dt 0.001
                                              whether that step is stable
  python -m compare speed --scenes my.toml    scenes of your own
  python -m compare speed --help              what one experiment asks and finds
  python -m compare fleet models              every model in a folder, one table
                                              (its options: fleet --help)

output: a line for each experiment; seconds are CPU time of the experiment, not
waiting

compiled code is kept in ~/.cache/tmt, or $TMT_CACHE, for later runs and tests
of any checkout, some 10 MB for each robot; to clear it, delete that folder

exit status: 0 all checks pass; 1 a check failed; 2 the request could not be
carried out, for the reason in one line
"""


def in_lines(text: str, indent: str = "") -> str:
    """A text in lines that an ordinary terminal has room for; indent: of all lines but the first."""
    return fill(text, LINE_WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def help_of_all() -> str:
    """What the program does, and a line for each experiment."""
    return "\n".join([
        in_lines("Compare equations of motion with MuJoCo, on the assignment's arm or on your robot, and write a report."),
        "",
        "experiments (`all`: every one of them):",
        *(in_lines(f"  {name:<13} {block(name, 'summary')}", " " * 16) for name in EXPERIMENTS),
    ])  # fmt: skip


class Parser(argparse.ArgumentParser):
    def error(self, message):
        self.exit(2, f"{self.prog}: {in_one_line(' '.join(message.split()))}\n")


def not_empty(text: str) -> str:
    if not text:
        raise argparse.ArgumentTypeError("it is empty; a name is expected")
    return text


def step_in_seconds(text: str) -> float:
    """A step that is asked about, s."""
    try:
        dt = float(text)
    except ValueError:
        dt = 0.0
    if not 0.0 < dt <= LONGEST_ASKED:
        raise argparse.ArgumentTypeError(
            f"{text!r} is no step; seconds above 0 and at most {LONGEST_ASKED:g} are expected"
        )
    return dt


def process_count(text: str) -> int:
    if not text.isdecimal() or not 0 < int(text) <= 1024:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of processes; 1 or more are expected")
    return int(text)


def stated_reference(text: str) -> str:
    """What a model is compared with: what has a colon is read later."""
    if text in ("arm", "model") or ":" in text or text.lower().endswith((".xml", ".mjcf")):
        return text
    if text.endswith(".py"):
        hint = f"a colon is missing: {text}:OBJECT, or {text}: for the file itself"
    else:
        hint = expected(text, {"arm": "arm", "model": "model"}, "arm, model, FILE.xml, FILE.py:OBJECT or MODULE:OBJECT")
    raise argparse.ArgumentTypeError(f"{text!r} is no reference; {hint}")


# every option; those with False are of the experiments whose record has them
OPTIONS_OF_ALL = {
    "--out": (True, {
        "type": not_empty, "default": "reports/latest", "metavar": "DIR",
        "help": "where the report goes (default: %(default)s)",
    }),
    "--quick": (True, {"action": "store_true", "help": "fewer states; with all, one figure of each experiment that passes"}),
    "--mjcf": (True, {"type": not_empty, "metavar": "FILE", "help": "your model, an MJCF file"}),
    "--reference": (True, {
        "type": stated_reference, "metavar": "WHAT",
        "help": "what it is compared with: arm, the stated numbers (default for a file with exactly the arm's hinges); FILE.xml, "
        "a solution; model, tmt's equations for it as MuJoCo compiled it (default for any other); or equations of your own, "
        "FILE.py:OBJECT or MODULE:OBJECT, with mass_matrix(q) and bias(q, qd) (nothing after the colon: the module itself)",
    }),
    "--joints": (False, {
        "type": not_empty, "metavar": "LIST",
        "help": "the joints as your own equations take them, in their order: first,-second,third+90deg",
    }),
    "--scenes": (False, {
        "type": not_empty, "metavar": "FILE",
        "help": "scenes of your own (TOML), beside those of the robot in trajectory, speed and reduction",
    }),
    "--dt": (False, {
        "type": step_in_seconds, "metavar": "S",
        "help": "stability: whether this step, s, is stable under the robot's own servos (default: the file's)",
    }),
    "--integrator": (False, {
        "type": not_empty, "metavar": "NAME",
        "help": "stability: the same with this integrator of MuJoCo (default: the file's)",
    }),
}  # fmt: skip


def parser(experiment: str | None = None) -> Parser:
    """The command line, of one experiment with the options that it takes, or of all."""
    made = Parser(
        prog=PROGRAM,
        usage=f"{PROGRAM} {experiment or 'EXPERIMENT|all'} [options]",
        description=(help_of_all() if experiment is None else help_of(experiment)),
        epilog=None if experiment else EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        add_help=False,
    )
    if experiment is None:
        made.add_argument("experiment", nargs="?", help=argparse.SUPPRESS)
        made.add_argument("--version", action="store_true", help="the version of this program, and nothing else")
    made.add_argument("-h", "--help", action="store_true", help="this text; after an experiment: what it asks")
    for name, (of_all, how) in OPTIONS_OF_ALL.items():
        if of_all or experiment is None or name in EXPERIMENTS[experiment].options:
            made.add_argument(name, **how)
    return made


def help_of(experiment: str) -> str:
    """What an experiment asks, compares and writes."""
    first, *rest = block(experiment, "help").split("\n")
    return "\n".join([in_lines(first), *rest])


def takers(option: str) -> list[str]:
    """The experiments that take an option."""
    return [name for name, record in EXPERIMENTS.items() if option in record.options]


def what_can_be_asked() -> str:
    """Ten lines for who asks nothing."""
    return SHORT + in_lines(f"Experiments: {', '.join(EXPERIMENTS)}.")


def request(arguments: Sequence[str]) -> argparse.Namespace:
    """What is asked for. SystemExit: with 0 where help is asked for, or nothing; with 2 and one line for what is mistyped."""
    whole = parser()
    if not arguments:
        with suppress(OSError, ValueError, AttributeError):  # nobody may be there to read it
            print(what_can_be_asked(), flush=True)
        raise SystemExit(0)
    options, unknown = whole.parse_known_args(with_minus(arguments))
    refuse_unknown(whole, options, unknown, shlex.join(arguments))
    if options.help:
        (whole if options.experiment in (None, "all") else parser(options.experiment)).print_help()
        raise SystemExit(0)
    if not options.version:
        refuse_what_does_not_go_together(whole, options)
    return options


def with_minus(arguments: Sequence[str]) -> list[str]:
    """The arguments, a list of joints that begins with a minus as part of its option: it is none itself."""
    given = list(arguments)
    for k in range(len(given) - 1, 0, -1):
        if given[k - 1] == "--joints" and given[k].startswith("-") and not given[k].startswith("--"):
            given[k - 1 : k + 1] = [f"--joints={given[k]}"]
    return given


def refuse_unknown(whole: Parser, options: argparse.Namespace, unknown: Sequence[str], given: str) -> None:
    """End with the first word that is not known, or where no experiment is asked for. given: all words."""
    words = {name: name for name in (*EXPERIMENTS, "all")}
    names = {name.strip("-"): name for name in OPTIONS_OF_ALL}
    for word in unknown:
        if word.startswith("-"):
            whole.error(
                f"{word!r} is no option; {expected(word.strip('-').split('=')[0], names, ' '.join(OPTIONS_OF_ALL))}"
            )
    name, choices = options.experiment, f"{', '.join(EXPERIMENTS)} or all"
    if name is None and not (options.help or options.version):
        whole.error(f"no experiment is named; one of {choices} is expected, as in {PROGRAM} all {given}")
    if name == FLEET:
        whole.error(f"{FLEET} is the first word, before its options, as in {PROGRAM} {FLEET} models")
    if name is not None and name not in words:
        near = expected(name, words | {"help": "--help", FLEET: FLEET}, choices)
        whole.error(f"{name!r} is no experiment; {near}")
    if unknown:
        whole.error(f"{unknown[0]!r} is one word too many; one experiment, or all, is expected")


def expected(word: str, known: dict[str, str], choices: str) -> str:
    """What was meant instead of a word: the nearest of those that are known, by what it stands for; or all choices."""
    near = get_close_matches(word.casefold(), known, 1)
    return f"did you mean {known[near[0]]}?" if near else f"one of {choices} is expected"


def refuse_what_does_not_go_together(whole: Parser, options: argparse.Namespace) -> None:
    """End with the first option that the experiment does not take."""
    name = options.experiment
    if options.scenes and name not in (*takers("--scenes"), "all"):
        whole.error(f"--scenes is for {', '.join(takers('--scenes'))} and all; {name} follows no scene")
    if options.joints and ":" not in (options.reference or ""):
        whole.error("--joints is for equations of your own (--reference FILE.py:OBJECT or MODULE:OBJECT)")
    if (options.dt, options.integrator) != (None, None) and name != "stability":
        whole.error(f"--dt and --integrator are for stability; {name} answers for no other step")
    if name == "diagnosis" and not (options.mjcf or options.reference):
        whole.error("diagnosis needs a robot's file or equations of your own (--mjcf, --reference)")
