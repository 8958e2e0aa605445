"""Edits of timing, errors and advice."""

from ..edit import Edit

EDITS = (
    Edit("timing", "fastest", "min(taken)", "7 * min(taken)", "times x 7"),
    Edit("timing", "in_turns", "time.perf_counter() - begin", "7 * (time.perf_counter() - begin)", "seconds x 7"),
    Edit("timing", "in_turns", "len(taken) * min(taken)", "sum(taken)", "a call that was disturbed ends the repetition"),
    Edit("speed", "rows", "_1.feeds_back and not regular.controller", "False", "nobody is told that servos are off"),
    Edit("speed.runs", "take_times", "factor * min(of_row)", "7 * factor * min(of_row)", "reported seconds x 7"),
    Edit("speed.runs", "take_times", "factor * min(of_row)", "factor * max(of_row)", "the slowest run is reported"),
    Edit("speed.runs", "scene", "max(_1, reference.apart)", "_1",
         "a reference of few digits is taken as exact"),
    Edit("evaluations", "per_state", "1e9 * min(of_call) / count", "1e9 * min(of_call)", "time of all states as that of one"),
    Edit("truth.reference", "Reference.error", "self.low[_1]", "0 * self.low[_1]", "the low part of the reference is dropped"),
    Edit("truth.reference", "Reference.error", "_1.max(axis=1)", "_1.min(axis=1)", "the best joint is judged", nth=1),
    Edit("truth.reference", "reference", "case.tree", "case.robot.tree", "the reference is of the robot without the scene"),
    Edit("advice", "cheapest", "min(fit, key=_1, default=None)", "max(fit, key=_1, default=None)",
         "the dearest is advised"),
    Edit("advice", "advice", "row['worst_error_rad'] <= target", "row['worst_error_rad'] <= 10 * target",
         "a setting ten times too inexact is advised"),
    Edit("advice", "ratio", "slow['seconds'] / fast['seconds']", "fast['seconds'] / slow['seconds']",
         "ratios are inverted"),
    Edit("accuracy", "check_orders", "regular[-2:]", "regular[:2]", "the order is measured at the coarsest steps"),
    Edit("accuracy", "check_orders", "clear < row['early'] < REGULAR", "True", "the order is measured among errors of rounding"),
    Edit("accuracy", "LEAST_ORDER", "7.0", "1.0", "order 8 need only be 1"),
    Edit("speed.settings", "coarsest_steps", "GRID if case.controller else _1", "_1", "steps of a step response begin fine"),
    Edit("accuracy", "check_same_schemes", "FACTOR * floors[scene]", "1e6 * floors[scene]",
         "the same scheme's tolerance: 64 -> 1e6"),
    Edit("accuracy", "check_smallest_errors", "FACTOR * left", "100 * FACTOR * left", "tolerance x 100", nth=1),
    Edit("accuracy", "check_smallest_errors", "np.isfinite([theirs, ours]).any()",
         "np.isfinite([theirs, ours]).all()", "a MuJoCo that diverges where tmt does not is not compared"),
    Edit("accuracy", "error", "row['diverged']", "False", "a run that diverged has an error"),
    # engines
    Edit("engines", "as_far_as_it_goes", "t[int(np.argmin(finite)) - 1]", "t[0]", "every run ends at its start"),
    Edit("engines.tmt", "TmtDynamics.prepare", "path[0, ::every].copy()", "path[0, -65:].copy()",
         "a timed run is read at its last steps"),
)  # fmt: skip
