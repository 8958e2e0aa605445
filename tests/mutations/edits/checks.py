"""Checks that always pass, one for each that the experiments make, and some with a tolerance that is far too wide."""

# module, function, quantity: as written in the call of `check`, _1, _2 for what is filled in
CHECKS = (
    ("parameters", "compare_number", "quantity"), ("parameters", "check_forces", 'f"no forces of {_1}"'),
    ("published", "check_answer", "printed_digits"), ("published", "check_answer", "from_exact"),
    ("published", "check_answer", "every_digit"), ("published", "check_answer", "size"),
    ("states", "check_symmetry", "what"), ("states", "check_definiteness", "what"),
    ("conclusions", "check_same_schemes", "quantity"), ("conclusions", "check_stopped", "quantity"),
    ("conclusions", "check_smallest_errors", "quantity"),
    ("trajectory", "check_time_judged", '"time judged"'), ("trajectory", "check_divergence", "what"),
    ("judge.run", "check_movement", '"movement"'), ("trajectory.runs", "check_level", "quantity"),
    ("stability.limits", "check_limits", "what"),
    ("stability.limits", "check_limits", "quantity"), ("departure", "check_departures", "quantity"),
    ("claims", "check_torques", "quantity"),
    ("claims", "check_finer_steps", "quantity"), ("claims", "check_kept", "what"),

)  # fmt: skip
# module, function, the two that are compared, as written in the call of `agree`
AGREEMENTS = (
    ("states", "check_gravity", '"holding torque, springs too"'), ("states", "check_gravity", '"yours: gravity - bias at rest"'),
    ("states", "check_acceleration", 'f"tau from MuJoCo\'s qdd by {_1}"'),
    ("states", "check_acceleration", 'f"tau from {_1} qdd by mj_inverse"'),
    ("states", "check_acceleration", 'f"dE/dt - {work} at {_1} qdd"'),
)  # fmt: skip
EDITS = (
    *(
        (module, where, f"result.check(_3, {quantity}, _4, _5, *_6)", f"result.check(_3, {quantity}, _5, _5, *_6)",
         f"{quantity} always passes")
        for module, where, quantity in CHECKS
    ),
    *(
        (module, where, f"comparison.agree({quantity}, _3, _4, _5, _6)",
         f"comparison.agree({quantity}, _3, _5, _5, _6)", f"{quantity} is compared with itself")
        for module, where, quantity in AGREEMENTS
    ),
    *(
        ("states", "Comparison.compare", "self.agree(_1, _2, values, mujoco_values, *_3)",
         f"self.agree(_1, _2, values, values if name == {quantity!r} else mujoco_values, *_3)",
         f"{quantity} is compared with itself")
        for quantity in ("x_b", "omega_b", "T_b", "B_b", "v_conv", "w_conv", "Mbar", "holding torque", "bias", "qdd", "energy")
    ),
)  # fmt: skip
