"""Who takes part: the scenes that are followed, the methods of the engines that are there, and their steps and tolerances."""

from collections.abc import Mapping, Sequence

from tmt import Tree
from tmt.methods import method_named

from ...engines import COMPARED, GRID, LABELS, Engine, Method, Setting, methods_in, one_of_each_scheme
from ...robots import Robot
from ...robots.case import Case
from ..setup import Setup

FINEST = {"mujoco": 2**16, "tmt": 2**18}  # steps beyond which a run would take too long to be timed again and again
FINEST_RK4, FINEST_IMPLICIT = 2**17, 2**15  # of MuJoCo's RK4; of methods that solve their stages, and of other engines
EXPONENTS = {  # of the coarsest and of the finest tolerance, 10^-k
    "dopri8_adaptive": (2, 14), "RK45": (2, 12), "DOP853": (2, 13), "Radau": (2, 6), "LSODA": (2, 12), "Taylor": (4, 16),
}  # fmt: skip
OTHER_EXPONENTS = (2, 12)
FEW_SETTINGS, FEW_OTHERS = (
    {"quick": 5, "small": 7},
    2,
)  # settings of a run that is not full: the coarsest; of further engines
NEARER = slice(3, 7)  # of the settings: coarse ones that come near the reference where the motion is tame
# of the robot of a file, whose number of joints has no bound: seconds of one evaluation are about a constant times nv^1.5
CALL_SECONDS, COMPILED_SECONDS, MUJOCO_SECONDS = (
    4e-7,
    5e-8,
    2e-7,
)  # s: called from Python, of tmt's compiled code, of MuJoCo
ITERATIONS = 3  # of Newton's method for the stages of an implicit step, about
MOST_SECONDS = {"full": 0.6, "quick": 0.1, "small": 0.1}  # of the finest run of a method, by this estimate
LEAST_SETTINGS = {"full": 3, "quick": 2, "small": 2}  # of any method, whatever they take
QUICK_SPEEDS = 4  # up to which a quick run has methods that solve their stages
SLOWEST_RUN = 0.6  # s: a method whose coarsest run alone takes so long, by this estimate, is left out


def scenes_of(robot: Robot) -> list[Case]:
    """The scenes that every method follows: those with the tag, and a user's own; a file's robot that is held shows nothing."""
    return [
        case
        for case in robot.cases
        if "speed" in case.scene.tags or (is_own(case) and not (robot.is_read and case.is_held))
    ]


def is_own(case: Case) -> bool:
    """Whether a scene is a user's own."""
    return case.scene.tags == ("own",)


def regular_of(robot: Robot) -> Case:
    """Of these scenes the one in which errors fall regularly from coarse steps on; the first, if none is said to."""
    cases = scenes_of(robot)
    return next((case for case in cases if "regular" in case.scene.tags), cases[0])


def followed(robot: Robot, size: str) -> list[Case]:
    """The scenes of a run of this size: all; of a quick one the regular one and a user's own; of a small one two."""
    cases, regular = scenes_of(robot), regular_of(robot).name
    if size == "quick":
        return [case for case in cases if case.name == regular or is_own(case)]
    return [case for k, case in enumerate(cases) if size == "full" or k == 0 or case.name == regular]


def taking_part(engines: Mapping[str, Engine], size: str) -> dict[str, Engine]:
    """The engines of a run of this size, unavailable ones too; of a quick run the two that are compared."""
    return {name: engine for name, engine in engines.items() if size != "quick" or name in COMPARED}


def methods(
    engines: Mapping[str, Engine],
    size: str,
    which: str = "all",
    robot: Robot | None = None,
    case: Case | None = None,
) -> list[Method]:
    """The methods of all engines that are there; "same schemes": one of MuJoCo for each scheme, and the same in tmt.

    case: of the robot, if its own actuators may act there: then some are other schemes.
    """
    if which == "same schemes":
        theirs = one_of_each_scheme(engines["mujoco"])
        schemes = {method.scheme for method in theirs}
        return [*theirs, *(method for method in engines["tmt"].methods.values() if method.scheme in schemes)]
    out = left_out(engines, size, robot)
    return [
        method
        for engine in taking_part(engines, size).values()
        for method in (methods_in(engine, case) if case else engine.methods).values()
        if (engine.name, method.name) not in out
    ]


def methods_following(setup: Setup, cases: Sequence[Case], which: str) -> list[Method]:
    """The methods that follow any of the cases, each once."""
    found = {}
    for case in cases:
        of_case = methods(setup.engines, setup.size, which, setup.robot, case)
        found = {(method.engine, method.name): method for method in of_case} | found
    return list(found.values())


def schemes_in(setup: Setup, cases: Sequence[Case]) -> dict[str, dict[str, str]]:
    """Of each case by its name {integrator of MuJoCo: the method of tmt that is the same scheme}."""
    mujoco = setup.engines["mujoco"]
    return {case.name: {method.name: method.scheme for method in methods_in(mujoco, case).values()} for case in cases}


def left_out(engines: Mapping[str, Engine], size: str, robot: Robot | None) -> dict[tuple[str, str], str]:
    """{(engine, method): why it takes no part}: an engine is not there, or what it makes of this robot would take too long."""
    out = {}
    for engine in taking_part(engines, size).values():
        too_long = getattr(engine, "too_long", lambda tree: None)
        reason = engine.unavailable() or (robot and too_long(robot.tree))
        for method in engine.methods.values():
            if why := reason or (robot and too_slow(method, robot, size)):
                out[engine.name, method.name] = why
    return out


def too_slow(method: Method, robot: Robot, size: str) -> str | None:
    """Why a method is left out, as even its coarse steps take too long with so many joints; None: it is not."""
    if not robot.is_read or method.adaptive:
        return None
    case, n = regular_of(robot), robot.coordinates.nv
    seconds = coarsest_steps(case) * estimated(method, case.tree)
    if seconds > SLOWEST_RUN:
        return f"with {n} speeds its coarsest run alone would take about {seconds:.1g} s"
    if size == "quick" and n > QUICK_SPEEDS and method.engine == "tmt" and method_named(method.name).solves_stages:
        return f"with {n} speeds its code takes too long to make for a quick run"
    return None


def estimated(method: Method, tree: Tree) -> float:
    """Seconds of a step, or of an evaluation of a method that chooses its own steps: about, whatever the machine."""
    n = tree.coordinates.nv
    if method.engine == "mujoco":
        return MUJOCO_SECONDS * n**1.5 * (4 if method.name == "RK4" else 1)
    if method.engine != "tmt":
        return CALL_SECONDS * n**1.5
    stepping = method_named(method.name)
    evaluation = COMPILED_SECONDS * n**1.5
    if method.adaptive:
        return evaluation
    if stepping.solves_stages:
        return evaluation * stepping.stages**2 * n * ITERATIONS
    return evaluation * stepping.stages * (n if getattr(stepping, "implicit_bias", False) else 1)


def settings_of(method: Method, case: Case, size: str = "full", which: str = "all") -> tuple[Setting, ...]:
    """With what a method follows a case, from coarse to fine."""
    found = tolerances(method, case) if method.adaptive else halvings(method, case, size)
    if which == "same schemes":
        return found[NEARER] or found[-1:]
    few = FEW_SETTINGS if method.engine in COMPARED else dict.fromkeys(FEW_SETTINGS, FEW_OTHERS)
    return found[: few.get(size)]


def halvings(method: Method, case: Case, size: str = "full") -> tuple[Setting, ...]:
    """Steps that are halved and halved again: first the scene's own, or a little finer, as the times of reading ask for."""
    count, finest = coarsest_steps(case), finest_steps(method)
    if case.robot.is_read:
        affordable = int(MOST_SECONDS[size] / estimated(method, case.tree))
        finest = max(min(finest, affordable), count << (LEAST_SETTINGS[size] - 1))
    doublings = max(1, (finest // count).bit_length())
    return tuple(Setting(case.duration, steps=count << k) for k in range(doublings))


def coarsest_steps(case: Case) -> int:
    """The least multiple of 64 that is no less than the scene's own number of steps; 64 where servos act.

    There a scene's own steps are short for the sake of methods that are explicit in the speeds, as others need not be.
    """
    return GRID if case.controller else -(-case.steps // GRID) * GRID


def finest_steps(method: Method) -> int:
    """The number of the finest steps of a method."""
    if (method.engine, method.name) == ("mujoco", "RK4"):
        return FINEST_RK4
    if method.engine == "tmt" and method_named(method.name).solves_stages:
        return FINEST_IMPLICIT
    return FINEST.get(method.engine, FINEST_IMPLICIT)


def tolerances(method: Method, case: Case) -> tuple[Setting, ...]:
    """Tolerances that are divided by ten again and again."""
    first, last = EXPONENTS.get(method.name, OTHER_EXPONENTS)
    return tuple(Setting(case.duration, tolerance=10.0**-k) for k in range(first, last + 1))


def unavailable(setup: Setup, names: Sequence[str]) -> list[dict]:
    """A row for each scene, each engine that cannot take part and why: with its methods that are left out; no numbers."""
    groups = {}
    for (engine, method), reason in left_out(setup.engines, setup.size, setup.robot).items():
        groups.setdefault((engine, reason), []).append(method)
    return [
        {"scene": name, "engine": engine, "method": ", ".join(out), "why_not": reason}
        for name in names
        for (engine, reason), out in groups.items()
    ]


def absent_in_words(row: dict, engines: Mapping[str, Engine]) -> str:
    """Who takes no part and why, in a sentence."""
    whole = row["method"] == ", ".join(engines[row["engine"]].methods)
    who = LABELS.get(row["engine"], row["engine"])
    takes = "takes" if whole or ", " not in row["method"] else "take"
    return f"{who if whole else row['engine'] + ' ' + row['method']} {takes} no part: {row['why_not']}."


def too_long_next(method: Method, case: Case, work: int, size: str) -> bool:
    """Whether the next tolerance of a method that chooses its own steps would take too long with the robot of a file."""
    return case.robot.is_read and method.adaptive and work * estimated(method, case.tree) > MOST_SECONDS[size] / 2.0
