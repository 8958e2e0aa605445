"""The command line: words, options, help, and one line for what is mistyped."""

import argparse
import shlex
from collections.abc import Callable, Sequence
from contextlib import suppress
from difflib import get_close_matches
from functools import partial
from textwrap import fill
from typing import Any, NamedTuple, NoReturn

from ..core.text import block
from ..core.words import in_one_line
from ..experiments import EXPERIMENTS
from ..process.streams import PROGRAM

FLEET, EQUATIONS = "fleet", "equations"  # further commands, with options of their own
LINE_WIDTH = 80
HIGHEST_GAIN = 1e12
ROBOT = " --mjcf robot.xml"  # of an example
TEXT = "command_line"  # the template
EXAMPLES = block(TEXT, "examples")


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, and whose help has no line too wide."""

    def __init__(self, **more: Any):
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, add_help=False, **more)

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {in_one_line(' '.join(message.split()))}\n")

    def add_option(self, name: str, option: "Option", template: str) -> None:
        """Add an option; its help is the macro of its name."""
        values: dict[str, Any] = {"action": "store_true"}
        if option.type:
            values = {"type": option.type, "metavar": option.metavar, "default": option.default}
        self.add_argument(name, help=" ".join(block(template, name_of(name)).split()), **values)

    def refuse_option(self, word: str, options: Sequence[str]) -> NoReturn:
        names, name = {name.strip("-"): name for name in options}, word.strip("-").split("=")[0]
        self.error(f"{word!r} is not an option; {expected(name, names, ' '.join(options))}")


def name_of(option: str) -> str:
    """Of --control-period: control_period."""
    return option.strip("-").replace("-", "_")


def not_empty(text: str) -> str:
    if not text:
        raise argparse.ArgumentTypeError("the name is empty")
    return text


def number(noun: str, least: float, most: float, kind: type[int | float] = float) -> Callable[[str], float]:
    """A type of options: a number from `least` to `most`."""

    def in_range(text: str) -> float:
        with suppress(ValueError):
            if least <= kind(text) <= most:
                return kind(text)
        wrong = f"{text!r}: expected a number from {least:g} to {most:g} ({noun})"
        raise argparse.ArgumentTypeError(wrong)

    return in_range


seconds = partial(number, "time in s", 1e-6)  # to be called with the longest time
process_count = number("number of processes", 1, 1024, int)


def stated_reference(text: str) -> str:
    """What a model is compared with; a text with a colon is read later."""
    if text in ("arm", "model") or ":" in text or text.lower().endswith((".xml", ".mjcf", ".urdf")):
        return text
    choices = "arm, model, FILE.xml or .urdf, FILE.py:OBJECT or MODULE:OBJECT"
    hint = expected(text, {"arm": "arm", "model": "model"}, choices)
    if text.endswith(".py"):
        hint = f"expected {text}: (all of it), or FILE.py:OBJECT"
    raise argparse.ArgumentTypeError(f"{text!r} is not a reference; {hint}")


class Option(NamedTuple):
    """An option of the command line; its help is a macro of the template."""

    type: Callable[[str], Any] | None = not_empty  # None: it takes no value
    metavar: str | None = None
    default: str | float | None = None
    of_every: bool = False  # whether every experiment takes it; else `all`, and those whose record has it
    example: str = ""  # of its use, in the help of those


OPTIONS = {
    "--out": Option(metavar="DIR", default="reports/latest", of_every=True),
    "--quick": Option(None, of_every=True),
    "--open": Option(None, of_every=True),
    "--json": Option(None, of_every=True),
    "--mjcf": Option(metavar="FILE", of_every=True),
    "--floating": Option(None, of_every=True),
    "--reference": Option(stated_reference, "WHAT", of_every=True),
    "--joints": Option(metavar="LIST", example=f"{ROBOT} --reference my_equations.py:"),
    "--scenes": Option(metavar="FILE", example=" --scenes my.toml"),
    "--engines": Option(metavar="LIST", example=f"{ROBOT} --engines drake,mjx"),
    "--dt": Option(seconds(5.0), "S", example=f"{ROBOT} --integrator Euler --dt 0.001"),
    "--integrator": Option(metavar="NAME"),
    "--posture": Option(metavar="NAME|NUMBERS"),
    "--control-period": Option(seconds(1.0), "S", example=f"{ROBOT} --control-period 0.02 --delay 0.004"),
    "--delay": Option(number("time in s", 0.0, 1.0), "S"),
    "--kp": Option(number("gain", 0.0, HIGHEST_GAIN), "KP"),
    "--kv": Option(number("gain", 0.0, HIGHEST_GAIN), "KV"),
    "--push": Option(number("push in rad/s or m/s", 1e-9, 1e3), "P"),
    "--error": Option(number("error", 1e-12, 1.0), "E", example=f"{ROBOT} --error 0.001"),
    "--points": Option(metavar="NAMES"),
    "--controls": Option(metavar="CSV", example=f"{ROBOT} --controls recorded.csv"),
    "--write": Option(metavar="FILE", example=f"{ROBOT} --write small.xml"),
}


def parser(experiment: str | None = None) -> Parser:
    """The parser of one experiment with the options that it takes, or of all."""
    usage = f"{PROGRAM} {experiment or 'EXPERIMENT|all'} [options]"
    if experiment:
        made = Parser(prog=PROGRAM, usage=usage, description=help_of(experiment))
    else:
        lines = [f"  {name:<13} {block(name, 'summary')}" for name in EXPERIMENTS]
        lines = [fill(line, LINE_WIDTH, subsequent_indent=" " * 16) for line in lines]
        of_all = [block(TEXT, "description"), "", "experiments (`all`: every one of them):", *lines]
        made = Parser(prog=PROGRAM, usage=usage, description="\n".join(of_all), epilog=EXAMPLES)
        made.add_argument("experiment", nargs="?", help=argparse.SUPPRESS)
        made.add_argument("--version", action="store_true", help=block(TEXT, "version"))
    made.add_argument("-h", "--help", action="store_true", help=block(TEXT, "help"))
    for name, option in OPTIONS.items():
        if option.of_every or experiment is None or name in EXPERIMENTS[experiment].options:
            made.add_option(name, option, TEXT)
    return made


def command_parser(name: str, usage: str, template: str, options: dict[str, Option]) -> Parser:
    """The parser of a command that is no experiment; its texts are macros of its template."""
    texts = {"description": block(template, "help"), "epilog": block(template, "examples") + "\n"}
    made = Parser(prog=f"{PROGRAM} {name}", usage=f"{PROGRAM} {name} {usage} [options]", **texts)
    for option in options:
        made.add_option(option, options[option], template)
    made.add_argument("-h", "--help", action="store_true", help="this text")
    return made


def help_of(experiment: str) -> str:
    record, summary = EXPERIMENTS[experiment], fill(block(experiment, "summary"), LINE_WIDTH - 1)
    examples = [" --mjcf my_arm.xml" if record.needs_file else ""]
    examples += [OPTIONS[name].example for name in record.options if OPTIONS[name].example]
    text = block(experiment, "help")
    return block(TEXT, "experiment", name=experiment, summary=summary, text=text, examples=examples)


def expected(word: str, known: dict[str, str], choices: str) -> str:
    """A hint for an unknown word: the nearest known word, or all choices."""
    near = get_close_matches(word.casefold(), known, 1)
    return f"did you mean {known[near[0]]}?" if near else f"expected one of {choices}"


def request(arguments: Sequence[str]) -> argparse.Namespace:
    """The parsed request. SystemExit: with 0 after help, with 2 and one line for what is mistyped."""
    of_all, words = parser(), list(arguments) or ["--help"]
    for option in ("--joints", "--posture"):  # their values may begin with a minus
        if option in words[:-1]:
            at = words.index(option)
            words[at : at + 2] = [f"{option}={words[at + 1]}"]
    options, unknown = of_all.parse_known_args(words)
    name = options.experiment
    refuse_words(of_all, options, unknown, shlex.join(arguments))
    if options.help:
        (of_all if name in (None, "all") else parser(name)).print_help()
        raise SystemExit(0)
    for option, about in OPTIONS.items():
        takers = [other for other, record in EXPERIMENTS.items() if option in record.options]
        is_given = vars(options)[name_of(option)]
        if is_given and not about.of_every and name not in ("all", *takers):
            of_all.error(f"{option} is an option of {', '.join(takers)}; {name} does not take it")
    if options.joints and ":" not in (options.reference or ""):
        of_all.error("--joints needs equations of your own: --reference FILE.py:OBJECT or MODULE:OBJECT")
    needs_file = name in EXPERIMENTS and EXPERIMENTS[name].needs_file
    if needs_file and not (options.mjcf or options.reference or options.version):
        of_all.error(f"{name} needs a robot's file or equations of your own (--mjcf, --reference)")
    return options


def refuse_words(of_all: Parser, options: argparse.Namespace, unknown: Sequence[str], line: str) -> None:
    name, choices = options.experiment, f"{', '.join(EXPERIMENTS)} or all"
    for word in unknown:
        if word.startswith("-"):
            of_all.refuse_option(word, list(OPTIONS))
    if name is None and not (options.help or options.version):
        of_all.error(f"expected an experiment: {choices}, as in {PROGRAM} all {line}")
    if name in (FLEET, EQUATIONS):
        of_all.error(f"{name} must come first, before its options, as in {PROGRAM} {name} --help")
    if name not in (None, "all", *EXPERIMENTS):
        words = {word: word for word in (*EXPERIMENTS, "all", FLEET, EQUATIONS)} | {"help": "--help"}
        of_all.error(f"{name!r} is not an experiment; {expected(name, words, choices)}")
    if unknown:
        of_all.error(f"unexpected argument {unknown[0]!r}: expected one experiment, or all")
