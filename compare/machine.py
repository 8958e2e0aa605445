"""The machine that a report was made on."""

import platform
from pathlib import Path

WIDTHS = (("avx512f", "AVX-512"), ("avx2", "AVX2"), ("asimd", "NEON"), ("sse2", "SSE2"))


def cpu() -> str:
    """The processor's name."""
    return first_line("model name") or platform.processor() or "unknown"


def vectors() -> str:
    """The processor's name and the widest vectors that it has, as far as the system tells."""
    flags = (first_line("flags") or first_line("Features")).split()
    return f"{cpu()}, {next((name for flag, name in WIDTHS if flag in flags), 'width of its vectors unknown')}"


def first_line(name) -> str:
    """The first value of that name that Linux tells of the processor; "" elsewhere."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith(name)), "")
