"""The pieces of one file: what is said in them does not say where they were computed, but for times."""

import pickle
import platform
import zlib
from pathlib import Path

import pytest

from compare.experiments import EXPERIMENTS
from compare.fleet.file_pieces import Asked, broken, findings, read_file, reported, untimed_part
from compare.fleet.models import bundle, found_models
from compare.fleet.row import BROKE

PENDULUM = """<mujoco><option timestep="0.001"/><worldbody><body><joint name="hinge" axis="0 1 0"/>
<inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.01"/></body></worldbody></mujoco>"""
ASKED = Asked(tuple(EXPERIMENTS), True)


@pytest.fixture
def packed(tmp_path, monkeypatch):
    """packed(text): a model to be sent, and a folder of its own to work in."""
    (tmp_path / "m").mkdir()
    (tmp_path / "elsewhere").mkdir()

    def made(text):
        (tmp_path / "m" / "x.xml").write_text(text)
        monkeypatch.chdir(tmp_path / "elsewhere")
        return pickle.dumps(bundle(found_models([str(tmp_path / "m" / "x.xml")]).models[0]))

    return made


def results(value):
    return pickle.loads(zlib.decompress(value))


def test_what_is_known_of_a_file_names_it_as_it_was_given(packed):
    text = '<mujoco><worldbody><body><joint/><geom type="mesh" mesh="gone"/></body></worldbody></mujoco>'
    model = packed(text)
    refused = read_file("given.xml", ASKED, model).refused
    assert refused.startswith("MuJoCo cannot compile it: ") and str(Path.cwd()) not in refused
    known = read_file("given.xml", ASKED, packed(PENDULUM))
    assert (known.refused, known.joints, known.integrator, known.dt, known.reference) == (
        "",
        1,
        "Euler",
        0.001,
        "model",
    )
    assert "published" in dict(known.reasons) and "published" not in known.experiments


def test_a_timed_experiment_in_two_pieces_finds_what_it_finds_in_one_and_says_where(packed):
    model = packed(PENDULUM)
    whole, _ = results(findings("reduction", None, "given.xml", ASKED, model)[0])
    found, differs = findings(
        "reduction", untimed_part("reduction", "given.xml", ASKED, model), "given.xml", ASKED, model
    )
    parted, _ = results(found)
    assert differs == "" and parted.checks == whole.checks and len(parted.checks) > 10
    (note,) = [note for note in parted.notes if note.startswith("Timed on ")]
    assert platform.node() in note and "a worker that did nothing else" in note
    assert not any(note.startswith("Timed on ") for note in whole.notes)


def test_an_experiment_that_gave_nothing_is_in_the_report_and_the_others_too(packed):
    model = packed(PENDULUM)
    asked = Asked(("mass", "gravity", "speed"), True)
    found = {"mass": findings("mass", None, "given.xml", asked, model)[0], "gravity": "ended by SIGKILL, 4 times"}
    left_out = [("speed", "it measures time: nobody may")]
    row, written = reported(found, left_out, 3.0, "given.xml", asked, model)
    assert (row["verdict"], row["reason"]) == (BROKE, "gravity ended by SIGKILL, 4 times") and row["seconds"] > 3.0
    text = written["report.md"].decode()
    assert "ended by SIGKILL, 4 times" in text and "it measures time: nobody may" in text
    assert "fleet given.xml --only mass,gravity,speed" in text and str(Path.cwd()) not in text
    assert {"index.html", "results.json", "tables/mass.csv"} <= set(written) and not any(Path.cwd().glob("*/figures"))
    assert not broken("gravity", "why")[1].checks[0].passed
