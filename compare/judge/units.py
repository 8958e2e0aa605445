"""Tables and sentences of a robot whose joints do not all move in rad."""

from collections.abc import Sequence

RAD = "_rad"


def renamed(rows: Sequence[dict], unit: str) -> list[dict]:
    """Rows whose columns named in rad hold another unit, or several: those columns without it, and a column `unit`."""
    if unit == "rad":
        return list(rows)
    return [{name.removesuffix(RAD): value for name, value in row.items()} | {"unit": unit} for row in rows]


def value(row: dict, name: str) -> object:
    """What a row holds in a column, named in rad or not."""
    return row[name + RAD] if name + RAD in row else row[name]


def said(text: str, unit: str) -> str:
    """A sentence that says rad, with another unit."""
    return text if unit == "rad" else text.replace(" rad", f" {unit}").replace(RAD, "")
