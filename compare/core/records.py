"""Records of the modules of a folder, which are read without importing the modules."""

import ast
from pathlib import Path
from typing import TypeVar

Record = TypeVar("Record")


def records_in(folder: Path, name: str, kind: type[Record]) -> dict[str, Record]:
    """The records `name = kind(field=literal, ...)` by the names of their modules, sorted by their field `order`."""
    records = {}
    for file in (*folder.glob("*.py"), *folder.glob("*/__init__.py")):
        text = file.read_text(encoding="utf-8")
        for node in ast.parse(text).body if f"\n{name} = {kind.__name__}(" in text else ():
            if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", None) == name:
                fields = {field.arg: ast.literal_eval(field.value) for field in node.value.keywords}
                records[file.parent.name if file.stem == "__init__" else file.stem] = kind(**fields)
    return dict(sorted(records.items(), key=lambda item: item[1].order))
