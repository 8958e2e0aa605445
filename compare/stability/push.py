"""Which step holds: a motion of a file, pushed, at many steps, beside runs of fine steps. One definition for every robot.

- A run starts where the file starts. At t = 0 every speed is changed by a push, with one of four patterns of
  signs.
- The fine run without a push shows whether the robot rests: slower than STILL in its last quarter. Still, after a
  push, is no faster than that and half of the push (STILLER to STILL).
- Truth is the same run at fine steps, by the file's integrator or by Euler's, whichever first rests after the
  usual push. A fine run that is not finite is refined up to three times; if it never is, nothing is judged.
- The usual push is 0.1 rad/s or m/s, or the largest up to which fine runs come to rest, or coast no faster than
  the push.
- The longest step that is found is tried with eight further patterns, in longer runs, and so is one that is shorter
  by 6 %. 8 % above the one that fails, a third of all patterns fail: in between it depends on the push.
- A step holds if after each pattern the run is as still at its end as fine runs are, grows no more, and ends where
  they do; what is free may slide and turn on its floor. Where fine runs of two steps or patterns end elsewhere the
  place is chance, and is not judged.
- What coasts (no damping, a keyframe with speeds, recorded controls) is judged joint by joint: nowhere faster than
  three times the fine run, or the push. What moves on by itself is judged by divergence alone: not finite, or ten
  times as fast as fine runs.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import mujoco
import numpy as np

from ..engines.mujoco.changes import changed
from ..engines.mujoco.names import bit, matrix
from ..engines.mujoco.stepper import Stepper, distance
from .motion import Motion
from .search import largest

PUSHES = (0.001, 0.01, 0.03, 0.1, 0.3, 1.0)  # rad/s or m/s, of every speed
USUAL = 0.1  # of these pushes
WAYS, MORE_WAYS = 4, 8  # patterns of signs, and further ones for the step that is found
BELOW, ABOVE, ROUNDS = 0.94, 1.08, 8  # of that step, of one that fails, and how far up that is sought
LASTS, MOST_STEPS = 3.0, 20_000  # s and steps of a run
STILL, STILLER = 0.05, 0.01  # rad/s or m/s: what is still after a push, and after a small one
COASTS, AS_FAST, FAST = 1.5, 3.0, 100.0  # fold of a push, fold of a fine run, rad/s or m/s
GROWS = 1.05  # fold, from the middle to the last third of a run
LONGER, SURELY = 3.0, 4.0 / 3.0  # fold: the run that shows whether it goes on, and those of further patterns
CALM = 0.7  # s: what is still for as long stays so
DAMPED = 0.5  # of the speed that fine runs keep: a step that leaves less damps
FREELY = 0.9  # of the speed of what nothing holds or brakes
JUMP, AT_ONCE = 1.0, 0.01  # rad/s or m/s within s: the start is not one in which the robot can be
QUIET, REFINED = 1e-5, 3  # rad/s or m/s, without a push; times
ELSEWHERE, BY_CHANCE, EARLY = 0.3, 0.1, 0.5  # rad or m, twice; s: judged where the end is chance
LONGEST, WITHIN = 0.2, 1.06  # s; fold
FINER, FINEST = 8, 5e-4  # fold of the step in use, s: fine steps
SAMPLES = 100  # of the way of a run


class Run(NamedTuple):
    """A run of a motion.

    last, most: the largest speed of each degree of freedom in the last quarter and of all, (nv,); inf where the run diverges.
    middle, late: the largest of all speeds in the middle and in the last third. times, q: states, (n,) s and (n, nq). speeds:
    of all steps, (steps, nv); of a fine run none.
    """

    last: np.ndarray
    most: np.ndarray
    middle: float
    late: float
    times: np.ndarray
    q: np.ndarray
    speeds: np.ndarray

    @property
    def is_finite(self) -> bool:
        return bool(np.isfinite(self.most).all())


class Verdict(NamedTuple):
    """What runs of a step show.

    why: how it fails, diverges, moves, grows or elsewhere; "": it holds. dof: what moves first. speed: the largest at the end;
    apart: from fine runs, on the way. kept: the largest share of the speed of fine runs that coast, else None.
    """

    why: str
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


class Pushed:
    """A motion after pushes, by any step and integrator.

    dt, s, integrator: those in use. push: rad/s or m/s; None: the usual one. period, delay: s, of a program.
    """

    def __init__(
        self, motion: Motion, dt: float, integrator: str, push: float | None = None, period: float = 0.0,
        delay: float = 0.0,
    ) -> None:  # fmt: skip
        self.motion, self.ideal = silent(motion), silent(motion.ideal or motion)
        self.model, self.asked = self.motion.model, push
        self.dt, self.integrator = dt, integrator
        self.period, self.delay, self.longest = period, delay, max(LONGEST, dt)
        self.fine_dt = min(max(dt / FINER, LASTS / MOST_STEPS), dt / 2.0, FINEST)
        self.lasts = min(motion.times[-1] if len(motion.times) else LASTS, MOST_STEPS * self.fine_dt)
        rng, nv = np.random.default_rng(0), motion.model.nv
        self.signs = [np.sign(rng.normal(size=nv)) for _ in range(WAYS + MORE_WAYS)]
        self.stepper, self.is_of_fine = Stepper(self.model, dt, integrator), False
        speeds = motion.state[self.stepper.places["qvel"]]
        self.is_in_motion = bool(speeds.any() or len(motion.times))
        self.truth, self.survived = integrator, 0.0
        self.fine, self.by_twice = dict[tuple[float, int, float], Run](), dict[tuple[float, int], float]()
        self.tried = dict[tuple[float, float, str, float, float], Verdict]()
        self.surely = set[tuple[float, float, str, float, float]]()

    def run(
        self, push: float, way: int, dt: float, integrator: str, period: float = 0.0, delay: float = 0.0,
        fast: float = FAST, lasts: float = 0.0, is_fine: bool = False,
    ) -> Run:  # fmt: skip
        """A run after a push. It ends early where it diverges, is faster than `fast`, or is still and stays so."""
        motion = self.ideal if is_fine else self.motion
        if (self.stepper.dt, self.stepper.integrator, self.is_of_fine) != (dt, integrator, is_fine):
            self.stepper, self.is_of_fine = Stepper(motion.model, dt, integrator), is_fine
        stepper, nv = self.stepper, self.model.nv
        state = motion.state.copy()
        state[stepper.places["qvel"]] += push * self.signs[way]
        stepper.put(state)
        count, calm, done = max(4, round((lasts or self.lasts) / dt)), round(CALM / dt), 0
        quiet = min(STILL, push / 2.0) / 5.0 if push else QUIET
        q, speeds, failed = np.zeros((count, self.model.nq)), np.zeros((count, nv)), False
        for steps, controls in motion.parts(stepper, count, period, delay):
            rolled = stepper.roll(state, steps, controls)
            q[done : done + steps], speeds[done : done + steps] = rolled.q[0], np.abs(rolled.v[0])
            bad = ~(speeds[done : done + steps].max(axis=1) < fast)
            failed, state = bool(bad.any()), rolled.states[0]
            done += int(bad.argmax()) if failed else steps
            is_calm = done > calm and speeds[done - calm : done].max() < quiet
            if failed or (is_calm and not len(self.motion.times)):
                break
        last, most, middle, late = np.full(nv, np.inf), np.full(nv, np.inf), 0.0, np.inf
        if not failed:
            last = speeds[done - max(1, count // 4 if done == count else calm) : done].max(axis=0)
            most = speeds[:done].max(axis=0)
            middle, late = (speeds[k * count // 3 : (k + 1) * count // 3].max() for k in (1, 2))
        every = np.unique(
            np.r_[np.arange(0, done, 1 if is_fine else max(1, done // SAMPLES)), max(0, done - 1)]
        )
        return Run(
            last, most, float(middle), float(late), dt * (every + 1), q[every], speeds[: done + failed]
        )

    # fine runs

    def fine_run(self, push: float, way: int, lasts: float = 0.0) -> Run:
        """The run of fine steps, refined where it is not finite. lasts: s; 0.0: as long as others."""
        if (push, way, lasts) not in self.fine:
            dt = self.fine_dt
            for _ in range(1 + REFINED):
                run = self.run(push, way, dt, self.truth, fast=100.0 * FAST, lasts=lasts, is_fine=True)
                if run.is_finite:
                    break
                dt /= 2.0
            if push:
                run = run._replace(speeds=run.speeds[:0])  # they take memory
            self.fine[push, way, lasts] = run
        return self.fine[push, way, lasts]

    def twice(self, push: float, way: int) -> float:
        """How far a run of twice the fine step ends from that, rad or m."""
        if (push, way) not in self.by_twice:
            run = self.run(push, way, 2.0 * self.fine_dt, self.truth, fast=100.0 * FAST, is_fine=True)
            self.by_twice[push, way] = self.apart(run, self.fine_run(push, way)) if run.is_finite else np.inf
        return self.by_twice[push, way]

    def apart(self, run: Run, other: Run) -> float:
        """How far runs end from each other, rad or m."""
        return float(np.abs(distance(self.model, other.q[-1], run.q[-1])).max())

    def elsewhere(self, run: Run, other: Run) -> float:
        """How far runs end from each other, rad or m: of what is free its height and its tilt, as it may slide on a floor."""
        m, start, end = self.model, other.q[-1], run.q[-1]
        moved, gravity = np.abs(distance(m, start, end)), np.linalg.norm(m.opt.gravity)
        for joint in np.flatnonzero(m.jnt_type == mujoco.mjtJoint.mjJNT_FREE) if gravity else ():
            place, dof, down = m.jnt_qposadr[joint], m.jnt_dofadr[joint], m.opt.gravity / gravity
            before, after = (matrix(q[place + 3 : place + 7]).T @ down for q in (start, end))
            fall = abs((end - start)[place : place + 3] @ down)
            moved[dof : dof + 6] = max(
                fall, np.arctan2(np.linalg.norm(np.cross(before, after)), before @ after)
            )
        return float(moved.max())

    def along(self, run: Run, fine: Run, until: float) -> float:
        """The largest distance of a run from a fine one along its way, rad or m; inf where it is not finite."""
        if not run.is_finite:
            return np.inf
        upto = run.times <= max(until, run.times[0])
        at = np.array([np.interp(run.times[upto], fine.times, column) for column in fine.q.T]).T
        return float(np.abs(distance(self.model, at, run.q[upto])).max())

    def still(self, push: float) -> float:
        """The largest speed that is rest after a push, rad/s or m/s."""
        return float(self.fine_run(0.0, 0).last.max()) + float(np.clip(push / 2.0, STILLER, STILL))

    def place_is_chance(self, push: float) -> bool:
        """Whether fine runs of other signs, or of twice the step, end elsewhere."""
        first = self.fine_run(push, 0)
        spread = max(self.apart(first, self.fine_run(push, way)) for way in range(WAYS))
        return spread > BY_CHANCE or any(self.twice(push, way) > BY_CHANCE for way in range(WAYS))

    def comes_to_rest(self, push: float) -> bool:
        """Whether fine runs come to rest after a push, or coast no faster than it."""
        most = max(self.still(push), COASTS * push)
        return all(self.fine_run(push, way).last.max() <= most for way in range(WAYS))

    def survives_up_to(self, most: float) -> float:
        """The largest push up to which fine runs come to rest, at most `most`; 0.0: none. By the truth of now."""
        if not self.fine_run(0.0, 0).last.max() <= STILL:
            return 0.0
        usual = self.asked or USUAL
        if not self.comes_to_rest(usual):
            pushes = [push for push in PUSHES if push < usual and not self.asked]
        else:
            pushes = [usual, *(push for push in PUSHES if usual < push <= most)]
        survived = 0.0
        for push in pushes:
            if not self.comes_to_rest(push):
                break
            survived = push
        return survived

    def find_truth(self, most: float = USUAL) -> None:
        """Find the integrator of fine runs, and the largest push that they survive: the file's or Euler's, which first rests."""
        found = {}
        for name in dict.fromkeys((self.integrator, "Euler")):
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
        fine = [self.fine_run(self.push, way) for way in range(WAYS)]
        if not all(run.is_finite for run in fine):
            return ""
        if not self.rests and self.asked and self.fine_run(0.0, 0).last.max() <= STILL:
            return "falls"
        if not (self.rests or self.is_in_motion):
            return "divergence"
        is_still = self.rests and all(run.last.max() <= self.still(self.push) for run in fine)
        return "rest" if is_still else "speed"

    @property
    def by_itself(self) -> str:
        """What the fine run does without a push."""
        speed = float(self.fine_run(0.0, 0).last.max())
        if self.is_in_motion:
            return "in motion"
        if speed <= STILL:
            return "rests"
        freely = FREELY * float(np.linalg.norm(self.model.opt.gravity)) * self.lasts
        return "falls freely" if freely and freely <= speed < np.inf else "moves on"

    @property
    def starts(self) -> str:
        """How fast an equality or a mocap body makes something at once, without a push, if it does."""
        run = self.fine_run(0.0, 0)
        if not (self.model.neq or self.model.nmocap):
            return ""
        first = run.speeds[: max(1, round(AT_ONCE / self.fine_dt))]
        grown = float(first.max(initial=0.0)) - float(first[:1].max(initial=0.0)) * self.is_in_motion
        return f"with a jump to {grown:.2g}" if grown > JUMP else ""

    def creep(self, of: int | None = None) -> tuple[float, int]:
        """The mean speed in the last quarter of what rests without a push, rad/s or m/s, and its degree of freedom.

        of: a degree of freedom; None: the fastest.
        """
        run = self.fine_run(0.0, 0)
        if not run.last.max() <= STILL or run.times[-1] < 0.99 * self.lasts:
            return 0.0, 0
        q, ends = run.q, [round((len(run.q) - 1) * share) for share in (0.5, 0.75, 1.0)]
        before, last = (
            np.abs(distance(self.model, q[one], q[other])) / (self.lasts / 4.0)
            for one, other in pairwise(ends)
        )
        dof = int(last.argmax()) if of is None else of
        return (float(last[dof]), dof) if last[dof] > 0.5 * before[dof] else (0.0, 0)

    def recipe(self, dt: float, integrator: str, fails: bool) -> dict[str, Any] | None:
        """How plain MuJoCo repeats the run that decides on a step: its start, its steps, and the speed at its end.

        It is the first that fails, else the fastest at its end. fails: of a step that does, perhaps after a further pattern.
        None: controls change on the way.
        """
        if self.motion.program or len(self.motion.times):
            return None
        fine, is_chance = (
            [self.fine_run(self.push, way) for way in range(WAYS)],
            self.place_is_chance(self.push),
        )
        fast, found = (
            max(FAST, 10.0 * float(max(run.most.max() for run in fine))),
            list[tuple[str, int, Run]](),
        )
        for way, beside in enumerate(fine):
            run = self.run(self.push, way, dt, integrator, fast=fast)
            found.append((self.failure(run, beside, self.push, is_chance), way, run))
        if fails and not any(why for why, _, _ in found):
            more = range(WAYS, WAYS + MORE_WAYS)
            further = zip(more, self.further(self.push, dt, integrator, more))
            found += [(why, way, run) for way, (why, _, run) in further]
        failing = [each for each in found if each[0]]
        _, way, run = failing[0] if failing else max(found, key=lambda each: float(each[2].last.max()))
        count = round((self.lasts if way < WAYS else SURELY * self.lasts) / dt)
        done, over = len(run.speeds), 1
        if run.is_finite:
            over = round(CALM / dt) if done < count else max(1, count // 4)
        with np.errstate(invalid="ignore"):
            speed = float(run.speeds[done - over :].max())
        state = self.motion.state.copy()
        state[self.stepper.places["qvel"]] += self.push * self.signs[way]
        known = speed if np.isfinite(speed) else None
        of_run = {"integrator": integrator, "dt": dt, "steps": done, "over": over, "speed": known}
        return of_run | {"start": self.stepper.as_fields(state)}

    # other steps

    def verdict(
        self, push: float, dt: float, integrator: str, period: float = 0.0, delay: float = 0.0
    ) -> Verdict:
        """What runs of a step show after a push of each pattern; period, delay: of a program."""
        key = push, dt, integrator, period, delay
        if key not in self.tried:
            self.tried[key] = self.judged(*key)
        return self.tried[key]

    def judged(self, push: float, dt: float, integrator: str, period: float, delay: float) -> Verdict:
        is_chance, distances, speed, why, dof = self.place_is_chance(push), list[float](), 0.0, "", -1
        kept = list[float]()
        for way in range(WAYS):
            fine = self.fine_run(push, way)
            fast = max(FAST, 10.0 * float(fine.most.max()))
            run = self.run(push, way, dt, integrator, period, delay, fast)
            why = self.failure(run, fine, push, is_chance)
            if why == "grows":  # a longer run shows whether it goes on
                run = self.run(push, way, dt, integrator, period, delay, fast, lasts=LONGER * self.lasts)
                why = self.failure(run, fine, push, is_chance)
            speed, coasts = max(speed, float(run.last.max())), float(fine.last.max())
            if not coasts <= self.still(push):
                kept.append(float(run.last.max()) / coasts)
            distances.append(self.along(run, fine, EARLY if is_chance else np.inf))
            if why:
                dof = self.first(run, fine.most, push)
                break
        return Verdict(why, dof, speed, sorted(distances)[-2:][0], max(kept, default=None))

    def failure(self, run: Run, fine: Run, push: float, is_chance: bool) -> str:
        """How a run fails beside a fine one: diverges, moves, grows, elsewhere; "": it does not."""
        if not run.is_finite:
            return "diverges"
        if not (self.rests or self.is_in_motion):
            return ""
        still, floor = self.still(push), min(STILL, push / 2.0) / 5.0
        if self.rests and fine.last.max() <= still:
            if not run.last.max() <= still:
                return "moves"
        elif not (run.most <= AS_FAST * np.maximum(fine.most, push)).all():
            return "moves"
        usual = max(1.0, fine.late / fine.middle) if fine.middle else 1.0
        if run.late > floor and run.late > GROWS * max(fine.late, usual * run.middle):
            return "grows"
        return "elsewhere" if not is_chance and self.rests and self.elsewhere(run, fine) > ELSEWHERE else ""

    def further(self, push: float, dt: float, integrator: str, ways: range) -> Iterator[tuple[str, int, Run]]:
        """How runs of further patterns fail, or "", what moves first, and the runs.

        They are judged beside the fine runs of the first patterns, of which the fastest counts; what is in motion, also
        beside that of their own pattern: which way it tumbles depends on the push.
        """
        fine = [self.fine_run(push, way) for way in range(WAYS)]
        most, last = (np.max([getattr(run, name) for run in fine], axis=0) for name in ("most", "last"))
        whole = fine[0]._replace(
            most=most, last=last, late=np.inf
        )  # whether it grows is asked of longer runs
        is_chance, fastest = self.place_is_chance(push), max(FAST, 10.0 * float(most.max()))
        lasts = self.lasts if len(self.motion.times) else SURELY * self.lasts
        for way in ways:
            run = self.run(push, way, dt, integrator, fast=fastest, lasts=lasts)
            why, own_most = self.failure(run, whole, push, is_chance), most
            if why and self.is_in_motion:
                own_most = np.maximum(most, self.fine_run(push, way, lasts).most)
                why = self.failure(run, whole._replace(most=own_most), push, is_chance)
            yield why, self.first(run, own_most, push), run

    def first(self, run: Run, most: np.ndarray, push: float) -> int:
        """The degree of freedom that is first faster than fine runs ever are, else the fastest at the end."""
        fast = run.speeds > AS_FAST * np.maximum(most, push)
        return int(fast[fast.any(axis=1).argmax()].argmax()) if fast.any() else int(run.last.argmax())

    def sure(self, push: float, dt: float, integrator: str) -> bool:
        """Whether a step holds after further patterns of signs too."""
        key, verdict = (push, dt, integrator, 0.0, 0.0), self.verdict(push, dt, integrator)
        if not verdict.holds or key in self.surely:
            return verdict.holds
        more = MORE_WAYS if self.rests else MORE_WAYS // 2  # what falls is no more certain with more of them
        for why, dof, run in self.further(push, dt, integrator, range(WAYS, WAYS + more)):
            if why:
                self.tried[key] = verdict._replace(
                    why=why, dof=dof, speed=max(float(run.last.max()), verdict.speed)
                )
                return False
        self.surely.add(key)
        return True

    def mostly_fails(self, push: float, dt: float, integrator: str) -> bool:
        """Whether runs of a step fail after a third of all patterns: of any four others one will, most likely."""
        whys = [why for why, _, _ in self.further(push, dt, integrator, range(WAYS + MORE_WAYS))]
        return 3 * sum(map(bool, whys)) >= len(whys)

    def limit(self, push: float, integrator: str, surely: bool = True) -> Limit:
        """The longest step after a push, from the step in use upwards or downwards.

        surely: it, and one that is shorter by BELOW, hold after further patterns too, and so does the one in use; a factor
        ABOVE above the one that fails, a third of all patterns fail. Between both it depends on the push.
        """
        low, high = largest(
            lambda dt: self.verdict(push, dt, integrator).holds, self.dt, self.fine_dt, self.longest, WITHIN
        )
        if surely and low is not None:

            def is_sure(dt: float) -> bool:
                return self.sure(push, dt, integrator) and self.sure(
                    push, max(BELOW * dt, self.fine_dt), integrator
                )

            if not is_sure(low):
                lower, higher = largest(is_sure, low, self.fine_dt, low, WITHIN)
                is_own = (lower or 0.0) < self.dt <= low and self.sure(push, self.dt, integrator)
                low, high = (self.dt, high) if is_own else (lower, higher)
        failing = high or 0.0
        for _ in range(ROUNDS if surely and failing else 0):
            fails = not self.sure(push, failing, integrator)
            if fails and self.mostly_fails(push, ABOVE * failing, integrator):
                high = failing
                break
            failing *= ABOVE
        return Limit(low, high, self.verdict(push, high, integrator).dof if high else None)


def silent(motion: Motion) -> Motion:
    """A motion of the model without its sensors, which take time and move nothing."""
    model = motion.model
    return motion._replace(model=changed(model, disableflags=model.opt.disableflags | bit("SENSOR")))
