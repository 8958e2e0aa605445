"""Edits of the step of a file at rest: its derivative, closed form, limits, runs, programs, motions, cures."""

EDITS = (
    ("mujoco.step", "options_of", "TOLERANCE", "1e-4", "the force of constraints is that of a coarse solver"),
    ("mujoco.step", "Step.run_program", "(step - delay) // period", "step // period", "a delay delays nothing"),
    ("mujoco.step", "Step.relaxed", "1.0 - rate * self.dt", "1.0", "a relaxed run is not damped"),
    ("mujoco.variants", "in_the_air", "has_free_base(model)", "False", "in the air a free base falls"),
    ("mujoco.variants", "add_armature", "model.dof_M0 += more", "pass", "a body that never changes stays as it is"),
    ("mujoco.variants", "Servo.force", "np.clip(_1, *_2)", "float(_1)", "a program has no range of force"),
    ("mujoco.variants", "servo_bias", "-(kv or 0.0)", "0.0", "--kv is none"),
    ("mujoco.step", "start_of", "stated.any()", "False", "a keyframe's activations are lost"),
)  # fmt: skip
