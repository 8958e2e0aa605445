"""How cost grows with the number of joints, of the two smallest chains."""

import growth
import pandas
import pytest


@pytest.mark.slow
def test_costs_are_measured_and_drawn(tmp_path, monkeypatch):
    monkeypatch.setenv("TMT_CACHE", str(tmp_path / "store"))
    growth.main([2, 3], tmp_path)
    table = pandas.read_csv(tmp_path / "costs.csv")
    assert list(table.joints) == [2, 3] and (table > 0.0).all(axis=None)
    assert (tmp_path / "costs.png").stat().st_size > 5000
