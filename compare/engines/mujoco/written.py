"""A model as a file, with all digits: MuJoCo writes six."""

import re
import warnings
from hashlib import sha256
from pathlib import Path

import mujoco
import numpy as np

from ...process.files import assets_of
from .locked import compiled
from .names import element_name

MARK = "Written by python -m compare reduction"  # in the first line of each file
KINDS = {  # of elements, by the prefix of the fields that have their numbers
    "body": "body", "jnt": "joint", "geom": "geom", "site": "site", "tendon": "tendon", "actuator": "actuator",
    "eq": "equality", "key": "key",
}  # fmt: skip
PREFIXES = {kind: prefix for prefix, kind in KINDS.items()}  # by the tag
OF_INERTIAL = {"pos": "body_ipos", "quat": "body_iquat", "mass": "body_mass", "diaginertia": "body_inertia"}
OF_SPEEDS = ("damping", "armature", "frictionloss")
OTHERS = (
    "wrap_prm",
    "pair_solref",
    "pair_solimp",
    "pair_friction",
    "pair_margin",
    "mesh_scale",
    "hfield_size",
)
TAG, VALUES = re.compile(r"<(\w+) [^>]*>"), re.compile(r'(\w+)="([^"]*\d[^"]*)"')
NAME, TEXTS = re.compile(r'(name)="([^"]*)"'), ("name", "file", "mesh", "class", "childclass")


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
        model = compiled(spec)
        text = with_all_digits(spec.to_xml(), spec, model)
        path.write_text(f"<!-- {MARK} -->\n{text}", encoding="utf-8")


def with_all_digits(text: str, spec: mujoco.MjSpec, model: mujoco.MjModel) -> str:
    """MuJoCo's text of a spec, each number of which is the one of the model that has these six digits.

    It is that of the attribute's field, else of the element with this name, else of all; where several have
    the six digits it stays.
    """
    fields, body = numbers_of(spec, model), ""

    def in_tag(tag: re.Match[str]) -> str:
        nonlocal body
        kind = tag[1]
        name = body if kind == "inertial" else dict(NAME.findall(tag[0])).get("name", "")
        body = name if kind == "body" else body

        def in_value(value: re.Match[str]) -> str:
            if value[1] in TEXTS:
                return value[0]
            field = (
                OF_INERTIAL.get(value[1], "")
                if kind == "inertial"
                else f"{PREFIXES.get(kind, '')}_{value[1]}"
            )
            numbers = fields.get((name, field)) or fields.get((name, "")) or fields["", ""]
            return f'{value[1]}="{" ".join(exact(word, numbers) for word in value[2].split(" "))}"'

        return VALUES.sub(in_value, tag[0])

    return TAG.sub(in_tag, text)


def exact(word: str, numbers: dict[float, set[float]]) -> str:
    """The only one of some numbers that has the six digits of a word, or the word."""
    try:
        found = numbers.get(float(word), set())
    except ValueError:
        return word
    return repr(*found) if len(found) == 1 and float(word) not in found else word


def numbers_of(spec: mujoco.MjSpec, model: mujoco.MjModel) -> dict[tuple[str, str], dict[float, set[float]]]:
    """By the name of an element and the field, "" for all of them: numbers by what is left with six digits."""
    found: dict[tuple[str, str], dict[float, set[float]]] = {("", ""): {}}

    def add(name: str, field: str, values: object) -> None:
        numbers = np.unique(np.asarray(values, float))
        for number in numbers[np.isfinite(numbers)].tolist():
            for key in {(name, field), (name, ""), ("", "")}:
                found.setdefault(key, {}).setdefault(float(f"{number:.6g}"), set()).add(number)

    for field in dir(model):
        prefix, values = field.partition("_")[0], getattr(model, field)
        if prefix in KINDS and isinstance(values, np.ndarray) and values.dtype == float:
            for number, row in enumerate(values):
                add(element_name(model, KINDS[prefix], number), field, row)
    for joint in range(model.njnt):
        name, place, dof = (
            element_name(model, "joint", joint),
            model.jnt_qposadr[joint],
            model.jnt_dofadr[joint],
        )
        numbers = {"ref": model.qpos0[place], "springref": model.qpos_spring[place]}
        numbers |= {name: getattr(model, f"dof_{name}")[dof] for name in OF_SPEEDS}
        for field, value in numbers.items():
            add(name, f"jnt_{field}", value)
    for geom in spec.geoms:
        add(geom.name, "geom_mass", geom.mass)
    options = [name for name in dir(model.opt) if not name.startswith("_")]
    for values in (
        *(getattr(model, name) for name in OTHERS),
        *(getattr(model.opt, name) for name in options),
    ):
        add("", "", values)
    return found
