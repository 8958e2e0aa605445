"""Which tests an edit meets, in two stages: those of the judge, then the others."""

from pathlib import Path

JUDGE = ("test_judge_*.py", "test_agreement.py", "test_folder.py")  # all of them together under ten seconds
USELESS = ("test_mutations.py", "test_structure.py")  # they would see any edit, whatever it breaks
WAITING = "not ctrl_c and not leaves_early"  # interrupts take their time and judge nothing


def stages(project: Path) -> list[list[str]]:
    """Arguments for pytest: the fast tests of the judge; the rest."""
    names = {name: sorted(project.joinpath("tests").rglob(name)) for name in (*JUDGE, *USELESS)}
    first = [str(path.relative_to(project)) for name in JUDGE for path in names[name]]
    aside = first + [str(path.relative_to(project)) for name in USELESS for path in names[name]]
    return [first, ["tests", "-k", WAITING, *(f"--ignore={path}" for path in aside)]]
