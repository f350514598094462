#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""Runs the benchmark suite of the splatting engine and prints its curves as tables: cost against gaussians and pixels.

Usage: benchmarks/splatting_curves.py [build folder, default build/release]
"""

import json
import subprocess
import sys
from pathlib import Path


def run(program):
    command = [program, "--benchmark_filter=BM_", "--benchmark_format=json", "--benchmark_min_time=0.3"]
    report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    rows = {}
    for entry in report["benchmarks"]:
        name, count, width, height = entry["name"].split("/")[:4]
        size = (int(count), int(width), int(height))
        rows.setdefault(size, {"visible": int(entry["visible"])})[name] = entry["cpu_time"]
    return rows


def main():
    build = Path(sys.argv[1] if len(sys.argv) > 1 else "build/release")
    program = build / "src" / "splatting_benchmark"
    if not program.is_file():
        sys.exit(f"{program} is missing: configure with PHOTOSLAM_BUILD_BENCHMARKS=ON and build splatting_benchmark")
    print("| gaussians | visible | size | render ms | step ms | step us per visible gaussian | step ns per pixel |")
    print("|---|---|---|---|---|---|---|")
    for (count, width, height), row in sorted(run(program).items(), key=lambda item: (item[0][1], item[0][0])):
        step = row["BM_Step"]
        print(f"| {count} | {row['visible']} | {width}x{height} | {row['BM_Render']:.1f} | {step:.1f} "
              f"| {1e3 * step / max(row['visible'], 1):.2f} | {1e6 * step / (width * height):.0f} |")


if __name__ == "__main__":
    main()
