"""Which step holds: a motion of a file, pushed, at many steps, beside runs of fine steps. One definition for every robot.

- A run starts where the file starts. At t = 0 every speed is changed by a push, with one of four patterns of
  signs.
- The fine run without a push shows whether the robot rests: slower than STILL in its last quarter. Still, after a
  push, is no faster than that and half of the push (STILLER to STILL).
- Truth is the same run at fine steps, by the file's integrator, by Euler's or by implicitfast, whichever first rests after the
  usual push. A fine run that is not finite is refined up to three times; if it never is, nothing is judged.
- The usual push is 0.1 rad/s or m/s, or the largest up to which fine runs come to rest, or coast no faster than
  the push.
- The longest step that is found is tried with eight further patterns, in longer runs, and so is one that is shorter
  by 6 %. 8 % above the one that fails, a third of all patterns fail: in between it depends on the push.
- A step holds if after each pattern the run, or one three times as long, is as still at its end as fine runs are,
  grows no more, and ends where they do; what is free may slide and turn on its floor. Where fine runs of two
  steps or patterns end elsewhere the place is chance, and is not judged.
- What coasts (no damping, a keyframe with speeds, recorded controls) is judged joint by joint: nowhere faster than
  three times the fine run, or the push. What moves on by itself is judged by divergence alone: not finite, or
  ten times as fast as fine runs.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from .motion import Motion
from .runs import CALM, FAST, MORE_WAYS, STILL, WAYS, Run, Runs, Trial
from .search import largest

PUSHES = (0.001, 0.01, 0.03, 0.1, 0.3, 1.0)  # rad/s or m/s, of every speed
USUAL = 0.1  # of these pushes
BELOW, ABOVE, ROUNDS = 0.94, 1.08, 8  # of the step found, of one that fails, and how far up that is sought
COASTS, AS_FAST = 1.5, 3.0  # fold of a push, fold of a fine run
GROWS = 1.05  # fold, from the middle to the last third of a run
LONGER, SURELY = 3.0, 4.0 / 3.0  # fold: the run that shows whether it goes on, and those of further patterns
ELSEWHERE, EARLY = 0.3, 0.5  # rad or m; s: judged where the end is chance
WITHIN = 1.06  # fold


class Verdict(NamedTuple):
    """What runs of a step show.

    why: how it fails, diverges, moves, grows or elsewhere; "": it holds. way: the pattern of signs that
    decides; dof: what moves first. speed: the largest at the end; apart: from fine runs, on the way. kept:
    the largest share of the speed of fine runs that coast, else None.
    """

    why: str
    way: int
    dof: int
    speed: float
    apart: float
    kept: float | None

    @property
    def holds(self) -> bool:
        return not self.why


class Limit(NamedTuple):
    """The longest step that holds and the shortest that fails, s; None: none down to, or up to, what is tried."""

    stable_up_to: float | None
    fails_at: float | None
    dof: int | None  # of the run that fails


class Pushed(Runs):
    """A motion after pushes, judged. asked: the push, rad/s or m/s; None: the usual one; else see Runs."""

    def __init__(
        self, motion: Motion, dt: float, integrator: str, asked: float | None = None, period: float = 0.0,
        delay: float = 0.0,
    ) -> None:  # fmt: skip
        super().__init__(motion, dt, integrator, period, delay)
        self.asked, self.survived = asked, 0.0
        self.tried, self.surely = dict[Trial, Verdict](), set[Trial]()

    # fine runs

    def comes_to_rest(self, push: float) -> bool:
        """Whether fine runs come to rest after a push, or coast no faster than it."""
        most = max(self.still(push), COASTS * push)
        return all(run.speed <= most for run in self.fine_runs(push))

    def survives_up_to(self, most: float) -> float:
        """The largest push up to which fine runs come to rest, at most `most`; 0.0: none. By the truth of now."""
        usual, survived = self.asked or USUAL, 0.0
        if not self.unpushed.speed <= STILL:
            return survived
        pushes = [usual, *(push for push in PUSHES if usual < push <= most)]
        if not self.comes_to_rest(usual):
            pushes = [push for push in PUSHES if push < usual and not self.asked]
        for push in pushes:
            if not self.comes_to_rest(push):
                break
            survived = push
        return survived

    def find_truth(self, most: float = USUAL) -> None:
        """Find the integrator of fine runs, which first rests, and the largest push that they survive."""
        found = {}
        for name in dict.fromkeys((self.integrator, "Euler", "implicitfast")):
            self.truth, self.fine, self.by_twice = name, {}, {}
            found[name] = self.survives_up_to(most), self.fine, self.by_twice
            if found[name][0] >= (self.asked or USUAL):
                break
        self.truth = max(found, key=lambda name: found[name][0])
        self.survived, self.fine, self.by_twice = found[self.truth]

    @property
    def push(self) -> float:
        """The push by which steps are judged, rad/s or m/s."""
        return self.asked or min(USUAL, self.survived) or USUAL

    @property
    def rests(self) -> bool:
        return self.survived > 0.0

    @property
    def judged_by(self) -> str:
        """rest; speed, of what coasts or is in motion; divergence; falls, after a stated push; "": no fine run is finite."""
        fine = self.fine_runs(self.push)
        if not all(run.is_finite for run in fine):
            return ""
        if not self.rests and self.asked and self.unpushed.speed <= STILL:
            return "falls"
        if not (self.rests or self.is_in_motion):
            return "divergence"
        return "rest" if self.rests and all(run.speed <= self.still(self.push) for run in fine) else "speed"

    # other steps

    def verdict(self, trial: Trial) -> Verdict:
        """What runs of a step show after a push of each pattern."""
        if trial in self.tried:
            return self.tried[trial]
        push, is_chance, runs = trial.push, self.place_is_chance(trial.push), list[Run]()
        distances, kept, why, dof = list[float](), list[float](), "", -1
        for way, fine in enumerate(self.fine_runs(push)):
            fast = max(FAST, 10.0 * float(fine.most.max()))
            run = self.run(trial, way, fast)
            why = self.failure(run, fine, push, is_chance)
            if why in ("moves", "grows"):  # a longer run shows whether it goes on
                run = self.run(trial, way, fast, LONGER * self.lasts)
                why = self.failure(run, fine, push, is_chance)
            runs.append(run)
            if not fine.speed <= self.still(push):
                kept.append(run.speed / fine.speed)
            distances.append(self.along(run, fine, EARLY if is_chance else np.inf))
            if why:
                dof = self.first(run, fine.most, push)
                break
        speeds = [run.speed for run in runs]
        way = len(runs) - 1 if why else int(np.argmax(speeds))
        apart = sorted(distances)[-2:][0]
        self.tried[trial] = Verdict(why, way, dof, max(speeds), apart, max(kept, default=None))
        return self.tried[trial]

    def failure(self, run: Run, fine: Run, push: float, is_chance: bool) -> str:
        """How a run fails beside a fine one: diverges, moves, grows, elsewhere; "": it does not."""
        if not run.is_finite:
            return "diverges"
        if not (self.rests or self.is_in_motion):
            return ""
        still, floor = self.still(push), min(STILL, push / 2.0) / 5.0
        if self.rests and fine.speed <= still:
            if not run.speed <= still:
                return "moves"
        elif not (run.most <= AS_FAST * np.maximum(fine.most, push)).all():
            return "moves"
        usual = max(1.0, fine.late / fine.middle) if fine.middle else 1.0
        if run.late > floor and run.late > GROWS * max(fine.late, usual * run.middle):
            return "grows"
        return "elsewhere" if not is_chance and self.rests and self.elsewhere(run, fine) > ELSEWHERE else ""

    def first(self, run: Run, most: np.ndarray, push: float) -> int:
        """The degree of freedom that is first faster than fine runs ever are, else the fastest at the end."""
        fast = run.speeds > AS_FAST * np.maximum(most, push)
        return int(fast[fast.any(axis=1).argmax()].argmax()) if fast.any() else int(run.last.argmax())

    def further(self, trial: Trial, ways: range) -> Iterator[tuple[str, int, int, float]]:
        """How runs of further patterns fail, or "", the pattern, what moves first, and the speed at the end.

        They are judged beside the fine runs of the first patterns, of which the fastest counts; what fails,
        also beside that of its own pattern: which way it tumbles, and whether it topples at any step, depends
        on the push.
        """
        push, fine = trial.push, self.fine_runs(trial.push)
        most, last = (np.max([getattr(run, name) for run in fine], axis=0) for name in ("most", "last"))
        whole = fine[0]._replace(most=most, last=last, late=np.inf)  # growth is asked of longer runs
        is_chance, fastest = self.place_is_chance(push), max(FAST, 10.0 * float(most.max()))
        lasts = self.lasts if len(self.motion.times) else SURELY * self.lasts
        for way in ways:
            run = self.run(trial, way, fastest, lasts)
            why, own_most = self.failure(run, whole, push, is_chance), most
            if why and (self.is_in_motion or (self.rests and run.is_finite)):
                own = self.fine_run(push, way, lasts)
                own_most = np.maximum(most, own.most)
                why = self.failure(run, whole._replace(most=own_most), push, is_chance)
                if self.rests and self.failure(own, whole, push, is_chance):
                    why = ""  # not survived at fine steps either
            yield why, way, self.first(run, own_most, push), run.speed

    def sure(self, trial: Trial) -> bool:
        """Whether a step holds after further patterns of signs too."""
        verdict = self.verdict(trial)
        if not verdict.holds or trial in self.surely:
            return verdict.holds
        more = MORE_WAYS if self.rests else MORE_WAYS // 2  # what falls is no more certain with more of them
        for why, way, dof, speed in self.further(trial, range(WAYS, WAYS + more)):
            if why:
                most = max(speed, verdict.speed)
                self.tried[trial] = verdict._replace(why=why, way=way, dof=dof, speed=most)
                return False
        self.surely.add(trial)
        return True

    def mostly_fails(self, trial: Trial) -> bool:
        """Whether runs of a step fail after a third of all patterns: of any four others one will, most likely."""
        whys = [why for why, *_ in self.further(trial, range(WAYS + MORE_WAYS))]
        return 3 * sum(map(bool, whys)) >= len(whys)

    def limit(self, push: float, integrator: str, surely: bool = True, first: float | None = None) -> Limit:
        """The longest step after a push, sought up or down from the first, by default the one in use.

        surely: it, and one that is shorter by BELOW, hold after further patterns too, and so does the one in
        use; a factor ABOVE above the one that fails, a third of all patterns fail. Between both it depends on
        the push.
        """

        def trial(dt: float) -> Trial:
            return Trial(push, dt, integrator)

        def is_sure(dt: float) -> bool:
            return self.sure(trial(dt)) and self.sure(trial(max(BELOW * dt, self.fine_dt)))

        def failed() -> list[float]:
            return sorted(
                one.dt for one, found in self.tried.items() if one == trial(one.dt) and not found.holds
            )

        ends = self.fine_dt, self.longest, WITHIN
        low, high = largest(lambda dt: self.verdict(trial(dt)).holds, first or self.dt, *ends)
        if surely and low is not None and not is_sure(low):
            lower, higher = largest(is_sure, low, self.fine_dt, low, WITHIN)
            while lower is not None and failed()[0] < lower:  # where it is chance, on the way
                lower, higher = largest(is_sure, failed()[0], self.fine_dt, failed()[0], WITHIN)
            is_own = (lower or 0.0) < self.dt <= low and self.sure(trial(self.dt))
            low, high = (self.dt, high) if is_own else (lower, higher)
        failing = high or 0.0
        for _ in range(ROUNDS if surely and failing else 0):
            if not self.sure(trial(failing)) and self.mostly_fails(trial(ABOVE * failing)):
                high = failing
                break
            failing *= ABOVE
        else:
            high = next((dt for dt in failed() if dt > (low or 0.0)), high)
        return Limit(low, high, self.verdict(trial(high)).dof if high else None)

    def recipe(self, dt: float, integrator: str) -> dict[str, Any] | None:
        """How plain MuJoCo repeats the run that decides on a step: its start, its steps, and the speed at its end.

        None: controls change on the way.
        """
        if self.motion.program or len(self.motion.times):
            return None
        trial = Trial(self.push, dt, integrator)
        fastest = max(float(run.most.max()) for run in self.fine_runs(self.push))
        way = self.verdict(trial).way
        lasts = self.lasts * (1.0 if way < WAYS else SURELY)
        run = self.run(trial, way, max(FAST, 10.0 * fastest), lasts)
        count, done, over = round(lasts / dt), len(run.speeds), 1
        if run.is_finite:
            over = round(CALM / dt) if done < count else max(1, count // 4)
        with np.errstate(invalid="ignore"):
            speed = float(run.speeds[done - over :].max())
        of_run = {"integrator": integrator, "dt": dt, "steps": done, "over": over}
        start = self.stepper.as_fields(self.start(self.push, way, self.motion))
        return of_run | {"speed": speed if np.isfinite(speed) else None, "start": start}
