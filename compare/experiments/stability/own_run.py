"""The file's own run: everything on, from its own starts, at one step, and at finer ones where it does not come to rest."""

from collections.abc import Iterable
from functools import partial

from ...core.check import About, Result
from ...engines.mujoco import Reading
from ...engines.mujoco.names import on
from ...engines.mujoco.step import WholeRun
from ...judge.run import number_or_none
from ...robots.file import names_of_keys
from ...stability.place import MOST_POSTURES, Posture
from ...stability.start import CALM, StartRuns, is_calm
from ..setup import Setup
from .tables import OwnRunRow

FINER, MOST_FINER = 16, 60_000  # the step over the finer one, at most; steps of that run
FASTER = 10.0  # fold, than at the finer step: what moves on by the step alone
AT_OWN, AT_REQUESTED = "stable in its own run", "stable in its run"
ORDER = ("worse", "fails", "alike", "calm")  # of what is told first


def begin(setup: Setup, reading: Reading, dt: float, integrator: str) -> Iterable[OwnRunRow]:
    """Start the runs at a step."""
    starts = list(reading.keyframes)[:MOST_POSTURES] or [""]
    return setup.map(partial(own_run, dt=dt, integrator=integrator, reading=reading), starts)


def own_run(key: str, dt: float, integrator: str, reading: Reading) -> OwnRunRow:
    """What the file does from a keyframe (or from qpos0, if the name is empty): a row of own_run.csv.

    outcome: calm, it comes to rest where the posture rests; worse, it diverges, moves on, or comes to rest elsewhere, and at a
    finer step it does not; alike, it does so there too; fails, it diverges there too.
    """
    name = names_of_keys(reading).get(key, "qpos0")
    starts = StartRuns(reading, Posture(name, key), integrator)
    outcome, finer = "calm", None
    own, lasts = starts.until_rest(dt)
    finer_dt = dt / min(FINER, max(2, MOST_FINER // round(lasts / dt)))
    moved = starts.moved(own, lasts) if is_calm(own) else None
    if moved is None or moved.is_elsewhere:
        finer = starts.run(finer_dt, lasts)
        worse = is_worse(own, finer) if moved is None else ends_at_rest(starts, finer, lasts)
        outcome = "worse" if worse else "fails" if own.failed_at else "alike"
    failed = own.failed_at is not None
    return OwnRunRow(
        start=name, dt=dt, integrator=integrator, outcome=outcome,
        failed_at=own.failed_at, full_model_rms_speed=number_or_none(own.speeds[-1]),
        full_model_warnings=int(failed), full_model_resets=int(failed and on(reading.model, "AUTORESET")),
        full_model_calm=is_calm(own), finer_dt=finer and finer_dt,
        finer_rms_speed=finer and number_or_none(finer.speeds[-1]),
        moved=moved and moved.by, moved_joint=moved.joint if moved else "",
        rests_elsewhere=bool(moved and moved.is_elsewhere), has_fallen=bool(moved and moved.has_fallen),
    )  # fmt: skip


def ends_at_rest(starts: StartRuns, run: WholeRun, lasts: float) -> bool:
    """Whether a run ends where its posture rests, still or nearly so."""
    return not run.failed_at and not starts.moved(run, lasts).is_elsewhere


def is_worse(own: WholeRun, finer: WholeRun) -> bool:
    """Whether a run diverges or moves on, and its step is the cause: ten times as fast as at the finer step.

    Of a run that moves on there too, as its fastest part.
    """
    speed = finer.speeds[-1] if is_calm(finer) else finer.speeds.max()
    return not finer.failed_at and not own.speeds[-1] <= max(CALM, FASTER * float(speed))


def add(result: Result, rows: list[OwnRunRow], is_requested: bool) -> list[OwnRunRow]:
    """Add the rows and a check of each; those with the worst outcome."""
    rows.sort(key=lambda row: (ORDER.index(row.outcome), row.failed_at is None))
    result.tables.setdefault("own_run", []).extend(rows)
    quantity, about = AT_REQUESTED if is_requested else AT_OWN, About.STEP
    for row in rows:
        note, passed = f"{1e3 * row.dt:.4g} ms with {row.integrator}", row.outcome in ("alike", "calm")
        result.check(row.start, quantity, 1 if passed else None, 1, "runs", note, rule="equal", about=about)
    return [row for row in rows if row.outcome == rows[0].outcome]
