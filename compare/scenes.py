"""Postures and scenes, as small records: what is held or let go, from where, for how long."""

import dataclasses
from dataclasses import dataclass

import numpy as np

import tmt

POSTURES = {  # deg, (alpha, beta, gamma); the assignment's named postures
    "zero": (0, 0, 0),
    "hanging": (0, 0, 90),
    "upright": (180, 0, 90),
    "ball catch": (-70, 70, -30),
    "bent": (30, 20, 60),
}
HINGES = tmt.ARM.hinge_names
MOST_STEPS = 10_000_000  # of a run


def posture(name) -> np.ndarray:
    """Hinge angles of a named posture, or of three angles in deg: rad, shape (3,)."""
    return np.radians(np.array(POSTURES[name] if isinstance(name, str) else name, dtype=float))


@dataclass(frozen=True)
class Scene:
    """A motion under constant torque. Raises ValueError, in one line, for what cannot be a scene."""

    name: str
    posture: str | tuple  # of POSTURES, or three angles in deg
    torque: (
        str | tuple
    )  # "free": none; "hold": TMT's gravity balance at the start, given to both engines; or three, N m
    speed: tuple = (0.0, 0.0, 0.0)  # deg/s at the start
    damping: float = 0.0  # N m s/rad, of every hinge
    gravity: bool = True
    locked: tuple = ()  # names of the hinges that stay at the start
    duration: float = 5.0  # s
    dt: float = 5.0 / 64  # s, the coarsest step; runs with finer ones divide it
    judged: float | None = None  # s, for how long a run must be judged, its band of rounding narrow; None: all along

    def __post_init__(self):
        self.refuse("name", not isinstance(self.name, str) or not self.name.strip(), "a text that is not empty")
        three = f"three numbers, one per hinge ({', '.join(HINGES)})"
        choices = {
            "posture": (tuple(POSTURES), f"{', '.join(POSTURES)} or {three}, in deg"),
            "torque": (("free", "hold"), f"free, hold or {three}, in N m"),
            "speed": ((), f"{three}, in deg/s"),
        }
        for name, (words, accepted) in choices.items():
            value = getattr(self, name)
            known = value in words if isinstance(value, str) else finite(value, (3,))
            self.refuse(name, not known, accepted)
            if not isinstance(value, str):
                object.__setattr__(self, name, tuple(float(v) for v in value))
        for name in ("duration", "dt"):
            self.refuse(name, not finite(getattr(self, name), ()) or getattr(self, name) <= 0.0, "a time in s above 0")
        self.refuse("damping", not finite(self.damping, ()) or self.damping < 0.0, "at least 0 N m s/rad")
        self.refuse("gravity", not isinstance(self.gravity, bool | np.bool_), "True, the model's own, or False, none")
        self.refuse("dt", self.duration / self.dt > MOST_STEPS, f"a step that divides {self.duration:g} s into at most "
                    f"{MOST_STEPS:,}")  # fmt: skip
        left = abs(self.steps * self.dt - self.duration)
        self.refuse("dt", self.steps < 1 or left > 1e-9 * self.duration, f"a step that divides {self.duration:g} s")
        judged = self.judged is None or (finite(self.judged, ()) and 0.0 < self.judged <= self.duration)
        self.refuse("judged", not judged, f"None, or a time in s above 0 and at most {self.duration:g}")
        locked = self.locked
        wrong = not isinstance(locked, tuple | list) or not all(name in HINGES for name in locked)
        self.refuse(
            "locked", wrong or len(set(locked)) >= len(HINGES), f"a tuple of at most two of {', '.join(HINGES)}"
        )
        object.__setattr__(self, "locked", tuple(locked))
        moving = [name for name, rate in zip(HINGES, self.speed) if rate and name in locked]
        self.refuse("speed", moving, f"no speed of a locked hinge ({', '.join(locked)})")

    def refuse(self, name, wrong, accepted):
        if wrong:
            named, found = (shorten(" ".join(repr(getattr(self, field)).split())) for field in ("name", name))
            raise ValueError(f"scene {named}: {name} is {found}; {accepted} is expected")

    @property
    def steps(self) -> int:
        """The number of the coarsest steps."""
        return round(self.duration / self.dt)

    @property
    def hinges(self) -> tuple:
        """The names of the hinges that are not locked."""
        return tuple(name for name in HINGES if name not in self.locked)

    @property
    def whole(self) -> tmt.Tree:
        """The arm with the scene's damping added, and without gravity if the scene has none; no hinge locked."""
        gravity = tmt.ARM.gravity if self.gravity else (0.0, 0.0, 0.0)
        return dataclasses.replace(tmt.ARM, damping=tuple(d + self.damping for d in tmt.ARM.damping), gravity=gravity)

    @property
    def angles(self) -> dict:
        """The angles of the locked hinges, rad, by their names."""
        return {name: float(angle) for name, angle in zip(HINGES, posture(self.posture)) if name in self.locked}

    @property
    def model(self) -> tmt.Tree:
        """The scene's model on the side of TMT: the arm with what the scene changes, without the locked hinges."""
        return self.whole.lock(self.angles)

    def engine(self, engine):
        """The scene's model on the side of MuJoCo: the engine's own numbers with what the scene changes.

        Gravity and damping of the file stay: a scene that set them would hide what the file says of them.
        """
        return engine.lock(self.angles).variant(None if self.gravity else 0.0, self.damping)

    @property
    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """Angles and rates of the free hinges at t = 0, rad and rad/s."""
        return self.free(posture(self.posture)), self.free(np.radians(np.array(self.speed, dtype=float)))

    @property
    def tau(self) -> np.ndarray:
        """Torque at the free hinges, N m."""
        if self.torque == "hold":
            return self.free(tmt.gravity_balance(posture(self.posture), self.whole))
        return self.free(np.zeros(3) if self.torque == "free" else np.array(self.torque, dtype=float))

    def free(self, values) -> np.ndarray:
        """Of values for all hinges those of the free ones."""
        return values[[HINGES.index(name) for name in self.hinges]]

    def required(self, twin, dt) -> float:
        """For how long a run must be judged, s: with the assignment's coarse step only RK4 is stable that long."""
        judged = self.duration if self.judged is None else self.judged
        return judged if twin == "rk4" or dt < 0.01 else min(judged, 0.3)


def finite(value, shape) -> bool:
    """Whether a value is one finite real number, or so many; neither text nor true and false."""
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        return False
    return array.shape == shape and array.dtype.kind in "iuf" and bool(np.isfinite(array).all())


def shorten(text, length=60) -> str:
    """A text that may stand in one line."""
    return text if len(text) <= length else text[: length - 4] + " ..."


SCENES = (
    Scene("zero, free", "zero", "free"),
    Scene("ball catch, free", "ball catch", "free"),
    Scene("bent, free", "bent", "free"),
    Scene("ball catch, held", "ball catch", "hold", judged=2.5),  # unstable: rounding grows fast
    Scene("bent, held", "bent", "hold"),
    Scene("bent, damped", "bent", "free", damping=0.5),
    Scene("thrown, no gravity", "bent", "free", speed=(100.0, 200.0, -150.0), gravity=False, judged=4.5),
    Scene("elbow swing", "zero", "free", locked=("alpha", "beta")),
)
