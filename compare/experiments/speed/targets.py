"""What was aimed at for speed, and what is reached: ratios of one run. They make no checks."""

from collections.abc import Mapping

from ...judge.check import Result
from .accuracy import Floors
from .evaluations import EACH, EQUAL, FORWARD, IN_LANES, MJ_STEP, RK4_STEP, WAITING, WHOLE

LANES_AIM = {"AVX-512": 300}  # over lanes, by the width of the vectors; 120 for AVX2


def targets(result: Result, floors: Floors, vectors: str, aims: Mapping[tuple[str, float], float]) -> list[dict]:
    """A row for each aim: what is compared, the ratio that was aimed at, the ratio that is reached.

    aims: of the robot, {(scene, rad): MuJoCo's cheapest setting over tmt's}.
    """
    ns = {(row["quantity"], row["implementation"], row["states"], row["threads"]): row["ns_per_state"]
          for row in result.tables["evaluations"] if row["ns_per_state"]}  # fmt: skip
    lanes = {states: value for (quantity, name, states, threads), value in ns.items()
             if (quantity, name, threads) == (FORWARD, IN_LANES, 1) and states > 1}  # fmt: skip
    best = min(lanes, key=lanes.get, default=None)  # as many states as fit into the caches
    wide = next((aim for name, aim in LANES_AIM.items() if name in vectors), 120)
    rows = []

    def add(what, aim, slow, fast):
        reached = slow / fast if slow and fast else None
        rows.append({"what": what, "aim": aim, "reached": reached, "met": None if reached is None else reached >= aim})

    def of(quantity, name, states=1):
        return ns.get((quantity, name, states, 1))

    for name, how in ((WAITING, "each evaluation waits for the last"), (EACH, "independent states")):
        fast = of(FORWARD, name, 1 if name == WAITING else 1000)
        add(f"forward dynamics, {how}: mj_forward over the kernel", 40, of(FORWARD, WHOLE), fast)
        add(f"forward dynamics, {how}: equal work over the kernel", 12, of(FORWARD, EQUAL), fast)
    of_states = f" of {best:,} states" if best else ""
    add(f"forward dynamics: mj_forward over lanes{of_states}", wide, of(FORWARD, WHOLE), lanes.get(best))
    add("RK4 step: mj_step over the kernel", 20, of(RK4_STEP, MJ_STEP), of(RK4_STEP, EACH))
    for line in result.tables["what_should_i_use"]:
        aim = aims.get((line["scene"], line["target_rad"]))
        if aim:
            what = f"{line['scene']}, {line['target_rad']:.0e} rad: MuJoCo's cheapest over tmt's"
            add(what, aim, line["ratio"], 1.0)
    for scene, floor in floors.items():
        good = [row for row in result.rows if row["scene"] == scene and not row["diverged"]]
        ours = [row for row in good if row["engine"] == "tmt"]
        for row in good:
            if row["engine"] == "heyoka" and row["worst_error_rad"] > floor:
                reach = [r["seconds"] for r in ours if r["worst_error_rad"] <= row["worst_error_rad"]]
                what = f"{scene}, {row['worst_error_rad']:.2e} rad: heyoka's Taylor over tmt's cheapest"
                add(what, 1, row["seconds"], min(reach, default=None))
    return rows


def aims_in_words(rows: list[dict]) -> list[str]:
    """How many aims are met and which are missed, in words."""
    measured = [row for row in rows if row["met"] is not None]
    missed = [f"{row['what']}: {row['reached']:.3g} of {row['aim']:g}" for row in measured if not row["met"]]
    text = f"Of {len(measured)} aims for speed {len(measured) - len(missed)} are met"
    text += f"; missed: {'; '.join(missed)}." if missed else "."
    unknown = [row["what"] for row in rows if row["met"] is None]
    return [text + (f" Not measured: {'; '.join(unknown)}." if unknown else "")]
