"""The imports of the project, and the picture of them: `python -m tests.architecture` writes reports/architecture.png.

test_structure asserts the directions of these imports, and that the picture shows all of them.
"""

import ast
from functools import cache
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from compare.report.images import save_figure

ROOT = Path(__file__).resolve().parent.parent
FILES = sorted((ROOT / "compare").rglob("*.py"))
OF_TMT = sorted((ROOT / "tmt").rglob("*.py"))
PICTURE = ROOT / "reports" / "architecture.png"

# of each folder of modules: the middle of its box, from left to right, and what it has; the height follows from the imports
BOXES = {
    "compare": (3.0, "the command line"),
    "compare.fleet": (1.6, "many files"),
    "compare.export": (3.4, "equations to take away"),
    "compare.agreement": (5.0, "assert_agrees, differences"),
    "compare.run": (1.9, "a request and its report"),
    "compare.cli": (3.3, "words and options"),
    "compare.report": (1.9, "page, tables, figures"),
    "compare.experiments": (2.3, "what is compared"),
    "compare.truth": (1.0, "what needs no engine"),
    "compare.engines": (3.0, "MuJoCo, tmt and others"),
    "compare.diagnosis": (5.0, "why two sets differ"),
    "compare.robots": (1.0, "the arm, a file's robot, cases"),
    "compare.process": (3.0, "workers, interrupts, streams"),
    "compare.judge": (5.0, "checks, scales, rounding"),
    "tmt": (1.0, "the public functions"),
    "tmt.export": (2.4, "C, Python, MATLAB, LaTeX"),
    "tmt.exact": (1.0, "many digits, the true motion"),
    "tmt.compiled": (1.0, "machine code"),
    "tmt.methods": (1.0, "integrators"),
    "tmt.model": (1.0, "Tree, joints, coordinates"),
    "tmt.derivation": (1.0, "the TMT method, any scalar"),
}
SHARED = {
    "compare.report.text",
    "compare.report.style",
}  # for all of compare: words from templates, the style of figures
NOTE = """An arrow goes from a folder to one that it imports.
Left out: imports that follow from others, and those of
report.text and report.style, which all of compare uses.

The arm's numbers are written twice: in mjcf/arm.xml,
which MuJoCo reads, and in tmt/arm.py. One test ties
them; otherwise the two models share nothing."""
COLOURS = {"compare": ("#0072B2", "#E3EFF7"), "tmt": ("#A84300", "#FBEADF"), "mjcf": ("#00684B", "#DFF2EC")}
WIDTH, HEIGHT, COLUMN, ROW = 2.1, 0.52, 1.8, 0.82


def dotted(path) -> str:
    """The name of a file as a module."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {dotted(file) for file in [*FILES, *OF_TMT]}


@cache
def imports(path) -> frozenset[str]:
    """Full names of what a file imports, wherever in it: a module, or a name in one."""
    package = dotted(path) if path.name == "__init__.py" else dotted(path).rpartition(".")[0]
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            start = ".".join([*base, *filter(None, [node.module])])
            found |= {f"{start}.{alias.name}" for alias in node.names}
    return frozenset(found)


@cache
def modules_imported(path) -> set[str]:
    """The modules of compare and tmt that a file imports."""
    return {name if name in MODULES else name.rpartition(".")[0] for name in imports(path)} & MODULES - {dotted(path)}


def folder(module: str) -> str:
    first = ".".join(module.split(".")[:2])
    return first if ROOT.joinpath(*first.split(".")).is_dir() else module.split(".")[0]


def folder_imports() -> dict[tuple[str, str], int]:
    """How many imports there are from a folder to another, without SHARED."""
    counts = {}
    for path in [*FILES, *OF_TMT]:
        for name in modules_imported(path) - SHARED:
            pair = folder(dotted(path)), folder(name)
            if pair[0] != pair[1]:
                counts[pair] = counts.get(pair, 0) + 1
    return counts


def reached(pairs, start: str) -> set[str]:
    """What a folder imports, and what that imports."""
    found, waiting = set(), [start]
    while waiting:
        at = waiting.pop()
        new = {other for one, other in pairs if one == at} - found
        found |= new
        waiting += new
    return found


def arrows(counts: dict[tuple[str, str], int]) -> list[tuple[str, str]]:
    """The imports without those that follow from others: a to c, if a imports b and b imports c. The rare ones go first."""
    kept = sorted(counts, key=lambda pair: (counts[pair], pair))
    for pair in list(kept):
        rest = [other for other in kept if other != pair]
        if pair[1] in reached(rest, pair[0]):
            kept = rest
    return kept


def rows(pairs) -> dict[str, int]:
    """How many folders stand above each, one above the other; two that import each other stand side by side."""
    above = dict.fromkeys(BOXES, 0)
    for _ in above:
        for one, other in pairs:
            above[other] = max(above[other], above[one] + ((other, one) not in pairs))
    return above


def draw() -> Figure:
    pairs = arrows(folder_imports())
    gap = {"compare": 0.0, "tmt": 0.6}  # between the frames
    places = {
        name: (COLUMN * BOXES[name][0], -ROW * row - gap[name.split(".")[0]]) for name, row in rows(pairs).items()
    }
    fig = Figure(figsize=(7.7, 8.6))
    FigureCanvasAgg(fig)
    ax = fig.add_axes((0.0, 0.0, 1.0, 1.0))
    for package in ("compare", "tmt"):
        frame(ax, [place for name, place in places.items() if name.split(".")[0] == package], package)
    for one, other in pairs:
        both = (other, one) in pairs
        if not both or places[one] < places[other]:
            arrow(ax, places[one], places[other], both).set_gid(f"{one} {other}")
    for name, (x, y) in places.items():
        box(ax, x, y, name.split(".")[-1], BOXES[name][1], name.split(".")[0])
    x, y = COLUMN * 5.0, places["tmt"][1]
    box(ax, x, y, "mjcf", "arm.xml, no Python", "mjcf")
    ax.text(x - 2.7, y - 1.0, NOTE, va="top", size=8, linespacing=1.4)
    ax.set(xlim=(0.4, 10.5), ylim=(places["tmt.derivation"][1] - 0.6, 0.85))
    ax.axis("off")
    return fig


def frame(ax, places, package: str) -> None:
    (left, low), (right, high) = (tuple(pick(values) for values in zip(*places)) for pick in (min, max))
    edge, _ = COLOURS[package]
    corner = left - WIDTH / 2 - 0.15, low - HEIGHT / 2 - 0.15
    size = right - left + WIDTH + 0.3, high - low + HEIGHT + 0.3
    ax.add_patch(
        FancyBboxPatch(corner, *size, "round,pad=0,rounding_size=0.1", ec=edge, fc="none", lw=1.0, ls=(0, (4, 3)))
    )
    ax.text(corner[0] + 0.1, corner[1] + size[1] + 0.05, package, color=edge, weight="bold", size=12, va="bottom")


def box(ax, x: float, y: float, name: str, text: str, package: str) -> None:
    edge, face = COLOURS[package]
    corner = x - WIDTH / 2, y - HEIGHT / 2
    ax.add_patch(FancyBboxPatch(corner, WIDTH, HEIGHT, "round,pad=0,rounding_size=0.08", ec=edge, fc=face, lw=1.3))
    ax.text(x, y + 0.1, name, ha="center", va="center", weight="bold", size=10.5)
    ax.text(x, y - 0.13, text, ha="center", va="center", size=7.2)


def arrow(ax, start, end, both: bool) -> FancyArrowPatch:
    """From the lower edge of a box to the upper edge of another; between boxes of a row an arc below them."""
    (x, y), (to_x, to_y), half = start, end, HEIGHT / 2
    if y == to_y:
        ends, bent = ((x + 0.5, y - half), (to_x - 0.5, to_y - half)), "arc3,rad=0.04"
    else:
        share = 0.3 * (to_x - x) / max(1.0, abs(to_x - x))
        ends, bent = ((x + share, y - half), (to_x - share, to_y + half)), "arc3"
    style = "<|-|>" if both else "-|>"
    return ax.add_patch(FancyArrowPatch(
        *ends, arrowstyle=style, connectionstyle=bent, mutation_scale=11, color="#444444", lw=1.1, shrinkA=0, shrinkB=0
    ))  # fmt: skip


if __name__ == "__main__":
    save_figure(draw(), PICTURE)
    print(PICTURE.relative_to(ROOT))
