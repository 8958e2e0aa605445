"""The edits as pieces of work, for processes of this machine or for a cluster: each the tests on a copy of the project."""

import difflib
import os
import pickle
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from compare.fleet.piece import Door, Piece, outcomes
from compare.fleet.sent import sent_call

from . import trial
from .edit import Edit, Place

ASIDE = shutil.ignore_patterns(".*", "__pycache__", "*.egg-info", "venv", "build", "latest")  # not part of a copy
PATIENCE = 60.0, 3.0  # seconds and times the time of the unedited copy: then a run counts as endless
UNEDITED = 20  # times these seconds may the unedited copy take in a stage


class Stage(NamedTuple):
    """Tests that run together."""

    files: list[str]
    options: tuple = ()


class Tried(NamedTuple):
    """What became of an edit."""

    edit: Edit
    caught: str  # by which test, or how; empty: it survived
    seconds: float
    diff: str
    lost: str = ""  # why it could not be tried


class CannotStart(Exception):
    """The unedited copy does not pass."""


def longest(stages: list[Stage]) -> float:
    """Seconds that the longest piece may take: it ends its runs itself, before that."""
    return PATIENCE[0] + len(stages) * patience(PATIENCE[0] * UNEDITED)


def patience(seconds: float) -> float:
    """Seconds after which a run counts as endless, where the unedited copy took so many."""
    return PATIENCE[0] + PATIENCE[1] * seconds


def tried_edits(door: Door, project: Path, stages: list[Stage], places: dict[Edit, Place]) -> Iterator[Tried]:
    """Each edit with its outcome, as they end; an edit that survives one stage meets the next.

    CannotStart: the unedited copy does not pass, which comes first. FleetError: the cluster is gone.
    """
    copy = trial.packed(files_of(project))
    allowed = [PATIENCE[0] * UNEDITED] * len(stages)
    (outcome,) = outcomes(door, [piece("the unedited copy", "unedited", stages, allowed, (), (copy, b""))])
    if outcome.broke:
        raise CannotStart(outcome.broke)
    seconds, failed, compiled = outcome.returned
    if failed:
        raise CannotStart(failed)
    allowed, edits = [patience(one) for one in seconds], list(places.items())
    for k, (edit, place) in enumerate(edits):
        name = place.path.relative_to(project).as_posix()
        ordered = [stage._replace(files=nearest(project, stage, edit)) for stage in stages]
        door.submit(piece(str(k), "edited", ordered, allowed, (name, place.after), (copy, compiled)))
    while door.under_way:
        if done := door.next():
            edit, place = edits[int(done[0].name)]
            caught, seconds = ("", done[1].wall) if done[1].broke else done[1].returned
            yield Tried(edit, caught, seconds, difference(place.path.relative_to(project), place), done[1].broke)


def piece(name: str, function: str, stages: list[Stage], allowed: list[float], more: tuple, bundle: tuple) -> Piece:
    """One call of a function of trial, whose text and copy of the project it brings with it."""
    code = Path(trial.__file__).read_text(encoding="utf-8")
    arguments = code, function, trial.versions(), [tuple(stage) for stage in stages], allowed, *more
    return Piece(name, sent_call, arguments, group="edits", shared=pickle.dumps(bundle))


def files_of(project: Path) -> dict[str, Path]:
    """What a copy has: the files by their names in it."""
    found = {}
    for folder, folders, names in os.walk(project):
        aside = ASIDE(folder, [*folders, *names])
        folders[:] = [name for name in folders if name not in aside]
        paths = [Path(folder, name) for name in names if name not in aside]
        found |= {f"project/{path.relative_to(project).as_posix()}": path for path in paths}
    return found


def nearest(project: Path, stage: Stage, edit: Edit) -> list[str]:
    """The files of a stage, those first that name what is edited: most edits are caught by one of these."""
    words = {*edit.module.split("."), *edit.where.split(".")}

    def named(file):
        text = (project / file).read_text(encoding="utf-8")
        return sum(word in text for word in words) + (edit.module in Path(file).stem)

    return sorted(stage.files, key=named, reverse=True)


def difference(name, place) -> str:
    """An edit as a diff."""
    texts = (text.splitlines() for text in (place.before, place.after))
    return "\n".join(difflib.unified_diff(*texts, f"a/{name}", f"b/{name}", n=1, lineterm=""))
