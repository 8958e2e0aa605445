"""Machine code from LLVM's text, by llvmlite: for this processor, optimised, as functions for ctypes."""

import ctypes
from collections.abc import Callable
from functools import lru_cache
from threading import Lock
from typing import Any

import llvmlite
import llvmlite.binding as llvm

MUCH = 250_000  # characters of a module that is not optimised before it becomes machine code
Function = Callable[..., Any]
lock = Lock()  # LLVM's passes are not made for several threads at once


@lru_cache(maxsize=1)
def processor() -> tuple[str, str]:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def lanes() -> int:
    """How many doubles are taken side by side: what one register of this processor holds, at least four."""
    return 8 if "+avx512f" in processor()[1] else 4


def versions() -> str:
    return repr((llvmlite.__version__, llvm.llvm_version_info, llvm.get_default_triple(), *processor()))


def target() -> llvm.TargetMachine:
    """A new one each time: an engine takes its own over."""
    cpu, features = processor()
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(cpu=cpu, features=features, opt=1, codemodel="jitdefault")


def object_code(text: str) -> bytes:
    with lock:
        machine = target()
        module = llvm.parse_assembly(text)
        # of many straight lines LLVM's passes take long and leave them as fast as they were
        level = 2 if len(text) < MUCH else 0
        passes = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=level))
        passes.getModulePassManager().run(module, passes)
        if not level:
            passes = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=2))
            for function in module.functions:
                if len(list(function.blocks)) > 1:  # it has loops
                    passes.getFunctionPassManager().run(function, passes)
        return machine.emit_object(module)


class Library:
    def __init__(self, text: str = "", code: bytes | None = None):
        code = object_code(text) if code is None else code
        with lock:
            self.engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target())
            self.engine.add_object_file(llvm.ObjectFileRef.from_data(code))
            self.engine.finalize_object()

    def function(self, name: str, result: Any, *arguments: Any, keeps_lock: bool = False) -> Function:
        """A function by its name, of ctypes' types; keeps_lock: Python's other threads wait meanwhile."""
        address = self.engine.get_function_address(name)
        if not address:
            raise KeyError(name)
        function = (ctypes.PYFUNCTYPE if keeps_lock else ctypes.CFUNCTYPE)(result, *arguments)(address)
        setattr(function, "library", self)  # noqa: B010 - it must live as long; ctypes has no such field
        return function
