"""Rows of tables: dataclasses whose fields carry the unit and the digits of their columns.

    @dataclass(kw_only=True)
    class Limit(MovementRow):
        scene: str
        predicted_dt: float | None = column("s", digits=5)  # the column predicted_dt_s
        deviation: float = column(MOVEMENT)  # deviation_rad; with slides deviation, and unit is a column

Tables, CSV files and figures read the fields; no unit is known by a name.
"""

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

RAD = "rad"
MOVEMENT = "movement"  # the unit of a column: that of a MovementRow
DIGITS = 3  # of a number in a report


@dataclass(frozen=True)
class Column:
    """What a field says of its column.

    unit: ends the name of the column; "": none. digits: of its numbers in a report.
    optional: left out of a table in which no row has a value. names: it lists names, to be shortened.
    """

    unit: str = ""
    digits: int = DIGITS
    optional: bool = False
    names: bool = False


def column(
    unit: str = "", digits: int = DIGITS, optional: bool = False, names: bool = False, **field: Any
) -> Any:
    """A field of a Row, with its Column. field: default (None, if optional) or default_factory."""
    if optional:
        field.setdefault("default", None)
    return dataclasses.field(metadata={"column": Column(unit, digits, optional, names)}, **field)


@dataclass(kw_only=True)
class Row:
    """A row of a table; its columns are its fields, in their order."""

    def columns(self) -> dict[str, tuple[str, Column]]:
        """The fields by the names of their columns: (name of the field, Column)."""
        columns = {}
        for field in dataclasses.fields(self):
            of_field = field.metadata.get("column", Column())
            if not (of_field.optional and getattr(self, field.name) is None):
                unit = self.unit_of(of_field)
                columns[f"{field.name}_{unit}" if unit else field.name] = field.name, of_field
        return columns

    def unit_of(self, of_field: Column) -> str:
        return of_field.unit

    def record(self) -> dict[str, Any]:
        """The values by the names of their columns."""
        return {name: getattr(self, field) for name, (field, _) in self.columns().items()}


@dataclass(kw_only=True)
class MovementRow(Row):
    """A row with columns in the unit of a robot's movements: rad, or another one, in the last column."""

    unit: str = RAD

    def columns(self) -> dict[str, tuple[str, Column]]:
        columns = super().columns()
        of_unit = columns.pop("unit")
        return columns if self.unit == RAD else columns | {"unit": of_unit}

    def unit_of(self, of_field: Column) -> str:
        if of_field.unit != MOVEMENT:
            return of_field.unit
        return RAD if self.unit == RAD else ""


def columns_of(rows: Iterable[Row]) -> dict[str, Column]:
    """The columns of a table by their names, of all its rows."""
    return {name: of_field for row in rows for name, (_, of_field) in row.columns().items()}
