"""What the runs make of the predicted step limits: checks and sentences."""

from collections.abc import Mapping, Sequence

from ...judge.check import About, Result
from ...robots import Robot
from .choice import damped, who
from .growth import MOST_OF_A_STEP, growth_per_step_in_words
from .limits import GROWTH_TOLERANCE, LIMIT_KINDS, LIMIT_TOLERANCE


def check_limits(result: Result, robot: Robot, parts: Sequence[dict]) -> None:
    """The table of limits and that of growth per step, and a check for each row."""
    late, undecided, predicted_only = {}, {}, 0
    rows = [row for part in parts for row in part["rows"]]
    kinds = [row.pop("seen") for row in rows]
    for row, seen in zip(rows, kinds):
        tolerance, reason = row.pop("allowed"), row.pop("undecided", None)
        result.rows.append(row)
        where = f"{row['scene']}, {who(row)}, damping {row['damping']:g}"
        if seen is None:
            undecided.setdefault(reason, []).append(where)
            predicted_only += row["limit"] == "finite"
            continue
        others = [(other, kind) for other, kind in zip(rows, kinds) if is_twin(result, other, row, "scene", "damping")]
        agree = all(
            kind == seen and alike(other["observed_dt_s"], row["observed_dt_s"], tolerance) for other, kind in others
        )
        about = About.PREDICTION if agree else About.MODELS
        if row["limit"] == "finite":
            note = "" if seen == "finite" else f"it {LIMIT_KINDS[seen]}"
            off = apart(row)
            result.check(where, "limit, observed / predicted - 1", off, tolerance, "", note, about=about)
        else:
            quantity = f"runs in which it {LIMIT_KINDS[row['limit']]}, as predicted"
            result.check(where, quantity, int(seen == row["limit"]), 1, "runs", rule="equal", about=about)
        if tolerance > LIMIT_TOLERANCE:
            late[where] = tolerance
    growths = [row for part in parts for row in part["growths"]]
    for row in growths:
        where, off = f"{row['scene']}, {who(row)}, dt = {row['dt_s']:.4g} s", row.pop("total_off")
        what = f"growth in {row['steps']} steps, observed / predicted - 1"
        others = [other for other in growths if is_twin(result, other, row, "scene", "dt_s")]
        same = all(alike(other["observed_growth"], row["observed_growth"], GROWTH_TOLERANCE) for other in others)
        result.check(where, what, off, GROWTH_TOLERANCE, "", about=About.PREDICTION if same else About.MODELS)
    result.tables["stability_growth"] = growths
    words = limits_in_words(robot, result.rows, predicted_only) + late_in_words(late) + undecided_in_words(undecided)
    result.notes[:0] = words
    result.notes += growth_per_step_in_words(growths) + too_long_in_words(parts)


def is_twin(result: Result, other: dict, row: dict, *places: str) -> bool:
    """Whether another row is of the same scheme in the other engine, at the same places."""
    schemes = result.curves.get("schemes", {})
    mine, theirs = (schemes.get((of["engine"], of["method"]), of["method"]) for of in (row, other))
    return other["engine"] != row["engine"] and mine == theirs and all(other[name] == row[name] for name in places)


def alike(one: float | None, other: float | None, tolerance: float) -> bool:
    """Whether two numbers, or none, are the same, relative to a tolerance; engines that are not alike differ in their models."""
    return one is other if None in (one, other) else abs(one - other) <= tolerance * abs(other)


def too_long_in_words(parts: Sequence[dict]) -> list[str]:
    """Which steps are so long that no run can show the growth of one, and how far beyond the limit they are."""
    found = {where: times for part in parts for where, times in part.get("too long", {}).items()}
    if not found:
        return []
    places = "; ".join(f"{where} is {times:.3g} times beyond the limit" for where, times in found.items())
    return [
        f"Growth per step is not compared where a step multiplies a deviation by more than {MOST_OF_A_STEP:g}: {places}."
    ]


def apart(row: dict) -> float | None:
    """How far an observed limit is from the predicted one, relative; None if one of them is missing."""
    known = row["observed_dt_s"] and row["predicted_dt_s"]
    return abs(row["observed_dt_s"] / row["predicted_dt_s"] - 1.0) if known else None


def limits_in_words(robot: Robot, rows: list[dict], undecided: int = 0) -> list[str]:
    """How far observed limits are from the predicted ones, damping by damping; undecided: how many no run was asked for."""
    expected = [row for row in rows if row["limit"] == "finite"]
    known = [row for row in expected if apart(row) is not None]
    if not expected:
        return ["No method has a finite limit in these scenes."]
    differences = ", ".join(
        f"{100 * max(apart(row) for row in known if row['damping'] == damping):.3f} % "
        + (f"with {damped(robot, damping)} N m s/rad" if damping else damped(robot, damping))
        for damping in sorted({row["damping"] for row in known})
    )
    missing = len(expected) - len(known) - undecided
    if missing:
        seen = f"In {missing} cases the runs show no finite limit."
    else:
        seen = f"Of {undecided} no run decides." if undecided else "The runs show each of them."
    return [
        f"{len(expected)} finite limits are predicted without a run. "
        + (f"{len(known)} are observed without the prediction; largest difference: {differences}. " if known else "")
        + seen
    ]


def late_in_words(late: Mapping[str, float]) -> list[str]:
    """Where growth is seen only far above a limit, {where: how far, relative}."""
    if not late:
        return []
    places = "; ".join(f"{where}: {100 * excess:.2g} %" for where, excess in late.items())
    return [
        f"With little damping a mode hardly grows just above its limit. So far above it a run of this length shows the growth, "
        f"and so far from the prediction an observed limit may be: {places}."
    ]


def undecided_in_words(undecided: Mapping[str, Sequence[str]]) -> list[str]:
    """Which limits no run decides, {why: where}."""
    return [
        f"Limits that no run decides, and that are not checked, for {why}: {'; '.join(of)}."
        for why, of in undecided.items()
    ]
