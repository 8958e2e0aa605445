"""Results made for the first screen: rows of runs, times and limits; and its pictures."""

from compare.judge.check import Result
from compare.report import figures_overview
from compare.robots.arm import ARM

RUN = {"scene": "a", "level": "open loop", "difference_over_band": 0.2, "judged_until_s": 3.0, "diverged_at_s": None}


def timed(engine, method, seconds, error, **more):
    return {"scene": "s", "engine": engine, "method": method, "seconds": seconds, "worst_error_rad": error, "why_not": None,
            "diverged": False} | more  # fmt: skip


def limits(*observed):
    row = {"scene": "s", "engine": "tmt", "method": "rk4", "damping": 0.5, "limit": "finite", "predicted_dt_s": 0.1}
    rows = [row | {"observed_dt_s": value} for value in observed] + [row | {"scene": "saddle", "observed_dt_s": 0.1}]
    return Result("stability", rows=rows, curves={"looked at": {"centres": ("s",)}, "schemes": {("tmt", "rk4"): "rk4"}})


def drawn(experiment, result):
    return [call() for call in figures_overview.pictures(experiment, {experiment: result}, ARM)]
