"""Records of the modules of a folder, which are read without importing the modules."""

import ast
from operator import attrgetter
from pathlib import Path
from typing import TypeVar

Record = TypeVar("Record")
order_of = attrgetter("order")


def records_in(folder: Path, name: str, kind: type[Record]) -> dict[str, Record]:
    """The records `name = kind(field=literal, ...)` by the names of their modules, in their order."""
    records = {}
    for file in (*folder.glob("*.py"), *folder.glob("*/__init__.py")):
        _, begins, rest = file.read_text(encoding="utf-8").partition(f"\n{name} = {kind.__name__}(")
        if begins:
            call = ast.parse(f"kind({rest}").body[0]
            assert isinstance(call, ast.Expr) and isinstance(call.value, ast.Call)
            fields = {str(field.arg): ast.literal_eval(field.value) for field in call.value.keywords}
            records[file.parent.name if file.stem == "__init__" else file.stem] = kind(**fields)
    return dict(sorted(records.items(), key=lambda item: order_of(item[1])))
