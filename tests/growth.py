"""How cost grows with the number of joints: `python -m tests.growth 3 10 30 100 300` writes reports/growth.

Of chains of hinges: processor time and memory of `all --quick`, the time of one mass matrix, the size of exported C.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np
import pandas
import psutil
from matplotlib.figure import Figure

import compare
import tmt

FOLDER = Path(__file__).parents[1] / "reports" / "growth"
FEW = 100  # joints up to which C is exported
AXES = "1 0 0", "0 1 0", "0 0 1"


def chain(joints: int) -> str:
    """MJCF of a chain of hinges about x, y, z in turn."""
    link = '<inertial pos="0.05 0.01 0.02" mass="1" diaginertia="0.002 0.003 0.004"/>'
    body = ""
    for k in reversed(range(joints)):
        hinge = f'<joint name="j{k}" axis="{AXES[k % 3]}" damping="0.01"/>'
        body = f'<body name="b{k}" pos="{0.1 * (k > 0)} 0 0">{hinge}{link}{body}</body>'
    return f'<mujoco model="chain {joints}"><worldbody>{body}</worldbody></mujoco>'


def cost_of_a_run(path: Path, folder: str) -> dict[str, float]:
    """Processor s and MB of `all --quick` of a file, with all that is compiled anew."""
    words = [sys.executable, "-m", "compare", "all", "--quick", "--mjcf", str(path), "--out", f"{folder}/out"]
    run = psutil.Popen(words, env={**os.environ, "TMT_CACHE": f"{folder}/store"}, stdout=subprocess.DEVNULL)
    most, begin = 0, time.monotonic()
    while run.poll() is None:
        time.sleep(0.2)
        try:
            most = max(most, *(process.memory_info().rss for process in (run, *run.children(recursive=True))))
        except psutil.Error:
            continue
    used = os.times()
    checks = json.loads(Path(folder, "out", "results.json").read_text())["checks"]
    print(f"{path.stem}: {len(checks)} checks, {sum(not check['passed'] for check in checks)} fail")
    return {
        "wall_s": time.monotonic() - begin,
        "MB": most / 1e6,
        "children_s": used.children_user + used.children_system,
    }


def seconds(call, least=0.2) -> float:
    """Of one call, the least of three measurements."""
    call()
    count, best = 1, 0.0
    while best < least / 4:
        begin = time.perf_counter()
        for _ in range(count):
            call()
        best, count = time.perf_counter() - begin, 2 * count
    return min(best, *(measured(call, count // 2) for _ in range(2))) / (count // 2)


def measured(call, count: int) -> float:
    begin = time.perf_counter()
    for _ in range(count):
        call()
    return time.perf_counter() - begin


def costs(joints: int, folder: str) -> dict[str, float]:
    """All costs of a chain."""
    path = Path(folder, f"chain{joints}.xml")
    path.write_text(chain(joints))
    before = os.times()
    run = cost_of_a_run(path, folder)
    before_s = before.children_user + before.children_system
    row = {
        "joints": joints,
        "run_processor_s": run["children_s"] - before_s,
        "run_wall_s": run["wall_s"],
        "run_MB": run["MB"],
    }
    model = mujoco.MjModel.from_xml_path(str(path))
    data, tree, M = mujoco.MjData(model), compare.tree(path), np.zeros((joints, joints))
    q = data.qpos[:] = np.random.default_rng(1).uniform(-3, 3, joints)

    def of_mujoco():
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_crb(model, data)
        mujoco.mj_fullM(model, data, M)

    row["M_mujoco_us"] = 1e6 * seconds(of_mujoco)
    if joints <= FEW:
        begin = time.process_time()
        tmt.prepare(tree, "mass_matrix")
        tmt.mass_matrix(tree, q)
        row["M_compile_s"] = time.process_time() - begin
        row["M_tmt_us"] = 1e6 * seconds(lambda: tmt.mass_matrix(tree, q))
        assert np.abs(tmt.mass_matrix(tree, q) - M).max() < 1e-11 * np.abs(M).max()
        begin = time.process_time()
        row["c_kB"] = len(tmt.equations(tree, "c")) / 1e3
        row["c_s"] = time.process_time() - begin
    return row


def draw(table: pandas.DataFrame, path: Path) -> None:
    figure = Figure((9.0, 3.4), layout="constrained")
    shown = {
        "all --quick, processor time, s": {"run_processor_s": "whole run", "c_s": "three quantities as C"},
        "one mass matrix, us": {"M_mujoco_us": "MuJoCo", "M_tmt_us": "TMT, compiled"},
        "memory, MB, and C, kB": {
            "run_MB": "memory of the run, MB",
            "c_kB": "M, h and accelerations as C, kB",
        },
    }
    for ax, (title, columns) in zip(figure.subplots(1, 3), shown.items()):
        for (column, label), marker, colour in zip(columns.items(), "os", ("#0072B2", "#E69F00")):
            ax.loglog(table["joints"], table[column], marker=marker, color=colour, label=label)
        ax.set(xlabel="joints of the chain", ylabel=title)
        ax.set_xticks(table["joints"], table["joints"])
        ax.tick_params(which="minor", labelbottom=False, labelleft=False)
        ax.grid(alpha=0.3)
        ax.legend(frameon=False, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    figure.savefig(path, dpi=110)


def main(sizes: list[int], out: Path) -> None:
    """Write the table and the chart of chains of these numbers of joints."""
    out.mkdir(exist_ok=True)
    rows = []
    for joints in sizes:
        with tempfile.TemporaryDirectory() as folder:
            os.environ["TMT_CACHE"] = f"{folder}/store"
            rows.append(costs(joints, folder))
        table = pandas.DataFrame(rows)
        table.to_csv(out / "costs.csv", index=False, float_format="%.4g")
        draw(table, out / "costs.png")
    print(table.to_string(index=False, float_format=lambda x: f"{x:.3g}"))


if __name__ == "__main__":
    main([int(size) for size in sys.argv[1:]], FOLDER)
