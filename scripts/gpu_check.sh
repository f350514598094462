#!/usr/bin/env bash
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
#
# Everything that only a GPU can show, in one run of at most ten minutes on a machine without network or packages:
# builds src/splatting/standalone with nvcc and cmake, runs its tests on the GPU, also under compute-sanitizer, measures
# the engine, and with a bundle the whole program on the built-in room, which is filmed meanwhile. Where there is no GPU
# it does the rest, says so, and fails.
#
#   scripts/gpu_check.sh bundle [FILE]    beforehand, where build/release is: packs the program with its libraries
#   scripts/gpu_check.sh [check] [FILE]   on the machine with the GPU
#
# FILE is build/gpu_bundle.tar.xz by default. FRAMES ("300 2000") are the lengths of the sequences, SECONDS_ALLOWED (600)
# is all the time there is. Results: a report with the date in its name, and logs, in $OUT or else in output/gpu_check.
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
case $mode in
  bundle) make_bundle ;;
  check) ;;
  *) echo "gpu_check: $mode is neither bundle nor check" >&2 && exit 1 ;;
esac

mkdir -p "$out" "$build"
report=$out/gpu-$(date -u +%Y-%m-%d).md
allowed=${SECONDS_ALLOWED:-600}
lengths=${FRAMES:-300 2000}
failed=0

note() { echo "$*" | tee -a "$report"; }

# step NAME SECONDS COMMAND...: runs it with a time limit, its output in a log; a row of the report says what came of it.
step() {
  local name=$1 limit=$2 start=$SECONDS left=$((allowed - SECONDS - 5)) log state
  shift 2
  [ "$limit" -lt $left ] || limit=$left
  if [ "$limit" -lt 1 ]; then
    note "| $name | FAILED (no time left) | |"
    failed=1
    return 1
  fi
  log=$out/$(tr -d ',' <<<"$name" | tr ' ' _).log
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
  cmake -S src/splatting/standalone -B "$build" -DPHOTOSLAM_CUDA_ARCHITECTURES="${capability:-90}" &&
    cmake --build "$build" --parallel "$jobs"
}

# Figures of the program: one line of the report from a report.json.
figures() {
  command -v python3 >/dev/null || { tr -d '\n' <"$1" | head -c 4000 && return; }
  python3 - "$1" <<'PYTHON'
import json
import sys

report = json.load(open(sys.argv[1], encoding="utf-8"))
get = lambda group, key: report[group][key] if report[group][key] is not None else float("nan")
print(f"{report['frames']['tracked']} of {report['frames']['total']} frames, online PSNR {get('image_online', 'psnr_db'):.2f} dB, "
      f"refined {get('image', 'psnr_db'):.2f} dB, {report['mapping']['iterations']} iterations of "
      f"{get('mapping', 'ms_per_iteration'):.2f} ms, {report['mapping']['gaussians']} gaussians, tracking "
      f"{get('tracking', 'fps'):.0f} frames/s, ATE {100 * get('ate', 'rmse_m'):.2f} cm, GPU memory "
      f"{get('memory', 'gpu_mb'):.0f} MB; {report['machine']}")
PYTHON
}

# compare_images A B: renders as .npy of both backends; the largest difference must be small, but for the few pixels
# where rounding decides whether a splat counts.
compare_images() {
  command -v python3 >/dev/null || { echo "not compared: there is no python3" && return; }
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

film_rooms() {
  for frames in $lengths; do
    [ -f "$build/room-$frames/done" ] && continue
    rm -rf "$build/room-$frames"
    "$program/photoslam" synth room --frames "$frames" --size 1200x680 --output "$build/room-$frames" || return 1
    touch "$build/room-$frames/done"
  done
}

# run_room FRAMES REFINE_SECONDS: the program at 1200x680, as fast as tracking goes.
run_room() {
  local room=$build/room-$1
  [ -f "$room/done" ] || return 1
  step "run, $1 frames" 300 "$program/photoslam" run "$room" --backend "$backend" --pace asap --refine-seconds "$2" \
    --output "$out/run-$1" --no-session || return 1
  note "| $(figures "$out/run-$1/report.json") | | |"
}

# compare_backends FRAMES: what the CPU and the GPU draw of the map of a run, and how fast they train it.
compare_backends() {
  local run=$out/run-$1 backends=cpu
  [ -z "$gpu" ] || backends="cpu cuda"
  step "export" 60 "$program/photoslam" export "$run" --to transforms --output "$build/transforms" || return 1
  for backend in $backends; do
    step "bench on $backend" 100 "$program/photoslam" bench splat --model "$run/map.ply" --backend "$backend" \
      --cameras "$build/transforms/transforms.json" --rounds 1 --json
    step "render on $backend" 60 "$program/photoslam" render "$run" --orbit --orbit-frames 6 --backend "$backend" \
      --format npy --output "$build/render-$backend"
  done
  [ -n "$gpu" ] || return 0
  step "images equal those of the CPU" 60 bash -c 'compare_images "$@"' _ "$build/render-cpu" "$build/render-cuda" &&
    note "| $(cat "$out/images_equal_those_of_the_CPU.log") | | |"
}

sanitize() {
  local tool=$1
  shift
  step "$tool" 80 "$sanitizer" --tool "$tool" --error-exitcode 1 "$@"
}

# --- What needs the engine only ---

program=$build/program backend=${gpu:+cuda}
backend=${backend:-cpu}
export -f compare_images build_engine film_rooms
export build gpu capability jobs program lengths
filming=
if [ -f "$bundle" ]; then
  mkdir -p "$program" && tar -xJf "$bundle" -C "$program" || exit 1
  export LD_LIBRARY_PATH=$PWD/$program/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
  nice timeout "$allowed" bash -c film_rooms >"$out/film.log" 2>&1 &
  filming=$!
fi
step "build" 300 bash -c build_engine || exit 1
if [ -z "$gpu" ]; then
  step "tests on the host" 240 "$build/engine_host_test"
else
  step "tests on the GPU" 120 "$build/engine_device_test"
  sanitizer=$(command -v compute-sanitizer || ls /usr/local/cuda/bin/compute-sanitizer 2>/dev/null)
  if [ -n "$sanitizer" ]; then
    sanitize memcheck --leak-check full "$build/engine_device_test"
    sanitize racecheck "$build/engine_device_test" Sort Prefix Loss StepIsAdam Images Smaller
    sanitize initcheck "$build/engine_device_test" Sort Prefix Loss StepIsAdam Arrange Fates Smaller
    sanitize synccheck "$build/engine_device_test" Sort Prefix Loss StepIsAdam Images Smaller
  else
    note "| compute-sanitizer | not there | |"
  fi
fi

# --- What is measured: with nothing else running ---

if [ -n "$filming" ]; then
  step "film the room" 300 tail --pid="$filming" -f /dev/null
  wait "$filming" || {
    note "| filming FAILED: see film.log | | |"
    failed=1
  }
fi
if [ -n "$gpu" ]; then
  step "bench of the engine" 60 "$build/engine_bench" &&
    note "| \`$(tr -d '\n' <"$out/bench_of_the_engine.log")\` (aims on an H200: 1.4 ms per step, 0.5 ms per frame) | | |"
fi
if [ -n "$filming" ]; then
  [ ! -f "$build/photoslam_cuda.so" ] || cp "$build/photoslam_cuda.so" "$program/"
  step "doctor" 30 "$program/photoslam" doctor
  if [ -n "$gpu" ]; then
    step "steps equal those of the CPU" 60 "$program/splatting_test" --gtest_filter='Gpu.OfThisMachine*'
    if grep -q SKIPPED "$out/steps_equal_those_of_the_CPU.log"; then
      note "| FAILED: the module found no GPU | | |"
      failed=1
    fi
  fi
  first=${lengths%% *} refine=5
  for frames in $lengths; do
    run_room "$frames" $refine
    refine=0
  done
  [ ! -f "$out/run-$first/map.ply" ] || compare_backends "$first"
else
  note "| program | no $bundle: see scripts/gpu_check.sh | |"
fi

note ""
note "Aims of the program (H200): online PSNR 33 dB on 300 frames and 36 dB on 2000, at most 2000 MB of GPU memory."
note "$([ $failed = 0 ] && echo "All passed" || echo "Something failed") in $SECONDS s."
if [ -z "$gpu" ]; then
  note "No GPU was found: nothing above says anything about one."
  exit 2
fi
exit $failed
