"""The whole of stability with few methods, scenes and steps: every path, every figure; and a model it was not made for."""

from pathlib import Path

import pytest

from compare import stability
from compare.agreement import Setup
from compare.engine_file import ARM_XML, load

NAMES = {"limits", "regions", "departure", "torques", "silent", "map", "edge", "finer_steps", "bent", "zero", "energy"}


@pytest.fixture(scope="module")
def small(engine):
    return stability.rows(Setup.small(engine))


def test_a_small_run_passes_and_fills_every_table(small):
    assert [str(check) for check in small.checks if not check.passed] == []
    assert set(small.tables) == {
        "departure", "stability_modes", "stability_growth", "stability_torques", "stability_finer_steps",
        "stability_bent", "stability_energy", "stability_newton",
    }  # fmt: skip
    told = " ".join(small.notes)
    for words in ("Claim 1, reproduced", "Claim 2, reproduced", "Claim 3, bounded", "loses definiteness"):
        assert words in told


def test_every_figure_of_a_small_run_is_drawn(small, tmp_path):
    drawn = [figure() for figure in stability.figures(small)]
    assert {name for name, _, _ in drawn} == {f"stability_{name}" for name in NAMES}
    for name, figure, caption in drawn:
        figure.savefig(tmp_path / f"{name}.png")
        assert " nan" not in caption and "inf" not in caption and "None" not in caption


def test_on_the_moon_no_sentence_speaks_of_the_stated_arm(tmp_path):
    """Gravity 1.62: many checks fail, nothing raises, and the sentences say what happened there."""
    path = tmp_path / "moon.xml"
    path.write_text(Path(ARM_XML).read_text().replace("0 0 -9.81", "0 0 -1.62"))
    result = stability.rows(Setup.small(load(path)))
    assert sum(not check.passed for check in result.checks) > 100
    told = " ".join(result.notes + [figure()[2] for figure in stability.figures(result)])
    for words in ("it never starts again", "stays definite", "Claim 1, not reproduced", "MuJoCo: 27 leave, after 0.08 s"):
        assert words in told
    for words in ("loses definiteness", "the cause is rounding", "There is no limit", "silent failure", "edge is sharp"):
        assert words.lower() not in told.lower().replace("no failure is silent", "")
    assert not any("silent" in check.quantity for check in result.checks)  # nothing failed, so nothing has to be caught
