#!/usr/bin/env bash
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
#
# Everything that only a GPU can show, in one run of at most ten minutes on a machine without network or packages:
# builds src/splatting/standalone with nvcc and cmake, runs its tests on the GPU, also under compute-sanitizer, measures
# the engine, and with a bundle the whole program on the built-in room. What matters most comes first. Where there is no
# GPU it does the rest, says so, and fails.
#
#   scripts/gpu_check.sh bundle [FILE]    beforehand, where build/release is
#   scripts/gpu_check.sh [check] [FILE]   on the machine with the GPU
#
# FILE, build/gpu_bundle.tar.gz by default, holds the program with its libraries and the sources to build there, and
# FILE.rooms.tar (its ending replaced) a sequence of the first length of FRAMES, without noise at 1200x680: 300 frames
# are 200 MB, the rest 20 MB. Where the second file is missing the program films the sequence, as it does the other
# lengths. Both unpacked into an empty folder are all that is needed; so are a checkout and FILE.
#
# FRAMES ("300 2000") are the lengths of the sequences, SECONDS_ALLOWED (580) is all the time there is. Results: a
# report with the date in its name, and logs, in $OUT or else in output/gpu_check.
# Exit status: 0 all passed; 1 something failed; 2 there is no GPU; 3 none failed, but some could not be checked.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1

mode=${1:-check}
bundle=${2:-build/gpu_bundle.tar.gz}
rooms_file=${bundle%.tar.gz}.rooms.tar
out=${OUT:-output/gpu_check}
build=build/gpu_check
allowed=${SECONDS_ALLOWED:-580}
lengths=${FRAMES:-300 2000}

# film PHOTOSLAM FRAMES FOLDER: which exists only when it is complete.
film() {
  [ -d "$3" ] || "$1" synth room --frames "$2" --size 1200x680 --noise 0 --depth-noise 0 --output "$3"
}

# --- Beforehand ---

# The C and C++ libraries of the other machine serve, if they are as new: they also have to serve what nvcc builds.
pack_program() {
  mkdir -p "$1/lib"
  for program in build/release/photoslam build/release/src/splatting_test; do
    [ -x "$program" ] || { echo "gpu_check: $program is missing; run: make test" >&2 && return 1; }
    strip -o "$1/$(basename "$program")" "$program"
    ldd "$program" | awk '$3 ~ "^/" {print $3}' | grep -vE '/(libc|libm|libstdc\+\+|libgcc_s)\.so' |
      while read -r library; do cp -L "$library" "$1/lib/"; done
  done
  # Should nvcc fail there.
  [ ! -f build/release/photoslam_cuda.so ] || cp build/release/photoslam_cuda.so "$1/"
}

make_bundle() {
  local length=${lengths%% *}
  folder=$(mktemp -d) || exit 1
  trap 'rm -rf "$folder"' EXIT
  pack_program "$folder/program" || exit 1
  git rev-parse --short HEAD >"$folder/revision"
  git ls-files scripts/gpu_check.sh cmake/Nvcc.cmake src/splatting src/base src/image/block_formulas.h \
    src/image/undistort_formulas.h |
    tar -cf - -T - | tar -xf - -C "$folder" || exit 1
  mkdir -p "$(dirname "$bundle")"
  tar -czf "$bundle" -C "$folder" . || exit 1
  film build/release/photoslam "$length" "build/gpu_rooms/room-$length" || exit 1
  tar -cf "$rooms_file" -C build/gpu_rooms --transform 's,^,rooms/,' "room-$length" || exit 1
  du -h "$bundle" "$rooms_file"
}

# --- The report ---

note() { echo "$*" | tee -a "$report"; }

join() {
  local all
  all=$(printf '; %s' "$@")
  echo "${all:2}"
}

# A row about something that could not be checked, and why.
unchecked() {
  note "| $1 | not checked ($2) | |"
  missing+=("$1")
}

# step NAME SECONDS COMMAND...: runs it with a time limit, its output in a log; a row of the report says what came of
# it. A command that ends with 77 could not check anything; its last line says why. The program goes on without a GPU
# that fails; here that is a failure.
step() {
  local name=$1 limit=$2 start=$SECONDS left=$((allowed - SECONDS)) log code=0 state
  shift 2
  [ "$left" -ge 3 ] || { unchecked "$name" "no time left" && return 1; }
  [ "$limit" -lt "$left" ] || limit=$left
  log=$out/$(tr -d ',' <<<"$name" | tr ' ' _).log
  timeout --kill-after=5 "$limit" "$@" >"$log" 2>&1 &
  child=$!
  wait "$child" 2>/dev/null || code=$?
  child=
  [ "$code" != 0 ] || ! grep -q 'the GPU has failed' "$log" || code=gpu
  case $code in
    0) state=passed passed=$((passed + 1)) ;;
    77) unchecked "$name" "$(tail -n 1 "$log")" && return 1 ;;
    gpu) state="FAILED (the GPU has failed)" ;;
    124 | 137) state="FAILED (stopped after $limit s)" ;;
    *) state="FAILED ($code)" ;;
  esac
  note "| $name | $state | $((SECONDS - start)) s |"
  [ "$code" != 0 ] || return 0
  failures+=("$name")
  tail -n 15 "$log"
  return 1
}

# The end of the report, however the run ends.
finish() {
  trap - EXIT INT TERM
  [ -z "$child" ] || kill "$child"
  [ -z "$filming" ] || { kill -TERM -- "-$filming" && kill -CONT -- "-$filming"; } 2>/dev/null
  note ""
  note "Aims of the program (H200): online PSNR 33 dB on 300 frames and 36 dB on 2000, at most 2000 MB of GPU memory."
  note "In $SECONDS s: $passed passed, ${#failures[@]} failed, ${#missing[@]} not checked."
  [ ${#failures[@]} = 0 ] || note "FAILED: $(join "${failures[@]}")."
  [ ${#missing[@]} = 0 ] || note "Not checked: $(join "${missing[@]}")."
  [ "$ended" = yes ] || note "The run was stopped before its end."
  if [ -z "$gpu" ]; then
    note "No GPU was found: nothing above says anything about one."
    exit 2
  fi
  [ ${#failures[@]} = 0 ] && [ "$ended" = yes ] || exit 1
  [ ${#missing[@]} = 0 ] || exit 3
  exit 0
}

# Figures of the program: one line of the report from a report.json.
figures() {
  command -v python3 >/dev/null || { tr -d '\n' <"$1" | head -c 4000 && return; }
  python3 - "$1" <<'PYTHON'
import json
import sys

report = json.load(open(sys.argv[1], encoding="utf-8"))
get = lambda group, key: report[group][key] if report[group][key] is not None else float("nan")
gpu = f"GPU memory {get('memory', 'gpu_mb'):.0f} MB, GPU busy {100 * get('gpu', 'utilisation'):.0f} %; "
print(f"{report['frames']['tracked']} of {report['frames']['total']} frames, "
      f"online PSNR {get('image_online', 'psnr_db'):.2f} dB, "
      f"refined {get('image', 'psnr_db'):.2f} dB, {report['mapping']['iterations']} iterations of "
      f"{get('mapping', 'ms_per_iteration'):.2f} ms, {report['mapping']['gaussians']} gaussians, tracking "
      f"{get('tracking', 'fps'):.0f} frames/s, ATE {100 * get('ate', 'rmse_m'):.2f} cm; "
      f"{gpu if report['memory']['gpu_mb'] is not None else ''}{report['machine']}")
PYTHON
}

# compare_images A B: renders as .npy of both backends; the largest difference must be small, but for the few pixels
# where rounding decides whether a splat counts.
compare_images() {
  command -v python3 >/dev/null || { echo "there is no python3" && return 77; }
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

# --- The engine, for which nvcc, cmake and this folder are enough ---

find_gpu() {
  gpu=$(nvidia-smi --query-gpu=name,driver_version,compute_cap --format=csv,noheader 2>/dev/null | sed -n 1p) || gpu=
  [ -n "$gpu" ] || [ ! -e /dev/nvidiactl ] || gpu="unknown, there is no nvidia-smi"
  capability=$(sed -n 's/.*, *\([0-9]*\)\.\([0-9]*\)$/\1\2/p' <<<"$gpu")
  capability=${capability:-90}
}

build_engine() {
  local configure=(cmake -S src/splatting/standalone -B "$build/engine" -DPHOTOSLAM_CUDA_ARCHITECTURES="$capability")
  "${configure[@]}" || { rm -rf "$build/engine" && "${configure[@]}"; } || return 1
  cmake --build "$build/engine" --parallel "$jobs"
}

describe_machine() {
  note "# GPU check, $(date -u +%Y-%m-%d)"
  note ""
  note "GPU: ${gpu:-none}. Processor: $(sed -n 's/^model name.*: //p' /proc/cpuinfo | sed -n 1p), $jobs threads." \
    "nvcc: $(nvcc --version 2>/dev/null | sed -n 's/.*release \([0-9.]*\).*/\1/p')." \
    "Revision: $(cat revision 2>/dev/null || git rev-parse --short HEAD 2>/dev/null || echo unknown)."
  note ""
  note "| step | result | time |"
  note "|---|---|---|"
}

# sanitize TOOL ARGUMENT...: under compute-sanitizer, where there is one.
sanitize() {
  local tool=$1
  shift
  if [ -z "$sanitizer" ]; then
    unchecked "$tool" "there is no compute-sanitizer"
  elif [ ! -x "$engine/engine_device_test" ]; then
    unchecked "$tool" "the tests were not built"
  else
    step "$tool" 80 "$sanitizer" --tool "$tool" --error-exitcode 1 "$@"
  fi
}

check_engine() {
  step "build" 200 bash -c build_engine
  if [ -z "$gpu" ]; then
    step "tests on the host" 200 "$engine/engine_host_test"
    return
  fi
  if [ -x "$engine/engine_device_test" ]; then
    step "tests on the GPU" 90 "$engine/engine_device_test"
  else
    unchecked "tests on the GPU" "they were not built: is there an nvcc?"
  fi
  sanitize memcheck --leak-check full "$engine/engine_device_test"
}

# With nothing else running.
measure_engine() {
  [ -n "$gpu" ] || return
  [ -x "$engine/engine_bench" ] || { unchecked "bench of the engine" "it was not built" && return; }
  step "bench of the engine" 40 "$engine/engine_bench" &&
    note "| \`$(tr -d '\n' <"$out/bench_of_the_engine.log")\`" \
      "(aims on an H200: 1.4 ms per step, 0.5 ms per frame drawn, 2 ms per frame undistorted) | | |"
}

# --- The program, from the bundle ---

find_program() {
  carried=
  if [ -f "$bundle" ]; then
    carried=$build/bundle
    mkdir -p "$carried" && tar -xzf "$bundle" -C "$carried" || carried=
    [ ! -f "$rooms_file" ] || [ -z "$carried" ] || tar -xf "$rooms_file" -C "$carried"
  elif [ -d program ]; then
    carried=.
  fi
  rooms=${carried:-.}/rooms
  program=(env "LD_LIBRARY_PATH=$PWD/$carried/program/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}")
  program+=("$PWD/$carried/program/photoslam")
}

# Films what the bundle does not hold, in the background and in a process group of its own.
start_filming() {
  local script='for frames in $lengths; do film "$1" "$frames" "$rooms/room-$frames" || exit 1; done'
  LD_LIBRARY_PATH="$PWD/$carried/program/lib" setsid nice bash -c "$script" _ "${program[2]}" >"$out/film.log" 2>&1 &
  filming=$!
}
filming_pauses() { [ -z "$filming" ] || kill -STOP -- "-$filming" 2>/dev/null; }
filming_goes_on() { [ -z "$filming" ] || kill -CONT -- "-$filming" 2>/dev/null; }

# wait_for_room FRAMES SECONDS
wait_for_room() {
  [ ! -d "$rooms/room-$1" ] || return 0
  filming_goes_on
  local script='while [ ! -d "$1" ]; do sleep 1; kill -0 "$2" || { [ -d "$1" ] && exit; exit 1; }; done'
  step "film $1 frames" "$2" bash -c "$script" _ "$rooms/room-$1" "$filming"
}

# run_room FRAMES REFINE_SECONDS LIMIT: the program, as fast as tracking goes.
run_room() {
  wait_for_room "$1" "$3" || { unchecked "run, $1 frames" "they were not filmed" && return 1; }
  filming_pauses
  rm -rf "$out/run-$1"
  step "run, $1 frames" "$3" "${program[@]}" run "$rooms/room-$1" --backend "$backend" --pace asap \
    --refine-seconds "$2" --output "$out/run-$1" --no-session || return 1
  note "| $(figures "$out/run-$1/report.json") | | |"
}

# compare_backends FRAMES: what the CPU and the GPU draw of the map of a run, and how fast they train it.
compare_backends() {
  local run=$out/run-$1 backends=cpu on
  [ -z "$gpu" ] || backends="cuda cpu"
  rm -rf "$build"/{transforms,render-cpu,render-cuda}
  step "export" 30 "${program[@]}" export "$run" --to transforms --output "$build/transforms" || return 1
  for on in $backends; do
    step "bench on $on" 60 "${program[@]}" bench splat --model "$run/map.ply" --backend "$on" \
      --cameras "$build/transforms/transforms.json" --rounds 1 --json
    step "render on $on" 30 "${program[@]}" render "$run" --orbit --orbit-frames 6 --backend "$on" \
      --format npy --output "$build/render-$on"
  done
  [ -n "$gpu" ] || return 0
  step "images equal those of the CPU" 30 bash -c 'compare_images "$@"' _ "$build/render-cpu" "$build/render-cuda" &&
    note "| $(cat "$out/images_equal_those_of_the_CPU.log") | | |"
}

# The tests of the program against the GPU it finds; finding none is a failure.
steps_equal() {
  local log code=0
  log=$("$@" --gtest_filter='Gpu.OfThisMachine*' 2>&1) || code=$?
  echo "$log"
  [ "$code" = 0 ] && grep -q ' OK ' <<<"$log"
}

check_program() {
  [ ! -f "$engine/photoslam_cuda.so" ] || cp "$engine/photoslam_cuda.so" "$carried/program/"
  step "doctor" 20 "${program[@]}" doctor
  [ -z "$gpu" ] || step "steps equal those of the CPU" 40 bash -c 'steps_equal "$@"' _ "${program[@]:0:2}" \
    "$PWD/$carried/program/splatting_test"
  local limit=100
  [ -n "$gpu" ] || limit=300
  run_room "$first" 5 "$limit" && compare_backends "$first"
}

check() {
  check_engine
  filming_pauses
  measure_engine
  if [ -n "$carried" ]; then check_program; else unchecked program "there is no $bundle"; fi
  filming_goes_on
  if [ -n "$gpu" ]; then
    sanitize racecheck "$engine/engine_device_test" Sort Prefix Loss StepIsAdam Images Smaller Undistort
    sanitize initcheck "$engine/engine_device_test" Sort Prefix Loss StepIsAdam Arrange Fates Smaller Undistort
    sanitize synccheck "$engine/engine_device_test" Sort Prefix Loss StepIsAdam Images Smaller Undistort
  fi
  [ -n "$carried" ] || return
  for frames in $lengths; do
    [ "$frames" = "$first" ] || run_room "$frames" 0 300
  done
}

case $mode in
  bundle) make_bundle && exit 0 ;;
  check) ;;
  *) echo "gpu_check: $mode is neither bundle nor check" >&2 && exit 1 ;;
esac
mkdir -p "$out" "$build" || exit 1
report=$out/gpu-$(date -u +%Y-%m-%d).md
: >"$report" || exit 1
passed=0 failures=() missing=() child='' filming='' ended=no gpu=''
first=${lengths%% *}
engine=$build/engine
jobs=$(nproc)
cuda=${CUDA_HOME:-/usr/local/cuda}
PATH=$PATH:$cuda/bin
trap finish EXIT
trap 'exit 1' INT TERM
find_gpu
backend=${gpu:+cuda} backend=${backend:-cpu}
describe_machine
sanitizer=$(command -v compute-sanitizer || ls "$cuda/compute-sanitizer/compute-sanitizer" 2>/dev/null)
find_program
export -f film build_engine compare_images steps_equal
export build capability jobs lengths rooms
[ -z "$carried" ] || start_filming
check
ended=yes
