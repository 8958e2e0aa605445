"""The sentence at the top of a robot's report: each of its parts can come out the other way."""

import pytest

from compare.experiments.stability.servos.sentences import at_the_top, in_seconds, refused_in_words, shaking

ATTACHED = "attached to a scene whose `<option>` states no integrator"


def limits(own=("p", 0.2), euler=("p", 6e-4), file="implicitfast", **more):
    """Rows of one or more postures: (posture, limit in s; None: none; a word: of another kind) ..."""
    rows = []
    for integrator, places in (("Euler", euler), (file, own)):
        for name, limit in zip(places[::2], places[1::2]):
            kind = limit if isinstance(limit, str) else "finite" if limit else "none"
            dt = limit if kind == "finite" else None
            rows.append({
                "posture": name, "base": "fixed", "integrator": integrator, "limit": kind, "predicted_dt_s": dt,
                "file_dt_s": 2e-3, "file_integrator": file, "limiting_joint": "joint7",
                "stable_at_file_dt": dt is None or dt >= 2e-3, "step_response_error": 0.004,
            } | more)  # fmt: skip
    return rows


def run(integrator, speed, stable, warnings=0, resets=0, posture="p"):
    return {
        "posture": posture, "integrator": integrator, "rms_speed": speed, "warnings": warnings, "resets": resets,
        "predicted_stable": stable, "calm": speed is not None and speed < 1e-3,
    }  # fmt: skip


CALM = run("implicitfast", 1e-12, True)


@pytest.mark.parametrize("rows, full, said", [
    (limits(), [CALM, run("Euler", 0.4, False)],
     "Stable at its own 2 ms under implicitfast (limit 0.2 s, joint7). Under MuJoCo's default Euler it is not (limit 0.6 ms, "
     f"joint7): {ATTACHED}, it will shake, without a warning."),
    (limits(), [CALM, run("Euler", 0.4, False, 1, 2)], f"joint7): {ATTACHED}, it will shake, with 1 warning and 2 resets."),
    (limits(), [CALM, run("Euler", None, False, 3)], "it will shake, with 3 warnings."),
    (limits(), [CALM, run("Euler", 1e-5, False)], "it can shake, though the full model stays calm for two seconds."),
    (limits(), [run("implicitfast", 0.1, True), run("Euler", 0.4, False)],
     "it can shake. In the full model that cannot be told, which moves under stable integrators too."),
    (limits(), [], f"{ATTACHED}, it can shake."),
    (limits(euler=("p", 4e-3)), [], f"Under MuJoCo's default Euler it is too (limit 4 ms, joint7), {ATTACHED}."),
    (limits(euler=("p", None)), [], f"Under MuJoCo's default Euler it is too (no limit up to 5 s), {ATTACHED}."),
    (limits(own=("p", 1e-3)), [CALM | {"predicted_stable": False}, run("Euler", 1e-5, False)],
     "Not stable at its own 2 ms under implicitfast (limit 1 ms, joint7). The full model stays calm for two seconds all the "
     "same. Under MuJoCo's default Euler it is neither (limit 0.6 ms, joint7)"),
    (limits(own=("p", 1e-3), euler=("p", 0.1)), [], f"Under MuJoCo's default Euler it is (limit 0.1 s, joint7), {ATTACHED}."),
    (limits(file="Euler", own=("p", 1.99e-3), euler=()), [run("Euler", 30.0, False)],
     "Not stable at its own 2 ms under Euler, MuJoCo's default (limit 1.99 ms, joint7). The full model shakes, without a "
     "warning."),
    (limits(own=("p", 1e-3, "q", 0.1), euler=()), [],
     "Not stable at its own 2 ms under implicitfast at p (limit 1 ms, joint7, at p)."),
    (limits(own=("p", 0.1, "q", "saddle"), euler=("p", 0.1)), [],
     "Stable at its own 2 ms under implicitfast at p (limit 0.1 s, joint7). At the others that cannot be said: q: a saddle, "
     "which the robot leaves by itself whatever the step, as what stands upright falls."),
    (limits(own=("p", "saddle"), euler=(), file="Euler"), [],
     "Whether its own 2 ms under Euler is stable cannot be said: p: a saddle, which the robot leaves by itself whatever the "
     "step, as what stands upright falls; no posture that rests stably was found or given (a keyframe of one would be looked "
     "at)."),
    (limits(own=("p", "drifts"), euler=()), [], "cannot be said: p: nothing holds or brakes a movement."),
    (limits(own=("p", "drifts", "q", "not_at_rest"), euler=()), [],
     "Whether its own 2 ms under implicitfast is stable cannot be said: p: nothing holds or brakes a movement; q: it does "
     "not rest; no posture that rests stably was found or given (a keyframe of one would be looked at)."),
    (limits(own=("p", "not_at_rest"), euler=(), base="free"), [],
     "cannot be said: p: without gravity it does not rest; no posture that rests"),
])  # fmt: skip
def test_what_is_said_first(rows, full, said):
    if not any(row["integrator"] == "Euler" for row in rows):
        rows += [row | {"integrator": "Euler", "predicted_dt_s": 1.0, "stable_at_file_dt": True} for row in rows]
    assert said in at_the_top(rows, full)


def test_a_locked_base_does_not_count():
    rows = limits() + limits(own=("p", 1e-5), euler=("p", 1e-5), base="locked")
    assert at_the_top(rows, []) == at_the_top(limits(), [])


def test_it_shakes_if_it_does_at_one_posture_of_several():
    bad = limits(own=(), euler=("p", 1e-3, "q", 1e-3))
    calm = [run("Euler", 1e-5, False), CALM, run("implicitfast", 1e-9, True, posture="q")]
    assert shaking([*calm, run("Euler", 0.4, False, posture="q")], bad) == ("shakes", ", without a warning")
    assert shaking([*calm, run("Euler", 9e-4, False, posture="q")], bad) == ("calm", "")
    assert shaking([run("Euler", 0.9, False), run("RK4", 0.1, True)], bad) == ("both", "")
    assert shaking([run("Euler", 1.1, False), run("RK4", 0.1, True)], bad)[0] == "shakes"


@pytest.mark.parametrize("dt, beside, text", [
    (2e-3, None, "2 ms"), (5.9312e-4, 2e-3, "0.59 ms"), (0.2011, 2e-3, "0.2 s"),
    (1.9912e-3, 2e-3, "1.991 ms"), (0.0999, None, "100 ms"),
])  # fmt: skip
def test_times_have_the_digits_that_tell_them_apart(dt, beside, text):
    assert in_seconds(dt, beside) == text


def test_stable_and_far_off_is_said():
    assert "34 % off" in at_the_top(limits(step_response_error=0.34), [])
    assert "off" not in at_the_top(limits(step_response_error=0.0999), [])
    assert "off" not in at_the_top(limits(step_response_error=None), [])


def test_what_is_left_out_is_named_with_its_reason():
    assert refused_in_words({}) == []
    assert refused_in_words({"biceps": "a muscle"})[0].endswith("linear law: biceps: a muscle.")
