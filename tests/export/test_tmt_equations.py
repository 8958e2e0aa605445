"""tmt.equations: what is written in Python and C gives the values of tmt's functions."""

import ctypes
import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from helpers.many_digits import FIELDS, exact
from helpers.trees import UNIT, one_body, random_states, tree_of_kinds

import tmt
from tmt.derivation.quantities import PLAIN, QUANTITIES
from tmt.exact.many import Pairs, exact_of_many
from tmt.export import c
from tmt.export.parameters import Parameters

HAS_C = bool(shutil.which("gcc"))


def states_of(tree, count=5):
    return random_states(np.random.default_rng(1), tree, count)


def module(tree, *quantities):
    found = {}
    exec(tmt.equations(tree, "python", quantities), found)
    return found


def compile_in(folder, arguments):
    """Without any warning."""
    command = ["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", *arguments.split()]
    subprocess.run(command, cwd=folder, check=True)


TREE = tree_of_kinds(np.random.default_rng(3))
CHAIN = one_body(
    [*UNIT, (0, 1, 0), (1, 0, 0)], ("ball", "slide", "hinge"), (0.3, 0.2, 0.1), stiffness=(2.0, 3.0, 0.0)
)


@pytest.mark.skipif(not HAS_C, reason="no C compiler")
@pytest.mark.parametrize("single", [False, True])
def test_c_compiles_without_a_warning_and_gives_the_same_values_in_any_number_of_parts(
    single, tmp_path, monkeypatch
):
    """Values that parts hand on stand in an array whose places are used again."""
    kind, (rtol, atol) = (np.float32, (2e-3, 1e-4)) if single else (np.float64, (1e-11, 1e-12))
    states, results = [x[0].astype(kind) for x in states_of(TREE)], []
    expected = tmt.acceleration(TREE, *(x.astype(float) for x in states))
    (tmp_path / "robot.h").write_text(tmt.equations(TREE, "c header", ["acceleration"], single=single))
    for longest in (10_000, 30):
        monkeypatch.setattr(c, "LONGEST", longest)
        text = tmt.equations(TREE, "c", ["acceleration"], single=single)
        (tmp_path / f"{longest}.c").write_text(text)
        compile_in(tmp_path, f"-O0 -pedantic -fPIC -shared -include robot.h {longest}.c -o {longest}.so -lm")
        results.append(np.empty(len(TREE.axis), dtype=kind))
        function = ctypes.CDLL(str(tmp_path / f"{longest}.so")).robot_acceleration
        function(*(ctypes.c_void_p(x.ctypes.data) for x in (*states, results[-1])))
    assert np.allclose(results[0], expected, rtol=rtol, atol=atol) and np.array_equal(*results)
    assert "static void robot_acceleration_2(" in text
    assert int(re.search(r"(?:double|float) w\[(\d+)\]", text)[1]) < text.count(";") / 5


NAMES = ('*/ int run; /*"""', "x??/", "'''end\\", "`<img src=x onerror=run()>`` 100 %ä")
LINE = "first\nimport run\n\\input{run}\n#include <run>\rrun()\u2028run()"  # of the head
COMMENTS = {  # and where names are text
    "c": r"(?s)/\*.*?\*/", "c header": r"(?s)/\*.*?\*/", "matlab": "(?m)^%.*$", "python": '(?s)^""".*?"""',
    "sympy": r"(?m)#.*$|'\*/ int run.*?'|\w+_run_\w*", "latex": r"(?m)^%.*$|\*/ int run|<img src=x onerror=run",
    "html": r"<pre>[^<]*</pre>|\*/ int run|onerror=run",
}  # fmt: skip


def test_names_that_are_pieces_of_programs_stay_in_comments_and_texts(tmp_path):
    tree = replace(tmt.ARM.lock({"alpha": 0.0}), joint_names=NAMES[:2], body_names=NAMES[2:])
    for language, comment in COMMENTS.items():
        text = tmt.equations(tree, language, ["mass_matrix"], head=[LINE, *NAMES])
        (tmp_path / language).write_text(text)
        rest, count = re.subn(comment, "", text)
        assert count and "run" not in rest and "<img" not in rest, language
        if language in ("python", "sympy"):
            compile(text, language, "exec")
    if HAS_C:
        (tmp_path / "header").write_text((tmp_path / "c header").read_text())
        compile_in(tmp_path, "-x c -include header -c c")


@pytest.mark.parametrize("name", PLAIN)
def test_the_exact_values_of_many_states_are_those_of_single_ones(name):
    q, qd, tau = states_of(CHAIN, 2)
    high, low = exact_of_many(CHAIN, name, q, qd, tau)
    qdd = tau[1] if "qdd" in QUANTITIES[name].takes else None
    truth = exact(CHAIN, q[1], qd[1], tau[1], qdd)
    parts = [(high[1], low[1])] if len(FIELDS[name]) == 1 else list(zip(high[1], low[1]))
    for field, (h, l) in zip(FIELDS[name], parts, strict=True):
        off = np.abs((np.asarray(h).astype(object) - getattr(truth, field)) + l)
        assert np.max(off) <= 1e-28 * max(1.0, float(np.max(np.abs(h))))


def test_the_distance_from_exact_values_has_all_their_digits():
    pairs = Pairs(np.array([[1.0, 1.0], [2.0, 3.0]]), np.array([[1e-20, -2e-20], [0.0, 4e-20]]))
    assert pairs.distance(pairs.high).tolist() == [[1e-20, 2e-20], [0.0, 4e-20]]
    assert pairs.distance(pairs.high - 1.0).tolist() == [[1.0, 1.0], [1.0, 1.0]]
    near = 1.0 + 2.0**-52  # its distance is not a double plus the low part of the other sign
    assert pairs.distance(np.full((2, 2), near))[0].tolist() == [2.0**-52 - 1e-20, 2.0**-52 + 2e-20]
    assert pairs.part(1).distance(pairs.high[:, 1]).tolist() == [2e-20, 4e-20] and pairs.part(None) is pairs
    assert np.isnan(pairs.distance(np.full((2, 2), np.nan))).all()


@pytest.mark.parametrize("tree", [tmt.ARM, TREE], ids=["arm", "kinds"])
def test_parameters_are_those_of_the_tree_that_has_these_numbers(tree, rng):
    """Gravity, a body in a turned frame, and a payload, which is one more body."""
    body, q, qd, tau = tree.body_names[-1], *states_of(tree)
    axes, origin = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=3)
    axes[:, 0] *= np.linalg.det(axes)
    joint = tree.body_joint[-1:]
    tree = replace(tree, site_names=(body,), site_joint=joint, site_offset=(origin,), site_rotation=(axes,))
    tensors = [np.trace(S) * np.eye(3) - S for S in (root @ root.T for root in rng.normal(size=(2, 3, 3)))]
    six = [[I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]] for I in tensors]
    masses, coms, gravity = rng.uniform(1, 2, (2, 1)), rng.normal(size=(2, 3)), rng.normal(size=3)
    placed = [origin + axes @ com for com in coms]
    turned = [axes @ I @ axes.T for I in tensors]
    turned = [(I + I.T) / 2 for I in turned]
    other = replace(
        tree, gravity=gravity, mass=(*tree.mass[:-1], *masses[:, 0]), com=(*tree.com[:-1], *placed),
        inertia=(*tree.inertia[:-1], *turned), body_names=(*tree.body_names, "load"),
        body_joint=(*tree.body_joint, tree.body_joint[-1]),
    )  # fmt: skip
    found, names = {}, {"mass_matrix": (q,), "bias": (q, qd), "acceleration": (q, qd, tau), "energy": (q, qd)}
    words = ["gravity", f"{body}.inertia", f"{body}.mass", f"{body}.com", "payload", body]
    exec(tmt.equations(tree, "python", list(names), parameters=words), found)
    values = gravity, six[0], masses[0], coms[0], masses[1], coms[1], six[1]
    for name, states in names.items():
        expected = getattr(tmt, name)(other, *states)
        assert np.allclose(found[name](*states, *values), expected, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize(("words", "quantity", "why"), [
    (["payload"], "bias", "'payload' is no parameter"), (["hand.mas"], "bias", "'hand.mas'"),
    (["payload", "forearm"], "jacobians", "a payload has none"),
])  # fmt: skip
def test_what_is_no_parameter(words, quantity, why):
    with pytest.raises(ValueError, match=why):
        tmt.equations(tmt.ARM, "c", [quantity], parameters=words)


def test_a_body_keeps_its_own_frame_where_a_site_of_its_name_is_on_another_joint():
    """Of the names of sites that become one the file has either; numbers of the file are those of single precision."""
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    place = {
        "site_names": ["forearm", "a b", "a_b"],
        "site_offset": [(1.0, 2.0, 3.0)] * 3,
        "site_rotation": [turn] * 3,
    }
    for joint in (-1, 0, 1, 2):
        tree = replace(tmt.ARM, site_joint=[joint] * 3, **place)
        chosen = Parameters(tree, ["forearm.com"]).values["forearm_com"]
        assert chosen == (
            tmt.ARM.com[1] if joint != 2 else tuple(turn.T @ (tmt.ARM.com[1] - np.array([1.0, 2.0, 3.0])))
        )
        assert np.allclose(
            module(tree, "frame_pose:a b")["frame_pose_a_b"](np.zeros(3))[:, 3],
            tmt.frame(tree, "a_b", np.zeros(3))[0],
        )


def test_numbers_of_single_precision_end_where_floats_do():
    inside, beyond = (replace(tmt.ARM, armature=(size, 0.0, 0.0)) for size in (3.3e38, 3.5e38))
    assert "3.3e+38f" in tmt.equations(inside, "c", ["mass_matrix"], single=True)
    with pytest.raises(ValueError, match="single precision"):
        tmt.equations(beyond, "c", ["mass_matrix"], single=True)


def test_the_head_says_where_each_number_stands_and_what_parameters_are_in_the_model():
    """Of a slide, a ball and a hinge, counted by hand; the numbers of a body in a frame that is turned by a quarter about z."""
    tree = one_body(
        [(0, 0, 1), *np.eye(3), (0, 1, 0)], ["slide", "ball", "hinge"], (0.3, 0.2, 0.1), np.diag([1.0, 2.0, 2.5]),
        armature=[0.0] * 4 + [0.1],
        site_names=["body"], site_joint=[2], site_offset=[(1.0, 2.0, 3.0)],
        site_rotation=[((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))],
    )  # fmt: skip
    text = tmt.equations(
        tree, "c header", ["bias"], name="thing", parameters=["body", "gravity"], head=["Said first."]
    )
    lines = [line.strip(" *") for line in text.splitlines()]
    assert lines[0].strip("/* ") == "Said first." and "enum { thing_nq = 6, thing_nv = 5 };" in text
    assert "nq = 6 numbers in q, nv = 5 in qd and tau, m = 1 bodies: body." in lines
    assert lines[lines.index("a, slide, 0, 0; m, m/s, N") :][:3] == [
        "a, slide, 0, 0; m, m/s, N", "b, ball, 1-4, 1-3; quaternion w x y z, rad/s in its own axes, N m",
        "c, hinge, 5, 4; rad, rad/s, N m",
    ]  # fmt: skip
    found = dict(re.findall(r"(\w+): .*: \[(.*)\]", text))
    numbers = {name: [float(x) for x in values.split(",")] for name, values in found.items()}
    assert numbers["body_mass"] == [1.0] and numbers["gravity"] == [0.0, 0.0, -9.81]
    assert np.allclose(
        numbers["body_com"], (-1.8, 0.7, -2.9), atol=1e-15
    )  # x of the frame is y of the joint's
    assert np.allclose(numbers["body_inertia"], (2.0, 1.0, 2.5, 0.0, 0.0, 0.0), atol=1e-15)
    other = tmt.equations(replace(tree, mass=[1.0 + 2.0**-52]), "c header", ["bias"], name="thing")
    digests = [re.search("sha256 ([0-9a-f]{16})", version)[1] for version in (text, other)]
    assert digests[0] != digests[1]
