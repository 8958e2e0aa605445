"""A difference as few terms: sines, cosines and powers of the joints' positions that are added to the right expression.

Entries of Mbar and gravity, and the coefficients of products of speeds in h, are polynomials in the sines and cosines of hinges
and in the positions of slides, of second degree in each. A common mistake is one term with another factor, or replaced by another
term. Terms are tried in two forms: products such as sin(hip) cos(knee) and sums such as sin(hip + knee).
"""

from collections.abc import Iterator, Sequence
from itertools import combinations, product
from typing import NamedTuple

import numpy as np

JOINTS_OF_TERMS = 3  # the most whose terms are tried
MOST_COLUMNS = 1500  # in pairs that are tried
STATES_PER_TERM = 2  # at which the right expressions are known
LEFT_BY_FIT = 1e-9  # of the largest coefficient: rounding of a fit
AS_NEAR = 1.0 - 1e-6  # of the largest part of a target along one term
COMBINATIONS = (  # numbers of terms of the right expression and of other terms, and whether these replace those
    *((1, 0, False), (1, 1, True), (0, 1, False), (1, 1, False), (2, 0, False), (2, 2, True)),
    *((0, 2, False), (2, 1, False), (2, 2, False), (3, 0, False)),
)


class Terms(NamedTuple):
    """Functions of q by their names, (terms, states)."""

    names: list[str]
    columns: np.ndarray


def tried_terms(names: Sequence[str], kinds: Sequence[str], x: np.ndarray) -> Terms:
    """Terms of both forms, the simplest first, and wrong functions of an angle."""
    terms = dict(sums_of_angles(names, kinds, x))
    terms |= dict(products_of_angles(names, kinds, x, with_squares=True)) | dict(wrong_angles(names, kinds, x))
    return Terms(list(terms), np.array(list(terms.values())))


def products_of_angles(names, kinds, x: np.ndarray, with_squares: bool = False) -> Iterator[tuple[str, np.ndarray]]:
    """Products of one function of each joint; with_squares: sin^2 too, which is 1 - cos^2."""
    one = np.ones(len(x))
    of_each = []
    for name, kind, p in zip(names, kinds, x.T):
        if kind == "slide":
            of_each.append([("", one), (name, p), (f"{name}^2", p**2)])
            continue
        c, s = np.cos(p), np.sin(p)
        some = [
            ("", one),
            (f"cos({name})", c),
            (f"sin({name})", s),
            (f"cos({name})^2", c * c),
            (f"sin({name}) cos({name})", s * c),
        ]
        of_each.append(some + [(f"sin({name})^2", s * s)] * with_squares)
    for chosen in sorted(
        product(*of_each), key=lambda factors: sum(bool(name) + ("^2" in name) for name, _ in factors)
    ):
        yield (
            " ".join(name for name, _ in chosen if name) or "1",
            np.prod([one, *(column for _, column in chosen)], axis=0),
        )


def sums_of_angles(names, kinds, x: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Sines and cosines of sums of the angles, each up to twice, times powers of the slides."""
    of_slides = [(name, p) for name, kind, p in zip(names, kinds, x.T) if kind == "slide"]
    along = np.array([p for _, p in of_slides]).reshape(len(of_slides), len(x)).T
    powers = list(products_of_angles([name for name, _ in of_slides], ["slide"] * len(of_slides), along))
    hinges = [(name, p) for name, kind, p in zip(names, kinds, x.T) if kind != "slide"]
    for times in sorted(product(range(-2, 3), repeat=len(hinges)), key=lambda times: sum(map(abs, times))):
        leading = next((k for k in times if k), 0)
        if leading < 0:
            continue
        angle = sum((k * p for k, (_, p) in zip(times, hinges)), np.zeros(len(x)))
        called = sum_in_words([(k, name) for k, (name, _) in zip(times, hinges) if k])
        for power, column in powers:
            more = "" if power == "1" else f"{power} "
            if not leading:
                yield power, column
            else:
                yield f"{more}cos({called})", column * np.cos(angle)
                yield f"{more}sin({called})", column * np.sin(angle)


def sum_in_words(parts: list[tuple[int, str]]) -> str:
    text = ""
    for k, name in parts:
        sign = ("" if k > 0 else "-") if not text else (" + " if k > 0 else " - ")
        text += sign + (f"{abs(k)} " if abs(k) > 1 else "") + name
    return text


def wrong_angles(names, kinds, x: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """An angle without its sine, and a sine inside an angle."""
    angles = [(name, p) for name, kind, p in zip(names, kinds, x.T) if kind != "slide"]
    for name, p in angles:
        yield name, p
        yield f"sin(sin({name}))", np.sin(np.sin(p))
        yield f"cos(sin({name}))", np.cos(np.sin(p))
        for other, r in angles:
            if other != name:
                yield f"sin({name} + sin({other}))", np.sin(p + np.sin(r))
                yield f"cos({name} + sin({other}))", np.cos(p + np.sin(r))


def right_terms(names, kinds, x: np.ndarray, right: np.ndarray) -> list[dict[str, float]]:
    """Expressions, (expressions, states), as sums of terms, each in the form that has fewer; {} where there is none."""
    sums: list[dict[str, float]] = []
    forms = []
    for form in (sums_of_angles, products_of_angles):
        known = dict(form(names, kinds, x))
        matrix = np.array(list(known.values())).T
        coefficients = np.linalg.solve(matrix.T @ matrix, matrix.T @ right.T)
        forms.append((list(known), coefficients, np.abs(matrix @ coefficients - right.T).max(axis=0)))
    for k, expression in enumerate(right):
        size, best = np.abs(expression).max(), {}
        for called, coefficients, off in forms:
            large = np.flatnonzero(np.abs(coefficients[:, k]) > LEFT_BY_FIT * size)
            if off[k] <= LEFT_BY_FIT * size and (not best or len(large) < len(best)):
                best = {called[i]: float(coefficients[i, k]) for i in large}
        sums.append(best)
    return sums


def few_terms(known: Terms, right: dict[str, float], off: np.ndarray, tolerance: np.ndarray) -> dict[str, float] | None:
    """The terms that make up a difference, off (states,), with their coefficients; None: a few do not suffice."""
    columns, target = known.columns / tolerance, off / tolerance
    inner = columns @ columns.T
    places = {name: k for k, name in enumerate(known.names)}
    own = [places[name] for name in right if name in places]
    for of_right, others, is_replaced in COMBINATIONS:
        for chosen in combinations(own, of_right):
            for best in completed(columns, inner, target, list(chosen), others):
                x = np.linalg.lstsq(columns[best].T, target, rcond=None)[0]
                sizes = np.abs(x)
                if sizes.min() <= LEFT_BY_FIT * sizes.max() or np.abs(target - x @ columns[best]).max() > 1.0:
                    continue
                if is_replaced and not np.allclose(
                    np.sort(sizes[:of_right]), np.sort(sizes[of_right:]), rtol=LEFT_BY_FIT
                ):
                    continue
                return {known.names[k]: float(value) for k, value in zip(best, x)}
    return None


def completed(
    columns: np.ndarray, inner: np.ndarray, target: np.ndarray, chosen: list[int], others: int
) -> list[list[int]]:
    """The chosen terms with those others, one or two, that come closest to a target with them; of one all that come as close.

    inner: the inner products of the columns.
    """
    if not others or (others > 1 and len(columns) > MOST_COLUMNS):
        return [chosen] * (not others)
    basis = np.linalg.qr(columns[chosen].T)[0] if chosen else np.zeros((len(target), 0))
    taken, lengths = columns @ basis, np.sqrt(np.diag(inner))
    sizes = np.sqrt(np.maximum(np.diag(inner) - (taken**2).sum(axis=1), 0.0))  # of what the chosen ones leave of each
    scale = np.where(sizes > 1e-6 * lengths, 1.0 / np.maximum(sizes, 1e-6 * lengths), 0.0)
    along = scale * (columns @ target - taken @ (basis.T @ target))
    if others == 1:
        return [[*chosen, int(k)] for k in np.flatnonzero(np.abs(along) >= AS_NEAR * np.abs(along).max())]
    left = scale[:, None] * (inner - taken @ taken.T) * scale
    apart = 1.0 - left**2
    gained = along[:, None] ** 2 + along**2 - 2.0 * along[:, None] * along * left
    gained = np.where(apart > 1e-9, gained / np.where(apart > 1e-9, apart, 1.0), 0.0)
    return [[*chosen, *map(int, np.unravel_index(np.argmax(gained), gained.shape))]]
