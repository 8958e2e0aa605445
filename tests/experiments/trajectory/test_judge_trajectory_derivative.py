"""The derivative of the bias by the rates."""

import dataclasses

import numpy as np

import tmt
from compare.experiments.trajectory.derivative import check_derivative
from compare.judge.check import Result

EPS = 2.0**-52


def test_the_derivative_of_the_bias_is_judged_by_the_rates_of_each_state():
    q, qd = np.zeros((2, 3)), np.array([[1.0, -2.0, 3.0], [0.1, 0.0, 0.0]])
    damped, largest = dataclasses.replace(tmt.ARM, damping=(0.1, 0.5, 0.0)), tmt.mass_matrix(q[0]).max()
    for k, size in ((0, largest * 6.0 + 0.5), (1, largest * 0.1 + 0.5)):
        for share, passes in ((0.999, True), (1.001, False), (np.nan, False)):
            theirs, result = np.zeros((2, 3, 3)), Result("trajectory")
            theirs[k, 2, 1] = share * 64 * EPS * size
            check_derivative(result, damped, q, qd, np.zeros((2, 3, 3)), theirs)
            assert result.checks[0].passed is passes
