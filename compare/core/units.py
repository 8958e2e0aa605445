"""Tables of a robot whose joints do not all move in rad."""

from collections.abc import Sequence


def renamed(rows: Sequence[dict], unit: str) -> list[dict]:
    """Rows with the suffix _rad of columns replaced by a column `unit`, unless the unit is rad."""
    if unit == "rad":
        return list(rows)
    return [
        {name.removesuffix("_rad"): value for name, value in row.items()} | {"unit": unit} for row in rows
    ]


def value(row: dict, name: str) -> object:
    """The value of a column, with or without the suffix _rad."""
    return row[name + "_rad"] if name + "_rad" in row else row[name]
