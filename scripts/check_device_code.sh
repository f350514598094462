#!/usr/bin/env bash
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
#
# Compiles and links the kernels of src/splatting/cuda for the oldest GPU they support and a new one, where there is an
# nvcc; says so and stops without an error elsewhere. Prints a table of what each kernel takes, and fails if one spills.
set -euo pipefail
cd "$(dirname "$0")/.."

nvcc=$(command -v nvcc || true)
[ -n "$nvcc" ] || { [ -x /usr/local/cuda/bin/nvcc ] && nvcc=/usr/local/cuda/bin/nvcc; } || {
  echo "check_device_code: skipped, no nvcc"
  exit 0
}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
architectures=${PHOTOSLAM_CUDA_ARCHITECTURES:-"75 90"}
for architecture in $architectures; do
  "$nvcc" -std=c++20 -Werror all-warnings -Isrc -arch="sm_$architecture" -Xptxas -v -shared -Xcompiler -fPIC \
    src/splatting/cuda/kernels.cu -o "$scratch/kernels_$architecture.so" >"$scratch/ptxas_$architecture.log" 2>&1 || {
    cat "$scratch/ptxas_$architecture.log"
    exit 1
  }
done
python3 - "$scratch" $architectures <<'PYTHON'
import re
import sys

folder, architectures = sys.argv[1], sys.argv[2:]
used = {}
for architecture in architectures:
    log = open(f"{folder}/ptxas_{architecture}.log", encoding="utf-8").read()
    for entry in log.split("Compiling entry function")[1:]:
        name = re.search(r"run_kernelINS\w*?_\d+([A-Z][A-Za-z]+?)EEEv", entry)[1]
        shared = re.search(r"(\d+) bytes smem", entry)
        used.setdefault(name, {})[architecture] = (
            int(re.search(r"Used (\d+) registers", entry)[1]),
            int(shared[1]) if shared else 0,
            int(re.search(r"(\d+) bytes stack frame", entry)[1]),
            sum(map(int, re.findall(r"(\d+) bytes spill", entry))),
        )
print("| kernel |" + "".join(f" sm_{a}: registers | shared B | stack B | spilled B |" for a in architectures))
print("|---|" + "---|" * (4 * len(architectures)))
for name, rows in sorted(used.items()):
    print(f"| {name} |" + "".join(f" {value} |" for a in architectures for value in rows[a]))
if any(row[3] for rows in used.values() for row in rows.values()):
    sys.exit("check_device_code: a kernel spills registers")
PYTHON
echo "check_device_code: the kernels compile and link with $("$nvcc" --version | sed -n 's/.*release \([0-9.]*\).*/nvcc \1/p')"
