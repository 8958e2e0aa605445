"""The table of a fleet as a page and as CSV, its sentences, and the estimate of how long a fleet takes still."""

import csv
import html
import re
from collections import Counter
from types import SimpleNamespace
from urllib.parse import unquote

import pytest

from compare.fleet.figures_fleet import MOST_NAMED_FILES, draw_steps
from compare.fleet.models import place_of_report
from compare.fleet.page import fleet_page
from compare.fleet.row import FLEET_COLUMNS
from compare.fleet.table import picture_of_steps, sentences_of, write_table
from compare.fleet.times import time_of_workers

ROW = {
    "file": "a.xml", "sha256": "1", "verdict": "agree", "reason": "", "joints": 3, "worst_ratio": 0.123456,
    "file_integrator": "Euler", "file_dt_s": 0.002, "stable_at_file_dt": True, "limit_s": 0.0123456, "seconds": 1.26,
    "has_report": True, "report_of": "a.xml", "reference": "arm", "why_itself": "",
}  # fmt: skip
EMPTY = dict.fromkeys(("joints", "worst_ratio", "file_integrator", "file_dt_s", "stable_at_file_dt", "limit_s"))
NAMES = ["with space.xml", "ümlaut/x.xml", "a#b.xml", "a%41b.xml", "it's \"q\".xml", "<b>.xml", "&amp;.xml", "q?x=1.xml",
         "by\\xff.xml", "new\\nline.xml", "c:d;e.xml", "../up.xml", "/far/away.xml", "$title.xml"]  # fmt: skip


def page_of(rows, left_out=(), changed=None, picture=None):
    return fleet_page("A fleet", ["1 file."], rows, left_out, changed, {"command": "x"}, picture)


def cells(text, name):
    return re.findall(rf'<td class="\w+ {name}"[^>]*>(.*?)</td>', text)


def test_every_name_leads_to_its_report():
    text = page_of([ROW | {"file": name, "report_of": name} for name in NAMES])
    links = re.findall(r'<th scope="row"><a href="([^"]*)">(.*?)</a></th>', text)
    assert [html.unescape(name.replace("<wbr>", "")) for _, name in links] == NAMES
    for (address, _), name in zip(links, NAMES, strict=True):
        address = html.unescape(address)
        assert not set(address) & set("#?\"'<> ") and ":" not in address  # no fragment, no scheme
        assert unquote(address) == f"{place_of_report(name)}/index.html"


def test_numbers_are_short_and_have_units_and_what_is_not_known_is_empty():
    refused = ROW | EMPTY | {"verdict": "refused", "has_report": False, "file": "b.xml"}
    text = page_of([ROW, ROW | {"stable_at_file_dt": False, "worst_ratio": 3e14}, refused])
    assert cells(text, "file_dt_s") == ["2", "2", ""] and cells(text, "limit_s") == ["12.35", "12.35", ""]
    assert cells(text, "worst_ratio") == ["0.12", "3e+14", ""] and cells(text, "seconds") == ["1.3", "1.3", "1.3"]
    assert len(set(cells(text, "stable_at_file_dt"))) == 3
    assert re.findall(r'<tr class="(\w+)">', text) == ["good", "bad", "none"] and '<th scope="row">b.xml</th>' in text


@pytest.mark.parametrize("verdict, of_row, of_page", [
    ("differ", "bad", "bad"), ("broke", "bad", "bad"), ("unconfirmed", "bad", "bad"), ("refused", "none", "good"),
    ("self-consistent", "none", "good"), ("agree", "good", "good"),
])  # fmt: skip
def test_the_verdict_says_whether_a_file_differs(verdict, of_row, of_page):
    text = page_of([ROW, ROW | {"verdict": verdict}])
    assert f'<div class="verdict {of_page}">' in text
    assert re.findall(r'<tr class="(\w+)">', text) == ["good", of_row]


def test_nothing_that_is_said_is_taken_for_html_and_lists_stand_where_they_are_asked_for():
    title, said, name, value, caption, why, reason, change = words = [f'<w{k}>&"' for k in range(8)]
    text = fleet_page(
        title, [said], [ROW | {"reason": reason}], [("a", why)], [change], {name: value}, (b"", caption, (2, 2))
    )
    for k in range(len(words)):
        assert f"<w{k}>" not in text and f"&lt;w{k}&gt;&amp;&quot;" in text
    places = [text.index(f"&lt;w{k}&gt;") for k in (7, 6, 5)]
    assert places == sorted(places)  # what changed, the files, what is left out
    lists = [page_of([ROW], changed=changed).count("<li>") for changed in (None, [], ["a.xml: new", "b.xml: new"])]
    assert lists == [0, 1, 2] and "<img" not in page_of([ROW])


@pytest.mark.parametrize("count", [2, MOST_NAMED_FILES, MOST_NAMED_FILES + 1])
def test_the_picture_has_a_point_for_each_file_with_a_limit(count):
    rows = [ROW | {"file": f"{'long/' * 20}${k}.xml", "limit_s": 1.5e-3 + 1e-3 * k} for k in range(count)]
    _, figure, caption = draw_steps([*rows, ROW | {"limit_s": None}])
    ax = figure.axes[0]
    points = [line.get_xdata() for line in ax.lines if line.get_marker() != "None"]
    shares = sorted(float(share) for line in points for share in line)
    assert shares == pytest.approx(sorted(row["file_dt_s"] / row["limit_s"] for row in rows))
    assert any(max(line) <= 1.0 for line in points) and any(min(line) > 1.0 for line in points)
    assert (len(ax.get_yticks()) == count) == (count <= MOST_NAMED_FILES) and f"{count} of {count + 1}" in caption
    assert picture_of_steps([ROW]) is None and picture_of_steps(rows)[0].startswith(b"\x89PNG")


def run_of(rows, **more):
    given = {"rows": rows, "parts": [], "took": {"mass": [(3, 5.0)]}, "workers": 2, "machines": {"b", "a"}, "no_timing": None,
             "done_before": 0, "pieces_before": 0, "door": SimpleNamespace(times_alone=True)}  # fmt: skip
    return SimpleNamespace(**given | {"verdicts": lambda: Counter(row["verdict"] for row in rows)} | more)


def test_rows_are_in_their_order_in_the_csv_and_in_the_page(tmp_path):
    rows = [ROW, ROW | {"file": "b.xml", "verdict": "differ"}, ROW | {"file": "c.xml", "stable_at_file_dt": False}]
    run = run_of(rows, parts=[("late.xml", "why")])
    said = write_table(tmp_path, run, [("early.xml", "because")], None, "the command", 10.0)
    with (tmp_path / "fleet.csv").open(newline="") as file:
        table = csv.DictReader(file)
        found = list(table)
    assert tuple(table.fieldnames) == FLEET_COLUMNS and [row["file"] for row in found] == ["b.xml", "c.xml", "a.xml"]
    assert [row["stable_at_file_dt"] for row in found] == ["true", "false", "true"] and found[0][
        "limit_s"
    ] == "0.0123456"
    text = (tmp_path / "index.html").read_text()
    assert all(part in text for part in ("late.xml", "early.xml", "a, b", "the command"))
    assert text.index(">b.xml<") < text.index(">c.xml<") < text.index(">a.xml<")
    assert re.findall(r"\d+ %", said[-1]) == ["25 %", "75 %"]


def test_the_sentences_count_verdicts_and_name_whose_own_step_is_not_stable():
    verdicts = ("differ", "broke", "broke", "refused", "unconfirmed", "agree", "agree", "agree")
    said = sentences_of([], [], run_of([ROW | {"verdict": verdict} for verdict in verdicts]))
    assert re.findall(r"\d+", said[0])[1:] == ["1", "2", "1", "1", "3"]  # in the order of the verdicts
    rows = [ROW | {"file": f"{k}.xml", "stable_at_file_dt": k < 0} for k in range(-1, 5)]
    (said,) = sentences_of(rows, [], run_of(rows))[1:]
    assert re.findall(r"\d\.xml|\d more", said) == ["0.xml", "1.xml", "2.xml", "2 more"]
    more = {"no_timing": "nobody may", "done_before": 7, "pieces_before": 5}
    said = sentences_of([ROW], [("p.xml", "why")] * 3, run_of([ROW], **more))
    assert len(said) == 4 and "3 files" in said[1] and "nobody may" in said[2] and "7 files and 5 pieces" in said[3]


@pytest.mark.parametrize("took, workers, whole, alone, shares", [
    ({"mass": [(2, 10.0), (3, 20.0)], "speed": [(2, 6.0)], "reduction": [(2, 4.0)]}, 2, 32.0, True, (40 / 64, 10 / 64)),
    ({"mass": [(2, 10.0), (3, 20.0)], "speed": [(2, 6.0)], "reduction": [(2, 4.0)]}, 2, 32.0, False, (40 / 64, 0.0)),
    ({"speed": [(1, 9.0)]}, 1, 10.0, True, (0.9, 0.0)),  # one worker waits for nobody
    ({"mass": [(1, 50.0)]}, 2, 10.0, True, (1.0, 0.0)),  # nothing is more than all
    ({}, 2, 10.0, True, (0.0, 0.0)),
])  # fmt: skip
def test_the_time_of_the_workers_is_computing_waiting_for_timings_or_neither(took, workers, whole, alone, shares):
    assert time_of_workers(took, workers, whole, alone) == pytest.approx((*shares, 1.0 - sum(shares)))
