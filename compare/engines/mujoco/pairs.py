"""Which geoms of a model may touch."""

import mujoco
import numpy as np

from .flags import on


def contact_pairs(m: mujoco.MjModel) -> int:
    """How many pairs of geoms may touch: those that MuJoCo chooses, and those that the file names."""
    return m.npair + len(chosen_pairs(m))


def touching(m: mujoco.MjModel) -> list[int]:
    """The geoms of these pairs, each once."""
    named = np.column_stack([m.pair_geom1, m.pair_geom2]) if m.npair else np.zeros((0, 2), int)
    return np.unique(np.concatenate([chosen_pairs(m), named])).astype(int).tolist()


def chosen_pairs(m: mujoco.MjModel) -> np.ndarray:
    """The pairs of geoms that MuJoCo chooses, (pairs, 2): of two bodies that move against each other."""
    i, j = np.triu_indices(m.ngeom, 1)
    one, other = np.sort([m.geom_bodyid[i], m.geom_bodyid[j]], axis=0)
    a, b = m.body_weldid[one], m.body_weldid[other]
    over_a, over_b = (m.body_weldid[m.body_parentid[weld]] for weld in (a, b))
    related = (a > 0) & (b > 0) & ((a == over_b) | (b == over_a)) & on(m, "FILTERPARENT")
    wanted = (m.geom_contype[i] & m.geom_conaffinity[j]) | (m.geom_contype[j] & m.geom_conaffinity[i])
    excluded = np.isin((one.astype(np.int64) << 16) + other, m.exclude_signature)
    return np.column_stack([i, j])[(a != b) & (wanted != 0) & ~related & ~excluded]
