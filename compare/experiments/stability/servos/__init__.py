"""Which step is stable under a robot's own servos, predicted and observed."""
