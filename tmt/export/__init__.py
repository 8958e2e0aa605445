"""The equations of a Tree as text in another language."""

import hashlib
import keyword
import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from textwrap import wrap
from typing import Any

from tmt.compiled import forms
from tmt.compiled.straight import Traced
from tmt.derivation.mechanism import Mechanism
from tmt.derivation.quantities import QUANTITIES, is_quantity, quantity_of, shape_of, what_is_known
from tmt.derivation.vectors import Values
from tmt.model.tree import Tree, checked_model, stated
from tmt.model.values import positive, require, shown

from . import c, jax, scripts
from .parameters import OF_BODIES, Parameters
from .statements import Function, Program

LANGUAGES: dict[str, Callable[[Program], str]] = {
    "c": c.source, "c header": c.header, "python": scripts.python, "matlab": scripts.matlab,
    "casadi": scripts.casadi, "jax": jax.source,
}  # fmt: skip
SYMBOLIC = "latex", "html", "sympy"
OF_SYMBOLS = "mass_matrix", "bias", "gravity_balance"
UNITS = {
    "hinge": "rad, rad/s, N m",
    "slide": "m, m/s, N",
    "ball": "quaternion w x y z, rad/s in its own axes, N m",
}
# names that a file could not have: words of C, C++ and MATLAB, functions and modules that the files use
WORDS = """\
auto bool break case catch char class const continue default delete do double else elseif end enum extern
float for friend function global goto if inline int long namespace new operator otherwise parfor persistent
private public register restrict return short signed sizeof spmd static struct switch template this throw try
typedef typename union unsigned using virtual void volatile while main arrays sin cos sqrt atan size zeros
permute reshape assert error math numpy sympy"""
CONVENTIONS = """\
M(q) qdd + h(q, qd) = tau - D qd - k (q - rest) - P q - S qd, by the TMT method; Mbar is M, with armature.
h: bias, MuJoCo's qfrc_bias: Coriolis, centrifugal and gravity terms. D: damping, k and rest: springs,
P and S: gains of a linear controller. Numbers of the model that are no arguments are in the functions.
T_b, B_b: Jacobians of the centre of mass of body b, inertial frame, and of its angular velocity, body axes.
SI units, angles in rad. Shapes are those of one state; ... stands for any batch, where there is one."""


def equations(
    model: Tree,
    language: str = "c",
    quantities: Sequence[str] = ("mass_matrix", "bias", "acceleration"),
    *,
    name: str = "robot",
    single: bool = False,
    head: Sequence[str] = ("Not checked.",),
    parameters: Sequence[str] = (),
    limit: float = 60.0,
) -> str:
    """The equations of a model, with its numbers, as text in another language, for use without this package.

    Parameters
    ----------
    model : Tree
    language : {"c", "c header", "python", "matlab", "casadi", "jax", "latex", "html", "sympy"}
        C99 with math.h alone, no allocation; Python with NumPy alone, any batch; MATLAB and Octave, one file,
        states as columns; a casadi.Function for each quantity; JAX, any batch. The last three are simplified,
        with a symbol for each parameter, for some six hinges and slides (needs SymPy).
    quantities : functions of this package, by name; with symbols mass_matrix, bias, gravity_balance.
        As in `prepare` "step_derivatives:rk4", [A B] of a step, and "frame_pose:hand" and so on.
    name : of the file, which begins the names of C functions.
    single : float in C.
    head : lines that begin the comment at its head.
    parameters : numbers that are further arguments of each function: "gravity" (3,); a body's name, or with
        ".mass" (1,), ".com" (3,) or ".inertia" (6,), xx yy zz xy xz yz about the centre of mass, after it;
        "payload" and then a body's name: what that carries besides. They are in the frame that is the site of
        the body's name on its joint, else in that of its joint.
    limit : s, with symbols the most work, counted as that of one processor core; ValueError beyond.

    >>> print(tmt.equations(tmt.ARM, language="python", quantities=["gravity_balance"]).splitlines()[-1].strip())
    return out.reshape([*batch, 3])
    """
    checked_model(model)
    known = [*LANGUAGES, *SYMBOLIC]
    require(
        isinstance(language, str) and language in known, "language", language, f"one of {', '.join(known)} is"
    )
    is_symbolic, in_c = language in SYMBOLIC, language in ("c", "c header")
    chosen = checked_quantities(quantities, OF_SYMBOLS if is_symbolic else ())
    for word, values in (("head", head), ("parameters", parameters)):
        are_texts = isinstance(values, list | tuple) and all(isinstance(text, str) for text in values)
        require(are_texts, word, values, "a sequence of texts is")
    is_name = isinstance(name, str) and re.fullmatch("[A-Za-z][A-Za-z0-9_]{0,62}", name) and not is_word(name)
    require(is_name, "name", name, "an identifier, no word of C, Python or MATLAB and no quantity, is")
    in_single = isinstance(single, bool) and (in_c or not single)
    require(
        in_single, "single", single, f"True (single precision) in C alone, not in {language}, or False is"
    )
    limit = positive("limit", limit, "a number of seconds")
    arguments = Parameters(model, parameters)
    require(
        not (parameters and is_symbolic),
        "parameters",
        parameters,
        f"none in {language}, of symbols alone, are",
    )
    of_bodies = arguments.has_payload and OF_BODIES.intersection(chosen)
    require(not of_bodies, "quantity", of_bodies, "no row for each body, of which a payload has none, is")
    lines = [line for text in head for line in text.splitlines() or [""]]  # a comment each
    lines += ["", *conventions(model)]
    if is_symbolic:
        try:
            from . import documents, symbols
        except ImportError:
            raise ValueError("symbolic equations need SymPy: pip install sympy") from None
        writers = {"latex": documents.latex, "html": documents.page, "sympy": symbols.python_source}
        return writers[language](symbols.symbolic(model, chosen, limit), lines)
    if arguments.values:
        lines += ["Parameters and their values in the model:"]
        lines += [f"  {x}: {arguments.meanings[x]}: {list(value)}" for x, value in arguments.values.items()]
    functions = [function_of(model, quantity, arguments) for quantity in dict.fromkeys(chosen)]
    return LANGUAGES[language](Program(name, lines, functions, single))


def checked_quantities(quantities: Any, choices: Sequence[str]) -> tuple[str, ...]:
    chosen = tuple(quantities) if isinstance(quantities, list | tuple) else (quantities,)
    require(chosen, "quantities", chosen, "some quantity is")
    names: dict[str, str] = {}
    for quantity in chosen:
        is_right = is_quantity(quantity) and (not choices or quantity in choices)
        expected = f"one of {', '.join(choices)} is" if choices else what_is_known(quantity)
        require(is_right, "quantity", quantity, expected)
        is_new = names.setdefault(identifier(quantity), quantity) == quantity
        require(is_new, f"name of {shown(names[identifier(quantity)])}", identifier(quantity), "another is")
    return chosen


def is_word(name: str) -> bool:
    return keyword.iskeyword(name) or name in WORDS.split() or name in QUANTITIES


def conventions(model: Tree) -> list[str]:
    coordinates, m = model.coordinates, len(model.mass)
    sizes = f"nq = {coordinates.nq} numbers in q, nv = {coordinates.nv} in qd and tau, m = {m} bodies"
    lines = [
        *CONVENTIONS.splitlines(),
        *wrap(f"{sizes}: {', '.join(model.body_names)}.", 120),
        f"Numbers of the model: sha256 {hashlib.sha256(stated(model).encode()).hexdigest()[:16]}.",
        "Joint, kind, place in q, place in qd and tau (from 0); units of q, qd, tau:",
    ]
    for name, joint in zip(model.joint_names, coordinates.joints):
        lines.append(f"  {name}, {joint.kind}, {places(joint.q)}, {places(joint.qd)}; {UNITS[joint.kind]}")
    return lines


def places(part: slice) -> str:
    return f"{part.start}" if part.stop == part.start + 1 else f"{part.start}-{part.stop - 1}"


def function_of(model: Tree, name: str, parameters: Parameters) -> Function:
    import tmt  # for the docstring

    quantity, shape, nv = quantity_of(name), shape_of(name, model), model.coordinates.nv
    third = "qdd" if "qdd" in quantity.takes else "tau"
    sizes = {"q": model.coordinates.nq, "qd": nv, third: nv, "dt": 1}
    sizes |= {x: len(value) for x, value in parameters.values.items()}
    title = quantity.title or f"{getattr(tmt, name).__doc__.splitlines()[0]} Unit: {quantity.unit}."
    results, shape = (quantity.parts, shape[1:]) if quantity.parts else (("out",), shape)
    takes, operations = (*quantity.takes, *parameters.values), traced(model, name, parameters.words)
    return Function(identifier(name), title, takes, sizes, shape, results, operations)


def identifier(name: str) -> str:
    return re.sub(r"\W", "_", name, flags=re.ASCII)


@lru_cache(maxsize=16)
def traced(model: Tree, name: str, words: tuple[str, ...] = ()) -> Traced:
    parameters = Parameters(model, words)

    def tree_of(arrays: Sequence[Values]) -> Mechanism:
        return parameters.applied(dict(zip(parameters.values, arrays)))

    sizes = [len(value) for value in parameters.values.values()]
    return forms.quantity(model, name, sizes, tree_of if sizes else None)
