"""What has changed since an earlier fleet."""

import pytest

from compare.fleet.piece import FleetError
from compare.fleet.row import FLEET_COLUMNS
from compare.fleet.since import changes, earlier
from compare.fleet.table import csv_of_fleet

ROW = {
    "file": "a b.xml", "sha256": "1", "verdict": "agree", "reason": "", "joints": 3, "worst_ratio": 0.1,
    "file_integrator": "Euler", "file_dt_s": 0.002, "stable_at_file_dt": True, "limit_s": 0.01, "seconds": 1.0,
}  # fmt: skip


def since(tmp_path, before, now):
    (tmp_path / "fleet.csv").write_text(csv_of_fleet([ROW | row for row in before]), encoding="utf-8")
    return changes(earlier(tmp_path), [ROW | row for row in now])


@pytest.mark.parametrize("before, now, says", [
    ({}, {}, None),
    ({}, {"seconds": 99.0, "worst_ratio": 0.9, "sha256": "2", "reason": "other"}, None),
    ({}, {"verdict": "differ", "reason": "mass of x"}, "a b.xml: agree before, now differ: mass of x"),
    ({"verdict": "differ"}, {}, "a b.xml: differ before, now agree"),
    ({}, {"stable_at_file_dt": False}, "a b.xml: at its own step stable before, now not stable"),
    ({"stable_at_file_dt": None}, {"stable_at_file_dt": False}, "a b.xml: at its own step not known before, now not stable"),
    ({"stable_at_file_dt": False}, {"stable_at_file_dt": None}, "a b.xml: at its own step not stable before, now not known"),
    ({}, {"limit_s": 0.010099}, None),
    ({}, {"limit_s": 0.009901}, None),
    ({}, {"limit_s": 0.010101}, "a b.xml: limit 10 ms before, now 10.1 ms"),
    ({}, {"limit_s": 0.009899}, "a b.xml: limit 10 ms before, now 9.899 ms"),
    ({}, {"limit_s": None}, "a b.xml: limit 10 ms before, now none"),
    ({"limit_s": None}, {}, "a b.xml: limit none before, now 10 ms"),
    ({"limit_s": None}, {"limit_s": None}, None),
    ({"limit_s": 0.0}, {"limit_s": 0.0}, None),
    ({"limit_s": 0.0}, {}, "a b.xml: limit 0 ms before, now 10 ms"),
    ({}, {"verdict": "broke", "limit_s": 1.0, "sha256": "2"},
     "a b.xml: agree before, now broke; limit 10 ms before, now 1000 ms (the file has changed)"),
])  # fmt: skip
def test_a_verdict_a_step_or_a_limit_that_is_another(before, now, says, tmp_path):
    assert since(tmp_path, [before], [now]) == ([says] if says else [])


def test_files_that_are_new_and_files_that_are_gone(tmp_path):
    found = since(
        tmp_path, [{}, {"file": "old.xml", "verdict": "broke"}], [{}, {"file": "new.xml", "verdict": "refused"}]
    )
    assert found == ["new.xml: new, refused", "old.xml: gone, broke before"]


@pytest.mark.parametrize("content, says", [
    (None, "cannot read .*fleet.csv: No such file or directory; the folder of an earlier fleet is expected"),
    (b"a,b\n1,2\n", r".*fleet.csv is not of a fleet: it has not the columns file, sha256, "),
    (b"", r".*fleet.csv is not of a fleet: "),
    (b"\xff\xfe\x00", "cannot read .*fleet.csv: it is no table of a fleet; "),
    ((",".join(FLEET_COLUMNS) + "\na,1,agree,,1,1,Euler,1,true,soon,1\n").encode(), "cannot read .*: it is no table of a fleet"),
])  # fmt: skip
def test_what_is_no_earlier_fleet_is_refused_in_one_line(content, says, tmp_path):
    if content is not None:
        (tmp_path / "fleet.csv").write_bytes(content)
    with pytest.raises(FleetError, match=says) as refused:
        earlier(tmp_path)
    assert len(str(refused.value).splitlines()) == 1
