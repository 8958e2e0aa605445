"""Made faults and the edits of the judge on a Dask cluster: as without it."""

import pytest
from mutations.__main__ import main
from mutations.campaign import Stage
from mutations.edit import Edit

from compare.experiments.diagnosis.fault_table import made_faults, rows_by_pieces, rows_in_parts
from compare.fleet.calls import door_opened
from compare.judge.check import Result

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module", name="address")
def address_of_scheduler():
    """A scheduler, and one worker in a process of its own that times."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, resources={"timing": 1}, dashboard_address=":0", silence_logs=50
    ) as cluster:
        yield cluster.scheduler_address


def without_seconds(table):
    return [{name: value for name, value in row.items() if name != "seconds"} for row in table]


def test_faults_have_the_same_rows(address):
    faults, result = [fault for fault in made_faults() if fault.kind == "sign"][:3], Result("diagnosis")
    with door_opened(address, None) as door:
        table = rows_by_pieces(result, faults, door, lambda done: None)
        assert door.no_timing() is None
    assert not result.checks
    assert without_seconds(table) == without_seconds(rows_in_parts(faults, map, lambda done: None))


def test_edits_are_tried_on_a_copy_that_is_sent(address, tmp_path, capfd):
    for name, text in {
        "compare/rules.py": "def passed(value):\n    return value <= 1.0\n\n\ndef width():\n    return 3\n",
        "tmt/rules.py": "",
        "tests/test_toy.py": "from compare.rules import passed\n\n\ndef test_it():\n    assert passed(0.5) and not passed(2)\n",
    }.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    edits = Edit("rules", "passed", "1.0", "9.0", "always"), Edit("rules", "width", "3", "4", "wider")
    assert main(["--dask", address], tmp_path, edits, lambda project: [Stage(["tests/test_toy.py"])]) == 1
    out = capfd.readouterr().out
    assert "always: caught by tests/test_toy.py::test_it" in out and "wider: SURVIVED" in out
    assert out.endswith("2 edits: 1 caught, 0 declared harmless, 1 survived\n")
