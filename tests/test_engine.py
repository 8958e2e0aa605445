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


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ModelError, match=r"cannot read .*no\.xml: No such file"):
        load(tmp_path / "no.xml")


@pytest.mark.parametrize(
    "content, says",
    [
        (b"not xml", "is not MJCF"),
        (b"<robot/>", "has the joints none"),
        (b"\xff\xfe\x00", "is not MJCF"),
        (b"<mujoco><worldbody><body><joint/></body></worldbody></mujoco>", "MuJoCo cannot compile"),
        (b"<mujoco/>", "has the joints none; hinges alpha, beta, gamma and no others are expected"),
    ],
)
def test_a_file_that_is_not_the_arm(tmp_path, content, says):
    path = tmp_path / "model.xml"
    path.write_bytes(content)
    with pytest.raises(ModelError, match=says) as error:
        load(path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "old, new, says",
    [
        ('name="gamma"', 'name="elbow"', r"elbow \(hinge\)"),
        ('name="gamma"', "", r"unnamed \(hinge\)"),
        ('name="gamma" type="hinge"', 'name="gamma" type="slide"', r"gamma \(slide\)"),
        (
            '<body name="upper_arm" pos="0 0 0">',
            '<body name="upper_arm"><freejoint name="loose"/>',
            "cannot compile|loose",
        ),
    ],
)
def test_other_hinges(tmp_path, old, new, says):
    path = tmp_path / "model.xml"
    path.write_text(edited(old, new))
    with pytest.raises(ModelError, match=says):
        load(path)


def test_body_axes_are_those_of_the_world_at_zero(rng):
    """A forearm frame that lies turned in the file describes the same arm."""
    turned = edited(
        '<body name="forearm" pos="0 0 -0.3">', '<body name="forearm" pos="0 0 -0.3" euler="0 0 1.5707963267948966">'
    )
    turned = turned.replace('name="gamma" type="hinge" axis="0 1 0"', 'name="gamma" type="hinge" axis="1 0 0"')
    turned = turned.replace('pos="0.15 0 0" mass="1.5" diaginertia="0.001 0.019 0.019"',
                            'pos="0 -0.15 0" mass="1.5" diaginertia="0.019 0.001 0.019"')  # fmt: skip
    engine, arm = parse(turned), load()
    q, qd = rng.uniform(-3, 3, (2, 50, 3))
    assert np.allclose(engine.angular_velocities(q, qd), arm.angular_velocities(q, qd), atol=1e-12)
    assert np.allclose(engine.jacobians(q)[1], arm.jacobians(q)[1], atol=1e-12)
    assert np.allclose(parameters(engine)["inertia"], parameters(arm)["inertia"], atol=1e-15)
    assert np.allclose(parameters(engine)["com"], parameters(arm)["com"], atol=1e-15)


def test_a_comment_in_another_encoding_is_no_obstacle(tmp_path):
    path = tmp_path / "model.xml"
    path.write_bytes(XML.encode().replace(b"<!--", b"<!-- \xe9 ", 1))
    assert load(path).mass_matrix(REST)[0, 0] == pytest.approx(0.2445)


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
