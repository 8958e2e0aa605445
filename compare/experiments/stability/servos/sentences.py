"""What the limits of the step mean, in sentences made of their rows: at the top of a report, and the notes."""

from collections.abc import Sequence

from ....judge.words import capital, listed
from ....robots import Robot
from .predicted import Predicted

DEFAULT = "Euler"  # MuJoCo's integrator where a file states none
SHAKES = 10.0  # fold, of the speed under an integrator that is stable: then it is the step that shakes it
MOST_LISTED = 6  # postures or actuators in a sentence
RESTS = 1e-6  # rad or m: a rest so near is the posture


def in_seconds(dt: float, beside: float | None = None) -> str:
    """A time in words, 2 ms or 0.15 s; with more digits where another one is near."""
    digits = 4 if beside and abs(dt / beside - 1.0) < 0.1 and dt != beside else 2
    number, unit = (1e3 * dt, "ms") if dt < 0.1 else (dt, "s")
    return f"{float(f'{number:.{digits}g}'):g} {unit}"


def some_of(words: Sequence[str]) -> str:
    """The first of many words as a list."""
    more = len(words) - MOST_LISTED
    return f"{', '.join(words[:MOST_LISTED])} and {more} more" if more > 0 else listed(words)


def known(rows: Sequence[dict], integrator: str) -> list[dict]:
    """The rows of an integrator that count, of postures with a limit or known to have none, the least limit first."""
    found = [
        row
        for row in rows
        if (row["integrator"], row["limit"] in ("finite", "none"), row["base"] != "locked") == (integrator, True, True)
    ]
    return sorted(found, key=lambda row: row["predicted_dt_s"] or float("inf"))


def limit_in_words(row: dict, several: bool, dt: float) -> str:
    """limit 1.1 ms, joint3; at which posture, if there are several."""
    if row["predicted_dt_s"] is None:
        return "no limit up to 5 s"
    where = f", at {row['posture']}" if several else ""
    return f"limit {in_seconds(row['predicted_dt_s'], dt)}, {row['limiting_joint']}{where}"


def at_the_top(rows: Sequence[dict], full: Sequence[dict]) -> list[str]:
    """What a robot's engineer wants to know first: whether its own step is stable, and MuJoCo's default Euler with it.

    rows: of step_limits.csv; full: of full_model.csv.
    """
    dt, integrator = rows[0]["file_dt_s"], rows[0]["file_integrator"]
    own = known(rows, integrator)
    if not own:
        return [f"Whether its own {in_seconds(dt)} under {integrator} is stable cannot be said: {kinds_in_words(rows)}."]
    words = [own_in_words(rows, own, full)]
    if integrator != DEFAULT:
        words.append(default_in_words(rows, own, full))
    return words


def own_in_words(rows: Sequence[dict], own: Sequence[dict], full: Sequence[dict]) -> str:
    """Whether the file's own step is stable under its own integrator."""
    dt, integrator = own[0]["file_dt_s"], own[0]["file_integrator"]
    name = integrator if integrator != DEFAULT else f"{DEFAULT}, MuJoCo's default"
    postures = list(dict.fromkeys(row["posture"] for row in rows))
    others = len(postures) - len(own)
    bad = [row for row in own if not row["stable_at_file_dt"]]
    if bad:
        where = "" if len(bad) == len(postures) else f" at {some_of([row['posture'] for row in bad])}"
        text = f"Not stable at its own {in_seconds(dt)} under {name}{where} ({limit_in_words(own[0], len(postures) > 1, dt)})."
        shaken = shaking(full, own[0]["posture"], integrator, rows)
        return text + {"": "", "shakes": f" The full model shakes there{silence(full, own[0])}.",
                       "calm": " The full model stays calm there all the same.",
                       "both": " In the full model that is not to be seen, which moves under stable integrators too."}[shaken]  # fmt: skip
    where = f" at {some_of([row['posture'] for row in own])}" if others else ""
    limit = limit_in_words(own[0], False, dt).split(",")[0]
    text = f"Stable at its own {in_seconds(dt)} under {name}{where} ({limit})."
    return text + (f" At the other postures that cannot be said: {kinds_in_words(rows)}." if others else "")


def default_in_words(rows: Sequence[dict], own: Sequence[dict], full: Sequence[dict]) -> str:
    """Whether the same step is stable under the integrator that a scene has which states none."""
    of_default, dt = known(rows, DEFAULT), own[0]["file_dt_s"]
    several = len({row["posture"] for row in rows}) > 1
    attached, least = "attached to a scene whose <option> states no integrator", of_default[0]
    too = all(row["stable_at_file_dt"] for row in own)
    limit = limit_in_words(least, several, dt)
    if all(row["stable_at_file_dt"] for row in of_default):
        return f"Under MuJoCo's default {DEFAULT} it is{' too' if too else ''} ({limit}), {attached}."
    text = f"Under MuJoCo's default {DEFAULT} it is {'not' if too else 'neither'} ({limit}): {attached}, "
    shaken = shaking(full, least["posture"], DEFAULT, rows)
    return text + {"": "it can shake", "shakes": f"it will shake{silence(full, least)}",
                   "calm": "it can shake, though the full model stays calm there for two seconds",
                   "both": "it can shake; in the full model that is not to be seen, which moves under stable integrators too",
                   }[shaken] + "."  # fmt: skip


def shaking(full: Sequence[dict], posture: str, integrator: str, rows: Sequence[dict]) -> str:
    """What the full model does at a posture under an integrator: calm, shakes, or both, it moves under a stable one as well; "": not run."""
    of_posture = {row["integrator"]: row for row in full if row["posture"] == posture}
    if integrator not in of_posture:
        return ""
    row = of_posture[integrator]
    if row["calm"]:
        return "calm"
    stable = [other["rms_speed"] for other in of_posture.values() if other["predicted_stable"]]
    least = min((speed for speed in stable if speed is not None), default=0.0)
    return "shakes" if row["rms_speed"] is None or row["rms_speed"] > SHAKES * least else "both"


def silence(full: Sequence[dict], row: dict) -> str:
    """Whether MuJoCo says something of it: ", without a warning"."""
    of_run = next(r for r in full if (r["posture"], r["integrator"]) == (row["posture"], row["integrator"]))
    said = [
        f"{of_run[key]} {word if of_run[key] == 1 else f'{word}s'}"
        for key, word in (("warnings", "warning"), ("resets", "reset"))
        if of_run[key]
    ]
    return f", with {listed(said)}" if said else ", without a warning"


KINDS = {
    "saddle": "a saddle, which is left by itself",
    "drifts": "nothing holds or brakes a movement",
    "not_at_rest": "it does not rest",
}


def kinds_in_words(rows: Sequence[dict]) -> str:
    """At which postures there is no limit to be said, and why."""
    texts = []
    for kind, why in KINDS.items():
        names = list(dict.fromkeys(row["posture"] for row in rows if row["limit"] == kind and row["base"] != "locked"))
        texts += [f"{some_of(names)}: {why}"] * bool(names)
    return "; ".join(texts)
