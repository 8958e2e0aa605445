"""Centre of mass and momentum of a robot, from MuJoCo's subtrees of the bodies that joints hang on the world."""

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

Jacobian = Callable[[mujoco.MjModel, mujoco.MjData, np.ndarray, int], None]


class Whole:
    """Its methods take data of which mj_comPos is done.

    bodies: those of the robot; of what never moves these alone count.
    """

    def __init__(self, model: mujoco.MjModel, bodies: Sequence[int]) -> None:
        # in no tree: the world, mocap bodies, and what is fixed to them
        self.model, moves = model, model.body_treeid >= 0
        self.trees = np.flatnonzero(moves & ~moves[model.body_parentid])
        self.masses = model.body_subtreemass[self.trees]
        self.still = [body for body in bodies if not moves[body]]
        self.total = self.masses.sum() + model.body_mass[self.still].sum()
        self.shares = self.masses / self.total

    def com(self, d: mujoco.MjData) -> np.ndarray:
        return d.subtree_com[self.trees[0]] + self.from_first(d)[1]

    def from_first(self, d: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
        """Centres of mass from that of the first tree: of all trees, (trees, 3), and the common one, (3,)."""
        places = d.subtree_com[self.trees], d.xipos[self.still]
        trees, still = (place - d.subtree_com[self.trees[0]] for place in places)
        return trees, self.shares @ trees + self.model.body_mass[self.still] @ still / self.total

    def com_jacobian(self, d: mujoco.MjData) -> np.ndarray:
        """(3, nv)."""
        return np.einsum("t,tij->ij", self.shares, self.of_trees(mujoco.mj_jacSubtreeCom, d))

    def momentum(self, d: mujoco.MjData) -> np.ndarray:
        """Linear, and angular about the common centre of mass, for unit speeds, (6, nv)."""
        linear = self.masses[:, None, None] * self.of_trees(mujoco.mj_jacSubtreeCom, d)
        trees, middle = self.from_first(d)
        arms = trees - middle
        angular = self.of_trees(mujoco.mj_angmomMat, d) + np.cross(arms[:, :, None], linear, axis=1)
        return np.concatenate([linear.sum(axis=0), angular.sum(axis=0)])

    def of_trees(self, function: Jacobian, d: mujoco.MjData) -> np.ndarray:
        result = np.zeros((len(self.trees), 3, self.model.nv))
        for jacobian, body in zip(result, self.trees):
            function(self.model, d, jacobian, int(body))
        return result
