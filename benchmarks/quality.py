#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""Picture quality over seconds of compute, for every sequence, with switches of the mapper on and off.

Usage: benchmarks/quality.py build/release/photoslam OUTPUT SEQUENCE... [--sensor rgbd] [--switches NAME...]
                             [--iterations-per-frame 2 8] [--refine-iterations 0] [--seeds 1] [--jobs 1]

Every sequence is run by logical time, so that chance and the load of the machine change nothing, with one thread, so
that the processor time of the mapping thread is all that mapping cost. Each run gives a point: PSNR and SSIM over all
frames at our own poses against seconds of compute. Several budgets of iterations make a curve per switch. Writes
OUTPUT/quality.md with a table per sequence (difference to the first switch at the largest budget) and the curves,
OUTPUT/SEQUENCE-psnr.svg and -ssim.svg. Runs that OUTPUT holds already are not repeated.
"""
import argparse
import concurrent.futures
import html
import json
import pathlib
import statistics
import subprocess

PREFIX = "photorealistic_mapping."
SWITCHES = {
    "default": [],
    "no dense seeding": ["seeding.dense=false", "reseed_interval=0"],
    "no seeds at inactive features": ["seeding.inactive_features=false"],
    "no seeding again": ["reseed_interval=0"],
    "wrong guesses stay": ["guess_tolerance=0"],
    "no exposure": ["exposure.enabled=false"],
    "no seeds before what is drawn": ["seeding.consistency_tolerance=0"],
    "no depth loss": ["depth_weight=0"],
    "opacity regularisation": ["opacity_weight=0.01"],
    "no refinement of poses": ["poses.enabled=false"],
    "worse keyframe of two": ["schedule.worse_probability=0.5"],
    "pyramid 0": ["schedule.pyramid_levels=0"],
    "pyramid 2": ["schedule.pyramid_levels=2", "schedule.start_pixels=1"],
    "pyramid 3": ["schedule.pyramid_levels=3", "schedule.start_pixels=1"],
    "full size online": ["schedule.online_pixels=1000000000"],
    "never full size online": ["schedule.online_uses=0"],
    "SSIM online": ["ssim_weight_online=0.2"],
    "SH degree 0": ["sh_degree=0"],
    "SH degree 1": ["sh_degree=1"],
    "SH degree 3 at once": ["sh_interval=0"],
    "cap of 5000": ["densification.max_gaussians=5000"],
    "cap of 5000, relocation": ["densification.max_gaussians=5000", "densification.relocation=true"],
}
COLOURS = ("#000", "#c33", "#36c", "#293", "#b6b", "#c80", "#099", "#777", "#a52", "#66f")


def run(arguments, sequence: pathlib.Path, switch: str, iterations: int, seed: int) -> dict:
    output = arguments.output / "-".join([sequence.name, switch.replace(" ", "_"), str(iterations), str(seed)])
    report = output / "report.json"
    if not report.exists():
        command = [arguments.program, "run", str(sequence), "--output", str(output), "--deterministic", "--threads", "1",
                   "--seed", str(seed), "--iterations-per-frame", str(iterations), "--refine-iterations",
                   str(arguments.refine_iterations), "--no-session"]
        if arguments.sensor:
            command += ["--sensor", arguments.sensor]
        for setting in SWITCHES[switch]:
            command += ["--set", PREFIX + setting]
        subprocess.run(command, capture_output=True, check=True)
        for bulky in ("map.ply", "report.html"):
            (output / bulky).unlink(missing_ok=True)
    figures = json.loads(report.read_text())
    if SWITCHES[switch] and not any(PREFIX + setting.split("=")[0] in figures["config"]["changed"]
                                    for setting in SWITCHES[switch]):
        raise SystemExit(f"the switch '{switch}' sets what is the default: {', '.join(SWITCHES[switch])}")
    return figures


def mean(reports: list[dict], group: str, key: str) -> float:
    return statistics.fmean(report[group][key] for report in reports)


def curve_plot(title: str, unit: str, curves: dict[str, list[tuple[float, float]]]) -> str:
    """SVG of one line per switch."""
    points = [point for curve in curves.values() for point in curve]
    right, low, high = max(x for x, _ in points), min(y for _, y in points), max(y for _, y in points)
    span = max(high - low, 1e-6)

    def place(x: float, y: float) -> str:
        return f"{50 + 430 * x / right:.1f},{280 - 250 * (y - low) / span:.1f}"

    lines = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 320" font-family="sans-serif" font-size="11">',
             f'<text x="50" y="16">{html.escape(title)}</text>',
             f'<path d="M50 30V280H480" fill="none" stroke="#999"/><text x="480" y="300" text-anchor="end">'
             f'{right:.0f} s of compute</text><text x="46" y="284" text-anchor="end">{low:.3g}</text>'
             f'<text x="46" y="34" text-anchor="end">{high:.3g}</text><text x="4" y="150">{unit}</text>']
    for i, (name, curve) in enumerate(curves.items()):
        colour = COLOURS[i % len(COLOURS)]
        dash = "" if i < len(COLOURS) else ' stroke-dasharray="4 2"'
        line = " ".join(place(x, y) for x, y in sorted(curve))
        lines.append(f'<polyline points="{line}" fill="none" stroke="{colour}"{dash}/>'
                     f'<text x="500" y="{40 + 14 * i}" fill="{colour}">{html.escape(name)}</text>')
    return "\n".join(lines) + "\n</svg>\n"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("sequences", nargs="+", type=pathlib.Path)
    parser.add_argument("--sensor")
    parser.add_argument("--switches", nargs="+", choices=SWITCHES, default=list(SWITCHES), metavar="NAME")
    parser.add_argument("--iterations-per-frame", nargs="+", type=int, default=[2, 8])
    parser.add_argument("--refine-iterations", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    budgets = sorted(arguments.iterations_per_frame)
    text = []
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for sequence in arguments.sequences:
            jobs = {(switch, budget): [pool.submit(run, arguments, sequence, switch, budget, seed)
                                       for seed in range(1, arguments.seeds + 1)]
                    for switch in arguments.switches for budget in budgets}
            results = {key: [job.result() for job in seeds] for key, seeds in jobs.items()}
            text += ["", f"### {sequence.name}", "", "| switch | PSNR dB | worst 5 % | SSIM | gaussians | compute s |",
                     "|---|---|---|---|---|---|"]
            curves = {"psnr_db": {}, "ssim": {}}
            for switch in arguments.switches:
                for key, lines in curves.items():
                    lines[switch] = [(mean(results[switch, b], "mapping", "cpu_seconds"),
                                      mean(results[switch, b], "image", key)) for b in budgets]
                most = results[switch, budgets[-1]]
                base = results[arguments.switches[0], budgets[-1]]
                psnr = mean(most, "image", "psnr_db")
                change = "" if most is base else f" ({psnr - mean(base, 'image', 'psnr_db'):+.2f})"
                text.append(f"| {switch} | {psnr:.2f}{change} | {mean(most, 'image', 'psnr_p5_db'):.2f} | "
                            f"{mean(most, 'image', 'ssim'):.3f} | {mean(most, 'mapping', 'gaussians'):.0f} | "
                            f"{mean(most, 'mapping', 'cpu_seconds'):.1f} |")
            print("\n".join(text[-len(arguments.switches) - 4:]), flush=True)
            for key, unit in (("psnr_db", "dB"), ("ssim", "")):
                name = f"{sequence.name}-{key.removesuffix('_db')}.svg"
                (arguments.output / name).write_text(curve_plot(f"{sequence.name}: {key}", unit, curves[key]))
    (arguments.output / "quality.md").write_text("\n".join(text) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
