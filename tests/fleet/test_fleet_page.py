"""The page of a fleet: every row leads to its report, nothing of a name is taken for HTML, and one picture where it helps."""

import html
import re
from urllib.parse import unquote

from compare.fleet.figures_fleet import MOST_NAMED_FILES, draw_steps
from compare.fleet.models import place_of_report
from compare.fleet.page import fleet_page
from compare.fleet.table import picture_of_steps

ROW = {
    "file": "a.xml", "sha256": "1", "verdict": "agree", "reason": "", "joints": 3, "worst_ratio": 0.123456,
    "file_integrator": "Euler", "file_dt_s": 0.002, "stable_at_file_dt": True, "limit_s": 0.0123456, "seconds": 1.26,
    "has_report": True, "report_of": "a.xml", "reference": "arm",
}  # fmt: skip
EMPTY = dict.fromkeys(("joints", "worst_ratio", "file_integrator", "file_dt_s", "stable_at_file_dt", "limit_s"))
NAMES = ["with space.xml", "ümlaut/x.xml", "a#b.xml", "a%41b.xml", "it's \"q\".xml", "<b>.xml", "&amp;.xml", "q?x=1.xml",
         "by\\xff.xml", "new\\nline.xml", "c:d;e.xml", "../up.xml", "/far/away.xml", "$title.xml"]  # fmt: skip


def page_of(rows, **more):
    given = {"said": ["1 file: 1 agrees."], "left_out": [], "changed": None, "origin": {"command": "x"}} | more
    return fleet_page(
        "A fleet", given["said"], rows, given["left_out"], given["changed"], given["origin"], more.get("picture")
    )


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
    assert "<b>" not in text and "$" in text


def test_a_file_without_a_report_has_no_link():
    text = page_of([ROW | EMPTY | {"verdict": "refused", "reason": "<script>", "has_report": False}])
    assert '<th scope="row">a.xml</th>' in text and "<script>" not in text
    assert cells(text, "reason") == ["&lt;script&gt;"]
    assert [cells(text, name) for name in ("joints", "worst_ratio", "limit_s", "stable_at_file_dt")] == [[""]] * 4


def test_numbers_are_short_and_have_units():
    text = page_of([ROW, ROW | {"stable_at_file_dt": False, "worst_ratio": 3e14}])
    assert cells(text, "file_dt_s") == ["2", "2"] and cells(text, "limit_s") == ["12.35", "12.35"]
    assert cells(text, "worst_ratio") == ["0.12", "3e+14"] and cells(text, "seconds") == ["1.3", "1.3"]
    assert cells(text, "stable_at_file_dt") == ["yes", "no"]
    assert re.findall(r'<tr class="(\w+)">', text) == ["good", "bad"]


def test_the_verdict_says_whether_a_file_differs():
    assert '<div class="verdict good">' in page_of(
        [ROW, ROW | {"verdict": "refused"}, ROW | {"stable_at_file_dt": False}]
    )
    for verdict in ("differ", "broke", "unconfirmed"):
        assert '<div class="verdict bad">' in page_of([ROW, ROW | {"verdict": verdict}])


def test_what_changed_and_what_is_left_out_stand_in_lists():
    text = page_of([ROW], changed=["a<b.xml: new, agree"], left_out=[("p&q.xml", "it is a part")])
    assert "<li>a&lt;b.xml: new, agree</li>" in text and "<li>p&amp;q.xml: it is a part.</li>" in text
    assert text.index("What has changed") < text.index('id="files"') < text.index("Left out")
    assert "<li>Nothing.</li>" in page_of([ROW], changed=[])
    plain = page_of([ROW])
    assert "What has changed" not in plain and "Left out" not in plain and "<img" not in plain


def test_nothing_that_is_said_is_taken_for_html():
    words = ["t1", "s1", "n1", "v1", "c1", "w1", "r1"]
    title, said, name, value, caption, why, reason = (f'<{word}>&"' for word in words)
    text = fleet_page(
        title, [said], [ROW | {"reason": reason}], [("a", why)], None, {name: value}, (b"", caption, (2, 2))
    )
    for word in words:
        assert f"<{word}>" not in text and f"&lt;{word}&gt;&amp;&quot;" in text


def test_what_differs_or_broke_off_stands_out_and_what_was_refused_does_not():
    text = page_of(
        [
            ROW | {"verdict": verdict}
            for verdict in ("differ", "broke", "unconfirmed", "refused", "self-consistent", "agree")
        ]
    )
    assert re.findall(r'<tr class="(\w+)">', text) == ["bad", "bad", "bad", "none", "none", "good"]


def many(count):
    return [
        ROW | {"file": f"robots_of_a_long_collection/robot_{k}/$robot_{k}.xml", "limit_s": 1.5e-3 + 1e-3 * k}
        for k in range(count)
    ]


def test_the_picture_has_a_point_for_each_file_with_a_limit():
    assert draw_steps([ROW, ROW | {"limit_s": None}]) is None and picture_of_steps([ROW]) is None
    for count in (2, MOST_NAMED_FILES, MOST_NAMED_FILES + 1, 400):
        _, figure, caption = draw_steps([*many(count), ROW | {"limit_s": None}])
        ax = figure.axes[0]
        points = {line.get_label(): line.get_xdata() for line in ax.lines if line.get_marker() != "None"}
        assert sum(map(len, points.values())) == count
        assert max(points["within its limit"]) <= 1.0 < min(points["above it"])
        assert (len(ax.get_yticks()) == count) == (count <= MOST_NAMED_FILES)
        assert figure.get_size_inches()[1] < 10.0 and f"{count} of {count + 1} files" in caption


def test_the_picture_is_in_the_page():
    rows = many(3)
    data, caption, (width, height) = picture_of_steps(rows)
    assert data.startswith(b"\x89PNG") and width > height
    text = page_of(rows, picture=(data, caption, (width, height)))
    assert text.count("<img") == 1 and 'src="data:image/png;base64,' in text and html.escape(caption) in text
