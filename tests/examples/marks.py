"""Points for each report of a fleet, by the experiments and checks that pass: a rubric as a script.
Run it beside `fleet`: python marks.py reports/fleet"""

import csv
import json
import sys
from pathlib import Path

from compare.fleet.models import place_of_report

POINTS = {"parameters": 4, "mass: Mbar": 2, "gravity": 1}  # of an experiment, or of one of its checks

folder = Path(sys.argv[1])
with open(folder / "fleet.csv", encoding="utf-8", newline="") as file:
    for row in csv.DictReader(file):
        results = folder / place_of_report(row["same_as"] or row["file"]) / "results.json"
        checks = json.loads(results.read_text(encoding="utf-8"))["checks"] if results.exists() else []
        points = 0
        for name, worth in POINTS.items():
            experiment, _, quantity = name.partition(": ")
            of_name = [check for check in checks if check["experiment"] == experiment]
            of_name = [check["passed"] for check in of_name if quantity in ("", check["quantity"])]
            points += worth * (bool(of_name) and all(of_name))
        print(f"{row['file']}: {points} of {sum(POINTS.values())}")
