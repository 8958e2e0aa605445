"""python -m tests.benchmarks: what tmt costs on this machine, as a table.

start   processor time of a process that simulates 4096 steps of RK4, with an empty store and with what that has left there
rates   time of one acceleration beside MuJoCo's: one state after the other, several side by side, and by a call from Python
truth   processor time of the true motion of 5 s, in pairs of doubles
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd

import tmt
from compare.engines.mujoco import engine, read
from compare.engines.mujoco.calls import MinimalCalls
from compare.judge import timing
from compare.robots.file import robot_of
from tmt.compiled import evaluator
from tmt.exact.motion import trajectory

from ..models.made import chain

MODELS = Path(__file__).parents[1] / "models"
ROUNDS, STATES, TAKEN = 15, 8192, 6e-4  # of what is timed in turns; side by side; s of one turn
START = """
import sys, numpy, tmt
tree = tmt.ARM
if len(sys.argv) > 1:
    from compare.run.reference import compared_with
    tree = compared_with(None, sys.argv[1]).robot.tree
n = len(tree.axis)
{}tmt.simulate(numpy.array(tree.zero), numpy.full(n, 0.1), numpy.zeros(n), 0.001, 4096, "rk4", tree)
"""


def start() -> Iterator[dict]:
    """Processor time of whole processes, s, the least of three; without simulating it is what imports and the file take."""
    for name in ("arm", "arm7", "humanoid29_free"):
        path = [] if name == "arm" else [str(MODELS / f"{name}.xml")]
        empty, kept, without = [], [], []
        for _ in range(3):
            with tempfile.TemporaryDirectory() as folder:
                os.chmod(folder, 0o700)
                for times, comment in ((without, "# "), (empty, ""), (kept, "")):
                    times.append(processor_time([sys.executable, "-c", START.format(comment), *path], folder))
        yield {"model": name, "empty_store_s": min(empty), "kept_s": min(kept), "without_simulate_s": min(without)}


def processor_time(command: list[str], store: str) -> float:
    """s of a process and its children, its own and the system's."""
    before = sum(os.times()[2:4])
    subprocess.run(command, env=os.environ | {"TMT_CACHE": store}, check=True)
    return sum(os.times()[2:4]) - before


def rates() -> Iterator[dict]:
    """Nanoseconds of one acceleration, the least of turns; microseconds of a call from Python."""
    sources = {"arm": Path("mjcf/arm.xml")} | {f"chain of {n}": chain(n) for n in (1, 16, 64)}
    sources |= {name: MODELS / f"{name}.xml" for name in ("arm7", "quadruped", "humanoid29")}
    for name, source in sources.items():
        tree, functions, states = functions_of(source)
        one = [np.ascontiguousarray(part[0]) for part in states]
        tmt.prepare(tree)
        tmt.acceleration(*states, tree)
        functions["call_us"] = lambda: tmt.acceleration(*one, tree), 1e3  # noqa: B023
        functions["call_of_many"] = lambda: tmt.acceleration(*states, tree), STATES  # noqa: B023
        found = in_turns(functions)
        for width in ("one_state", "side_by_side"):
            found |= {f"{call}/{width}": found[call] / found[width] for call in ("mj_forward", "equal_work")}
        yield {"model": name, "n": tree.coordinates.nv} | found


def functions_of(source) -> tuple[tmt.Tree, dict, list[np.ndarray]]:
    """The tree of a file or text, {name: (call, states in it)} of its accelerations, and random states."""
    reading = read(source)
    robot = robot_of(reading, "a file")
    tree, rng = robot.tree, np.random.default_rng(1)
    states = [robot.coordinates.random(rng, STATES), *rng.uniform(-3.0, 3.0, (2, STATES, tree.coordinates.nv))]
    compiled, out = evaluator(tree, "acceleration"), np.empty((STATES, tree.coordinates.nv))
    columns, out_columns = [np.ascontiguousarray(part.T) for part in states], np.ascontiguousarray(out.T)
    dynamics = engine(reading).of(robot.case())
    loops, single = MinimalCalls(dynamics).loops(*(part[0] for part in states)), 64
    functions = {
        "one_state": (lambda: compiled.each(*states, out), STATES),
        "side_by_side": (lambda: compiled.lanes(*columns, out_columns), STATES),
        "mj_forward": (lambda: loops["MuJoCo, mj_forward"][1](single), single),
        "equal_work": (lambda: loops["MuJoCo, equal work"][1](single), single),
    }
    return tree, functions, states


def in_turns(functions: dict[str, tuple[Callable, float]]) -> dict[str, float]:
    """ns of each, the least of turns: {name: (call, states in it)}."""
    calls, counts = [], []
    for call, states in functions.values():
        (taken,) = timing.in_turns([call], 2)
        repeats = max(1, int(TAKEN / min(taken)))
        calls.append(lambda call=call, repeats=repeats: [call() for _ in range(repeats)])
        counts.append(repeats * states)
    times = timing.in_turns(calls, ROUNDS)
    return {name: 1e9 * min(taken) / count for name, taken, count in zip(functions, times, counts)}


def truth() -> Iterator[dict]:
    """Processor time of the true motion of 5 s from the position zero, s."""
    for name in ("arm", "arm7", "humanoid29"):
        tree = tmt.ARM if name == "arm" else robot_of(read(MODELS / f"{name}.xml"), name).tree
        n, times = len(tree.axis), []
        for _ in range(3):
            began = time.process_time()
            trajectory(tree, tree.zero, [0.1] * n, [0.0] * n, 0.05, 100)
            times.append(time.process_time() - began)
        yield {"model": name, "truth_s": min(times)}


COMMANDS = {"start": start, "rates": rates, "truth": truth}


def main() -> None:
    parser = argparse.ArgumentParser(
        "python -m tests.benchmarks", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("what", choices=COMMANDS)
    rows = []
    for row in COMMANDS[parser.parse_args().what]():
        rows.append(row)
        print(row, file=sys.stderr)
    print(pd.DataFrame(rows).to_string(index=False, float_format="{:.4g}".format, na_rep=""))


if __name__ == "__main__":
    main()
