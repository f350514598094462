#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""The paper's ablation (Table 4): geometry-based densification and pyramid levels, for each sensor, over several seeds.

Usage: benchmarks/ablation.py build/release/photoslam SEQUENCE OUTPUT [--sensors mono rgbd] [--seeds 5]
                              [--pace realtime|logical] [--refine-seconds 0]

Prints, for every variant, mean and spread over the seeds of the PSNR over all frames, of the tracking rate and of the
size of the map, and writes OUTPUT/ablation.md with the table; every run's folder with its report and pictures stays in
OUTPUT.
`logical` spends the same number of training iterations everywhere, so that only their effect is compared.
"""
import argparse
import json
import pathlib
import statistics
import subprocess

PREFIX = "photorealistic_mapping."
NO_GEOMETRY = ["seeding.dense=false", "seeding.inactive_features=false", "reseed_interval=0"]


def variants() -> dict[str, list[str]]:
    table = {}
    for geometry in (False, True):
        for levels in (0, 1, 2, 3):
            name = f"{'with' if geometry else 'without'} Geo, pyramid {levels}"
            table[name] = ([] if geometry else NO_GEOMETRY) + [f"schedule.pyramid_levels={levels}", "schedule.start_pixels=1"]
    return table


def run(arguments, sensor: str, settings: list[str], seed: int, output: pathlib.Path) -> dict:
    command = [arguments.program, "run", arguments.sequence, "--sensor", sensor, "--output", str(output), "--seed",
               str(seed), "--json"]
    if arguments.pace == "logical":
        command += ["--iterations-per-frame", "4"]
    if arguments.refine_seconds > 0:
        command += ["--refine-seconds", str(arguments.refine_seconds)]
    for setting in settings:
        command += ["--set", PREFIX + setting]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def mean_and_spread(values: list[float]) -> str:
    spread = statistics.stdev(values) if len(values) > 1 else 0.0
    return f"{statistics.fmean(values):.2f} ± {spread:.2f}"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("sequence")
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("--sensors", nargs="+", default=["mono", "rgbd"])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--pace", choices=["realtime", "logical"], default="realtime")
    parser.add_argument("--refine-seconds", type=float, default=0)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)

    lines = ["| sensor | variant | PSNR dB | SSIM | rendered frames/s | map MB |", "|---|---|---|---|---|---|"]
    for sensor in arguments.sensors:
        for name, settings in variants().items():
            reports = []
            for seed in range(1, arguments.seeds + 1):
                folder = arguments.output / f"{sensor}-{name.replace(', ', '-').replace(' ', '-')}-{seed}"
                reports.append(run(arguments, sensor, settings, seed, folder))
            figures = [mean_and_spread([report[group][key] for report in reports])
                       for group, key in (("image", "psnr_db"), ("image", "ssim"), ("render", "fps"),
                                          ("map", "size_mb"))]
            lines.append(f"| {sensor} | {name} | " + " | ".join(figures) + " |")
            print(lines[-1], flush=True)
    (arguments.output / "ablation.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
