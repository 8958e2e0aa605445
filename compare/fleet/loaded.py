"""What a process of a fleet has when it begins: all that a file needs is imported once, in the server that forks them."""

import importlib

from ..core.text import environment
from ..experiments import EXPERIMENTS, functions

for name in ("engines.outside.answers", "report.files", "report.style", "run.examine"):
    importlib.import_module(f"compare.{name}")
importlib.import_module("tmt.compiled.machine")
for experiment in EXPERIMENTS:
    functions(experiment)
for template in environment().list_templates(["jinja"]):
    environment().get_template(template)
