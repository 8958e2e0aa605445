"""What a diagnosis says of made faults: a row for each, and counts by outcome."""

import time
from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

import tmt
from tmt import literal

from ...diagnosis import STATES_ASKED, Diagnosis, diagnose, packed
from ...diagnosis.places import OF_ZERO
from ...judge.check import ENDS, About, Result
from ...judge.entries import Entries
from ...judge.scale import EPS, FACTOR
from ...robots.arm import ARM
from ...robots.six_hinges import SIX_HINGES
from ..setup import Setup
from .confirmed import confirmed
from .faults import Fault, fault_list
from .generator import generated
from .made_values import by_composite, values_of_fault
from .wrong_motion import row_of_motion, wrong_motions

SHOWN_OF_FAULTS = ["robot", "kind", "source", "visible", "outcome", "faults", "longest_s"]
PART = 12  # faults that a process is handed at once
SAMPLE = 40  # faults of a quick run
SEARCHED = 20.0  # s of one fault: what else the machine does must not change what is found
OTHERS = 3  # explanations that a reason names
RANKS = dict.fromkeys(("order", "sign", OF_ZERO, "unit", "option"), 1) | dict.fromkeys(
    ("pair", "composition"), 3
)  # else 2
AT = {"search": 3, "again": 4}  # seeds of states


def rows_of_faults(setup: Setup) -> Result:
    """A row for each fault in tables/faults.csv; counts by outcome; a check that no outcome is wrong."""
    result = Result("diagnosis", shown=SHOWN_OF_FAULTS)
    faults = made_faults()
    if setup.size != "full":
        faults = sampled(faults, setup.of(0, SAMPLE, SAMPLE // 4))

    def progress(done: int) -> None:
        setup.progress(f"diagnosis: {done} of {len(faults)} faults")

    table = (
        rows_by_pieces(result, faults, setup.door, progress)
        if setup.door
        else rows_in_parts(faults, setup.map, progress)
    )
    judge_faults(result, table)
    return result


def rows_in_parts(faults: Sequence[Fault], spread: Callable, progress: Callable[[int], object]) -> list[dict]:
    """The rows of faults, some of which are handed out at once."""
    table = []
    for part in spread(rows_of_part, [faults[k : k + PART] for k in range(0, len(faults), PART)]):
        table += part
        progress(len(table))
    return table


def rows_by_pieces(
    result: Result, faults: Sequence[Fault], door: object, progress: Callable[[int], object]
) -> list[dict]:
    """The rows of faults, each a call of its own, see Setup.door; a failed check for each that was not tried to its end."""
    table = []
    for fault, outcome in zip(faults, door.outcomes(row_of, faults, progress=progress)):
        if outcome.broke:
            result.check(
                f"{fault.robot}, {fault.name}", ENDS, None, 0.0, "", outcome.broke, rule="equal", about=About.PROGRAM
            )
        else:
            table.append(outcome.returned)
    return table


def made_faults() -> list[Fault]:
    """The list, and as many of the generator; neighbours take about as long."""
    robots = {"arm": (ARM.tree, True), "six hinges": (SIX_HINGES, False)}
    listed = [fault for name, (tree, every_size) in robots.items() for fault in fault_list(name, tree, every_size)]
    listed += [fault for name, (tree, _) in robots.items() for fault in wrong_motions(name, tree)]
    return [fault for pair in zip(listed, generated(len(listed))) for fault in pair]


def sampled(faults: Sequence[Fault], count: int) -> list[Fault]:
    """So many faults, of every kind and both sources."""
    chosen = np.random.default_rng(2).permutation(len(faults))[:count]
    return [faults[k] for k in sorted(chosen)]


def judge_faults(result: Result, table: list[dict]) -> None:
    """Counts, sentences and checks of rows of faults."""
    result.tables["faults"] = table
    groups = {}
    for row in table:
        groups.setdefault((row["robot"], row["kind"], row["source"], row["visible"], row["outcome"]), []).append(row)
    for (robot, kind, source, visible, outcome), rows in groups.items():
        about = {"robot": robot, "kind": kind, "source": source, "visible": visible, "outcome": outcome}
        result.rows.append(about | {"faults": len(rows), "longest_s": max(row["seconds"] for row in rows)})
    kinds = result.curves["outcomes"] = {}
    for row in table:
        kinds.setdefault(row["kind"], Counter())[row["outcome"] if row["visible"] else "invisible"] += 1
    for source in ("list", "generator"):
        rows = [row for row in table if row["source"] == source]
        seen = Counter(row["outcome"] for row in rows if row["visible"])
        wrong = sum(row["outcome"] == "wrong" for row in rows)
        whose = {"list": "of the list", "generator": "of the generator"}[source]
        what = f"{whose}: explained by something else"
        result.check("made faults", what, wrong, 0.0, "faults", rule="equal", about=About.PREDICTION)
        counts = ", ".join(f"{seen[outcome]} {outcome}" for outcome in ("right", "tied", "none", "wrong"))
        unseen = sum(not row["visible"] for row in rows)
        times = [row["seconds"] for row in rows] or [0.0]
        result.notes.append(
            f"Faults {whose}: {len(rows)}, of which {sum(seen.values())} change M or h: {counts}; {unseen} change neither at "
            f"any state. The longest diagnosis took {max(times):.1f} s."
        )


def rows_of_part(faults: Sequence[Fault]) -> list[dict]:
    return [row_of(fault) for fault in faults]


def row_of(fault: Fault) -> dict:
    """What a diagnosis says of one fault."""
    q, qd = search_states(fault.tree, AT["search"])
    if fault.make[0] in ("force", "step"):
        visible, causes, seconds = row_of_motion(fault, q, qd)
        found = Diagnosis(visible, tuple(causes))
        off = [{"force": "acceleration", "step": "trajectory"}[fault.kind]] * visible
    else:
        started = time.perf_counter()
        found, off = diagnosis_of(fault, q, qd)
        seconds = time.perf_counter() - started
    outcome, reason = judged_fault(fault, found)
    if outcome == "invisible":
        outcome, reason = "none", why_invisible(fault)
    return {
        "robot": fault.robot,
        "fault": fault.name,
        "kind": fault.kind,
        "source": fault.source,
        "size": fault.size,
        "visible": found.differs,
        "seen_by": ";".join(off),
        "diagnosis": found.sentence if found.differs else "",
        "outcome": outcome,
        "reason": reason,
        "seconds": seconds,
    }


def search_states(tree: tmt.Tree, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions within a turn or a metre, rates up to 3 per s, (states, nv) each."""
    return tuple(np.random.default_rng(seed).uniform(-3.0, 3.0, (2, STATES_ASKED, len(tree.axis))))


def diagnosis_of(fault: Fault, q: np.ndarray, qd: np.ndarray) -> tuple[Diagnosis, list[str]]:
    """The diagnosis of a fault at states, and the experiments that see it."""
    tree, nv = fault.tree, qd.shape[1]
    scale = Entries(tree, q, qd)
    sizes = np.broadcast_to(scale.mass_matrix, (len(q), nv, nv)), np.broadcast_to(scale.bias, (len(q), nv))
    M, h = values_of_fault(fault, q, qd)
    still = values_of_fault(fault, q, 0.0 * qd)[1]
    right, weight = by_composite(tree, q, qd), by_composite(tree, q, 0.0 * qd)[1]
    off = {
        "mass": np.abs(M - right[0]) > FACTOR * EPS * sizes[0],
        "gravity": np.abs(still - weight) > FACTOR * EPS * sizes[1],
        "acceleration": np.abs(h - right[1]) > FACTOR * EPS * sizes[1],
    }
    found = diagnose(
        tree, tree.hinge_names, q, qd, packed(M, h, nv, len(q)), tolerance_of_values(tree, q, qd), SEARCHED
    )
    return found, [name for name, differs in off.items() if differs.any()]


def tolerance_of_values(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """64 eps of the scale of each entry of Mbar and h, (states, entries)."""
    scale, nv = Entries(tree, q, qd), qd.shape[1]
    M, h = np.broadcast_to(scale.mass_matrix, (len(q), nv, nv)), np.broadcast_to(scale.bias, (len(q), nv))
    return FACTOR * EPS * packed(M, h, nv, len(q))


def judged_fault(fault: Fault, found: Diagnosis) -> tuple[str, str]:
    """Outcome and reason: right if the fault alone is named, tied if others do exactly the same, wrong if it is not named."""
    if not found.differs:
        return "invisible", ""
    if not found.causes:
        return "none", found.sentence
    named = [cause for cause in found.causes if cause.place in fault.expected and has_values(fault, cause)]
    others = [cause.place for cause in found.causes if cause not in named]
    shown = "; ".join(others[:OTHERS]) + (f" and {len(others) - OTHERS} more" if len(others) > OTHERS else "")
    if named:
        return ("tied", f"the same at all states: {shown}") if others else ("right", "")
    if fault.make[0] not in ("force", "step") and explains_elsewhere(fault, found):
        return "tied", f"simpler, and the same at all states: {shown}"
    return "wrong", shown


def has_values(fault: Fault, cause) -> bool:
    """Whether a cause gives the numbers that were made."""
    if not fault.values:
        return True
    if len(fault.values) == 1:
        found = [float(cause.explains)]
    else:
        found = [float(value) for value in str(cause.explains).split(" and ")]
        found = found if cause.place == fault.expected[0] else found[::-1]
    return all(abs(x - y) <= 1e-6 * max(abs(y), 1e-3) for x, y in zip(found, fault.values))


def explains_elsewhere(fault: Fault, found: Diagnosis) -> bool:
    """Whether what explains a fault, another and no less simple one, explains it at states that the search did not have.

    Each cause is made by other code than the search's where that can be done; if none can, a second search must agree.
    """
    if min(cause.rank for cause in found.causes) > rank_of(fault):
        return False
    states = search_states(fault.tree, AT["again"])
    verdicts = [confirmed(fault, cause, *states) for cause in found.causes]
    if known := [verdict for verdict in verdicts if verdict is not None]:
        return all(known)
    places = {cause.place for cause in diagnosis_of(fault, *states)[0].causes}
    return all(cause.place in places for cause in found.causes)


def rank_of(fault: Fault) -> int:
    """Of what was made."""
    return RANKS.get(fault.kind, 2)


def why_invisible(fault: Fault) -> str:
    """The reason for which neither M nor h changes at any state."""
    tree, q = fault.tree, search_states(fault.tree, AT["search"])[0]
    if fault.make[0] == "tree":
        edited = fault.make[1]
        if np.abs(literal.com_positions(q, edited) - literal.com_positions(q, tree)).max() > 1e-9 * max(
            1.0, np.abs(q).max()
        ):
            moved = literal.com_positions(q, edited) - literal.com_positions(q, tree)
            if np.ptp(moved, axis=(0, 1)).max() < 1e-9:
                return "all bodies are displaced by the same: M and h do not depend on where the robot stands"
            return "positions differ, M and h do not: the robot is the same in a mirror, or displaced along an axis"
        if np.array_equal(edited.inertia, tree.inertia):
            return "M and h do not depend on it: what it moves lies on the axis"
        turns = literal.jacobians(q, tree)[1]
        for b, body in enumerate(tree.body_names):
            axes = [k for k in range(3) if np.abs(turns[:, b, k]).max() < 1e-12]
            touched = {k for k in range(3) if np.any(np.array(edited.inertia[b])[k] != np.array(tree.inertia[b])[k])}
            if touched & set(axes):
                return f"{body} never turns about {' or '.join(XYZ_AXES[k] for k in sorted(touched & set(axes)))}"
        return "M and h do not depend on it"
    if fault.make[0] == "joints":
        return "the robot is the same in a mirror: M and h are those of that joint turned the other way"
    return "this term is zero, or comes out the same, at every state"


XYZ_AXES = ("its x axis", "its y axis", "its z axis")
