"""Edits of stability: limits, departures, claims, failures."""

from ..edit import Edit

EDITS = (
    Edit("stability.limits", "LIMIT_TOLERANCE", "1e-3", "0.1", "limits may be off by a tenth"),
    Edit("stability.limits", "GROWTH_ALLOWED", "100.0", "1e6", "growth by a million is allowed"),
    Edit("stability.limits", "GROWTH_MARGIN", "1e-3", "1.0", "a mode that doubles does not grow"),
    Edit("stability.limits", "grows", "return True", "return False", "a run without numbers does not grow"),
    Edit("stability.limits", "grows", "late > (1.0 + GROWTH_MARGIN) * early", "False", "growth between the quarters is not seen"),
    Edit("stability.limits", "check_limits", "int(seen == row['limit'])", "1", "a limit of another kind is as predicted"),
    Edit("departure", "DEPARTURE_TOLERANCE", "0.03", "3.0", "departures may be off by three seconds"),
    Edit("departure", "near", "max(DEPARTURE_TOLERANCE, row['dt_s'])", "100 * max(DEPARTURE_TOLERANCE, row['dt_s'])",
         "tolerance x 100"),
    Edit("departure", "late", "0.0 if times == (None, None) else None", "0.0",
         "a run that stays where the other leaves is as predicted"),
    Edit("truth.linear", "Held.kind", "np.abs(values).min() <= small", "False",
         "without gravity every posture is a centre"),
    Edit("linear", "NEUTRAL", "1e-9", "0.1", "growth by a tenth in a step is none"),
    Edit("equilibria", "check_amplification", "FACTOR * EPS", "100 * FACTOR * EPS", "64 eps become 6400"),
    Edit("departure", "late", "times[0] - times[1]", "0.0", "every run leaves when it should"),
    Edit("departure", "departure_values", "max(_1, default=None)", "min(_1, default=None)",
         "the nearest departure is said to be the farthest"),
    Edit("claims", "check_torques", "_1 and all(_2)", "True", "claim 1 is reproduced whatever its checks say"),
    Edit("claims", "check_finer_steps", "still &= _1", "_1", "claim 2 is reproduced although an arm moves"),
    Edit("robots.arm", "CLAIMS", "4.5", "9.5", "the published time is another"),
    Edit("claims", "side", "np.sign(_1)", "-np.sign(_1)", "the side to which the arm leaves is turned round"),
    Edit("claims", "check_kept", "stays and moves", "True", "claim 3 is reproduced whatever the runs do"),
    Edit("claims", "check_kept", "result.check(_1, quantity, size, PUSHED, *_2)",
         "result.check(_1, quantity, PUSHED, PUSHED, *_2)", "bent's torque always pushes a hanging arm"),
    Edit("claims", "PUSHED", "1.0", "100.0", "any torque lets the arm hang"),
    Edit("failure", "check_reset", "run['resets']", "False", "no reset is looked at"),
)  # fmt: skip
