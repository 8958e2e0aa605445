"""Wrong verdicts of a fleet, and wrong decisions what to compute."""

from ..edit import Edit

EDITS = (
    Edit("fleet.table", "row_of_file", 'outcome, reason = DIFFER, str(differing[0])',
         'outcome, reason = AGREE, ""', "a file that differs agrees"),
    Edit("fleet.table", "row_of_file", "outcome, reason = BROKE, _1", 'outcome, reason = AGREE, ""', "what broke off agrees"),
    Edit("fleet.table", "own_step", "all(stable)", "any(stable)", "one posture at which the step is stable is enough"),
    Edit("fleet.table", "own_step", "min(limits, default=None)", "max(limits, default=None)", "the largest of the limits"),
    Edit("fleet.table", "own_step", 'row["integrator"] == row["file_integrator"]', "True", "limits of any integrator"),
    Edit("fleet.table", "order", "VERDICTS.index", "VERDICTS[::-1].index", "what agrees comes first"),
    Edit("fleet.table", "row_of_file", 'reference.kind == "model"', "False", "what was compared with itself agrees"),
    Edit("fleet.table", "row_of_file", "UNCONFIRMED if unconfirmed else _1", "_1", "what no run confirms agrees"),
    Edit("fleet.models", "Model.is_copy_of", "needs(self) == needs(other)", "True", "meshes of copies are forgotten"),
    Edit("fleet.file_tasks", "FleetOptions.key", "self.solution_hash", '""', "another solution is the same"),
    Edit("fleet.table", "changed_parts", "abs(after - before) > MOVED * abs(before)", "False", "no limit has moved"),
    Edit("fleet.table", "changed_parts", 'old["verdict"] != row["verdict"]', "False", "no verdict has changed"),
    Edit("fleet.progress", "Progress.is_good", "set(self.verdicts()) & set(BAD_VERDICTS)", "False", "always good"),
    Edit("fleet.models", "Model.hash", "self.contents()", '{"": self.path.read_bytes()}', "meshes are forgotten"),
    Edit("fleet.cache", "program", 'path.suffix in (".py", ".xml", ".html", ".js", ".jinja")', "False",
         "any program is the same"),
    Edit("fleet.file_tasks", "broken", 'result.check("", ENDS, None, *_1)',
         'result.check("", ENDS, 0.0, *_1)',
         "an experiment that gave nothing counts for nothing"),
    Edit("fleet.pool", "Pool.choice", "any(task.timed for task in running)", "False", "others begin beside a timed task"),
    Edit("fleet.pool", "Pool.choice", "self.waiting[first].timed and running", "False", "a timed task begins beside others"),
    Edit("fleet.pool", "Pool.work", "range(1, MAX_TRIES + 1)", "range(1, 2)", "nothing is tried again"),
)  # fmt: skip
