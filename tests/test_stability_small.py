"""The whole of stability with few methods, scenes and steps: every path, every figure; and a model it was not made for."""

from pathlib import Path

from compare import stability
from compare.agreement import Setup
from compare.engine_file import ARM_XML, load


def test_a_small_run_fills_every_table(small):
    small = small("stability")
    assert set(small.tables) == {
        "departure", "stability_modes", "stability_growth", "stability_torques", "stability_finer_steps",
        "stability_bent", "stability_energy", "stability_newton",
    }  # fmt: skip
    told = " ".join(small.notes)
    for words in ("Claim 1, reproduced", "Claim 2, reproduced", "Claim 3, bounded", "loses definiteness"):
        assert words in told


def test_on_the_moon_no_sentence_speaks_of_the_stated_arm(tmp_path):
    """Gravity 1.62: many checks fail, nothing raises, and the sentences say what happened there."""
    path = tmp_path / "moon.xml"
    path.write_text(Path(ARM_XML).read_text().replace("0 0 -9.81", "0 0 -1.62"))
    result = stability.rows(Setup.small(load(path)))
    assert sum(not check.passed for check in result.checks) > 100
    told = " ".join(result.notes + [figure()[2] for figure in stability.figures(result)])
    for words in (
        "it never starts again",
        "stays definite",
        "Claim 1, not reproduced",
        "MuJoCo: 27 leave, after 0.08 s",
    ):
        assert words in told
    for words in (
        "loses definiteness",
        "the cause is rounding",
        "There is no limit",
        "silent failure",
        "edge is sharp",
    ):
        assert words.lower() not in told.lower().replace("no failure is silent", "")
    assert not any("silent" in check.quantity for check in result.checks)  # nothing failed, so nothing has to be caught
