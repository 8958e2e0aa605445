"""Traced text in the cache folder: it is the text that is traced, and only of what is tmt's own."""

import dataclasses
import hashlib

import numpy as np
import pytest
from cache_folder import new_folder as new_folder
from cache_folder import posix

import tmt
from tmt import kept, source
from tmt.equations import composite, method
from tmt.methods import METHODS, RungeKutta

RK4 = METHODS["rk4"]
WAYS = {
    "run_source": (RK4,),
    "lanes_source": (RK4,),
    "evaluator_source": ("forward_dynamics", composite.mass_matrix_and_bias, "sincos"),
}


def texts(folder):
    return sorted(folder.glob("source_*.txt"))


@pytest.mark.parametrize("name", WAYS)
def test_what_is_kept_is_what_is_traced(name, folder):
    function = getattr(source, name)
    traced = function.__wrapped__(tmt.ARM, *WAYS[name])
    assert function(tmt.ARM, *WAYS[name]) == traced and len(texts(folder)) == 1
    assert function(tmt.ARM, *WAYS[name]) == traced and len(texts(folder)) == 1


def test_it_is_read_the_next_time(folder, monkeypatch):
    text = source.run_source(tmt.ARM, RK4)
    monkeypatch.setattr(source, "slope_code", None)  # nothing can be traced
    assert source.run_source(tmt.ARM, RK4) == text


def test_each_question_has_a_text_of_its_own(folder):
    heavier = dataclasses.replace(tmt.ARM, mass=tuple(2.0 * mass for mass in tmt.ARM.mass))
    asked = [(tree, stepping) for tree in (tmt.ARM, heavier) for stepping in METHODS.values()]
    found = [source.run_source(*which) for which in asked]
    literal = source.evaluator_source(tmt.ARM, "forward_dynamics", method.mass_matrix_and_bias, "sincos")
    assert literal != source.evaluator_source(tmt.ARM, *WAYS["evaluator_source"])
    assert [source.run_source(*which) for which in asked] == found
    assert found == [source.run_source.__wrapped__(*which) for which in asked]


def test_another_version_of_tmt_traces_anew(folder, monkeypatch):
    source.run_source(tmt.ARM, RK4)
    monkeypatch.setattr(kept, "own_sources", lambda: "another")
    source.run_source(tmt.ARM, RK4)
    assert len(texts(folder)) == 2


def test_each_way_has_a_text_of_its_own(folder):
    found = {name: getattr(source, name)(tmt.ARM, *more) for name, more in WAYS.items()}
    for name, more in WAYS.items():
        function = getattr(source, name)
        assert function(tmt.ARM, *more) == found[name] == function.__wrapped__(tmt.ARM, *more)
    assert len(texts(folder)) == len(WAYS)


def test_a_version_is_known_by_the_contents_of_its_files(tmp_path, monkeypatch):
    monkeypatch.setattr(kept, "__file__", str(tmp_path / "kept.py"))
    found = set()
    for content in ("", "a = 1", "a = 2"):
        (tmp_path / "trace.py").write_text(content)
        found.add(kept.own_sources.__wrapped__())
    assert len(found) == 3


@pytest.mark.parametrize("content", ["", "damaged", "0" * 64 + "raise SystemExit", None])
def test_a_text_that_was_not_written_so_is_not_taken(content, folder):
    text = source.run_source(tmt.ARM, RK4)
    (path,) = texts(folder)
    path.write_text(path.read_text()[:-10] if content is None else content)
    assert source.run_source(tmt.ARM, RK4) == text
    assert path.read_text()[kept.DIGEST :] == text  # and it is mended


@posix
def test_a_text_that_others_can_write_is_not_read(folder):
    text = source.run_source(tmt.ARM, RK4)
    (path,) = texts(folder)
    planted = "planted, and signed as what is written here"
    path.write_text(hashlib.sha256(planted.encode()).hexdigest() + planted)
    path.chmod(0o666)
    assert source.run_source(tmt.ARM, RK4) == text


def test_what_is_the_users_own_is_traced_each_time(folder, monkeypatch):
    """A name in METHODS, a class of trees or a function may be another tomorrow, with the same name."""

    class Mine(tmt.Tree):
        pass

    def terms(tree, q, qd):
        return composite.mass_matrix_and_bias(tree, q, qd)

    euler = RungeKutta(1, ((),), (1.0,), (0.0,))
    monkeypatch.setitem(METHODS, "mine", euler)
    own = Mine(**{field.name: getattr(tmt.ARM, field.name) for field in dataclasses.fields(tmt.ARM)})
    source.run_source(tmt.ARM, euler)
    source.run_source(own, RK4)
    source.evaluator_source(tmt.ARM, "forward_dynamics", terms, "sincos")
    assert texts(folder) == []


def test_zeros_of_either_sign_are_two_models(folder):
    one, other = (dataclasses.replace(tmt.ARM, gravity=(0.0, zero, -9.81)) for zero in (0.0, -0.0))
    assert np.signbit(other.gravity[1])
    source.run_source(one, RK4)
    source.run_source(other, RK4)
    assert len(texts(folder)) == 2
