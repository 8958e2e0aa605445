"""The edits, by what they break."""

from . import checks, engines, fleet, motion, own, parameters, report, rules, servos, speed, stability, tmt

EDITS = (
    *rules.EDITS, *checks.EDITS, *parameters.EDITS, *motion.EDITS, *own.EDITS, *speed.EDITS, *stability.EDITS, *servos.EDITS,
    *report.EDITS, *tmt.EDITS, *fleet.EDITS, *engines.EDITS,
)  # fmt: skip
