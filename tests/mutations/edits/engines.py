"""Edits of the comparison with other engines."""

EDITS = (
    ("mujoco.parameters", "remarks", "feature.treatment in (OFF, OPEN, LEFT_OUT)", "feature.treatment in (OFF, OPEN)",
     "a keyframe that is left out is not told"),
    ("experiments.engines", "compare_quantity", "FACTOR * eps * size", "100 * FACTOR * eps * size", "tolerance x 100"),
    ("experiments.engines", "compare_quantity", "record.eps", "1.2e-07", "every engine is judged as float32"),
    ("engines.readings", "tolerance_of", "FACTOR * record.eps", "1e9 * record.eps", "numbers as read: 64 -> 1e9"),
    ("engines.readings", "add_differing", "cause and str(cause)", "None", "no cause is named"),
    ("engines.answer", "as_set", "all(_1)", "True", "other equations are said to be the same"),
    ("engines.answer", "cheapest_of", "row.worst_error <= target", "True", "a method that is not exact enough is the cheapest"),
    ("engines.answer", "cheapest_engine", "min(reached, *_1)", "max(reached, *_1)", "the dearest engine is the cheapest"),
    ("engines.integrators", "step_of", "np.floor(_1)", "np.ceil(_1)", "a single step is longer than the file's"),
    ("engines.outside", "OutsideDynamics.acting", "self.is_set", "True", "damping is that of the file, whatever was read"),
    ("engines.outside.model", "movement", "moved.origin - turn @ link.origin", "moved.origin", "an anchor is a point of a body"),
    ("timing", "is_timed", "scatter(taken) <= STEADY", "True", "one disturbed call is a time"),
    ("engines.readings", "OF_BODIES", "('mass', 'moments')", "('moments',)", "a wrong mass is only listed"),
    ("engines.integrators", "compare_steps", "_1 * record.eps / EPS", "_1 * 1e9", "one step: tolerance x 1e9"),
    ("engines.integrators", "order_of", "max(CLEAR, EARLY / dt)", "CLEAR", "the rounding of each step is regular"),
    ("engines.outside", "read", "model.mend(number, stated[number])", "True", "nothing is set, and it is said to be"),
    ("engines.outside", "OutsideDynamics.acceleration", "tau - passive(*_1)", "tau", "damping is forgotten"),
    ("outside", "OutsideDynamics.ask", "WorkerEnded", "KeyError", "an engine whose process ends breaks the experiment"),
    ("engines.outside.model", "combined", "point_inertia(d, m)", "0.0", "Steiner's part is forgotten"),
)  # fmt: skip
