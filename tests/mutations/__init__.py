"""Edits that make the judge wrong, applied one after another to a copy of the project; see __main__."""
