"""Edits of stability: limits, growth, departures, claims, failures."""

from ..edit import Edit

EDITS = (
    Edit("limits", "AIM", "1e-3", "0.1", "limits may be off by a tenth"),
    Edit("limits", "GROWN", "1e-3", "0.1", "growth in all steps may be off by a tenth"),
    Edit("limits", "ALLOWED", "100.0", "1e6", "growth by a million is allowed"),
    Edit("limits", "MARGIN", "1e-3", "1.0", "a mode that doubles does not grow"),
    Edit("limits", "grows", "return True", "return False", "a run without numbers does not grow"),
    Edit("limits", "grows", "late > (1.0 + MARGIN) * early", "False", "growth between the quarters is not seen"),
    Edit("limits", "judge", "int(seen == row['limit'])", "1", "a limit of another kind is as predicted"),
    Edit("limits", "tell_limits", "max(_1)", "min(_1)", "the least difference is told as the largest"),
    Edit("departure", "NEAR", "0.03", "3.0", "departures may be off by three seconds"),
    Edit("departure", "near", "max(NEAR, dt)", "100 * max(NEAR, dt)", "tolerance x 100"),
    Edit("departure", "late", "0.0 if times == (None, None) else None", "0.0", "one that stays where the other leaves is as predicted"),
    Edit("departure", "EXPONENT", "0.02", "2.0", "the exponent may be off by two"),
    Edit("linear", "NEUTRAL", "1e-9", "0.1", "growth by a tenth in a step is none"),
    Edit("stability", "equilibria", "64 * EPS * _1", "6400 * EPS * _1", "64 eps become 6400: amplification"),
)  # fmt: skip
