"""What a report is of: its title and its first sentences."""

from collections.abc import Sequence

from ..judge.words import capital, listed


def title(robot) -> str:
    return f"{'Your equations' if robot.own else 'TMT'} and MuJoCo compared on {robot.described or robot.name}"


def first_lines(reference) -> Sequence[str]:
    """What the report is of, as on the terminal: what is compared with what, what is open, what MuJoCo warns of."""
    return () if reference is None else reference.lines


def introduction(robot) -> str:
    """What is compared, and how its tables are read."""
    named = robot.described or robot.name
    what = f"{how_many(len(robot.tree.body_names), 'rigid body', 'rigid bodies')} on {joints_in_words(robot)}"
    return (of_file(named, what, robot) if robot.is_read else of_two_models(named, what)) + (
        " Each difference stands beside a tolerance that was "
        "fixed beforehand (column bar); 'exact' is the method in 50-digit arithmetic, and distances from it are in eps = "
        "2.2e-16 of the quantity's scale. Of the states in a row, the largest difference is the largest of all; the worst is "
        "the one that comes closest to its tolerance."
    )


def of_two_models(named: str, what: str) -> str:
    """What is compared of a robot whose numbers are stated."""
    return (
        f"{capital(named)}, {what}, modelled twice: as MJCF, run by MuJoCo, and by the TMT method in a program that shares "
        "nothing with it."
    )


def of_file(named: str, what: str, robot) -> str:
    """What is compared of a robot that is read from a file, and what is switched off for that."""
    if robot.own:
        compared = f"{named}: {what}. Your equations, which give {listed(robot.own)}, are compared with MuJoCo's. "
    elif robot.stated_in:
        compared = (
            f"{named}: {what}. tmt's equations of motion for the numbers of {robot.stated_in} are compared with MuJoCo's for "
            "this file. "
        )
    else:
        compared = (
            f"{named}: {what}. The numbers are those of the model as MuJoCo compiled it; tmt's equations of motion for these "
            "numbers are compared with MuJoCo's, so that an agreement says that the equations are the same, and not that the "
            "numbers are right. "
        )
    off = [f"{feature.feature} ({feature.count})" for feature in robot.features if feature.treatment != "modelled"]
    return (
        compared
        + (f"Switched off in MuJoCo, because the equations do not have it: {', '.join(off)}." if off else
           "Nothing of the file is switched off.")
    )  # fmt: skip


def joints_in_words(robot) -> str:
    """The joints of a robot by their kinds: of a file as it has them, a free joint as one."""
    words = {"hinge": "hinges", "slide": "slides", "ball": "balls", "free": "free joints"}
    kinds = robot.tree.kind
    known = {feature.feature: feature.count for feature in robot.features} or {k: kinds.count(k) for k in kinds}
    singular = {"free": "free joint"}
    return listed([how_many(known[k], singular.get(k, k), many) for k, many in words.items() if known.get(k)])


def how_many(count: int, one: str, many: str) -> str:
    """So many of something, a small number in words."""
    words = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
    return f"{words[count] if count < len(words) else count} {one if count == 1 else many}"
