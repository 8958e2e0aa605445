"""The probable cause of a difference, of assert_agrees and of a run: in Mbar and h, or in the accelerations alone."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from tmt import Tree, literal

from ..core.cause import Cause
from ..core.finding import Finding
from ..core.text import say
from ..diagnosis import STATES_ASKED, Diagnosis, Stated, Values, diagnose
from ..diagnosis.cause import LEAST_STATES
from ..diagnosis.consistency import conditions, symmetric
from ..diagnosis.forces import LeftOver
from ..diagnosis.layout import ROUNDED, Entry
from ..diagnosis.regression import through_noise
from ..engines.own import QUICK, OwnEquations
from ..robots.coordinates import Coordinates
from .affine import CONSTANT, Affine
from .comparison import Comparison
from .tables import slips_of_tables
from .values import OF_CORIOLIS

SECONDS_OF_CAUSE = 4.5  # of a search
SECONDS_OF_SLOPES = 1.5  # of accelerations at several torques


class Why(NamedTuple):
    """What explains a difference, or what else is known of it."""

    text: str = ""
    is_found: bool = True  # whether that is a cause
    diagnosis: Diagnosis = Diagnosis(False)  # of Mbar and h
    forces: tuple[Cause, ...] = ()  # what else acts in the accelerations
    force_text: str = ""  # the same in words, or what else is known of it
    force_ratio: float = 0.0  # of a force left over to its tolerance, the largest


class Given(NamedTuple):
    """Values at some states that are explained, in the joints of the model that is right."""

    tree: Tree
    values: Values  # Mbar and h; NaN where they are not given
    tau: ndarray  # (states, nv)
    qdd: ndarray | None  # (states, nv) accelerations to explain
    stated: Stated | None = None
    equations: OwnEquations | None = None  # of the user
    rounding: float = ROUNDED  # of the scale of an entry
    bias: Callable[[ndarray], ndarray] | None = None  # of other speeds, where there is such a function
    mass_matrix: Callable[[ndarray], ndarray] | None = None  # of other positions

    def with_functions(self) -> "Given":
        """The same with the user's functions that are quick, which are asked for more values."""
        own = self.equations
        if own is None or own.seconds > QUICK or not own.has("bias"):
            return self
        mass_matrix = own.mass_matrix if own.has("mass_matrix") else None
        return self._replace(bias=partial(own.bias, self.values.q), mass_matrix=mass_matrix)

    @property
    def right(self) -> Values:
        """The model's Mbar and h."""
        tree, q, qd = self.tree, self.values.q, self.values.qd
        M, h = literal.mass_matrix(tree, q), literal.bias(tree, q, qd)
        return Values.of(tree, q, qd, M, h, self.rounding)

    def left_over(self, values: Values, tau: ndarray) -> LeftOver:
        """The force that the accelerations leave over."""
        assert self.qdd is not None
        return LeftOver(self.tree, values, tau, self.qdd, self.rounding)


def why(given: Given) -> Why:
    """What explains values: of Mbar and h, and of accelerations beside them; of accelerations alone where these agree."""
    if holes := without_numbers(given):  # what the other entries have in common may be chance
        return Why(say(Finding("agreement", "holes", {"entries": holes})), False)
    are_given = bool(np.isfinite(given.values.packed).any())
    found = of_equations(given) if are_given else Why("", False)
    if given.qdd is not None and not found.diagnosis.differs:
        return of_accelerations(given)
    if given.qdd is None or not given.values.are_finite:
        return found
    left_over = given.left_over(given.values, given.tau)
    if left_over.ratio <= 1.0:
        return found._replace(force_ratio=left_over.ratio)
    text = left_over.sentence() or say(Finding("agreement", "another"))
    both = f"{found.text} {text}" if found.is_found else found.text
    return found._replace(text=both, forces=left_over.causes, force_text=text, force_ratio=left_over.ratio)


def without_numbers(given: Given) -> list[str]:
    """The entries of a given Mbar or h that are finite at no state, "h[hip]"."""
    names, holes = Coordinates(given.tree.joint_names, given.tree.kind).speeds, list[str]()
    for kind, values in (("M", given.values.mass_matrix), ("h", given.values.bias)):
        known = np.isfinite(values).any(axis=0)
        missing = np.argwhere(~known & known.any()).tolist()
        holes += [Entry(kind, tuple(at)).named(names) for at in missing]
    return holes


def of_equations(given: Given) -> Why:
    """What a diagnosis finds in values of Mbar and h."""
    values, equations = given.values, given.equations
    diagnosis = diagnose(given.tree, values, SECONDS_OF_CAUSE, given.bias, given.stated, given.mass_matrix)
    if not diagnosis.differs:
        return Why("", False, diagnosis)
    if not diagnosis.causes and is_single(values.packed):
        return Why(say(Finding("agreement", "single")), False, diagnosis)
    broken = list[str]()
    if equations and given.mass_matrix and values.are_finite and not diagnosis.causes:
        tested = conditions(given.mass_matrix, equations.bias, equations.coordinates, values.q, values.qd)
        broken = [condition.text for condition in tested if not condition.is_met]
    if not diagnosis.is_symmetric:
        names = Coordinates(given.tree.joint_names, given.tree.kind).speeds
        broken = [symmetric(values.mass_matrix, values.tolerances[0].max(axis=(1, 2)), names).text]
    return Why(" ".join([diagnosis.sentence(), *broken[:1]]), bool(diagnosis.causes), diagnosis)


def is_single(values: ndarray) -> bool:
    """Whether all numbers have single precision, and some of them need all of it."""
    finite = values[np.isfinite(values)]
    return bool((finite == finite.astype(np.float32)).all() and (finite != finite.astype(np.float16)).any())


def of_accelerations(given: Given) -> Why:
    """What explains accelerations alone: a force, how they are solved for, or the bias if Mbar is right."""
    right, equations = given.right, given.equations
    left_over = given.left_over(right, given.tau)
    ratio = left_over.ratio
    if ratio <= 1.0:
        return Why("", False, force_ratio=ratio)
    if left_over.causes:
        return of_force(left_over.sentence(), left_over.causes, ratio)
    q, are_given = right.q, given.values.are_finite
    solved = of_force(say(Finding("agreement", "solved")), (), ratio)
    is_asked = equations is not None and equations.has("acceleration")
    if not is_asked or equations is None or equations.seconds * len(q) * (len(q[0]) + 1) > SECONDS_OF_SLOPES:
        return solved if are_given else of_needed_forces(given, left_over)
    affine = Affine(given.tree, equations)
    inputs, by_inputs = affine.inputs(q), None
    if (np.abs(inputs - np.eye(len(inputs))) > CONSTANT).any():
        by_inputs = of_inputs(inputs, given.left_over(right, given.tau @ inputs.T), ratio)
        if by_inputs.is_found or are_given:
            return by_inputs
    if are_given:
        return solved
    values = affine.values(q, right.qd, given.rounding)
    if values is None:
        return by_inputs or of_needed_forces(given, left_over)
    asked = partial(diagnose, given.tree, values, SECONDS_OF_CAUSE, with_forces=True)
    if equations.seconds <= QUICK:
        bias = partial(affine.bias, q, values.mass_matrix)
        asked = partial(asked, bias=bias, stated=given.stated, mass_matrix=affine.mass_matrix)
    diagnosis = asked()
    if by_inputs and not diagnosis.causes:
        return by_inputs
    return of_force(diagnosis.sentence(), diagnosis.causes, ratio)


def of_force(text: str, causes: tuple[Cause, ...], ratio: float) -> Why:
    return Why(text, bool(causes), forces=causes, force_text=text, force_ratio=ratio)


def of_inputs(factors: ndarray, left_over: LeftOver, ratio: float) -> Why:
    """Torques that act with other factors or elsewhere, and what else acts; left_over: with these factors."""
    names = Coordinates(left_over.tree.joint_names, left_over.tree.kind).speeds
    off = np.argwhere(np.abs(factors - np.eye(len(names))) > CONSTANT).tolist()
    wrong = [(names[j], names[i] if i != j else "", float(factors[i, j])) for i, j in off]
    text = f"{say(Finding('agreement', 'inputs', {'factors': wrong}))} {left_over.sentence()}".strip()
    cause = Cause(
        rank=2, kind="input", unit="times", text=text.removesuffix("."),
        place=" and ".join(f"tau of {name}{f' at {at}' * bool(at)}" for name, at, _ in wrong),
        stated=", ".join("0" if at else "1" for _, at, _ in wrong),
        explains=", ".join(f"{factor:.7g}" for *_, factor in wrong),
    )  # fmt: skip
    return of_force(text, (cause,), ratio)._replace(is_found=left_over.ratio <= 1.0 or bool(left_over.causes))


def of_needed_forces(given: Given, left_over: LeftOver) -> Why:
    """What explains accelerations by the forces Mbar qdd + h = tau - D qd - k (q - rest) that they need."""
    right, qdd = left_over.values, given.qdd
    assert qdd is not None
    force = left_over.force + right.bias + np.einsum("sij,sj->si", right.mass_matrix, qdd)
    alone = right._replace(bias=force, tolerances=(right.tolerances[0], left_over.tolerance))
    diagnosis = diagnose(given.tree, alone, SECONDS_OF_CAUSE, stated=given.stated, qdd=qdd)
    text = diagnosis.sentence() if diagnosis.causes else say(Finding("agreement", "accelerations_alone"))
    return of_force(text, diagnosis.causes, left_over.ratio)


# the arguments of assert_agrees


def cause_of(comparison: Comparison) -> Why:
    """The probable cause of what differs: slips of a table, else of its equations, else one number beside noise."""
    every = [name for name, compared in comparison.compared.items() if compared.fails]
    failing = [name for name in every if name not in OF_CORIOLIS]
    if not failing:
        return of_coriolis(comparison, every)
    if slips := slips_of_tables(comparison):
        return Why(" ".join(map(say, slips)))
    which = some_states(comparison)
    if len(which) < min(LEAST_STATES, len(comparison.q)):
        return Why("", False)  # too few of them are numbers
    yours, tolerances = ({name: part[which] for name, part in parts.items()}
                         for parts in (comparison.values, comparison.tolerances))  # fmt: skip
    is_gravity = "bias" not in yours or ("gravity" in failing and "bias" not in failing)
    of_h = "gravity" if "gravity" in yours and is_gravity else "bias"
    qd = comparison.qd[which] * (of_h == "bias" or failing == ["acceleration"])
    given = yours.get("mass_matrix"), yours.get(of_h)
    values = Values.of(comparison.tree, comparison.q[which], qd, *given, comparison.rounding)
    allowed = (tolerances.get(name, part) for name, part in zip(("mass_matrix", of_h), values.tolerances))
    values = values._replace(tolerances=tuple(allowed))
    qdd = yours["acceleration"] if "acceleration" in failing else None
    about = qdd, Stated(comparison.joints), comparison.equations, comparison.rounding
    found = why(Given(comparison.tree, values, comparison.tau[which], *about).with_functions())
    name = "acceleration" if failing == ["acceleration"] else of_h
    return found if found.is_found else of_noise(comparison, name) or found


def of_coriolis(comparison: Comparison, failing: list[str]) -> Why:
    """Which of its two laws a Coriolis matrix breaks, and whether its transpose or a multiple keeps them."""
    products = comparison.compared["C qd"]
    turned = comparison.coriolis.swapaxes(1, 2) @ comparison.qd[:, :, None]
    off = np.abs(comparison.own("C qd")(turned[:, :, 0]) - products.right)
    factor = float((products.yours * products.right).sum() / ((products.right**2).sum() or 1.0))
    is_multiple = bool((np.abs(products.yours - factor * products.right) <= products.tolerance).all())
    is_transposed = "C qd" in failing and bool((off <= products.tolerance).all())
    is_multiple &= "C qd" in failing and not is_transposed
    values = {"failing": failing, "is_transposed": is_transposed, "factor": factor if is_multiple else None}
    return Why(say(Finding("agreement", "coriolis", values)), is_transposed or is_multiple)


def some_states(comparison: Comparison) -> ndarray:
    """As many states as a diagnosis takes: of those with finite values the first, and the worst."""
    ratios = [compared.ratio for compared in comparison.compared.values()]
    worst = np.max([ratio.reshape(len(ratio), -1).max(axis=1) for ratio in ratios], axis=0)
    finite = np.flatnonzero(np.isfinite(worst))
    return np.unique([*finite[np.argsort(-worst[finite])[:1]], *finite[: STATES_ASKED - 1]]).astype(int)


def of_noise(comparison: Comparison, name: str) -> Why | None:
    """A number that is wrong in tables with noise, with its uncertainty, or noise alone; None: something else.

    name: of the table of h, of gravity or of accelerations.
    """
    tree, q, qd, given = comparison.tree, comparison.q, comparison.qd, comparison.values
    equations = comparison.equations
    if equations is not None and any(map(equations.has, given)):
        return None
    qdd, h, M = None, given.get(name), given.get("mass_matrix")
    if name == "acceleration":
        qdd, M = h, None
        h = comparison.tau - np.array(tree.damping) * qd - literal.spring_torque(tree, q)
    found = through_noise(tree, Values.of(tree, q, 0.0 * qd if name == "gravity" else qd, M, h), qdd)
    if found is None:
        return None
    text = say(Finding("agreement", "noisy" if found.cause else "noise_alone", {"found": found}))
    return Why(text, found.cause is not None)
