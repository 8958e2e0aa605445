"""Object files on disk: $TMT_CACHE, else $XDG_CACHE_HOME/tmt, else ~/.cache/tmt.

The name of a file is the hash of all that its machine code depends on: tmt's sources as imported, the versions of llvmlite and
LLVM, the processor, the tree and what is compiled for it. What lies there is run, so the folder must be the user's own: others
may neither write to it nor put another in its place. Without such a folder, with a damaged file or a full disk, the code is
compiled anew: it only costs time. To clear it is to delete the folder.
"""

import hashlib
import logging
import os
import stat
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import is_dataclass
from pathlib import Path

from tmt.methods.stepping import Method
from tmt.model.tree import Tree, stated

from .machine import Library, object_code, versions
from .sources import own_sources

DIGEST = 32  # bytes of a SHA-256, before the object code
complaints: list[OSError] = []  # about the folder, of this process


class NotOwn(OSError):
    """What lies there can be written by others, or belongs to somebody else."""


def library(source: Callable[[], str], *what: Tree | Method | str | int) -> Library:
    """The compiled module of a source, from the folder if it lies there; what: all that the source follows from, with tmt itself.

    Of what is the user's own (a class of trees, a method), or of changed sources, nothing is kept: it may be another.
    """
    words = [own_sources(), versions(), *map(word_of, what)]
    parts = [word for word in words if word is not None]
    if len(parts) < len(words):
        return Library(source())
    name = hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]
    try:
        path = own_folder() / f"{name}.o"
        code = read(path)
    except Exception as error:  # whatever is wrong with the folder or the file
        if isinstance(error, NotOwn):
            complain(error)
        return Library(source())
    if code is None:
        code = object_code(source())
        with suppress(OSError):
            write_aside(path, hashlib.sha256(code).digest() + code)
    return Library(code=code)


def word_of(value: object) -> str | None:
    """What stands for a value in the name of a file; None if it may mean something else another time."""
    if isinstance(value, (str, int)):
        return repr(value)
    is_of_tmt = type(value).__module__.split(".")[0] == __name__.split(".")[0]
    if is_of_tmt and isinstance(value, Tree | Method) and is_dataclass(value):
        return f"{type(value).__qualname__}({stated(value)})"
    return None


def read(path: Path) -> bytes | None:
    """The object code of a file, None where there is none or it is damaged; NotOwn if others could have written it."""
    try:
        check_own(path)
        content = path.read_bytes()
    except FileNotFoundError:
        return None
    digest, code = content[:DIGEST], content[DIGEST:]
    return code if digest == hashlib.sha256(code).digest() else None


def complain(error: OSError) -> None:
    """Say once in a process why the folder is not used; on stderr, unless logging is set up otherwise."""
    if not complaints:
        complaints.append(error)
        done, advice = "code is compiled in memory", "remove it, or set TMT_CACHE to a folder of your own"
        logging.getLogger("tmt").warning("%s: nothing there is run, %s; %s", error, done, advice)


def cache_folder() -> Path:
    if os.environ.get("TMT_CACHE"):
        return Path(os.environ["TMT_CACHE"])
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "tmt"


def own_folder() -> Path:
    """The cache folder, its links resolved, made if it is not there; NotOwn unless it is the user's own."""
    folder = Path(os.path.realpath(cache_folder()))
    for path in (*reversed(folder.parents), folder):
        if not path.exists():
            path.mkdir(mode=0o700, exist_ok=True)
        # in a folder like /tmp everybody makes entries, but moves only his own
        check_own(path, on_the_way=path != folder)
    return folder


def check_own(path: Path, on_the_way: bool = False) -> None:
    """Raise NotOwn if a file or folder belongs to somebody else or others can write to it.

    on_the_way: a parent folder; it may be root's, and in it others may make entries of their own (as in /tmp).
    """
    if not hasattr(os, "geteuid"):
        return  # not POSIX: these bits say nothing
    about = os.lstat(path)
    if about.st_uid != os.geteuid() and not (on_the_way and about.st_uid == 0):
        raise NotOwn(f"{path} belongs to user {about.st_uid}")
    if stat.S_ISLNK(about.st_mode):
        raise NotOwn(f"{path} is a link")
    writers = about.st_mode & (0o002 if private(path, about.st_gid) else 0o022)
    if writers and not (on_the_way and about.st_mode & stat.S_ISVTX):
        raise NotOwn(f"{path} can be written by others (mode {stat.S_IMODE(about.st_mode):04o})")


def private(path: Path, group: int) -> bool:
    """Whether the group of a path is the user's own, without other members and without further rights."""
    import grp  # POSIX only
    import pwd

    try:
        user, about = pwd.getpwuid(os.geteuid()), grp.getgrgid(group)
        further = "system.posix_acl_access" in os.listxattr(path)
    except (KeyError, OSError, AttributeError):  # no such user or group; not known here
        return False
    return about.gr_name == user.pw_name and set(about.gr_mem) <= {user.pw_name} and not further


def write_aside(path: Path, content: bytes) -> None:
    """Write a file aside and move it, so that a process that reads meanwhile sees all of it or nothing."""
    with tempfile.NamedTemporaryFile("wb", dir=path.parent, suffix=".new", delete=False) as file:
        aside = Path(file.name)
        try:
            file.write(content)
            file.close()
            os.replace(aside, path)
        except OSError:
            aside.unlink(missing_ok=True)
            raise
