#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""Runs sequences several times at real-time pace in the default configuration; prints medians and spread as a table.

Usage: benchmarks/tracking.py build/release/photoslam NAME=SEQUENCE[@SENSOR]... [--runs 5] [--json FILE]

For example: kitchen=data/redkitchen kitchen-mono=data/redkitchen@mono zed=data/zed. Needs ground truth and an idle
machine. "Lost" counts every frame without a pose; those before the first pose are in brackets. The spread is
(largest - smallest) / median of the trajectory error over the runs.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

COLUMNS = {
    "ATE cm": ("ate", "rmse_m", 100), "RPE cm": ("rpe", "trans_m", 100), "RPE deg": ("rpe", "rot_deg", 1),
    "lost": ("frames", "lost", 1), "before init": ("frames", "lost_before_init", 1), "dropped": ("frames", "dropped", 1),
    "p50 ms": ("tracking", "p50_ms", 1), "p99 ms": ("tracking", "p99_ms", 1),
    "blocked p99 ms": ("tracking", "blocked_p99_ms", 1), "latency p99 ms": ("latency", "p99_ms", 1),
    "PSNR dB": ("image_online", "psnr_db", 1),
}
MAPPER = "mapper cores"  # processor time of photorealistic mapping per second of input


def run(program: str, sequence: str, sensor: str) -> dict:
    with tempfile.TemporaryDirectory() as output:
        command = [program, "run", sequence, "--output", output, "--json"] + (["--sensor", sensor] if sensor else [])
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        if result.returncode != 0:
            sys.exit(f"{' '.join(command)}\n{result.stderr}")
        return json.loads(result.stdout)


def figures(report: dict) -> dict:
    if report["config"]["changed"]:
        sys.exit(f"not the default configuration: {report['config']['changed']}")
    result = {name: (report.get(group) or {}).get(key, float("nan")) * scale
              for name, (group, key, scale) in COLUMNS.items()}
    mapping = report["mapping"]
    return result | {MAPPER: mapping["cpu_seconds"] / (mapping["seconds_online"] + mapping["seconds_drain"])}


def main() -> None:
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("program")
    parser.add_argument("sequences", nargs="+")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--json", type=pathlib.Path)
    arguments = parser.parse_args()
    columns = [*COLUMNS, MAPPER]
    print("| sequence | runs | ATE spread % | " + " | ".join(columns) + " |")
    print("|---" * (len(columns) + 3) + "|", flush=True)
    everything = {}
    for entry in arguments.sequences:
        name, _, place = entry.partition("=")
        sequence, _, sensor = place.partition("@")
        runs = [figures(run(arguments.program, sequence, sensor)) for _ in range(arguments.runs)]
        everything[name] = runs
        errors = [r["ATE cm"] for r in runs]
        spread = 100 * (max(errors) - min(errors)) / statistics.median(errors)
        medians = [statistics.median(r[column] for r in runs) for column in columns]
        print(f"| {name} | {len(runs)} | {spread:.1f} | " + " | ".join(f"{m:.4g}" for m in medians) + " |", flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(everything, indent=1))


if __name__ == "__main__":
    main()
