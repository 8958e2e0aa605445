"""How near to what the processor can do: independent fused multiply-adds in the same run, and nothing else."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from tmt.eight import WIDTH
from tmt.inlined import get, inlined
from tmt.machine_code import compiled

# chains of multiply-adds that do not wait for each other: more hide more of what each takes, until registers run out
FEW_CHAINS, MANY_CHAINS = 5, 12
PEAK = "multiply_add"


@inlined
def first_numbers(w):
    """The first numbers of an array."""
    return tuple(w[k] for k in range(FEW_CHAINS))


@inlined
def more_numbers(w):
    """More of them."""
    return tuple(w[k] for k in range(MANY_CHAINS))


@inlined
def multiplied_and_added(numbers, x, y):
    """Each number times x and y, rounded once."""
    return tuple(number.fma(x, y) for number in numbers)


@inlined
def put_each(w, numbers):
    """Put numbers to the beginning of an array."""
    for k, number in enumerate(numbers):
        w[k] = number


@compiled
def few_chains(w, count):
    """So many multiply-adds of each of FEW_CHAINS numbers, doubles or eight side by side; x and y are the last two of w."""
    numbers, x, y = first_numbers(w), get(w, MANY_CHAINS), get(w, MANY_CHAINS + 1)
    for _ in range(count):
        numbers = multiplied_and_added(numbers, x, y)
    put_each(w, numbers)


@compiled
def many_chains(w, count):
    """The same of MANY_CHAINS numbers."""
    numbers, x, y = more_numbers(w), get(w, MANY_CHAINS), get(w, MANY_CHAINS + 1)
    for _ in range(count):
        numbers = multiplied_and_added(numbers, x, y)
    put_each(w, numbers)


def chains_in_words(chains: int, width: int) -> str:
    """Of a loop of multiply-adds."""
    return f"{chains} chains, {'one double' if width == 1 else f'{width} doubles side by side'} each"


def peaks() -> Iterator[tuple[str, int, Callable]]:
    """(name, numbers, loop(count)): multiply-adds of so many numbers at a time, one by one or eight side by side."""
    for chains, compiled_loop in ((FEW_CHAINS, few_chains), (MANY_CHAINS, many_chains)):
        for width, shape in ((1, (MANY_CHAINS + 2,)), (WIDTH, (MANY_CHAINS + 2, WIDTH))):
            w = np.full(shape, 0.5)
            yield chains_in_words(chains, width), chains * width, lambda count, loop=compiled_loop, w=w: loop(w, count)


def rates(ns: Mapping[tuple, float]) -> dict[int, float]:
    """The most floating-point operations per ns, of doubles one by one and of WIDTH side by side, {1: ..., WIDTH: ...}."""
    found = {}
    for width in (1, WIDTH):
        times = [
            ns[key]
            for key in ns
            if key[0] == PEAK and key[1] in (chains_in_words(FEW_CHAINS, width), chains_in_words(MANY_CHAINS, width))
        ]
        if times:
            found[width] = 2.0 / min(times)
    return found


def near_in_words(ns: Mapping[tuple, float], operations: Mapping[tuple[str, str], int], of_sine: int) -> list[str]:
    """How near the peak each implementation comes whose operations are known; the fastest number of states of each.

    operations: of one state, {(quantity, implementation): so many}; of_sine: of a sine with its cosine.
    """
    peak, forms = rates(ns), {}
    if len(peak) < 2:
        return []
    for (quantity, name), count in operations.items():
        least = min((value for key, value in ns.items() if key[:2] == (quantity, name) and key[3] == 1), default=None)
        if least is not None:
            rate = count / least
            one_by_one = f"; {100 * rate / peak[1]:.0f} % of one by one" if rate < peak[1] else ""
            forms.setdefault(count, []).append(
                f"{name} {rate:.1f} ({100 * rate / peak[WIDTH]:.0f} % of the peak{one_by_one})"
            )
    said = "; ".join(f"of {count:,} operations a state: {', '.join(parts)}" for count, parts in forms.items())
    return [
        f"How near the processor: its peak, independent fused multiply-adds with {WIDTH} doubles side by side, is "
        f"{peak[WIDTH]:.0f} floating-point operations a ns, {peak[1]:.1f} one by one. Forward dynamics, in operations a ns, "
        f"{said}. A fused multiply-add is two operations, a sine with its cosine {of_sine}, a change of sign none."
    ]
