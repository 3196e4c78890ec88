#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compiles all kernels as CUDA by NVRTC, without a GPU, and prints registers and spilled bytes of each as a table,
and the local memory of a work group.

A kernel file says with which definitions it is compiled, one line "// Compiled: NAME=value …" for each set. NVRTC is
named by COVARY_NVRTC (a file), or found by the loader, or as the package nvidia-cuda-nvrtc-cu12 of this Python.

cuda_kernels.py [--architectures sm_70,sm_89,sm_90] [ROOT]; exit code 1 if a kernel does not compile or spills.
"""
import argparse
import ctypes
import glob
import os
import re
import sys

KERNELS = "src/device/kernels"
# As src/device/cuda_api.cpp, and what the assembler says of registers.
OPTIONS = ["--std=c++17", "--fmad=false", "--device-as-default-execution-space", "--ptxas-options=-v",
           "--diag-suppress=177"]


def load_nvrtc():
    names = [os.environ.get("COVARY_NVRTC"), "libnvrtc.so", "libnvrtc.so.13", "libnvrtc.so.12"]
    for folder in sys.path:
        names += sorted(glob.glob(os.path.join(folder, "nvidia/cuda_nvrtc/lib/libnvrtc.so.*")))
    for name in filter(None, names):
        try:
            return ctypes.CDLL(name)
        except OSError:
            pass
    sys.exit("cuda_kernels: no NVRTC; pip install nvidia-cuda-nvrtc-cu12, or name libnvrtc.so.12 by COVARY_NVRTC")


def source_of(folder, name, seen=None):
    """As kernel_source() in src/device/kernel_source.h."""
    seen = seen if seen is not None else set()
    if name in seen:
        return ""
    seen.add(name)
    with open(os.path.join(folder, name), encoding="utf-8") as file:
        lines = file.readlines()
    return "".join(source_of(folder, match[1], seen) if (match := re.match(r'#include "(.*)"', line)) else line
                   for line in lines)


def compile_kernels(nvrtc, source, definitions, architecture):
    """Whether it compiles, and the log."""
    program = ctypes.c_void_p()
    nvrtc.nvrtcCreateProgram(ctypes.byref(program), source.encode(), b"kernels.cu", 0, None, None)
    options = [f"--gpu-architecture={architecture}", *OPTIONS, *(f"-D{d}" for d in definitions)]
    array = (ctypes.c_char_p * len(options))(*(o.encode() for o in options))
    code = nvrtc.nvrtcCompileProgram(program, len(options), array)
    size = ctypes.c_size_t()
    nvrtc.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    log = ctypes.create_string_buffer(size.value)
    nvrtc.nvrtcGetProgramLog(program, log)
    nvrtc.nvrtcDestroyProgram(ctypes.byref(program))
    return code == 0, log.value.decode(errors="replace")


def figures(log):
    """(kernel, registers, spilled bytes, local memory of a group in bytes) of each kernel in the assembler's log."""
    found, name, spilled = [], None, 0
    for line in log.splitlines():
        if match := re.search(r"Compiling entry function '(\w+)'", line):
            name, spilled = match[1], 0
        elif match := re.search(r"(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads", line):
            spilled = int(match[2]) + int(match[3])
        elif (match := re.search(r"Used (\d+) registers", line)) and name:
            local = re.search(r"(\d+) bytes smem", line)
            found.append((name, int(match[1]), spilled, int(local[1]) if local else 0))
            name = None
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("root", nargs="?", default=os.path.join(os.path.dirname(__file__), "../.."))
    parser.add_argument("--architectures", default="sm_70,sm_89,sm_90")
    arguments = parser.parse_args()
    folder = os.path.join(arguments.root, KERNELS)
    nvrtc, failed, rows = load_nvrtc(), False, {}
    architectures = arguments.architectures.split(",")
    for path in sorted(glob.glob(os.path.join(folder, "*.cl"))):
        name = os.path.basename(path)
        source = source_of(folder, name)
        sets = re.findall(r"^// Compiled:(.*)$", source, re.M) or [""]
        for number, definitions in enumerate(sets):
            for architecture in architectures:
                good, log = compile_kernels(nvrtc, source, definitions.split(), architecture)
                if not good:
                    failed = True
                    print(f"{name} with{definitions or ' nothing'} for {architecture}:\n{log}", file=sys.stderr)
                for kernel, registers, spilled, local in figures(log):
                    rows.setdefault((name, number + 1, kernel), {})[architecture] = (registers, spilled, local)
                    failed |= spilled > 0
    print(f"| kernel | set | {' | '.join(architectures)} | local memory |")
    print("|---|---|" + "---|" * (len(architectures) + 1))
    for (name, number, kernel), found in rows.items():
        cells = [f"{found[a][0]}, {found[a][1]}" if a in found else "–" for a in architectures]
        print(f"| `{name}` {kernel} | {number} | " + " | ".join(cells) + f" | {max(f[2] for f in found.values())} |")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
