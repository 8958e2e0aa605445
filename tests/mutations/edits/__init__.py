"""The edits, by what they break; a row of a module has the fields of an Edit in their order."""

from ..edit import Edit
from . import (
    checks,
    engines,
    fleet,
    motion,
    own,
    parameters,
    report,
    rules,
    servos,
    speed,
    stability,
    steps,
    tmt,
)

MODULES = rules, checks, parameters, motion, own, speed, stability, steps, servos, report, tmt, fleet, engines
EDITS = tuple(Edit(*row) for module in MODULES for row in module.EDITS)
