"""The equations of a Tree as text in another language; see `tmt.equations`."""

import hashlib
import keyword
import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from textwrap import wrap
from typing import Any, NamedTuple

from tmt.compiled import forms
from tmt.compiled.straight import Traced
from tmt.derivation.quantities import QUANTITIES
from tmt.model.arguments import checked_model
from tmt.model.tree import Tree, stated
from tmt.model.values import shown

from . import c, latex, matlab, page, python, symbols

LANGUAGES: dict[str, Callable[..., str]] = {
    "c": c.source,
    "c header": c.header,
    "python": python.source,
    "matlab": matlab.source,
}
SYMBOLIC: dict[str, Callable[..., str]] = {
    "latex": latex.latex,
    "html": page.page,
    "sympy": symbols.python_source,
}
OF_SYMBOLS = "mass_matrix", "bias", "gravity_balance"
UNITS = {
    "hinge": "rad, rad/s, N m",
    "slide": "m, m/s, N",
    "ball": "quaternion w x y z, rad/s in its own axes, N m",
}
# names that a file could not have: words of C, C++ and MATLAB, functions and modules that the files use
WORDS = """auto bool break case catch char class const continue default delete do double else elseif end enum extern float for
friend function global goto if inline int long namespace new operator otherwise parfor persistent private public register restrict
return short signed sizeof spmd static struct switch template this throw try typedef typename union unsigned using virtual void
volatile while main arrays sin cos sqrt atan size zeros permute reshape assert error math numpy sympy"""


class Function(NamedTuple):
    """A quantity that is written as a function."""

    name: str
    title: str  # what it returns, with units
    takes: tuple[str, ...]  # of "q", "qd", "tau"
    sizes: tuple[int, ...]  # of these
    shape: tuple[int, ...]  # of a result
    results: tuple[str, ...]  # names of the results
    traced: Traced

    @property
    def inputs(self) -> list[tuple[str, int]]:
        """The name and the place of each number that is taken, in the order of the traced inputs."""
        return [(name, k) for name, size in zip(("q", "qd", "tau"), self.sizes) for k in range(size)]

    @property
    def used(self) -> set[tuple[str, int]]:
        """Those of the inputs on which a result depends."""
        nodes = set(self.traced.nodes)
        return {place for place, x in zip(self.inputs, self.traced.inputs) if x.i in nodes}


def text(
    model: Tree, language: str, quantities: Sequence[str], name: str, single: bool, head: Sequence[str]
) -> str:
    """See `tmt.equations`."""
    checked_model(model)
    known = [*LANGUAGES, *SYMBOLIC]
    if not isinstance(language, str) or language not in known:
        raise ValueError(f"language is {shown(language)}; expected one of {', '.join(known)}")
    chosen: tuple[Any, ...] = tuple(quantities) if isinstance(quantities, list | tuple) else (quantities,)
    choices = OF_SYMBOLS if language in SYMBOLIC else tuple(QUANTITIES)
    wrong = [quantity for quantity in chosen if not isinstance(quantity, str) or quantity not in choices]
    if wrong or not chosen:
        raise ValueError(f"quantity is {shown((*wrong, ())[0])}; expected some of {', '.join(choices)}")
    if not isinstance(head, list | tuple) or not all(isinstance(line, str) for line in head):
        raise ValueError(f"head is {shown(head)}; a sequence of lines is expected")
    if not (isinstance(name, str) and re.fullmatch("[A-Za-z][A-Za-z0-9_]{0,62}", name)) or is_word(name):
        wanted = "an identifier, no word of C, Python or MATLAB and no quantity"
        raise ValueError(f"name is {shown(name)}; expected {wanted}")
    if not isinstance(single, bool) or (single and language not in ("c", "c header")):
        wanted = f"single precision is True or False, and in C only (not in {language})"
        raise ValueError(f"single is {shown(single)}; {wanted}")
    lines = [line for text in head for line in text.splitlines() or [""]]  # a comment each
    lines += ["", *conventions(model)]
    if language in SYMBOLIC:
        return SYMBOLIC[language](symbols_of(model, chosen), lines)
    functions = [function_of(model, quantity) for quantity in dict.fromkeys(chosen)]
    return LANGUAGES[language](name, lines, functions, *[single] * (language in ("c", "c header")))


@lru_cache(maxsize=4)
def symbols_of(model: Tree, quantities: tuple[str, ...]) -> Any:
    """The symbolic equations, derived once for all files."""
    return symbols.symbolic(model, quantities)


def is_word(name: str) -> bool:
    return keyword.iskeyword(name) or name in WORDS.split() or name in QUANTITIES


def conventions(model: Tree) -> list[str]:
    """Equation, joints and units in words."""
    sizes = f"nq = {model.coordinates.nq} numbers in q, nv = {model.coordinates.nv} in qd and tau, m = {len(model.mass)} bodies"
    lines = [
        "M(q) qdd + h(q, qd) = tau - D qd - k (q - rest) - P q - S qd, by the TMT method; Mbar is M, with armature.",
        "h: bias, MuJoCo's qfrc_bias: Coriolis, centrifugal and gravity terms. D: damping, k and rest: springs of the joints,",
        "P and S: gains of a linear controller. All numbers of the model are in the functions.",
        "T_b, B_b: Jacobians of the centre of mass of body b, inertial frame, and of its angular velocity, body axes.",
        "SI units, angles in rad. Shapes are those of one state; ... stands for any batch, where there is one.",
        *wrap(f"{sizes}: {', '.join(model.body_names)}.", 120),
        f"Numbers of the model: sha256 {digest(model)}.",
        "Joint, kind, place in q, place in qd and tau (from 0); units of q, qd, tau:",
    ]
    for name, joint in zip(model.joint_names, model.coordinates.joints):
        places = [
            f"{part.start}" if part.stop == part.start + 1 else f"{part.start}-{part.stop - 1}"
            for part in (joint.q, joint.qd)
        ]
        lines.append(f"  {name}, {joint.kind}, {', '.join(places)}; {UNITS[joint.kind]}")
    return lines


def digest(model: Tree) -> str:
    """The first digits of a hash of a Tree's names and numbers."""
    return hashlib.sha256(stated(model).encode()).hexdigest()[:16]


def function_of(model: Tree, quantity: str) -> Function:
    import tmt  # for the docstring

    of, nv = QUANTITIES[quantity], model.coordinates.nv
    sizes = {"m": len(model.mass), "nv": nv}
    shape = tuple(sizes.get(size, size) for size in of.shape)
    title = getattr(tmt, quantity).__doc__.splitlines()[0]
    taken = (model.coordinates.nq, nv, nv)
    results = of.parts or ("out",)
    return Function(
        quantity,
        title,
        of.takes,
        taken,
        shape[1:] if of.parts else shape,
        results,
        forms.quantity(model, quantity),
    )
