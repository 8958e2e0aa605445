"""What is run: scenes, methods of the available engines, steps or tolerances of each method."""

from collections.abc import Mapping

from tmt import Tree
from tmt.methods import method_named

from ...engines import IN_QUICK_RUNS, RECORDS, Engine, Method, Setting, methods_in
from ...robots import Robot
from ...robots.case import Case
from ...truth.reference import coarsest_steps

# steps; more would take too long
FINEST = {"mujoco": 2**15, ("mujoco", "RK4"): 2**16, "tmt": 2**18}
FINEST_OTHERS = 2**15  # of other engines, and of methods that solve their stages
EXPONENTS = {  # k of the coarsest and of the finest tolerance, 10^-k
    "dopri8_adaptive": (2, 14), "RK45": (2, 10), "DOP853": (2, 13), "Radau": (2, 4), "LSODA": (2, 12),
    "Taylor": (4, 16),
}  # fmt: skip
FEW_SETTINGS = {"quick": 5, "small": 7}  # of a run that is not full: the coarsest settings
FEW_OTHERS = 2  # the same for engines other than MuJoCo and tmt
# A robot from a file may have any number of joints. Seconds of one evaluation are about a constant times
# nv^1.5; an engine that is called from Python adds those of a call and of the solver's own work:
SECONDS, CALL_SECONDS = {"mujoco": 2e-7, "tmt": 5e-8}, 3e-5
ITERATIONS = 3  # of Newton's method for the stages of an implicit step, about
MOST_SECONDS = {"full": 0.6, "quick": 0.1, "small": 0.1}  # estimated, of the finest run of a method
LEAST_SETTINGS = {"full": 3, "quick": 2, "small": 2}  # of a method, whatever they take
QUICK_SPEEDS = 4  # nv up to which a quick run has methods that solve their stages
SLOWEST_RUN = 0.6  # s, estimated: a method whose coarsest run takes longer is left out


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
    """The engines that follow a scene; the experiment `engines` compares those that read the file."""
    names = [name for name in engines if size != "quick" or name in IN_QUICK_RUNS]
    return [engines[name] for name in names if not RECORDS[name].reads_file]


def methods(engines: Mapping[str, Engine], size: str, case: Case) -> list[Method]:
    """The methods by which a case is followed. Where the robot's actuators act, some have other schemes."""
    excluded = left_out(engines, size, case.robot)
    candidates = [method for engine in asked(engines, size) for method in methods_in(engine, case).values()]
    return [method for method in candidates if (method.engine, method.name) not in excluded]


def left_out(engines: Mapping[str, Engine], size: str, robot: Robot) -> dict[tuple[str, str], str]:
    """Methods that are not run, (engine, method), and why: no engine, or too slow for this robot."""
    reasons = {}
    for engine in asked(engines, size):
        too_long = getattr(engine, "too_long", lambda tree: None)
        of_engine = engine.unavailable() or too_long(robot.tree)
        for method in engine.methods.values():
            if reason := of_engine or too_slow(method, robot, size):
                reasons[engine.name, method.name] = reason
    return reasons


def too_slow(method: Method, robot: Robot, size: str) -> str | None:
    """Why a method is left out for a robot of many joints; None: it is not."""
    if not robot.is_read or method.adaptive:
        return None
    case, n = regular_of(robot), robot.coordinates.nv
    seconds = coarsest_steps(case) * estimated(method, case.tree)
    if seconds > SLOWEST_RUN:
        return f"with {n} speeds its coarsest run would take about {seconds:.1g} s"
    is_large = size == "quick" and n > QUICK_SPEEDS
    if is_large and method.engine == "tmt" and method_named(method.name).solves_stages:
        return f"with {n} speeds its code takes too long to compile for a quick run"
    return None


def estimated(method: Method, tree: Tree) -> float:
    """Approximate seconds of a step, or of an evaluation of a method with adaptive steps."""
    n = tree.coordinates.nv
    is_called = method.engine not in SECONDS
    evaluation = SECONDS.get(method.engine, SECONDS["tmt"]) * n**1.5 + CALL_SECONDS * is_called
    if method.engine == "mujoco":
        return evaluation * (4 if method.name == "RK4" else 1)
    if method.engine != "tmt" or method.adaptive:
        return evaluation
    stepping = method_named(method.name)
    if stepping.solves_stages:
        return evaluation * stepping.stages**2 * n * ITERATIONS
    return evaluation * stepping.stages * (n if getattr(stepping, "implicit_bias", False) else 1)


def settings_of(method: Method, case: Case, size: str = "full") -> tuple[Setting, ...]:
    """The settings of a method, from coarse to fine: steps are halved, tolerances divided by ten."""
    first, last = EXPONENTS.get(method.name, (2, 12))
    settings = tuple(Setting(case.duration, tolerance=10.0**-k) for k in range(first, last + 1))
    if not method.adaptive:
        settings = halvings(method, case, size)
    few = FEW_SETTINGS.get(size)
    return settings[: FEW_OTHERS if few and method.engine not in IN_QUICK_RUNS else few]


def halvings(method: Method, case: Case, size: str = "full") -> tuple[Setting, ...]:
    """The scene's own step, halved repeatedly."""
    count = coarsest_steps(case)
    solves = method.engine == "tmt" and method_named(method.name).solves_stages
    of_engine = FINEST.get(method.engine, FINEST_OTHERS)
    finest = FINEST_OTHERS if solves else FINEST.get((method.engine, method.name), of_engine)
    if case.robot.is_read:
        affordable = int(MOST_SECONDS[size] / estimated(method, case.tree))
        finest = max(min(finest, affordable), count << (LEAST_SETTINGS[size] - 1))
    halved = max(1, (finest // count).bit_length())
    return tuple(Setting(case.duration, steps=count << k) for k in range(halved))
