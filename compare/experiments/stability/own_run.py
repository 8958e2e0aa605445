"""The file's own run: everything on, from its own starts, at one step, and at finer ones where it does not come to rest."""

from collections.abc import Iterable
from functools import partial

import numpy as np

from ...core.check import About, Result
from ...engines.mujoco import Reading
from ...engines.mujoco.names import on
from ...engines.mujoco.step import WholeRun, start_of, whole_run
from ...judge.run import number_or_none
from ...robots.case import SEED
from ...robots.file import names_of_keys
from ...stability.place import MOST_POSTURES
from ..setup import Setup
from .tables import OwnRunRow

LASTS, LEAST_STEPS, MOST_STEPS = 2.0, 1000, 20_000  # s, and between which numbers of steps it lasts
LONGER = 3.0  # fold: where it has not come to rest it is run so long
PARTS = 4  # of a run: the speeds of each are averaged
FINER = 16  # the step over the finer one
PUSH = (
    1e-6  # rad/s or m/s at the start, by chance: what rests exactly would stay where it is, however unstable
)
CALM = 1e-3  # rad/s or m/s, root of the mean square
FASTER = 10.0  # fold, than at the finer step: what moves on by the step alone
AT_OWN, AT_REQUESTED = "stable in its own run", "stable in its run"
ORDER = ("worse", "fails", "alike", "calm")  # of what is told first


def begin(setup: Setup, reading: Reading, dt: float, integrator: str) -> Iterable[OwnRunRow]:
    """Start the runs at a step."""
    starts = list(reading.keyframes)[:MOST_POSTURES] or [""]
    return setup.map(partial(own_run, dt=dt, integrator=integrator, reading=reading), starts)


def own_run(key: str, dt: float, integrator: str, reading: Reading) -> OwnRunRow:
    """What the file does from a keyframe (or from qpos0, if the name is empty): a row of own_run.csv.

    outcome: calm, it comes to rest; worse, it diverges or moves on, and at a finer step it does not; alike, it moves on there
    too; fails, it diverges there too.
    """
    push = PUSH * np.random.default_rng(SEED).normal(size=reading.model.nv)
    start, finer_dt = start_of(reading.model, reading.drive, key, push), dt / FINER
    lasts = float(np.clip(LASTS, LEAST_STEPS * dt, MOST_STEPS * dt))

    def run(step: float) -> WholeRun:
        with np.errstate(over="ignore", invalid="ignore"):
            return whole_run(reading.model, start, step, integrator, lasts, PARTS)

    own, outcome, finer = run(dt), "calm", None
    if not (is_calm(own) or own.failed_at):
        lasts *= LONGER
        own = run(dt)
    if not is_calm(own):
        finer = run(finer_dt)
        outcome = "worse" if is_worse(own, finer) else "fails" if own.failed_at else "alike"
    failed = own.failed_at is not None
    return OwnRunRow(
        start=names_of_keys(reading).get(key, "qpos0"), dt=dt, integrator=integrator, outcome=outcome,
        failed_at=own.failed_at, full_model_rms_speed=number_or_none(own.speeds[-1]),
        full_model_warnings=int(failed), full_model_resets=int(failed and on(reading.model, "AUTORESET")),
        full_model_calm=is_calm(own), finer_dt=finer and finer_dt,
        finer_rms_speed=finer and number_or_none(finer.speeds[-1]),
    )  # fmt: skip


def is_calm(run: WholeRun) -> bool:
    return bool(run.speeds[-1] < CALM)


def is_worse(own: WholeRun, finer: WholeRun) -> bool:
    """Whether a run diverges or moves on, and its step is the cause: ten times as fast as at the finer step.

    Of a run that moves on there too, as its fastest part.
    """
    speed = finer.speeds[-1] if is_calm(finer) else finer.speeds.max()
    return not finer.failed_at and not own.speeds[-1] <= max(CALM, FASTER * float(speed))


def add(result: Result, rows: list[OwnRunRow], is_requested: bool) -> None:
    """The rows, a check of each, and what is said of the worst start."""
    rows.sort(key=lambda row: (ORDER.index(row.outcome), row.failed_at is None))
    result.tables.setdefault("own_run", []).extend(rows)
    quantity, about = AT_REQUESTED if is_requested else AT_OWN, About.STEP
    for row in rows:
        note, passed = f"{1e3 * row.dt:.4g} ms with {row.integrator}", row.outcome in ("alike", "calm")
        result.check(row.start, quantity, 1 if passed else None, 1, "runs", note, rule="equal", about=about)
    others = sum(row.outcome == rows[0].outcome for row in rows[1:])
    result.top.append(
        result.finding("own_run", run=rows[0], requested=is_requested, others=others, calm=CALM)
    )
