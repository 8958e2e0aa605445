"""Edits of how runs are compared: bands of rounding, divergence, drift, smaller models, motions that are known."""

from ..edit import Edit

EDITS = (
    Edit("band", "NARROW", "1e-3", "0.1", "runs are judged up to 0.1 rad"),
    Edit("band", "slope_rounding", "FACTOR * EPS * _1", "30 * FACTOR * EPS * _1", "band x 30: the rounding of the slope"),
    Edit("band", "step_rounding", "8 * EPS * (np.abs(qd) + _1)", "240 * EPS * (np.abs(qd) + _1)", "rounding of the rates x 30"),
    Edit("band", "step_rounding", "8 * EPS * (np.abs(q) + _1)", "240 * EPS * (np.abs(q) + _1)", "rounding of the angles x 30"),
    Edit("band", "band", "np.abs(carried[:, :here])", "30 * np.abs(carried[:, :here])", "the carried rounding x 30"),
    Edit("band", "growth", "np.log10(size)", "2 * np.log10(size)", "growth of a small difference squared"),
    Edit("motion", "LEFT", "0.1", "0.13", "an arm has left when it is 0.13 rad away"),
    Edit("motion", "departure", "t[away][0]", "t[away][-1]", "the last time away is that of leaving"),
    Edit("motion", "diverged_at", "2.0 * gravity_scale()", "6.0 * gravity_scale()", "the bound of the energy x 3"),
    Edit("motion", "diverged_at", "_1 + kinetic", "_1 + 3 * kinetic", "the energy at the start x 3"),
    Edit("motion", "ORDER_MARGIN", "0.15", "3", "orders may be off by 3"),
    Edit("sub_blocks", "judge", "np.argmax(_1)", "np.argmin(_1)", "the best state is judged"),
    Edit("sub_blocks", "judge", "FACTOR * EPS * scale", "100 * FACTOR * EPS * scale", "tolerance x 100"),
    Edit("smallest", "ZERO", "mpmath.mpf(10) ** _1", "mpmath.mpf(10)", "an acceleration below 10 rad/s2 is zero"),
    Edit("smallest", "needed", "number != 0.0", "False", "every acceleration folds to zero"),
    Edit("known_motion", "judge_function", "FACTOR * EPS * scale", "1e6 * EPS * scale", "64 eps become a million"),
    Edit("known_motion", "judge_orders", "np.divide(_1, _2)", "values[0] / values[1]",
         "the order is measured at the coarsest steps"),
    Edit("exact_motion", "swing", "ellipj(frequency * t + _1, k * k)[0]", "np.sin(frequency * t)", "a sine as the exact swing"),
    Edit("reduction", "judge_run", "np.argmax(_1)", "np.argmin(_1)", "the best state is judged"),
)  # fmt: skip
