"""Which step is stable: runs of a file after a push, their limits and remedies; a held posture of the arm, linearized."""
