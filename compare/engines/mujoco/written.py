"""A model as a file, with all digits: MuJoCo writes six."""

import ctypes
import re
import warnings
from hashlib import sha256
from pathlib import Path

import mujoco

from ...process.files import assets_of
from .locked import compiled
from .runs import library

MARK = "Written by python -m compare reduction"  # in the first line of each file
DIGITS, ALL_DIGITS = 6, 17  # that MuJoCo writes, and that tell all doubles apart
LONG = re.compile(r"-?\d+\.\d{9,}(?:e[+-]\d+)?")  # numbers in all digits


def files_of(spec: mujoco.MjSpec) -> list[mujoco.MjsMesh | mujoco.MjsHField]:
    """The meshes and height fields that are read from files."""
    return [asset for asset in (*spec.meshes, *spec.hfields) if asset.file]


def write(stated: mujoco.MjSpec, path: Path, comment: str) -> None:
    """Write a spec, all of whose elements have names; meshes and height fields go into a folder beside the file.

    Its first line says that this program wrote it.
    """
    spec, origin, folder = stated.copy(), Path(stated.modelfiledir or ".").absolute(), assets_of(path)
    for asset in files_of(spec):
        name = Path(asset.file).name
        places = origin / spec.meshdir / asset.file, origin / spec.meshdir / name, origin / asset.file
        content = next(filter(Path.is_file, places), places[0]).read_bytes()
        folder.mkdir(exist_ok=True)
        asset.name = asset.name or Path(asset.file).stem
        asset.file = f"{folder.name}/{sha256(content).hexdigest()[:8]} {name}"  # others of it stay
        (path.parent / asset.file).write_bytes(content)
    spec.comment = comment.replace("--", "- -")  # which XML does not allow
    spec.modelfiledir, spec.meshdir, spec.strippath = str(path.absolute().parent), "", False
    spec.texturedir = str(origin / spec.texturedir) if spec.textures else ""
    with warnings.catch_warnings(action="ignore"):
        compiled(spec)
    path.write_text(f"<!-- {MARK} -->\n{with_all_digits(spec)}", encoding="utf-8")


def with_all_digits(spec: mujoco.MjSpec) -> str:
    """MuJoCo's text of a compiled spec, in the fewest digits that are the same doubles; in six without its library."""
    if (path := library()) is None:
        return str(spec.to_xml())
    set_digits = ctypes.CDLL(path)["_mjPRIVATE__set_xml_precision"]
    try:
        set_digits(ALL_DIGITS)
        text = str(spec.to_xml())
    finally:
        set_digits(DIGITS)
    return LONG.sub(lambda number: repr(float(number[0])), text)
