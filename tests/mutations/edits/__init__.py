"""The edits, by what they break, in the files of this folder; a row has the fields of an Edit in their order."""

from importlib import import_module
from pathlib import Path

from ..edit import Edit

FILES = sorted(Path(__file__).parent.glob("[a-z]*.py"))
EDITS = tuple(Edit(*row) for file in FILES for row in import_module(f".{file.stem}", __package__).EDITS)
