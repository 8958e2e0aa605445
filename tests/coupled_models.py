"""Small robots whose joints hold each other: by equalities, by a tendon, by limits; and one with a joint that nothing holds."""

# two fingers of unlike mass on slides, one servo: the other finger follows by an equality
GRIPPER = """<mujoco><option timestep="0.002" integrator="{integrator}"/><worldbody>
  <body><joint name="left" type="slide" axis="0 1 0" damping="2"/><inertial pos="0 0 0" mass="0.1" diaginertia="1 1 1"/></body>
  <body><joint name="right" type="slide" axis="0 1 0"/><inertial pos="0 0 0" mass="0.3" diaginertia="1 1 1"/></body></worldbody>
  <equality><joint name="mimic" joint1="right" joint2="left" polycoef="{polycoef}" solref="{solref} 1"/></equality>
  <actuator><position name="grip" joint="left" kp="400" kv="{kv}"/></actuator>
  <keyframe><key qpos="0.01 0.02" ctrl="0.01"/></keyframe></mujoco>"""
# a loop of four bars that a connect closes, with a servo on one
FOUR_BARS = """<mujoco><option timestep="0.002" integrator="{integrator}"/>
  <default><geom type="capsule" size="0.01" mass="0.1"/></default><worldbody>
  <body><joint name="crank" axis="0 1 0" damping="0.05"/><geom fromto="0 0 0 0 0 0.1"/>
    <body name="last" pos="0 0 0.1"><joint name="coupler" axis="0 1 0"/><geom fromto="0 0 0 0.2 0 0.05"/></body></body>
  <body name="rocker" pos="0.2 0 0"><joint name="rocker" axis="0 1 0"/><geom fromto="0 0 0 0 0 0.15"/></body></worldbody>
  <equality><connect body1="rocker" body2="last" anchor="0 0 0.15" solref="{solref} 1"/></equality>
  <actuator><position name="crank" joint="crank" kp="20" kv="{kv}"/></actuator></mujoco>"""
# a finger of two hinges that one tendon moves together and gravity bends, as far as a limit
FINGER = """<mujoco><option timestep="0.002"/><default><joint axis="0 1 0" damping="0.1" range="0 90" limited="true"/>
  <geom type="capsule" size="0.01" mass="0.05"/></default><worldbody>
  <body><joint name="middle"/><geom fromto="0 0 0 0.05 0 0"/>
  <body pos="0.05 0 0"><joint name="tip"/><geom fromto="0 0 0 0.05 0 0"/></body></body></worldbody>
  <tendon><fixed name="both"><joint joint="middle" coef="1"/><joint joint="tip" coef="1"/></fixed></tendon>
  <actuator><position name="bend" tendon="both" kp="5"/></actuator></mujoco>"""
# an arm with a servo, and a finger that may slide down
LOOSE = """<mujoco><option timestep="0.002"/><worldbody>{floor}
  <body><joint name="arm" axis="0 1 0"/><geom type="capsule" size="0.02" fromto="0 0 0 0.3 0 0" mass="1"/>
  <body pos="0.3 0 0"><joint name="finger" type="slide" axis="0 0 1"/><geom size="0.02" mass="0.1"/></body></body>
  </worldbody><actuator><position name="arm" joint="arm" kp="200" kv="5"/></actuator></mujoco>"""
