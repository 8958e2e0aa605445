"""Which step is stable: rest, the step linearised there, its growth, limits, cures, and what runs show."""
