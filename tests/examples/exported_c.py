"""Take the equations of a robot away as C, compile them, and call them through ctypes; needs gcc.
`python -m compare equations --mjcf robot.xml --out FOLDER` writes such files for any robot, checked."""

import ctypes
import subprocess
from pathlib import Path

import numpy as np

import tmt

quantities = ["mass_matrix", "bias"]
Path("arm.c").write_text(tmt.equations(tmt.ARM, "c", quantities, name="arm"), encoding="utf-8")
Path("arm.h").write_text(tmt.equations(tmt.ARM, "c header", quantities, name="arm"), encoding="utf-8")
library = Path("arm.so").resolve()
subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "arm.c", "-o", library, "-lm"], check=True)
arm = ctypes.CDLL(str(library))


def called(function, shape, *arguments):
    """What `void function(const double *..., double *out)` writes to out."""
    arrays = [np.ascontiguousarray(values, float) for values in arguments] + [np.empty(shape)]
    function(*(array.ctypes.data_as(ctypes.c_void_p) for array in arrays))
    return arrays[-1]


q, qd = [0.5, 0.3, 1.0], [1.0, -2.0, 0.5]  # rad, rad/s
mass_matrix = called(arm.arm_mass_matrix, (3, 3), q)
bias = called(arm.arm_bias, 3, q, qd)
print("M =", mass_matrix, "h =", bias, sep="\n")
difference = max(
    abs(mass_matrix - tmt.mass_matrix(tmt.ARM, q)).max(), abs(bias - tmt.bias(tmt.ARM, q, qd)).max()
)
print(f"largest difference from tmt: {difference:.1g}")
