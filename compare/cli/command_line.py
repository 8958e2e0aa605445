"""The command line: the words of a request, its options, help, and one line for what is mistyped."""

import argparse
import shlex
import sys
from collections.abc import Sequence
from textwrap import fill
from typing import Any, NoReturn

from ..core.options import Option, expected, name_of, options_in
from ..core.text import block
from ..core.words import in_one_line
from ..experiments import EXPERIMENTS
from ..experiments.options import Options, options_of
from ..process.streams import PROGRAM, Stream

FLEET, EQUATIONS, ALL = "fleet", "equations", "all"
LINE_WIDTH = 80
TEXT = "command_line"  # the template
EXAMPLES = block(TEXT, "examples")
MAY_BE_NEGATIVE = "--joints", "--posture"  # their values may begin with a minus


class Once(argparse.Action):
    """Keeps the value of an option; an error if there is one already."""

    is_stated = False

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, _: str | None = None
    ) -> None:  # fmt: skip
        if self.is_stated:
            parser.error(f"{self.option_strings[0]} is stated twice")
        self.is_stated = True
        setattr(namespace, self.dest, values)


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, and whose help has no line too wide."""

    def __init__(self, **more: Any):
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, add_help=False, **more)

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {in_one_line(' '.join(message.split()))}\n")

    def add_option(self, word: str, option: Option, template: str) -> None:
        """Add an option; its help is the macro of its name, or the one that it names."""
        values: dict[str, Any] = {"action": "store_true"}
        if option.type:
            values = {"type": option.type, "metavar": option.metavar, "default": option.default}
            values["action"] = Once
        text = block(template, option.text or name_of(word))
        self.add_argument(word, help=" ".join(text.split()), **values)

    def refuse_option(self, word: str, options: Sequence[str]) -> NoReturn:
        """End with one line for a word that is not among the options."""
        name = word.split("=")[0]
        names = [option.strip("-") for option in options]
        hint = expected(name.strip("-"), names, " ".join(options)).replace("mean ", "mean --")
        self.error(f"{word!r} is not an option; {hint}")


def parser(command: str) -> Parser:
    """The parser of an experiment or of `all`, with the options that it takes and no others."""
    made = Parser(prog=PROGRAM, usage=f"{PROGRAM} {command} [options]")
    made.add_argument("-h", "--help", action="store_true", help=block(TEXT, "help"))
    for word, option in options_in(options_of(command)).items():
        made.add_option(word, option, TEXT)
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
    examples += [option.example for option in options_in(options_of(experiment)).values() if option.example]
    paragraphs = block(experiment, "help").split("\n\n")
    text = "\n\n".join(
        text if text.lstrip("\n").startswith("    ") else fill(text, LINE_WIDTH) for text in paragraphs
    )
    return block(TEXT, "experiment", name=experiment, summary=summary, text=text, examples=examples)


def help_of_all_commands() -> str:
    summaries = {name: block(name, "summary") for name in EXPERIMENTS}
    commands = {ALL: block(TEXT, "all")} | summaries
    commands |= {FLEET: block(TEXT, "fleet"), EQUATIONS: block(TEXT, "equations")}
    lines = [f"  {name:<13} {' '.join(text.split())}" for name, text in commands.items()]
    lines = [fill(line, LINE_WIDTH, subsequent_indent=" " * 16) for line in lines]
    return block(TEXT, "commands", lines=lines, examples=EXAMPLES)


def request(arguments: Sequence[str]) -> tuple[str, Options]:
    """The experiment, or all, and its options. SystemExit: with 0 after help, with 2 and one line for what is mistyped."""
    words = list(arguments) or ["--help"]
    if words[0] in ("-h", "--help"):
        print(help_of_all_commands(), file=Stream(sys.stdout), flush=True)
        raise SystemExit(0)
    command, *words = words
    if command != ALL and command not in EXPERIMENTS:
        refuse_command(command, arguments)
    for option in MAY_BE_NEGATIVE:
        if option in words[:-1]:
            at = words.index(option)
            words[at : at + 2] = [f"{option}={words[at + 1]}"]
    made = parser(command)
    values, unknown = made.parse_known_args(words)
    for word in sorted(unknown, key=lambda word: not word.startswith("-"))[:1]:
        if not word.startswith("-"):
            made.error(f"unexpected argument {word!r}: expected one experiment, or all")
        if takers := [name for name in EXPERIMENTS if word.split("=")[0] in options_in(options_of(name))]:
            made.error(f"{word} is an option of {', '.join(takers)}; {command} does not take it")
        made.refuse_option(word, list(options_in(options_of(command))))
    if values.help:
        made.description = block(TEXT, "help_of_all") if command == ALL else help_of(command)
        made.print_help()
        raise SystemExit(0)
    del values.help
    options = options_of(command)(**vars(values))
    if options.get("joints") and ":" not in (options.reference or ""):
        made.error("--joints needs equations of your own: --reference FILE.py:OBJECT or MODULE:OBJECT")
    needs_file = command != ALL and EXPERIMENTS[command].needs_file
    if needs_file and not (options.mjcf or options.reference):
        made.error(f"{command} needs a robot's file or equations of your own (--mjcf, --reference)")
    return command, options


def refuse_command(command: str, arguments: Sequence[str]) -> NoReturn:
    """End with one line for a first word that is no command."""
    made, known = Parser(prog=PROGRAM), [*EXPERIMENTS, ALL, FLEET, EQUATIONS]
    if not command.startswith("-"):
        choices = f"{', '.join(EXPERIMENTS)} or all"
        hint = expected(command, [*known, "help"], choices).replace("mean help", "mean --help")
        made.error(f"{command!r} is not an experiment; {hint}")
    later = [word for word in arguments if word in known]
    first = later[0] if later else ALL
    others = [word for word in arguments if word != first]
    what = f"{first} must come first" if later else f"expected an experiment: {', '.join(EXPERIMENTS)} or all"
    made.error(f"{what}, as in {PROGRAM} {first} {shlex.join(others)}")
