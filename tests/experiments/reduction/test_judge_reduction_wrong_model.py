"""An engine whose smaller model is another one is seen."""

from compare import experiment
from compare.engines.mujoco import Mujoco, load
from compare.experiments import reduction
from compare.robots.arm import ARM


class DampedWhereLocked(Mujoco):
    """MuJoCo, whose model with locked joints has damping."""

    def changed(self, case):
        model = super().changed(case)
        model.dof_damping[:] += 0.1 if case.locked else 0.0
        return model


def test_a_smaller_model_of_one_engine_that_is_wrong_is_seen():
    wrong = load(ARM.mjcf, ARM.tree)
    wrong.__class__ = DampedWhereLocked
    setup = experiment.Setup.small(ARM, experiment.engines(wrong))
    failed = [check for check in reduction.rows(setup, timed=False).checks if not check.passed]
    where = {check.scene for check in failed if check.quantity == "smallest model to whole"}
    assert "zero, free, MuJoCo, RK4, dt = 5/1024 s" in where and not any("TMT" in scene for scene in where)
