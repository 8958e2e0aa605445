"""Symbolic equations: their numbers, their forms, and the texts in which they are handed out."""

import html
import shutil
import subprocess
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import sympy
from helpers.trees import random_tree, small_tree, tree_of_kinds

import tmt
from compare.judge.entries import Entries
from compare.run.reference import compared_with
from tmt import Tree
from tmt.export import trigonometry
from tmt.export.documents import in_latex, latex, page, sections
from tmt.export.symbols import python_source, symbolic

EPS = np.finfo(float).eps
SCALES = {"mass_matrix": "mass_matrix", "bias": "bias", "gravity_balance": "weight"}


def tree_of(name) -> Tree:
    return compared_with("model", f"tests/models/{name}.xml").robot.tree


def planar(n) -> Tree:
    """A pendulum of n links."""
    link = {"axis": (0, 1, 0), "mass": 1.0, "com": (0, 0, -0.25), "inertia": (0.02, 0.021, 0.003)}
    offsets = [(0, 0, -0.5 * (i > 0)) for i in range(n)]
    return Tree.from_joints([tmt.Joint(f"joint{i}", offset=x, **link) for i, x in enumerate(offsets)])


def cart_pole(reference=0.0) -> Tree:
    cart = tmt.Joint("slider", "slide", axis=(1, 0, 0), mass=1.0)
    pole = tmt.Joint("hinge", axis=(0, 1, 0), mass=0.1, com=(0, 0, 0.5), armature=0.02)
    return Tree.from_joints([cart, pole], reference=(0.1, reference))


def assert_right(symbols, tree, rng, states=100):
    """The expressions with their numbers are tmt's at random states, within the tolerance of the comparison."""
    q, qd = rng.uniform(-3.0, 3.0, (2, states, len(tree.axis)))
    scale = Entries(tree, q, qd)
    for name in symbols.entries:
        state = (q, qd)[: 2 if name == "bias" else 1]
        variables = symbols.q + symbols.qd if name == "bias" else symbols.q
        columns = [*q.T, *qd.T][: len(variables)]
        numbers = {symbol: row.value for symbol, row in symbols.parameters.items()}
        function = sympy.lambdify(variables, list(symbols.entries[name].subs(numbers)), "numpy", cse=True)
        values = function(*columns)
        expected = getattr(tmt, name)(tree, *state)
        found = np.stack([np.broadcast_to(value, states) for value in values], axis=-1)
        found = found.reshape(expected.shape)
        assert (np.abs(found - expected) <= 64 * EPS * getattr(scale, SCALES[name])).all(), name


@pytest.mark.parametrize("make, named", [
    (lambda rng: tmt.ARM, True), (lambda rng: tmt.ARM, False), (lambda rng: planar(2), True),
    (lambda rng: cart_pole(0.4), True), (lambda rng: cart_pole(0.4), False),
    (lambda rng: random_tree(rng, bodies=1), True),
    (lambda rng: tree_of_kinds(rng, bodies=2, kinds=("hinge", "slide")), False),
])  # fmt: skip
def test_the_numbers_are_those_of_the_tree(make, named, rng):
    tree = make(rng)
    symbols = symbolic(tree, named=named)
    assert symbols.named == named and bool(symbols.parameters) == named and not symbols.note
    assert_right(symbols, tree, rng)


def test_a_double_pendulum_has_the_form_of_textbooks():
    symbols = symbolic(planar(2))
    names = "m_joint0 m_joint1 l_1 c_joint0 c_joint1 I_joint0_yy I_joint1_yy q_joint1 qd_joint0 qd_joint1"
    m1, m2, l1, c1, c2, I1, I2, q2, qd1, qd2 = sympy.symbols(names)
    M, h = symbols.entries["mass_matrix"], symbols.entries["bias"] - symbols.entries["gravity_balance"]
    assert M[0] == m1 * c1**2 + I1 + I2 + m2 * (l1**2 + c2**2 + 2 * l1 * c2 * sympy.cos(q2))
    assert h[0] == -m2 * l1 * c2 * sympy.sin(q2) * (2 * qd1 * qd2 + qd2**2)
    gravity = symbols.entries["gravity_balance"][1]
    assert gravity == m2 * sympy.Symbol("g") * c2 * sympy.sin(sympy.Symbol("q_joint0") + q2)
    assert symbols.parameters[l1] == (0.5, "m", "from joint0 to joint1, along -z")


def test_a_large_robot_has_numbers_and_says_so(rng, monkeypatch):
    monkeypatch.setattr(trigonometry, "LARGEST_PRODUCT", 100)
    tree = tree_of("arm6").lock({"roll": 0.0, "pitch": 0.3, "flange": 0.0})
    symbols = symbolic(tree)
    assert not symbols.named and symbols.note and not symbols.parameters
    assert_right(symbols, tree, rng)


def test_what_cannot_be_derived_is_one_line():
    for tree, words in ((small_tree(), "is a ball"), (tree_of("arm7"), "take more work than 0.2 s")):
        with pytest.raises(ValueError, match=words) as error:
            symbolic(tree, limit=0.2)
        assert "\n" not in str(error.value)


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="no pdflatex")
def test_the_arm_in_latex_is_one_page(tmp_path):
    (tmp_path / "arm.tex").write_text(latex(symbolic(), ["50% of a_b & c"]), encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "arm.tex"]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert result.returncode == 0 and "(1 page" in result.stdout, result.stdout


def formulas_of(text) -> list[str]:
    """What is read of the formulas of a page, which is an XML that fetches nothing."""
    assert "http" not in text and "src=" not in text
    body = text[text.index("<body>") : text.index("<pre>")].replace("<wbr>", "")
    root = ElementTree.fromstring(html.unescape(body) + "</body>")
    return ["".join("".join(p.itertext()).split()) for p in root.iter("p") if p.find("math") is not None]


OBLIQUE = replace(planar(2), axis=((0, 0, 1), (1, 0, 2e-5)))


@pytest.mark.parametrize("tree", [tmt.ARM, planar(2), cart_pole(), OBLIQUE])
def test_documents_have_every_entry_and_the_bias_that_of_gravity_by_its_symbol(tree, rng):
    symbols = symbolic(tree)
    text, count = latex(symbols), 0
    for section, (name, matrix) in zip(sections(symbols), symbols.entries.items(), strict=True):
        gravity = {
            sympy.Symbol(f"G_{{{i + 1}}}"): G for i, G in enumerate(symbols.entries["gravity_balance"])
        }
        for shown, row in zip(section.rows, matrix.tolist(), strict=True):
            for entry, right in zip(shown, row):
                off = entry.subs(gravity) - right
                values = {symbol: rng.uniform(0.5, 1.5) for symbol in sorted(off.free_symbols, key=str)}
                assert abs(off.subs(values)) < (1e-3 if tree is OBLIQUE else 1e-12)
                assert in_latex(entry, symbols.display) in text
                assert (
                    name != "bias" or entry.free_symbols & gravity.keys() or not right.has(sympy.Symbol("g"))
                )
        count += 1 if section.fits else len(section.labelled)
    assert len(formulas_of(page(symbols, ["from a < b & c"]))) == count


def test_symbols_of_names_that_are_alike_are_different(tmp_path):
    names = {"joint_names": ("p q", "p_q", "p-q"), "body_names": ("a", "a_x", "a b")}
    tree = replace(planar(3), com=((0.1, 0.2, 0.3), (0.4, 0, 0), (0, 0.1, 0.2)), **names)
    assert_right(symbolic(tree), tree, np.random.default_rng(0), 5)
    for joints in (("µ", "μ", "x²"), ("{text}", "a_{b}", "%")):
        tree = replace(planar(3), joint_names=joints)
        found = {}
        exec(python_source(symbolic(tree)), found)
        assert len(set(found["q"])) == 3
        text = latex(symbolic(tree), [joints[0]])
        assert text.count("\\begin{document}") == 1 and "\n\\begin{document}" in text
        assert formulas_of(page(symbolic(tree)))
