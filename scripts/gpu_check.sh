#!/usr/bin/env bash
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
#
# Everything that only a GPU can show, in one run of at most ten minutes on a machine without network or packages:
# builds src/splatting/standalone with nvcc and cmake, runs its tests on the host and on the GPU, the latter also under
# compute-sanitizer, measures the engine, and with a bundle the whole program. Where there is no GPU the rest is done.
#
#   scripts/gpu_check.sh bundle [FILE]       beforehand, where build/release is: packs the program with its libraries
#   scripts/gpu_check.sh [check|long] [FILE] on the machine with the GPU; "long" only runs the program, on 2000 frames
#
# FILE is build/gpu_bundle.tar.xz by default; FRAMES changes the length of the sequence. Results: report.md and logs in $OUT, or else in output/gpu_check.
set -uo pipefail
cd "$(dirname "$0")/.."

mode=${1:-check}
bundle=${2:-build/gpu_bundle.tar.xz}
out=${OUT:-output/gpu_check}
build=build/gpu_check

make_bundle() {
  local folder
  folder=$(mktemp -d) || exit 1
  trap 'rm -rf "$folder"' EXIT
  mkdir -p "$folder/lib"
  for program in build/release/photoslam build/release/src/splatting_test; do
    [ -x "$program" ] || { echo "gpu_check: $program is missing; run: make test" >&2; exit 1; }
    strip -o "$folder/$(basename "$program")" "$program"
    # The C and C++ libraries of the other machine serve, if they are as new: they also have to serve what nvcc builds.
    ldd "$program" | awk '$3 ~ "^/" {print $3}' | grep -vE '/(libc|libm|libstdc\+\+|libgcc_s)\.so' |
      while read -r library; do cp -L "$library" "$folder/lib/"; done
  done
  mkdir -p "$(dirname "$bundle")"
  XZ_OPT=-2 tar -cJf "$bundle" -C "$folder" . || exit 1
  echo "gpu_check: $bundle, $(du -h "$bundle" | cut -f1)"
  exit 0
}
[ "$mode" = bundle ] && make_bundle

mkdir -p "$out" "$build"
report=$out/report.md
failed=0

note() { echo "$*" | tee -a "$report"; }

# step NAME SECONDS COMMAND...: runs it with a time limit, its output in a log; a row of the report says what came of it.
step() {
  local name=$1 limit=$2 start=$SECONDS log state
  shift 2
  log=$out/$(tr ' ' _ <<<"$name").log
  if timeout "$limit" "$@" >"$log" 2>&1; then state=passed; else state="FAILED ($?)" failed=1; fi
  note "| $name | $state | $((SECONDS - start)) s |"
  if [ "$state" != passed ]; then tail -n 15 "$log"; fi
  [ "$state" = passed ]
}

jobs=$(nproc)
gpu=$(nvidia-smi --query-gpu=name,driver_version,compute_cap --format=csv,noheader 2>/dev/null | head -n 1)
capability=$(sed 's/.*, *//; s/\.//' <<<"$gpu")
: >"$report"
note "# GPU check, $(date -u +%Y-%m-%d)"
note ""
note "GPU: ${gpu:-none}. Processor: $(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1), $jobs threads. nvcc: $( (command -v nvcc >/dev/null && nvcc --version || /usr/local/cuda/bin/nvcc --version) 2>/dev/null | sed -n 's/.*release \([0-9.]*\).*/\1/p'). Revision: $(git rev-parse --short HEAD 2>/dev/null || echo unknown)."
note ""
note "| step | result | time |"
note "|---|---|---|"

build_engine() {
  cmake -S src/splatting/standalone -B "$build" ${gpu:+-DPHOTOSLAM_CUDA_ARCHITECTURES="$capability"} &&
    cmake --build "$build" --parallel "$jobs"
}

# Figures of the program: one line of the report from a report.json.
figures() {
  python3 - "$1" <<'PYTHON'
import json
import sys

report = json.load(open(sys.argv[1], encoding="utf-8"))
get = lambda group, key: report[group][key] if report[group][key] is not None else float("nan")
print(f"{report['frames']['tracked']} of {report['frames']['total']} frames, online PSNR {get('image_online', 'psnr_db'):.2f} dB, "
      f"refined {get('image', 'psnr_db'):.2f} dB, {report['mapping']['iterations']} iterations of "
      f"{get('mapping', 'ms_per_iteration'):.2f} ms, {report['mapping']['gaussians']} gaussians, tracking "
      f"{get('tracking', 'fps'):.0f} frames/s, GPU memory {get('memory', 'gpu_mb'):.0f} MB; {report['machine']}")
PYTHON
}

# compare_images A B: renders as .npy of both backends; the largest difference must be small, but for the few pixels
# where rounding decides whether a splat counts.
compare_images() {
  python3 - "$@" <<'PYTHON'
import array
import pathlib
import sys

count, worst, beyond, total = 0, 0.0, 0, 0
for path in sorted(pathlib.Path(sys.argv[1]).glob("*.npy")):
    values = []
    for folder in sys.argv[1:]:
        data = (pathlib.Path(folder) / path.name).read_bytes()
        start = 10 + int.from_bytes(data[8:10], "little")
        values.append(array.array("f", data[start:]))
    differences = [abs(a - b) for a, b in zip(*values)]
    count, total = count + 1, total + len(differences)
    worst, beyond = max(worst, max(differences)), beyond + sum(d > 1e-3 for d in differences)
print(f"{count} images, largest difference {worst:.1e}, {beyond} of {total} values differ by more than 1e-3")
sys.exit(count == 0 or beyond > 1e-4 * total)
PYTHON
}

run_program() {
  local program=$build/program frames=$1 refine=$2
  mkdir -p "$program"
  tar -xJf "$bundle" -C "$program" || return 1
  [ ! -f "$build/photoslam_cuda.so" ] || cp "$build/photoslam_cuda.so" "$program/"
  export LD_LIBRARY_PATH=$PWD/$program/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
  step "doctor" 30 "$program/photoslam" doctor
  local backend=cpu
  if [ -n "$gpu" ]; then
    backend=cuda
    step "steps equal those of the CPU" 60 "$program/splatting_test" --gtest_filter='Gpu.OfThisMachine*'
    if grep -q SKIPPED "$out/steps_equal_those_of_the_CPU.log"; then
      note "| FAILED: the module found no GPU | | |"
      failed=1
    fi
  fi
  local room=$build/room-$frames
  [ -f "$room/done" ] || { rm -rf "$room"; step "film the room, $frames frames" 400 "$program/photoslam" synth room --frames "$frames" --size 1200x680 --output "$room" && touch "$room/done"; } || return 1
  step "run, $frames frames" 420 "$program/photoslam" run "$room" --backend $backend --pace asap --refine-seconds "$refine" --output "$out/run" --no-session || return 1
  note "| $(figures "$out/run/report.json") | | |"
  [ "$mode" = check ] || return 0
  step "export" 60 "$program/photoslam" export "$out/run" --to transforms --output "$build/transforms"
  step "bench on the CPU" 120 "$program/photoslam" bench splat --model "$out/run/map.ply" --cameras "$build/transforms/transforms.json" --rounds 1 --backend cpu --json
  if [ -n "$gpu" ]; then
    step "bench on the GPU" 60 "$program/photoslam" bench splat --model "$out/run/map.ply" --cameras "$build/transforms/transforms.json" --rounds 4 --backend cuda --json
    for backend in cpu cuda; do
      step "render $backend" 60 "$program/photoslam" render "$out/run" --orbit --orbit-frames 12 --backend $backend --format npy --output "$build/render-$backend"
    done
    step "images equal those of the CPU" 60 bash -c 'compare_images "$@"' _ "$build/render-cpu" "$build/render-cuda" &&
      note "| $(cat "$out/images_equal_those_of_the_CPU.log") | | |"
  fi
  rm -rf "$out/run/session.photoslam"
}

export -f compare_images build_engine
export build gpu capability jobs
step "build" 300 bash -c build_engine || exit 1
if [ "$mode" = check ]; then
  if [ -z "$gpu" ]; then
    step "tests on the host" 240 "$build/engine_host_test"
  else
    step "tests on the GPU" 120 "$build/engine_device_test"
    sanitizer=$(command -v compute-sanitizer || ls /usr/local/cuda/bin/compute-sanitizer 2>/dev/null)
    if [ -n "$sanitizer" ]; then
      step "memcheck" 90 "$sanitizer" --tool memcheck --leak-check full --error-exitcode 1 "$build/engine_device_test"
      step "racecheck" 90 "$sanitizer" --tool racecheck --error-exitcode 1 "$build/engine_device_test" Sort Prefix Loss StepIsAdam Images
      step "initcheck" 60 "$sanitizer" --tool initcheck --error-exitcode 1 "$build/engine_device_test" Sort Prefix Loss StepIsAdam Arrange Fates
      step "synccheck" 60 "$sanitizer" --tool synccheck --error-exitcode 1 "$build/engine_device_test" Sort Prefix Loss StepIsAdam Images
    else
      note "| compute-sanitizer | not there | |"
    fi
    step "bench of the engine" 60 "$build/engine_bench" &&
      note "| \`$(tr -d '\n' <"$out/bench_of_the_engine.log")\` (aims on an H200: 1.4 ms per step, 0.5 ms per frame) | | |"
  fi
fi
if [ -f "$bundle" ]; then
  if [ "$mode" = long ]; then run_program "${FRAMES:-2000}" 0; else run_program "${FRAMES:-300}" 5; fi
else
  note "| program | no $bundle: see scripts/gpu_check.sh | |"
fi
[ -n "$gpu" ] || note "
No GPU: nothing above says anything about one."
note "
$([ $failed = 0 ] && echo "All passed" || echo "Something failed") in $SECONDS s."
exit $failed
