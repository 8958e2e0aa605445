"""A door that leads nowhere: the pieces of a fleet are carried out in the process of the test, or answered in their place."""

import pickle

from compare.fleet.models import place_of_report
from compare.fleet.piece import Outcome
from compare.process.crash import described

PENDULUM = ("<mujoco><worldbody><body name='b'><joint name='j' axis='0 1 0'/><inertial pos='0 0 {}' mass='1' "
            "diaginertia='1 1 1'/></body></worldbody></mujoco>")  # fmt: skip


class Inside:
    """A door to this process: pieces are carried out one after the other, those of the lowest rank first."""

    def __init__(self, workers=1, times_alone=True, before=lambda piece: None):
        self.count, self.times_alone, self.before = workers, times_alone, before
        self.pieces, self.most, self.names, self.done = [], 0, [], []

    @property
    def under_way(self):
        return len(self.pieces)

    def submit(self, piece):
        self.pieces.append(piece)
        self.names.append(piece.name)
        self.most = max(self.most, self.under_way)

    def next(self):
        piece = min(self.pieces, key=lambda piece: piece.rank)
        self.pieces.remove(piece)
        self.done.append(piece.name)
        if outcome := self.before(piece):
            return piece, outcome
        try:
            value = piece.function(*piece.arguments, *([piece.shared] if piece.shared else []))
            return piece, Outcome(pickle.dumps(value), seconds=1.0, wall=1.0, machine="here")
        except Exception as error:
            return piece, Outcome(error=described(error))

    def no_timing(self):
        return None

    def workers(self):
        return self.count

    def close(self):
        pass


def report(tmp_path, name):
    return tmp_path / "out" / place_of_report(f"m/{name}")


def step_of(name):
    return name.rsplit(" of ", 1)[0]
