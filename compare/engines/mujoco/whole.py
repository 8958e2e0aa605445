"""Centre of mass and momentum of all that moves, from MuJoCo's subtrees of the bodies that joints hang on the world."""

from collections.abc import Callable

import mujoco
import numpy as np

Jacobian = Callable[[mujoco.MjModel, mujoco.MjData, np.ndarray, int], None]


class Whole:
    """Its methods take data of which mj_comPos is done. What never moves does not count."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model, moves = (
            model,
            model.body_treeid >= 0,
        )  # no tree: the world, mocap bodies, what is fixed to them
        self.trees = np.flatnonzero(moves & ~moves[model.body_parentid])
        self.masses = model.body_subtreemass[self.trees]
        self.shares = self.masses / self.masses.sum()

    def com(self, d: mujoco.MjData) -> np.ndarray:
        return self.shares @ d.subtree_com[self.trees]

    def com_jacobian(self, d: mujoco.MjData) -> np.ndarray:
        """(3, nv)."""
        return np.einsum("t,tij->ij", self.shares, self.of_trees(mujoco.mj_jacSubtreeCom, d))

    def momentum(self, d: mujoco.MjData) -> np.ndarray:
        """Linear, and angular about the common centre of mass, for unit speeds, (6, nv)."""
        linear = self.masses[:, None, None] * self.of_trees(mujoco.mj_jacSubtreeCom, d)
        arms = d.subtree_com[self.trees] - self.com(d)
        angular = self.of_trees(mujoco.mj_angmomMat, d) + np.cross(arms[:, :, None], linear, axis=1)
        return np.concatenate([linear.sum(axis=0), angular.sum(axis=0)])

    def of_trees(self, function: Jacobian, d: mujoco.MjData) -> np.ndarray:
        result = np.zeros((len(self.trees), 3, self.model.nv))
        for jacobian, body in zip(result, self.trees):
            function(self.model, d, jacobian, int(body))
        return result
