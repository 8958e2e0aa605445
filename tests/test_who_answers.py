"""Who answers the public functions: compiled code once it has cost as much, and never sooner."""

import json
import subprocess
import sys
from dataclasses import replace
from functools import lru_cache

import pytest

import tmt
from tmt import answers, cache
from tmt.choice import Form, chosen

ASKED = """
import json, sys, numpy as np, tmt
q, many = np.array([0.1, 0.2, 0.3]), int(sys.argv[1])
found = [tmt.acceleration(q, q, q)]
light = "numba" not in sys.modules
found += [tmt.acceleration(q, q, q) for _ in range(many)]
print(json.dumps([light, "numba" in sys.modules, float(max(abs(found[0] - found[-1])))]))
"""


@pytest.mark.parametrize("calls, compiled", [(20, False), (3000, True)])
def test_a_short_question_never_waits_for_a_compiler(calls, compiled):
    tmt.prepare()  # so that their machine code is on disk
    run = subprocess.run([sys.executable, "-c", ASKED, str(calls)], capture_output=True, text=True, check=True)
    light, later, off = json.loads(run.stdout)
    assert light and later is compiled and off <= 1e-12


@pytest.mark.parametrize("there, kept", [(True, True), (False, True), (False, False)])
def test_code_is_got_when_the_literal_form_has_cost_as_much(there, kept, monkeypatch):
    known = answers.Known(tmt.ARM)
    monkeypatch.setattr(answers, "loops", lru_cache(lambda: None))
    monkeypatch.setattr(answers, "getting_loops", lambda: answers.READ if kept else answers.COMPILED)
    monkeypatch.setattr(answers.Known, "get_loops", lambda self: setattr(self, "parts", ()))
    if there:
        answers.loops()
    getting = (0.0 if there else answers.READ if kept else answers.COMPILED) + answers.WRITTEN * 3
    calls = getting / (answers.CALL + 1) / (answers.LITERAL * 2 * 9 + answers.LITERAL_JOINT * 3)
    assert not any(known.has_loops(1) for _ in range(int(calls)))
    assert known.has_loops(1) and calls > 5
    many = answers.Known(tmt.ARM)
    assert many.has_loops(10_000_000)  # at once


def test_who_cannot_wait_has_the_loops_got_beforehand():
    tree = replace(tmt.ARM, mass=(2.75, 1.5))
    assert tmt.prepare(tree) is None and answers.remembered(tree).parts is not None
    with pytest.raises(ValueError, match=r"model is 'arm'; a tmt\.Tree is expected"):
        tmt.prepare("arm")


def test_the_first_of_equals_is_chosen():
    cheap, dear = Form("literal", 0.0, 1.0), Form("loop", 10.0, 0.0)
    assert [chosen([cheap, dear], wanted).name for wanted in (9.9, 10.0, 10.1)] == ["literal", "literal", "loop"]
    assert chosen([cheap, dear], 1.0, before=9.5).name == "loop"


def test_kept_machine_code_is_seen(tmp_path, monkeypatch):
    monkeypatch.setenv("TMT_CACHE", str(tmp_path))
    assert not cache.is_kept("loop_answers.many-*")
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "__pycache__" / "loop_answers.many-0123.nbi").touch()
    assert cache.is_kept("loop_answers.many-*") and not cache.is_kept("loop_answers.one-*")
