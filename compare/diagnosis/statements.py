"""How joints are to be stated in the convention of a cause."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Literal, NamedTuple

from ..core.cause import Cause
from ..robots.coordinates import Coordinates
from ..robots.joint_map import Joint, JointMap, within_a_turn
from .fit import Fitted
from .places import OF_ZERO


class Stated(NamedTuple):
    """How the joints of given equations are stated."""

    joints: JointMap
    by: Literal["argument", "option"] = "argument"  # joints=[...] of assert_agrees, or --joints


class Statements(NamedTuple):
    """The statements of causes. stated: the joints as stated, which may be wrong; None: they cannot be."""

    coordinates: Coordinates
    stated: Stated | None

    def causes(self, fits: Iterable[Fitted]) -> list[Cause]:
        """The fits as causes; of zeros of joints with the joints to state."""
        causes = []
        for fit in fits:
            cause = fit.cause
            are_zeros = all(part.kind == OF_ZERO for part in cause.parts or (cause,))
            causes += self.restated(cause, self.with_zeros(fit)) if are_zeros else [cause]
        return causes

    def with_zeros(self, fit: Fitted) -> JointMap:
        """Joints with the zeros of a fit."""
        changes = zip(fit.places, fit.changes)
        zeros = {place.name: place.value(change) - place.stated for place, change in changes}
        joints, kinds = [], self.coordinates.all_kinds
        for name, kind in zip(self.coordinates.names, kinds):
            zero = within_a_turn(zeros.get(f"zero of {name}", 0.0), kind == "slide")
            joints.append(Joint(name, zero=float(f"{zero:.12g}"), slides=kind == "slide"))
        return JointMap(self.coordinates, joints)

    def restated(self, cause: Cause, convention: JointMap | None) -> list[Cause]:
        """A cause with how joints are to be stated in its convention; [] if that cannot be."""
        if self.stated is None or convention is None:
            return [cause]
        wrong, by = self.stated
        joints = convention if wrong.is_same else wrong.after(convention, self.coordinates)
        if joints is None:
            return []
        if joints.is_same and not wrong.is_same and not cause.parts:
            stated = ", ".join(map(str, wrong.joints))
            part = Cause(rank=1, kind="order", place="joints", stated=stated, explains="those of the model")
            cause = replace(cause, parts=(part,))
        names = list(map(str, joints.joints))
        return [replace(cause, joints=f"--joints={','.join(names)}" if by == "option" else f"joints={names}")]
