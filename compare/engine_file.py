"""From a file to an Engine: MJCF is read, compiled and refused in one line where it cannot be this arm."""

import os
from pathlib import Path

import mujoco

from .engine import Engine

ARM_XML = Path(__file__).resolve().parent.parent / "mjcf" / "arm.xml"
HINGES = ("alpha", "beta", "gamma")
CARRIERS = ("beta", "gamma")  # upper arm, forearm


class ModelError(ValueError):
    """A file that cannot be held against the stated arm; the message is one line."""

    def __str__(self):
        return " ".join(super().__str__().split())


def load(path=ARM_XML) -> Engine:
    """The Engine for an MJCF file; ModelError if it cannot be read or does not have these hinges."""
    if Path(path).exists() and not (Path(path).is_file() or Path(path).is_dir()):
        raise ModelError(f"{path} is no file that can be read again; an MJCF file is expected")
    try:
        text = Path(path).read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise ModelError(f"cannot read {path}: {error.strerror}; an MJCF file is expected") from None
    try:
        model = mujoco.MjModel.from_xml_path(os.fsencode(path))  # bytes: any name, in any locale
    except ValueError as error:
        if "<mujoco" not in text:
            raise ModelError(f"{path} is not MJCF: MuJoCo says {error}") from None
        raise ModelError(f"MuJoCo cannot compile {path}: {error}") from None
    return check_hinges(model, Path(path), HINGES, CARRIERS)


def parse(text, hinges=HINGES, carriers=CARRIERS) -> Engine:
    """The Engine for MJCF text."""
    return check_hinges(mujoco.MjModel.from_xml_string(text), text, hinges, carriers)


def name_of(source) -> str:
    """What a message calls a source, a Path or MJCF text."""
    return str(source) if isinstance(source, Path) else "the text"


def check_hinges(model, source, hinges, carriers) -> Engine:
    """The Engine, if the model moves by exactly these hinges; it remembers its source, a Path or MJCF text."""
    names = [model.joint(j).name for j in range(model.njnt)]
    kinds = [mujoco.mjtJoint(model.jnt_type[j]).name.removeprefix("mjJNT_").lower() for j in range(model.njnt)]
    if sorted(names) != sorted(hinges) or set(kinds) != {"hinge"}:
        found = ", ".join(f"{name or 'unnamed'} ({kind})" for name, kind in zip(names, kinds)) or "none"
        raise ModelError(
            f"{name_of(source)} has the joints {found}; hinges {', '.join(hinges)} and no others are expected"
        )
    return Engine(model, hinges, carriers, source)
