"""Generated code on disk: $TMT_CACHE, else $XDG_CACHE_HOME/tmt, else ~/.cache/tmt.

The name of a generated module is the hash of its text, of the code that it takes from `sine` and `written`, and of numba's
version; numba keeps its machine code beside it, and that of loops.py (see machine_code.py); the text too is kept (see kept.py).
What lies there is run, so the
folder must be the user's own: others may neither write to it nor put another in its place. Without such a folder the code is
compiled anew in each process: it only costs time.
"""

import hashlib
import linecache
import logging
import os
import stat
import sys
import tempfile
import time
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

SINE, WRITTEN = (
    Path(__file__).with_name(name) for name in ("sine.py", "written.py")
)  # importing them would load numba
LEFT_OVER = ("*.new", "__pycache__/*.tmp.*")  # written aside and never moved, by us and by numba
ABANDONED = 3600.0  # s: a file takes milliseconds to write, but the clocks of a shared disk differ
complaints = []  # about the folder, of this process


class NotOwn(OSError):
    """What lies there can be written by others, or belongs to somebody else."""


def cache_folder() -> Path:
    """Where generated code is kept."""
    if os.environ.get("TMT_CACHE"):
        return Path(os.environ["TMT_CACHE"])
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "tmt"


def size_of_cache() -> int:
    """Bytes of what lies there."""
    found = 0
    for path in cache_folder().rglob("*"):
        with suppress(OSError):  # another process was sooner
            found += path.lstat().st_size * path.is_file()
    return found


def own_folder(folder: Path | None = None) -> Path:
    """The cache folder (or another), its links resolved, made if it is not there; NotOwn unless it is the user's own."""
    folder = Path(os.path.realpath(folder or cache_folder()))
    for path in (*reversed(folder.parents), folder):
        if not path.exists():
            path.mkdir(mode=0o700, exist_ok=True)
        # in a folder like /tmp everybody makes entries, but moves only his own
        check_own(path, on_the_way=path != folder)
    return folder


def check_own(path, on_the_way=False, shut=False) -> None:
    """Raise NotOwn if a file or folder belongs to somebody else or others can write to it.

    on_the_way: a parent folder; it may be root's, and in it others may make entries of their own (as in /tmp).
    shut: it lies in a folder that nobody else can enter, so that its own bits do not matter.
    """
    if os.name != "posix":
        return  # elsewhere these bits say nothing
    about = os.lstat(path)
    if about.st_uid != os.geteuid() and not (on_the_way and about.st_uid == 0):
        raise NotOwn(f"{path} belongs to user {about.st_uid}")
    if stat.S_ISLNK(about.st_mode):
        raise NotOwn(f"{path} is a link")
    writers = about.st_mode & (0o002 if private(path, about.st_gid) else 0o022)
    if writers and not (shut or (on_the_way and about.st_mode & stat.S_ISVTX)):
        raise NotOwn(f"{path} can be written by others (mode {stat.S_IMODE(about.st_mode):04o})")


def private(path, group) -> bool:
    """Whether the group of a path is the user's own, without other members, as many systems make one for each user.

    Where there are further access rights the group's bits stand for those.
    """
    import grp  # POSIX only
    import pwd

    try:
        user, group = pwd.getpwuid(os.geteuid()), grp.getgrgid(group)
        further = "system.posix_acl_access" in os.listxattr(path)
    except (KeyError, OSError, AttributeError):  # no such user or group; not known here
        return False
    return group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name} and not further


def name_of(text) -> str:
    """The name of the module with this source."""
    # numba versions do not read each other's machine code: each keeps its own
    key = "\n".join([version("numba"), SINE.read_text(encoding="utf-8"), WRITTEN.read_text(encoding="utf-8"), text])
    return "kernel_" + hashlib.sha256(key.encode()).hexdigest()[:16]


def is_kept(pattern) -> bool:
    """Whether there is machine code of such a name in the cache folder; it is not looked at."""
    return any((cache_folder() / "__pycache__").glob(f"{pattern}.nbi"))


def load(text):
    """The module with this source, its machine code from the cache folder if that is the user's own and can be used."""
    name = name_of(text)
    try:
        return from_disk(name, text.replace("CACHE", "True"), own_folder())
    except NotOwn as error:
        complain(error)
    except Exception:  # whatever is wrong with the folder or with a file in it: compile without them
        pass
    text = text.replace("CACHE", "False")
    linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
    return executed(name, text, name)


def complain(error) -> None:
    """Say once in a process why the folder is not used; on stderr, unless logging is set up otherwise."""
    if not complaints:
        complaints.append(error)
        logging.getLogger("tmt").warning(
            "%s: nothing there is run, code is compiled in memory; remove it, or set TMT_CACHE to a folder of your own",
            error,
        )


def from_disk(name, text, folder):
    """The module, with its machine code from the folder, written if it is not there; what is damaged is cleared away."""
    from numba import config  # here, so that `import tmt` need not wait for numba

    config.reload_config()  # it is read when something is compiled: too late
    if config.CACHE_DIR:  # $NUMBA_CACHE_DIR: numba takes that one instead
        own_folder(Path(config.CACHE_DIR))
    path, inside = folder / f"{name}.py", own_machine_code(folder, name)
    if os.path.lexists(path):
        check_own(path)
    if not path.exists() or path.read_bytes() != text.encode():
        clear(folder)
        write_aside(path, text.encode())
    try:
        return executed(name, text, str(path))
    except Exception:
        for file in inside.glob(f"{name}.*"):
            file.unlink()
        raise


def write_aside(path, content) -> None:
    """Write a file aside and move it, so that a process that reads meanwhile sees all of it or nothing."""
    with tempfile.NamedTemporaryFile("wb", dir=path.parent, suffix=".new", delete=False) as file:
        file.write(content)
    os.replace(file.name, path)


def own_machine_code(folder, name) -> Path:
    """The folder for machine code, which nobody else can enter; NotOwn unless it and its files of that name are the user's."""
    inside = folder / "__pycache__"
    inside.mkdir(mode=0o700, exist_ok=True)
    check_own(inside)
    if not os.access(inside, os.W_OK):  # numba would look in another folder, of its own choice
        raise PermissionError(f"{inside} cannot be written")
    shut = not inside.stat().st_mode & 0o077
    for file in inside.glob(f"{name}.*"):
        check_own(file, shut=shut)
    if os.name == "posix" and not shut:
        inside.chmod(0o700)  # numba's files get the usual rights, with which the group may be allowed to write
    return inside


def executed(name, text, path):
    """The module with this source, which numba believes to be in that file: it looks for machine code beside it."""
    module = ModuleType(name)
    module.__file__ = path
    sys.modules[name] = module  # numba looks it up there when it reads machine code back
    exec(compile(text, path, "exec"), module.__dict__)
    return module


def clear(folder) -> None:
    """Remove what writers that were killed have left."""
    for pattern in LEFT_OVER:
        for file in folder.glob(pattern):
            with suppress(OSError):
                if time.time() - file.lstat().st_mtime > ABANDONED:
                    file.unlink()
