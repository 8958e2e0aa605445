"""MJX in float32, its usual precision."""

from . import EngineRecord

ENGINE = EngineRecord(
    order=61, label="MJX float32", colour="#88CCEE", marker=">", package="mujoco.mjx", extra="mjx", reads_file=True,
    compiles=True, precision="float32", module="mjx",
)  # fmt: skip
