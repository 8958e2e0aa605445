"""Find the longest time step that is stable for a robot as it is, with each integrator of MuJoCo, and sweep a gain.
Use your own file in the place of the text; keyframes, contacts and all other actuators count too."""

import mujoco

import compare

ROBOT = """<mujoco>
  <option timestep="0.01" integrator="Euler"/>
  <worldbody><body name="upper arm">
    <joint name="shoulder" axis="0 1 0" damping="0.5"/>
    <inertial pos="0 0 -0.2" mass="2" diaginertia="0.02 0.02 0.004"/>
    <body name="forearm" pos="0 0 -0.4">
      <joint name="elbow" axis="0 1 0" damping="0.2"/>
      <inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.002"/>
    </body>
  </body></worldbody>
  <actuator><position joint="shoulder" kp="400" kv="20"/><position joint="elbow" kp="300" kv="8"/></actuator>
</mujoco>"""

model = mujoco.MjModel.from_xml_string(ROBOT)
limits = compare.step_limits(model)
print(limits)
print("the file's step of 10 ms is", "stable" if limits["Euler"].stable_at_file_dt else "not stable")
for kv in (8.0, 2.0, 0.5):
    model.actuator_biasprm[1, 2] = -kv
    (row,) = compare.step_limits(model, integrators=["Euler"])
    print(f"Euler, kv of the elbow {kv}: {row.stable_up_to_s:.4f} s, fails at {row.fails_at_s:.4f} s")
