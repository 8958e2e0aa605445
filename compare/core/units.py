"""Tables of dictionaries of a robot whose joints do not all move in rad; a MovementRow needs none of this."""

from collections.abc import Mapping, Sequence
from typing import Any


def renamed(rows: Sequence[Mapping[str, Any]], unit: str) -> list[dict[str, Any]]:
    """Rows with the suffix _rad of columns replaced by a column `unit`, unless the unit is rad."""
    if unit == "rad":
        return [dict(row) for row in rows]
    in_unit = [{name.removesuffix("_rad"): value for name, value in row.items()} for row in rows]
    return [row | {"unit": unit} for row in in_unit]


def value(row: Mapping[str, Any], name: str) -> Any:
    """The value of a column, with or without the suffix _rad."""
    return row[name + "_rad"] if name + "_rad" in row else row[name]
