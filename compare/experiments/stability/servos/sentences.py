"""What the limits of the step mean, in sentences made of their rows: at the top of a report, and the notes."""

from collections.abc import Mapping, Sequence

from ....judge.words import listed

DEFAULT_INTEGRATOR = "Euler"  # MuJoCo's integrator where a file states none
HIDDEN = "In the full model that cannot be told, which moves under stable integrators too"
SHAKES = 10.0  # fold, of the speed under an integrator that is stable: then it is the step that shakes it
FAR_OFF = 0.1  # of the response to a step of the targets: worth a word beside "stable"
MOST_IN_A_SENTENCE = 6  # postures or actuators in a sentence


def in_seconds(dt: float, beside: float | None = None) -> str:
    """A time in words, 2 ms or 0.15 s; with more digits where another one is near."""
    digits = 4 if beside and abs(dt / beside - 1.0) < 0.1 and dt != beside else 2
    number, unit = (1e3 * dt, "ms") if dt < 0.1 else (dt, "s")
    return f"{in_digits(number, digits)} {unit}"


def in_digits(number: float, digits: int = 2) -> str:
    """A number in a sentence, 130 and not 1.3e+02."""
    return f"{float(f'{number:.{digits}g}'):g}"


def some_of(words: Sequence[str]) -> str:
    """The first of many words as a list."""
    more = len(words) - MOST_IN_A_SENTENCE
    return f"{', '.join(words[:MOST_IN_A_SENTENCE])} and {more} more" if more > 0 else listed(words)


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


def at_the_top(rows: Sequence[dict], full: Sequence[dict], has_servos: bool = True, where: str = "") -> str:
    """What a robot's engineer wants to know first: whether its own step is stable, and MuJoCo's default Euler with it.

    rows: of step_limits.csv; full: of full_model.csv; where: without what the limits are, see remarks.circumstances.
    """
    dt, integrator = rows[0]["file_dt_s"], rows[0]["file_integrator"]
    own = known(rows, integrator)
    if not has_servos:
        kinds = kinds_in_words(rows)
        text = f"No actuator feeds back: there is no servo that its own {in_seconds(dt)} could make unstable"
        return f"{text} ({kinds})." if kinds else f"{text}."
    if not own:
        whether = f"Whether its own {in_seconds(dt)} under {integrator} is stable cannot be said"
        return f"{whether}: {kinds_in_words(rows)}{no_rest_in_words(rows)}."
    words = own_in_words(rows, own, full, where)
    return words if integrator == DEFAULT_INTEGRATOR else f"{words} {default_in_words(rows, own, full)}"


def refused_in_words(refused: Mapping[str, str]) -> list[str]:
    """What is left out of the limits, by its name, and why: a sentence, or none."""
    texts = [f"{name}: {why}" for name, why in refused.items()]
    return (
        [f"Left out of the limits, for they are not known to act by a linear law: {some_of(texts)}."] if texts else []
    )


def own_in_words(rows: Sequence[dict], own: Sequence[dict], full: Sequence[dict], without: str = "") -> str:
    """Whether the file's own step is stable under its own integrator."""
    dt, integrator = own[0]["file_dt_s"], own[0]["file_integrator"]
    name = integrator if integrator != DEFAULT_INTEGRATOR else f"{DEFAULT_INTEGRATOR}, MuJoCo's default"
    step = f"table at its own {in_seconds(dt)} under {name}{without}"
    postures = {row["posture"] for row in rows}
    bad = [row for row in own if not row["stable_at_file_dt"]]
    if bad:
        where = "" if len(bad) == len(postures) else f" at {some_of([row['posture'] for row in bad])}"
        text = f"Not s{step}{where} ({limit_in_words(own[0], len(postures) > 1, dt)})."
        kind, silent = shaking(full, bad)
        return (
            text
            + {
                "": "",
                "shakes": f" The full model shakes{silent}.",
                "calm": " The full model stays calm for two seconds all the same.",
                "both": f" {HIDDEN}.",
            }[kind]
        )
    elsewhere = len(postures) > len(own)
    where = f" at {some_of([row['posture'] for row in own])}" if elsewhere else ""
    text = f"S{step}{where} ({limit_in_words(own[0], False, dt)})."
    worst = max(row["step_response_error"] or 0.0 for row in own)
    if worst > FAR_OFF:
        text += f" But stable is not exact: a step of its targets is answered {in_digits(100.0 * worst)} % off."
    return text + (f" At the others that cannot be said: {kinds_in_words(rows)}." if elsewhere else "")


def default_in_words(rows: Sequence[dict], own: Sequence[dict], full: Sequence[dict]) -> str:
    """Whether the same step is stable under the integrator that a scene has which states none."""
    of_default, dt = known(rows, DEFAULT_INTEGRATOR), own[0]["file_dt_s"]
    attached = "attached to a scene whose `<option>` states no integrator"
    too = all(row["stable_at_file_dt"] for row in own)
    bad = [row for row in of_default if not row["stable_at_file_dt"]]
    limit = limit_in_words(of_default[0], len({row["posture"] for row in rows}) > 1, dt)
    if not bad:
        return f"Under MuJoCo's default {DEFAULT_INTEGRATOR} it is{' too' if too else ''} ({limit}), {attached}."
    kind, silent = shaking(full, bad)
    shakes = {
        "": "it can shake",
        "shakes": f"it will shake{silent}",
        "calm": "it can shake, though the full model stays calm for two seconds",
        "both": f"it can shake. {HIDDEN}",
    }
    text = f"Under MuJoCo's default {DEFAULT_INTEGRATOR} it is {'not' if too else 'neither'} ({limit})"
    return f"{text}: {attached}, {shakes[kind]}."


def shaking(full: Sequence[dict], bad: Sequence[dict]) -> tuple[str, str]:
    """What the full model does where a step is not stable, and what MuJoCo says of it: ", without a warning".

    shakes, at one of these postures at least, far more than with an integrator that is stable; calm at all; both: it moves much
    as with an integrator that is stable; "": it was not run. bad: rows of one integrator.
    """
    runs = {(row["posture"], row["integrator"]): row for row in full}
    ran = [runs[place] for row in bad if (place := (row["posture"], row["integrator"])) in runs]
    moving = [row for row in ran if not row["calm"]]
    shaken = [
        row
        for row in moving
        if row["rms_speed"] is None or row["rms_speed"] > SHAKES * least_speed(full, row["posture"])
    ]
    if not shaken:
        return ("both" if moving else "calm" if ran else ""), ""
    counts = {word: sum(row[key] for row in shaken) for key, word in (("warnings", "warning"), ("resets", "reset"))}
    said = [f"{count} {word if count == 1 else f'{word}s'}" for word, count in counts.items() if count]
    return "shakes", f", with {listed(said)}" if said else ", without a warning"


def least_speed(full: Sequence[dict], posture: str) -> float:
    """The least speed of the full model at a posture under integrators that are stable there."""
    speeds = [row["rms_speed"] for row in full if row["posture"] == posture and row["predicted_stable"]]
    return min((speed for speed in speeds if speed is not None), default=0.0)


WITHOUT_LIMIT = {
    "saddle": "a saddle, which the robot leaves by itself whatever the step, as what stands upright falls",
    "drifts": "nothing holds or brakes a movement",
    "not_at_rest": "it does not rest",
}


def kinds_in_words(rows: Sequence[dict]) -> str:
    """At which postures there is no limit to be said, and why."""
    texts = []
    for kind, why in WITHOUT_LIMIT.items():
        of = [row for row in rows if row["limit"] == kind and row["base"] != "locked"]
        weightless = kind == "not_at_rest" and any(row["base"] == "free" for row in of)
        where = some_of(list(dict.fromkeys(row["posture"] for row in of)))
        texts += [f"{where}: {'without gravity ' * weightless}{why}"] * bool(of)
    return "; ".join(texts)


def no_rest_in_words(rows: Sequence[dict]) -> str:
    """What would be looked at, where no posture has a limit and some do not rest stably; '' where all drift."""
    if all(row["limit"] == "drifts" for row in rows if row["base"] != "locked"):
        return ""
    return "; no posture that rests stably was found or given (a keyframe of one would be looked at)"
