"""Edits of what drives a robot."""

EDITS = (
    ("robots.actuators", "Actuator.stiffness", "self.gain[1] * u + _1", "_1", "a gain by the length is not stiff"),
    ("robots.actuators", "Actuator.damping", "self.gain[2] * u + _1", "_1", "a gain by the speed does not brake"),
    ("robots.actuators", "Drive.control", "actuator.target(length)", "0.0", "targets that no file states are zero"),
    ("case", "Case.controller", "coordinates.from_degrees(_1, positions=False)", "_1", "targets are moved by radians"),
    ("mujoco.actuators", "stated_controls", "len(keys[k].ctrl) > 0", "keys[k].ctrl.any()", "a stated zero is none"),
    ("mujoco.actuators", "off", "m.opt.disableactuator & (1 << group)", "False", "no group is disabled"),
)  # fmt: skip
