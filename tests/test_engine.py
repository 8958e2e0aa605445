"""MuJoCo behind the project's symbols: files, names, frames, divergence."""

import numpy as np
import pytest

import tmt
from compare.engine import INTEGRATORS
from compare.engine_file import ARM_XML, ModelError, load, parse
from compare.engine_parameters import parameters

XML = ARM_XML.read_text()
REST = np.zeros(3)


def edited(old, new):
    assert XML.count(old) == 1
    return XML.replace(old, new)


def test_quantities_are_those_of_the_state_that_is_asked_for(engine, rng):
    q, qd, tau = rng.uniform(-2, 2, (3, 3))
    before = engine.bias(q, qd)
    engine.trajectory(q, qd, tau, 0.01, 10)
    engine.acceleration(q + 1, qd, tau)
    assert np.array_equal(engine.bias(q, qd), before)


def test_trajectory_starts_at_the_start_and_feels_the_torque(engine):
    q0, tau = np.array([0.5, 0.4, 0.3]), np.array([3.0, -2.0, 1.0])
    t, q, qd = engine.trajectory(q0, REST, tau, 0.001, 10)
    assert t.shape == (11,) and np.array_equal(q[0], q0)
    assert np.allclose(qd[1] / 0.001, tmt.acceleration(q0, REST, tau), rtol=0.02)
    _, unpushed, _ = engine.trajectory(q0, REST, REST, 0.001, 10)
    assert np.abs(unpushed[-1] - q[-1]).max() > 1e-4


def test_a_diverged_run_is_nan_from_there_on_and_leaves_no_log(engine, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    _, q, _ = engine.trajectory(REST, np.full(3, 1e3), REST, 10.0, 200)
    finite = np.isfinite(q).all(axis=1)
    assert finite[0] and not finite[-1] and not finite[np.argmin(finite) :].any()
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def test_a_diverged_run_is_not_reset_where_the_file_allows_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lenient = parse(edited(' autoreset="disable"', ""))
    _, q, _ = lenient.trajectory(REST, np.full(3, 1e3), REST, 10.0, 200)
    assert not np.isfinite(q[-1]).any()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_batch_of_runs_is_each_run(engine, integrator, rng):
    q, qd, tau = rng.uniform(-1, 1, (3, 2, 3, 3))
    _, path_q, path_qd = engine.trajectory(q, qd, tau, 0.01, 5, integrator)
    _, single_q, single_qd = engine.trajectory(q[1, 2], qd[1, 2], tau[1, 2], 0.01, 5, integrator)
    assert np.array_equal(path_q[1, 2], single_q) and np.array_equal(path_qd[1, 2], single_qd)
