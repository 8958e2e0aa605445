"""The equations of a Tree as text to take away."""
