"""Forces near a state, linear in its deviation: actuators, springs and dampers, rows of constraints."""

from typing import NamedTuple

import mujoco
import numpy as np

from .step import NUDGE, Step

QUADRATIC = int(mujoco.mjtConstraintState.mjCNSTRSTATE_QUADRATIC)  # a row whose force is linear
CONTACTS = int(mujoco.mjtConstraint.mjCNSTR_CONTACT_FRICTIONLESS)  # the first of their types


class Rows(NamedTuple):
    """Rows of constraints at a state, k of them: J qdd + R f = aref. The generalized force is J' f.

    J: (k, nv); R, aref, f: (k,); contact: the number of the contact of each, -1 of other rows, (k,).
    """

    J: np.ndarray
    R: np.ndarray
    aref: np.ndarray
    f: np.ndarray
    contact: np.ndarray


class Forces(NamedTuple):
    """Forces near a state, and their derivatives by its deviation (n of them).

    smooth: d(actuators + springs and dampers), (nv, n). rows: that act at the state. dJf: d(J' f) with
    constant f, (nv, nv); dR, daref: (k, n).
    """

    smooth: np.ndarray
    rows: Rows
    dJf: np.ndarray
    dR: np.ndarray
    daref: np.ndarray


def rows(step: Step, on: np.ndarray) -> Rows | None:
    """Rows of the data of a step after mj_forward; on: which, (all,). None: their number is another one."""
    m, d = step.model, step.data
    if len(on) != d.nefc:
        return None
    J = np.zeros((d.nefc, m.nv))
    if mujoco.mj_isSparse(m):
        mujoco.mju_sparse2dense(J, d.efc_J, d.efc_J_rownnz, d.efc_J_rowadr, d.efc_J_colind)
    else:
        J[:] = d.efc_J[: J.size].reshape(J.shape)  # it has room for rows that turned out to be empty
    contact = np.where(d.efc_type >= CONTACTS, d.efc_id, -1)
    return Rows(J[on], d.efc_R[on].copy(), d.efc_aref[on].copy(), d.efc_force[on].copy(), contact[on])


def rows_at(step: Step, state: np.ndarray) -> tuple[np.ndarray, Rows]:
    """The mass matrix, (nv, nv), and all rows at a state."""
    step.put(state)
    mujoco.mj_forward(step.model, step.data)
    acting = rows(step, np.ones(step.data.nefc, bool))
    assert acting is not None
    M = np.zeros((step.model.nv, step.model.nv))
    mujoco.mj_fullM(step.model, step.data, M)
    return M, acting


def forces_near(step: Step, state: np.ndarray) -> Forces | None:
    """The forces near a state at rest; None where rows begin or cease within the nudge."""

    def forward(by: np.ndarray | None) -> np.ndarray:
        """Actuators, springs and dampers; the data are those at the moved state."""
        step.put(state, by)
        mujoco.mj_forward(step.model, step.data)
        return step.data.qfrc_actuator + step.data.qfrc_passive

    forward(None)
    on = step.data.efc_state == QUADRATIC
    acting = rows(step, on)
    assert acting is not None
    smooth, dJf, dR, daref = [], [], [], []
    for forth, back in step.sides(state, NUDGE):
        apart = float((forth - back).sum())
        force, ahead = forward(forth), rows(step, on)
        opposite, behind = forward(back), rows(step, on)
        if ahead is None or behind is None:
            return None
        smooth.append((force - opposite) / apart)
        dJf.append((ahead.J - behind.J).T @ acting.f / apart)
        dR.append((ahead.R - behind.R) / apart)
        daref.append((ahead.aref - behind.aref) / apart)
    columns = [np.array(values).T for values in (smooth, dJf[: step.model.nv], dR, daref)]
    return Forces(columns[0], acting, *columns[1:])
