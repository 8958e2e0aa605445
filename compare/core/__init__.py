"""What every part of compare needs and none owns; it imports nothing of the others."""
