"""What is run: scenes, methods of the available engines, steps or tolerances of each method."""

from collections.abc import Mapping
from typing import NamedTuple

from tmt.methods import method_named

from ...engines import IN_QUICK_RUNS, RECORDS, Engine, Method, Setting
from ...robots import Robot
from ...robots.case import Case
from ...truth.reference import coarsest_steps

# steps; more would take too long
FINEST, FINEST_OTHERS = {"tmt": 2**18}, 2**15
EXPONENTS = {  # k of the coarsest and of the finest tolerance, 10^-k
    "dopri8_adaptive": (2, 14), "RK45": (2, 10), "DOP853": (2, 13), "Radau": (2, 4), "LSODA": (2, 12),
    "Taylor": (4, 16), "RK3 adaptive": (2, 9), "Radau3 adaptive": (2, 7),
}  # fmt: skip
FEW_SETTINGS = {"quick": 5, "small": 7}  # of a run that is not full: the coarsest settings
FEW_OTHERS = 2  # the same for engines other than MuJoCo and tmt
LEAST_SETTINGS = {"full": 3, "quick": 2, "small": 2}  # of a method, whatever they take
# seconds of the finest run of a method; of a method whose coarsest run takes longer there is none; and after
# which a method of a called engine has no finer run
MOST_SECONDS, SLOWEST_RUN, LONGEST_CALLED = {"full": 0.15, "quick": 0.1, "small": 0.1}, 0.6, 0.06
# A robot may have any number of joints. Seconds of one evaluation are about a constant times nv^1.5; an
# engine that is called from Python adds those of a call and of the solver's own work:
SECONDS, CALL_SECONDS = {"mujoco": 2e-7, "tmt": 5e-8}, 3e-5
ITERATIONS = 3  # of Newton's method for the stages of an implicit step, about
QUICK_SPEEDS = 4  # nv up to which a quick run has methods that solve their stages


class Budget(NamedTuple):
    """What a run of a method may take. steps, settings: at most; why_not: the reason why there is no run."""

    settings: int = 0
    steps: int = 0
    seconds: float = 0.0  # a method of a called engine has no finer run after one that takes longer
    why_not: str = ""


def budget(method: Method, robot: Robot, size: str) -> Budget:
    """The budget of a method for a robot in a run of this size, from estimated times of its steps."""
    case, n, most = regular_of(robot), robot.coordinates.nv, MOST_SECONDS[size]
    finest = FINEST.get(method.engine, FINEST_OTHERS)
    settings = FEW_SETTINGS.get(size, finest)
    if size != "full" and method.engine not in IN_QUICK_RUNS:
        settings = FEW_OTHERS
    if method.adaptive or RECORDS[method.engine].reads_file:  # whose runs are timed one by one
        return Budget(settings, finest, LONGEST_CALLED)
    step, solves = estimated(method, n), method.engine == "tmt" and method_named(method.name).solves_stages
    if robot.is_read and (seconds := coarsest_steps(case) * step) > SLOWEST_RUN:
        return Budget(why_not=f"with {n} speeds its coarsest run would take about {seconds:.1g} s")
    if robot.is_read and size == "quick" and n > QUICK_SPEEDS and solves:
        return Budget(why_not=f"with {n} speeds its code takes too long to compile for a quick run")
    least = coarsest_steps(case) << (LEAST_SETTINGS[size] - 1)
    return Budget(settings, max(min(finest, int(most / step)), least), LONGEST_CALLED)


def estimated(method: Method, n: int) -> float:
    """Approximate seconds of a step with n speeds."""
    is_called = method.engine not in SECONDS
    evaluation = SECONDS.get(method.engine, SECONDS["tmt"]) * n**1.5 + CALL_SECONDS * is_called
    if method.engine == "mujoco":
        return evaluation * (4 if method.name == "RK4" else 1)
    if method.engine != "tmt":
        return evaluation
    stepping = method_named(method.name)
    if stepping.solves_stages:
        return evaluation * stepping.stages**2 * n * ITERATIONS
    return evaluation * stepping.stages * (n if getattr(stepping, "implicit_bias", False) else 1)


def settings_of(method: Method, case: Case, size: str = "full") -> tuple[Setting, ...]:
    """The settings of a method within its budget, from coarse to fine: the scene's own step, halved; tolerances / 10."""
    allowed, coarsest = budget(method, case.robot, size), coarsest_steps(case)
    if method.adaptive:
        first, last = EXPONENTS.get(method.name, (2, 10))
        settings = [Setting(case.duration, tolerance=10.0**-k) for k in range(first, last + 1)]
    else:
        halved = (allowed.steps // coarsest).bit_length()
        settings = [Setting(case.duration, steps=coarsest << k) for k in range(halved)]
    return tuple(settings[: allowed.settings])


def scenes_of(robot: Robot) -> list[Case]:
    """The scenes with the tag `speed`, and a user's own except held postures of a file's robot."""
    cases = [case for case in robot.cases if not (robot.is_read and case.is_held)]
    return [case for case in cases if "speed" in case.scene.tags or is_own(case)]


def is_own(case: Case) -> bool:
    return case.scene.tags == ("own",)


def regular_of(robot: Robot) -> Case:
    """The scene in which errors are regular from coarse steps on; the first, if none has that tag."""
    cases = scenes_of(robot)
    return next((case for case in cases if "regular" in case.scene.tags), cases[0])


def followed(robot: Robot, size: str) -> list[Case]:
    """The scenes of a run. quick: the regular one and a user's own; small: the first and the regular one."""
    cases, regular = scenes_of(robot), regular_of(robot).name
    if size == "quick":
        return [case for case in cases if case.name == regular or is_own(case)]
    return [case for k, case in enumerate(cases) if size == "full" or k == 0 or case.name == regular]


def asked(engines: Mapping[str, Engine], size: str) -> list[Engine]:
    """The engines of a run that integrate: in a quick one MuJoCo and tmt, in a small one none that reads the file."""
    names = [name for name in engines if size != "quick" or name in IN_QUICK_RUNS]
    chosen = [engines[name] for name in names if size == "full" or not RECORDS[name].reads_file]
    return [engine for engine in chosen if engine.methods]


def methods(engines: Mapping[str, Engine], size: str, case: Case) -> list[Method]:
    """The methods by which a case is followed. Where the robot's actuators act, some have other schemes.

    Engines that read the file follow the regular scene alone: each of their runs is timed.
    """
    excluded, is_regular = left_out(engines, size, case.robot), case.name == regular_of(case.robot).name
    able = [engine for engine in asked(engines, size) if is_regular or not RECORDS[engine.name].reads_file]
    ready = [engine for engine in able if not engine.unavailable()]
    found = [method for engine in ready for method in engine.methods_in(case).values()]
    return [method for method in found if (method.engine, method.name) not in excluded]


def left_out(engines: Mapping[str, Engine], size: str, robot: Robot) -> dict[tuple[str, str], str]:
    """Methods that are not run, (engine, method), and why: no engine, or too slow for this robot."""
    reasons = {}
    for engine in asked(engines, size):
        too_long = getattr(engine, "too_long", lambda tree: None)
        of_engine = engine.unavailable() or too_long(robot.tree)
        for method in engine.methods.values():
            if reason := of_engine or budget(method, robot, size).why_not:
                reasons[engine.name, method.name] = reason
    return reasons
