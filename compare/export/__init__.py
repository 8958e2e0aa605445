"""python -m compare equations: a robot's equations as text, checked against MuJoCo and the exact values."""
