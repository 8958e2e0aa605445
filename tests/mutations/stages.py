"""Which tests an edit meets, in two stages: those of the judge, then the others."""

from pathlib import Path

from .campaign import Stage

JUDGE = ("test_judge_*.py", "test_folder.py")  # all of them together under ten seconds
USELESS = ("test_mutations.py", "test_structure.py", "test_interrupt.py")  # they see any edit, or no edit of a judge
WAITING = "not ctrl_c"  # so does this
ALONE = ("-n", "0")  # in one process: edits are tried side by side


def stages(project: Path) -> list[Stage]:
    """The fast tests of the judge; the rest."""
    named = [{path for name in names for path in project.joinpath("tests").rglob(name)} for names in (JUDGE, USELESS)]
    rest = {*project.joinpath("tests").rglob("test_*.py")} - named[0] - named[1]
    files = [sorted(str(path.relative_to(project)) for path in paths) for paths in (named[0], rest)]
    return [Stage(files[0], ALONE), Stage(files[1], (*ALONE, "-k", WAITING))]
