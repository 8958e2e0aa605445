"""What is written of a whole fleet: the sentences at its top, its rows in their order, and where it was computed."""

import csv
from collections import Counter
from types import SimpleNamespace

from compare.fleet.table import csv_of_fleet, sentences_of, with_why_itself, write_table

ROW = {
    "file": "a.xml", "sha256": "1", "verdict": "agree", "reason": "", "joints": 3, "worst_ratio": 0.1,
    "file_integrator": "Euler", "file_dt_s": 0.002, "stable_at_file_dt": None, "limit_s": None, "seconds": 1.0,
    "has_report": True, "report_of": "a.xml", "reference": "arm", "why_itself": "",
}  # fmt: skip


def run_of(rows, **more):
    given = {"rows": rows, "parts": [], "took": {"mass": [(3, 5.0)]}, "workers": 2, "machines": {"b", "a"}, "no_timing": None,
             "done_before": 0, "pieces_before": 0, "door": SimpleNamespace(times_alone=True)}  # fmt: skip
    return SimpleNamespace(**given | {"verdicts": lambda: Counter(row["verdict"] for row in rows)} | more)


def said_of(rows, left_out=(), **more):
    return sentences_of(rows, left_out, run_of(rows, **more))


def test_the_sentences_count_verdicts_and_name_whose_own_step_is_not_stable():
    verdicts = ("differ", "broke", "broke", "refused", "unconfirmed", "agree", "agree")
    rows = [ROW | {"verdict": verdict} for verdict in verdicts]
    assert said_of(rows) == [
        "7 files: 1 differs, 2 broke off, 1 has a prediction that is not confirmed, 1 was refused, 2 agree."
    ]
    rows = [ROW | {"file": f"{k}.xml", "stable_at_file_dt": False} for k in range(5)]
    assert said_of([*rows[:1], ROW, ROW | {"stable_at_file_dt": True}])[1:] == ["Not stable at its own step: 0.xml."]
    assert said_of(rows)[1:] == ["Not stable at their own step: 0.xml, 1.xml, 2.xml and 2 more."]


def test_the_sentences_say_what_is_left_out_not_timed_and_known_from_before():
    assert said_of([ROW], [("p.xml", "it is a part")], no_timing="nobody may", done_before=1)[1:] == [
        "Left out: 1 file, each with its reason in index.html.",
        "Experiments that measure time are left out: nobody may.",
        "Known from before: 1 file.",
    ]
    assert said_of([ROW], done_before=2, pieces_before=1)[1:] == ["Known from before: 2 files and 1 piece of others."]


def test_what_is_compared_with_itself_is_counted_apart_and_has_the_reason_beside_files_with_stated_numbers():
    itself = ROW | {
        "verdict": "self-consistent",
        "reference": "model",
        "why_itself": "joint x is not y",
        "reason": "slow",
    }
    assert said_of([itself, itself, ROW])[0] == "3 files: 2 are self-consistent, 1 agrees."
    assert len(said_of([itself, ROW])) == 2 == 1 + len(said_of([ROW]))
    reasons = [row["reason"] for row in with_why_itself([itself, ROW])]
    assert reasons == ["joint x is not y: compared with its own compiled model only; slow", ""]
    assert with_why_itself([itself]) == [itself]


def test_rows_are_in_their_order_and_parts_and_machines_are_in_the_page(tmp_path):
    rows = [ROW, ROW | {"file": "b.xml", "verdict": "differ"}, ROW | {"file": "c.xml", "stable_at_file_dt": False}]
    run = run_of(rows, parts=[("late.xml", "no model of its own")])
    said = write_table(tmp_path, run, [("early.xml", "it is a part")], None, "the command", 10.0)
    with (tmp_path / "fleet.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    assert [row["file"] for row in table] == ["b.xml", "c.xml", "a.xml"]
    assert [row["stable_at_file_dt"] for row in table] == ["", "false", ""]
    assert said[-1] == "Of 2 x 10 s 25 % were computing, 75 % were neither." and "Left out: 2 files" in said[-2]
    text = (tmp_path / "index.html").read_text()
    for part in ("late.xml: no model of its own.", "early.xml: it is a part.", "<td>a, b</td>", "<td>the command</td>"):
        assert part in text
    assert text.index(">b.xml<") < text.index(">c.xml<") < text.index(">a.xml<")


def test_what_is_known_from_before_needed_no_machine(tmp_path):
    said = write_table(tmp_path, run_of([ROW], took={}, machines=set(), done_before=1), [], [], "the command", 1.0)
    assert said == ["1 file: 1 agrees.", "Known from before: 1 file."]
    assert "<td>none was needed</td>" in (tmp_path / "index.html").read_text()


def test_the_table_writes_true_and_false_in_small_letters():
    assert (
        csv_of_fleet([ROW | {"stable_at_file_dt": True}]).splitlines()[1]
        == "a.xml,1,agree,,3,0.1,Euler,0.002,true,,1.0"
    )
