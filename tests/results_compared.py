"""Two runs of the same program compared: which checks each makes, and their values, through a map of names that were changed.

`python tests/results_compared.py BEFORE.json AFTER.json` prints every check without a partner and every value that differs
by more than rounding; both files are a report's results.json. The map is for reports that are older than compare's folders.
"""

import json
import re
import sys
from collections import Counter
from pathlib import Path

FIELDS = ("experiment", "scene", "quantity", "rule")
RENAMED = [  # (field, regular expression, replacement): a name of before, and what it is now
    ("quantity", "^smallest error of MuJoCo's RK4, beside that of tmt's rk4$",
     "smallest error of MuJoCo's RK4, compared with tmt's rk4"),
    ("quantity", r"^distance of the measured order from (\d)$", r"deviation from order \1: error"),
    ("quantity", "^measured order, of 8$", "measured order, nominal 8"),
    ("quantity", r"^order of the error against the elliptic function, from (\d)$",
     r"deviation from order \1: error from the elliptic function"),
    ("quantity", "^growth of a step near that limit, TMT to MuJoCo$",
     "spectral radius of a step near the limit with servos, TMT to MuJoCo"),
    ("quantity", "^limit of the step under its servos, observed to predicted$",
     "step limit with servos, observed / predicted - 1"),
    ("quantity", "Mbar - Mbar' over its largest entry$", "Mbar - Mbar' over the scale of the entry"),
    ("quantity", "least eigenvalue of Mbar over", "least eigenvalue of Mbar in units of its diagonal over"),
    ("scene", "^(.*), free base, (.*)$", r"\1, \2"),
]  # fmt: skip
WITHOUT = {  # regular expression for the checks of before, or "after: " and one for those of after, without partner: the reason
    r"stability .*, locked base, ": "one base for each robot: free where it floats",
    r"stability .* growth in \d+ steps": "the growth per step is covered by limits and times of departure",
    "stability .* exponent of the time to leave|stability .* zero, .* departure": "no user asks how a marginal posture is left",
    "stability .* near sqrt 3": "the resonance at sqrt 3 was deleted",
    "stability .* runs whose energy": "drift of energy is in trajectory",
    "stability .* implicit, .* time from a silent": "trajectory shows the drift of energy; only a reset gives no sign at all",
    "stability .* (torque four decimals|printed torque)": "the torque that is one ulp off answers the same question",
    "stability .* numbers of steps .* with which it leaves|stability .* angle from .* free": "claim 3 stands without them",
    "stability .* gauss_legendre_4, dt .* departure": "departures are by the same few methods in every run",
    "new: stability .* implicit": "a quick run has implicit too",
    "reduction .* (the same bits|another motion) with": "the cost of additions in MuJoCo was deleted",
    "reduction .* linear modes": "stability compares modes with runs",
    "trajectory .* derivative, ": "acceleration compares qdd, and one step is compared from the same states",
    "trajectory .* dh/dqd": "one step of implicit depends on it",
    "trajectory .* the same bits as": "each integrator is compared with the scheme",
    "trajectory .* many digits": "the band bounds the rounding of both; errors are taken from the true motion",
    "trajectory .* of [^ ]*-momentum": "drift of energy, and accelerations compared with exact values",
    "trajectory .* over that of Euler": "energy.csv has the drift of each method",
    "trajectory .* locked, RK4": "reduction compares the smaller model with the whole",
    "trajectory .* drift of energy": "now the order is at least the nominal one",
    r"speed .*dt = (3\.81|7\.63)e-05 s|speed .* smallest error of mujoco's RK4, where": "steps end a halving earlier",
    "speed .* scenes that show its order": "orders are checked where errors fall regularly",
    "reduction .* Euler.* (smallest model|time judged|movement|deviation from order)": "the smaller model runs by RK4 only",
    "reduction .* elliptic function, scipy": "tests of truth compare it with 50 digits",
    "diagnosis .* one step of": "trajectory compares each integrator with its scheme",
    r"(mass|gravity) \| (?!random states)": "named postures are one sample, as in kinematics and acceleration",
    r"mass .* worst posture": "the tolerance of an acceleration has |Mbar^-1| of its state",
    r"gravity .* torque - dV/dq|gravity .* qdd of MuJoCo": "acceleration compares dE/dt with the power, and qdd",
    r"acceleration .* d(p_\w+|linear momentum|angular momentum)/dt": "accelerations are compared with exact values",
}
OTHER_VALUES = {  # regular expression for the checks whose values changed by more: the reason
    r"parameters \| .* \| inertia": "stated tensors are turned by matrices: the last bit",
    r"^(mass|kinematics|gravity|acceleration) \||reduction .*(Mbar|bias), ": "each entry has its own scale for the arm too",
    r"step limit with servos, observed": "no second run for slow alternating growth; plain bisection",
    r"reduction \| .* locked \| (Mbar|bias), ": "random locked angles are now in degrees: the last bit",
    "stability .* limit, observed / predicted - 1": "sought about the prediction; bisected to 1e-4",
    r"speed .* (deviation from order|smallest error of MuJoCo's RK4)": "steps end a halving earlier, to save time",
    "stability .* automatic reset on": "the time counts from the reset, and energy shows the failure before it",
}
CLOSE = 1e-6  # relative: values differ by less where only rounding differs


def name_of(check: dict, renamed=()) -> tuple:
    """What a check is called, after the changes."""
    named = {field: check[field] for field in FIELDS}
    for field, old, new in renamed:
        named[field] = re.sub(old, new, named[field])
    return tuple(named.values())


def compared(before: list[dict], after: list[dict], renamed=RENAMED) -> dict[str, list]:
    """Checks by what became of them: lost, new, with another outcome, with another value or tolerance than rounding explains."""
    old, new = Counter(name_of(check, renamed) for check in before), Counter(name_of(check) for check in after)
    found = {"lost": sorted((old - new).elements()), "new": sorted((new - old).elements()), "passed": [], "values": []}
    by_name = {name_of(check): check for check in after}
    for check in before:
        partner = by_name.get(name_of(check, renamed))
        if partner is None:
            continue
        if partner["passed"] != check["passed"]:
            found["passed"].append(name_of(partner))
        for field in ("value", "tolerance"):
            if not alike(check[field], partner[field], check):
                found["values"].append((*name_of(partner), field, check[field], partner[field]))
    return found


def alike(one, other, check) -> bool:
    """Whether two numbers are the same except for rounding; of a check of rounding a share of the tolerance is rounding."""
    if None in (one, other):
        return one is other
    allowed = check["tolerance"] if check["rule"] == "at most" and check["tolerance"] else 0.0
    return abs(one - other) <= max(CLOSE * max(abs(one), abs(other)), 0.01 * abs(allowed))


def reason(name: tuple, side: str) -> str | None:
    """Why a check has no partner, as far as that is known."""
    text = " | ".join(name)
    return next((why for pattern, why in WITHOUT.items() if re.search(pattern, f"{side}: {text}")), None)


def main(before: str, after: str) -> int:
    """Print what differs; 0 if each check has its partner with the same value, or a reason."""
    of_files = [json.loads(Path(path).read_text(encoding="utf-8"))["checks"] for path in (before, after)]
    found = compared(*of_files)
    print(f"{len(of_files[0])} checks before, {len(of_files[1])} after")
    unexplained = len(found["passed"])
    for side in ("lost", "new"):
        for name in found[side]:
            why = reason(name, side)
            unexplained += why is None
            print(f"{side}: {' | '.join(name)}: {why or 'no reason'}")
    for what in found["passed"]:
        print("passed:", *what)
    for *name, field, old, new in found["values"]:
        why = next((why for pattern, why in OTHER_VALUES.items() if re.search(pattern, " | ".join(name))), None)
        unexplained += why is None
        print(f"value: {' | '.join(name)}: {field} {old}, now {new}: {why or 'no reason'}")
    print(f"{unexplained} without a reason")
    return int(unexplained > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
