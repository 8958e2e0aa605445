"""Edits of what a reader gets: the verdict, the report and its folder, the exit status."""

from ..edit import Edit

EDITS = (
    Edit("verdict", "failures", "section.result.checks", "section.result.checks[:60]", "60 checks of a section count"),
    Edit("verdict", "failures", "not check.passed", "check.passed is None", "nothing fails"),
    Edit("verdict", "failures", "sections", "sections[:1]", "only the first experiment counts"),
    Edit("verdict", "failures", "check.quantity == ENDS or _1", "True", "every failure is a run that broke off"),
    Edit("verdict", "worst", "max(_1, key=_2, default=None)", "min(_1, key=_2, default=None)", "the best check is the worst"),
    Edit("verdict", "verdict", "100 * top.over_bar", "top.over_bar", "a share as a percentage"),
    Edit("verdict", "verdict", "causes[0]['text']", "causes[-1]['text']", "the last cause comes first"),
    Edit("verdict", "outcome", "if differing:\n _1", "pass", "a section whose checks fail holds"),
    Edit("verdict", "answers.apart", "max(rows, key=_1)", "min(rows, key=_1)", "the smallest difference is the answer"),
    Edit("verdict", "answers.apart", "row['largest_difference'] is None", "False", "a diverged run is an answer"),
    Edit("verdict", "answers.printed", "values['tmt']", "values['mujoco']", "the answers name MuJoCo's numbers TMT's"),
    Edit("verdict", "answers.printed", "values['mujoco']", "values['tmt']", "the answers name TMT's numbers MuJoCo's"),
)  # fmt: skip
