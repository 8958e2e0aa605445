"""Wrong verdicts of a fleet, and wrong decisions what to compute."""

from ..edit import Edit

EDITS = (
    Edit("fleet.table", "row_of_file", "outcome, reasons = DIFFER, _1", "outcome, reasons = AGREE, _1",
         "a file that differs agrees"),
    Edit("fleet.table", "row_of_file", "outcome, reasons = BROKE, []", "outcome, reasons = AGREE, []", "what broke off agrees"),
    Edit("fleet.table", "row_of_file", "reasons += _1 if unfinished else []", "reasons += []",
         "what differs hides what broke off"),
    Edit("fleet.run", "Run.start", "_1, own_hash, *others", "_1, own_hash", "a file with other parts is a copy"),
    Edit("fleet.executors", "guarded", "(code := error.exitcode) != KILLED", "(code := error.exitcode)",
         "no killed process is tried again"),
    Edit("fleet.table", "own_step", "all(stable)", "any(stable)", "one posture at which the step is stable is enough"),
    Edit("fleet.table", "own_step", "min(limits, default=None)", "max(limits, default=None)", "the largest of the limits"),
    Edit("fleet.table", "own_step", 'row["integrator"] == row["file_integrator"]', "True", "limits of any integrator"),
    Edit("fleet.models", "lines_of", "'#@'", "'#'", "a list names further lists"),
    Edit("export.command", "identifier", "_1 and not is_word(name)", "_1", "a function is named like a word of its language"),
    Edit("fleet.table", "order", "VERDICTS.index", "VERDICTS[::-1].index", "what agrees comes first"),
    Edit("fleet.table", "row_of_file", 'reference.kind == "model"', "False", "what was compared with itself agrees"),
    Edit("fleet.table", "row_of_file", "NOT_JUDGED if not_judged else outcome", "outcome", "what was not judged agrees"),
    Edit("fleet.run", "Run.start", "if is_row(row):\n _1\n _2", "if row:\n _1\n _2", "what lies in a folder is a row"),
    Edit("fleet.table", "row_of_file", "UNCONFIRMED if unconfirmed else _1", "_1", "what no run confirms agrees"),
    Edit("fleet.run", "Run.start", "hashlib.sha256(content)", "hashlib.sha256(name.encode())",
         "changes of models and meshes are forgotten"),
    Edit("fleet.run", "Run.start", "bundle(model) | self.sent", "bundle(model)", "another solution is the same"),
    Edit("fleet.table", "is_change", "abs(float(new) - float(old)) > MOVED * abs(float(old))", "False", "no limit has moved"),
    Edit("fleet.table", "is_change", "old != new", "False", "no verdict has changed"),
    Edit("fleet.run", "Run.is_good", "set(self.verdicts) & set(BAD_VERDICTS)", "False", "always good"),
    Edit("fleet.cache", "program", 'path.suffix in (".py", ".xml", ".html", ".js", ".jinja")', "False",
         "any program is the same"),
    Edit("fleet.run", "Run.receive", '{"verdict": BROKE, "reason": why}', '{"verdict": "agree"}', "a crash agrees"),
)  # fmt: skip
