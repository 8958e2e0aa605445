"""Who follows runs of a tree: straight-line code or the loop over any tree, one run at a time or many side by side.

What is there in this process costs nothing to get, what lies in the cache folder little: with such estimates choice.py
decides. Lanes and cores change nothing but the time: all code of one kind gives the same bits.
"""

from collections.abc import Callable
from itertools import pairwise

from tmt import choice, generic, kernels
from tmt.cache import is_kept
from tmt.choice import Form, chosen
from tmt.compiled.cores import cores, in_threads
from tmt.methods import METHODS, method_named
from tmt.methods.stepping import Method
from tmt.model import arguments as given
from tmt.model.tree import Tree
from tmt.source import LANES

WIDTH = 8  # of eight.py, which imports numba
SIDE_BY_SIDE = {"straight_line": 1, "loop": 1, "loop_lanes": WIDTH, "straight_line_lanes": LANES}  # runs, of each form
SPREAD = 0.01  # s of one core from which runs are spread over all of them
MOST = 64  # trees and methods of which the Runs are kept
PIECES = 4  # for each core, as one of them may be busy with something else


class Runs:
    """The runs of a tree by a method: what was asked for so far, and the code that is there for them."""

    def __init__(self, tree: Tree, stepping: Method, name: str):
        self.tree, self.stepping, self.name = tree, stepping, name
        self.given, self.longest, self.never_singular = METHODS[name], kernels.LONGEST, tree.never_singular
        self.asked = dict.fromkeys((1, WIDTH, LANES), 0.0)  # evaluations so far, of at least so many runs together
        self.there = {}  # compiled runs by their forms
        self.known = False  # whether the length of straight-line code is: it is traced only where it could pay
        self.estimates = {}
        self.settled = {}  # for so many runs together: the form where no other can do better any more

    def follow(self, q, qd, tau, settings: tuple, ended, every: int, form: str | None = None) -> tuple[str, int]:
        """Fill the paths q and qd as kernels.stepper does: the form that did it, and the evaluations.

        settings: dt, and the tolerance of an adaptive method; form: of SIDE_BY_SIDE, or None for that which is chosen.
        """
        runs, wanted = len(q), len(q) * (q.shape[1] - 1) * every * self.stepping.stages
        form = form or self.form(runs, wanted)
        for size in self.asked if runs > 1 else (1,):
            self.asked[size] += wanted * (runs >= size)
        pieces = self.pieces(form, runs, wanted) if runs > 1 else ()
        if len(pieces) < 2:
            alone = runs % SIDE_BY_SIDE[form] > 0
            return form, self.run(form.removesuffix("_lanes") if alone else form)(q, qd, tau, *settings, ended, every)
        for of_piece in {of_piece for of_piece, _ in pieces}:
            self.run(of_piece)  # got before several ask for it

        def piece(of_piece, part):
            return self.run(of_piece)(q[part], qd[part], tau[part], *settings, ended[part], every)

        return form, sum(in_threads(piece, pieces, cores()))

    def pieces(self, form: str, runs: int, wanted: float) -> list[tuple[str, slice]]:
        """Which runs are followed together and by which form: those that are left over of lanes one at a time."""
        width, seconds = SIDE_BY_SIDE[form], wanted * self.costs(form).each
        blocks = runs // width
        count = min(blocks, PIECES * cores() if seconds > SPREAD and cores() > 1 else 1)
        ends = [blocks * k // count * width for k in range(count + 1)] if count else [0]
        pieces = [(form, slice(*pair)) for pair in pairwise(ends)]
        if ends[-1] < runs or not pieces:
            pieces.append((form.removesuffix("_lanes"), slice(ends[-1], runs)))
        return pieces

    def run(self, form: str) -> Callable:
        """The compiled run of a form, got if it is not there."""
        if form not in self.there:
            self.there[form] = kernels.run_in(form, self.tree, self.name)
            self.estimates = {}
        return self.there[form]

    def form(self, runs: int, wanted: float) -> str:
        """The form that is chosen for so many runs, of so many evaluations in all."""
        together = 1 if runs < WIDTH or not self.stepping.lanes else WIDTH if runs < LANES else LANES
        if together in self.settled:
            return self.settled[together]
        names = [name for name, size in SIDE_BY_SIDE.items() if size <= together and self.is_there_a(name)]
        best = self.best(names, wanted + self.asked[together])
        if best.name.startswith("straight_line") and not self.known:
            # traced only where it could pay; from here on its length is known
            self.known, self.estimates = True, {}
            names = [name for name in names if self.is_there_a(name)]
            if not names:
                kernels.looped(self.tree, self.name)  # says that there is none
            best = self.best(names, wanted + self.asked[together])
        if best.getting == 0.0 and best.each == min(self.costs(name).each for name in names):
            self.settled[together] = best.name
        return best.name

    def best(self, names: list[str], evaluations: float) -> Form:
        return chosen(map(self.costs, names), evaluations)

    def is_there_a(self, form: str) -> bool:
        """Whether there is such a form, as far as is known; straight-line code that is not traced is taken to be short."""
        if form.startswith("loop"):
            return (
                self.loop_name(form) in choice.LOOPS_COMPILED if form.endswith("_lanes") else bool(self.stepping.loop)
            )
        return not self.known or kernels.is_traced(self.tree, self.stepping)

    def loop_name(self, form: str) -> str:
        """The name of the compiled loop of a form."""
        return self.stepping.loop + form.removeprefix("loop")

    def costs(self, form: str) -> Form:
        """A form with its estimates."""
        if form not in self.estimates:
            speeds, lanes = len(self.tree.axis), form.endswith("_lanes")
            if form.startswith("loop"):
                name = self.loop_name(form)
                getting = 0.0 if generic.is_compiled(name) else choice.loop_getting(name, is_kept(f"*.{name}-*"))
                each = choice.loop_each(speeds, lanes) * (2 + 4 * speeds if self.stepping.solves_stages else 1)
            else:
                used = choice.USUAL_LINES * speeds
                compiled, kept = used * kernels.least_lines(self.tree, self.stepping), True
                if self.known:
                    compiled, used = kernels.lines(self.tree, self.stepping)
                    kept = kernels.is_on_disk(self.tree, self.stepping, lanes)
                getting, each = (
                    choice.straight_line_getting(compiled, kept, lanes, self.known),
                    choice.straight_line_each(used, lanes),
                )
            self.estimates[form] = Form(form, 0.0 if form in self.there else getting, each)
        return self.estimates[form]


def runs_of(tree: Tree, name: str) -> Runs:
    """The Runs of a tree and the method of that name as it is now."""
    runs = known.get((id(tree), name)) if type(name) is str else None
    # whose tree is kept, so that no other has its id
    if runs is None or runs.given is not METHODS.get(name) or runs.longest != kernels.LONGEST:
        given.checked_model(tree)
        stepping = method_named(name)
        if len(known) >= MOST:
            known.clear()
        known[id(tree), name] = runs = Runs(tree, stepping, name)
    return runs


known = {}
kernels.OF_STEPPERS.append(known)
