"""From a file to an engine: MJCF is read, compiled, and refused in one line where it does not have a robot's joints."""

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

import mujoco

import tmt

from .engine import Mujoco
from .joints import joint_name, joint_places
from .light import without_visuals
from .lock import ModelError, editable, name_of


def load(path: str | Path, tree: tmt.Tree) -> Mujoco:
    """The engine for an MJCF file; ModelError if it cannot be read or does not have exactly the hinges of the Tree."""
    path = Path(path)
    model, warned = compiled(path, lambda: without_visuals(editable(path)).compile())
    return with_hinges(model, path, tree, warned)


def has_hinges(path: str | Path, names: Sequence[str]) -> bool:
    """Whether a file has exactly the hinges of these names, in any order; ModelError if it cannot be read."""
    path = Path(path)
    spec, _ = compiled(path, lambda: editable(path))
    hinges = [joint.name for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE]
    return len(hinges) == len(spec.joints) and sorted(hinges) == sorted(names)


def compiled(source: Path | str, compiling: Callable[[], mujoco.MjModel]) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """The model that compiling a source gives, and what MuJoCo's compiler warns of, one line each; ModelError if it cannot be."""
    text = text_of(source) if isinstance(source, Path) else source
    if not text.strip():
        raise ModelError(f"{name_of(source)} is empty; an MJCF file is expected")
    found, before = [], mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(found.append)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            model = compiling()
    except ValueError as error:
        name = name_of(source)
        if "<mujoco" not in text:
            raise ModelError(f"{name} is not MJCF: MuJoCo says {error}") from None
        raise ModelError(f"MuJoCo cannot compile {name}: {error}") from None
    finally:
        mujoco.set_mju_user_warning(before)
    lines = [" ".join(str(line).split()) for line in (*found, *(warning.message for warning in caught))]
    return model, tuple(dict.fromkeys(lines))


def text_of(path: Path) -> str:
    """The text of a file; ModelError if it cannot be read, and read again."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise ModelError(f"{path} is no file that can be read again; an MJCF file is expected")
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise ModelError(f"cannot read {path}: {error.strerror}; an MJCF file is expected") from None


def parse(text: str, tree: tmt.Tree) -> Mujoco:
    """The engine for MJCF text."""
    return with_hinges(mujoco.MjModel.from_xml_string(text), text, tree)


def with_hinges(model: mujoco.MjModel, source: Path | str, tree: tmt.Tree, warned: tuple = ()) -> Mujoco:
    """The engine, if the model moves by exactly the hinges of the Tree; it remembers its source, a Path or MJCF text."""
    hinges = tree.hinge_names
    names = [joint_name(model, j) for j in range(model.njnt)]
    kinds = [mujoco.mjtJoint(model.jnt_type[j]).name.removeprefix("mjJNT_").lower() for j in range(model.njnt)]
    if sorted(names) != sorted(hinges) or set(kinds) != {"hinge"}:
        found = ", ".join(f"{name} ({kind})" for name, kind in zip(names, kinds)) or "none"
        raise ModelError(
            f"{name_of(source)} has the joints {found}; hinges {', '.join(hinges)} and no others are expected"
        )
    return Mujoco(model, hinges, bodies(model, source, tree), source, warnings=warned)


def bodies(model: mujoco.MjModel, source: Path | str, tree: tmt.Tree) -> list[int]:
    """The numbers of the Tree's bodies in the model: the body that a hinge moves, whatever its name.

    By its name if it is fixed to the world, or one of several on a hinge; ModelError if the model has no body of that name.
    """
    found = []
    for name, hinge in zip(tree.body_names, tree.body_hinge):
        if hinge >= 0 and tree.body_hinge.count(hinge) == 1:
            found.append(int(model.jnt_bodyid[joint_places(model)[tree.hinge_names[hinge]].joint]))
            continue
        number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
        if number < 0:
            raise ModelError(f"{name_of(source)} has no body {name!r}; it is expected, for no hinge tells which it is")
        found.append(number)
    return found
