"""The output folder: a new report takes the place of the old one only when it is complete."""

import json
import shutil
import tempfile
from contextlib import contextmanager
from pathlib import Path

OWN = ("report.md", "index.html", "results.json", "tables", "figures")


class FolderError(ValueError):
    """A folder that cannot take a report; the message is one line."""


@contextmanager
def new_report(out):
    """A fresh folder inside `out`; what is in it takes the old report's place when the block ends well.

    Whatever else is in `out` stays. If the block raises, `out` is as it was. FolderError if `out` cannot be
    written, or has files under a report's names that are not the old report's.
    """
    out = Path(out)
    existed = out.exists()
    try:
        out.mkdir(parents=True, exist_ok=True)
        work = Path(tempfile.mkdtemp(prefix=".new-", dir=out))
    except OSError as error:
        raise FolderError(
            f"cannot write to {out}: {error.strerror}; a folder that can be written is expected"
        ) from None
    try:
        foreign = not_of_a_report(out)
        if foreign:
            raise FolderError(
                f"{out} has {foreign[0]}, which is not of an earlier report and would be replaced; "
                "another folder is expected"
            )
        yield work
        exchange(work, out)
    finally:
        shutil.rmtree(work, ignore_errors=True)
        if not existed and out.exists() and not any(out.iterdir()):
            out.rmdir()


def files(folder) -> list[str]:
    """What lies in a folder under a report's names, relative to it."""
    found = [path for name in OWN for path in [folder / name, *(folder / name).rglob("*")] if path.is_file()]
    return sorted(str(path.relative_to(folder)) for path in found)


def not_of_a_report(out) -> list[str]:
    """Files under a report's names that the report in `out` does not list as its own."""
    try:
        own = json.loads((out / "results.json").read_text())["provenance"]["files"]
        return [name for name in files(out) if name not in own]
    except (OSError, ValueError, KeyError, TypeError):
        return files(out)


def exchange(work, out):
    """Move the old report away and the new one in; on an error put everything back."""
    old = Path(tempfile.mkdtemp(prefix=".old-", dir=out))
    moved = []
    try:
        for source, target in ((out, old), (work, out)):
            for name in OWN:
                if (source / name).exists():
                    (source / name).rename(target / name)
                    moved.append((source / name, target / name))
    except OSError as error:
        for source, target in reversed(moved):
            target.rename(source)
        raise FolderError(f"cannot replace the report in {out}: {error.strerror}; the old one is unchanged") from None
    finally:
        shutil.rmtree(old, ignore_errors=True)
