// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "backend_arguments.h"

#include <fmt/format.h>

namespace photoslam {

void BackendArguments::bind(CLI::App& command) {
  command
      .add_option("--backend", backend,
                  "Where to splat: cpu, cuda (an error where there is no GPU), or auto: the GPU if there is one")
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}))
      ->capture_default_str();
  command.add_option("--gpu-memory", memory_mb, "At most so much memory of the GPU [MB]")
      ->check(CLI::Range(50.0, 1e6))
      ->capture_default_str();
}

Result<std::shared_ptr<splatting::Gpu>> BackendArguments::open() const {
  std::string note;
  auto gpu = splatting::choose_backend(splatting::parse_backend(backend), memory_mb, note);
  if (!gpu) return error("--backend {}: {}", backend, gpu.error().message);
  if (*gpu) fmt::print(stderr, "splatting on the GPU: {}\n", (*gpu)->name());
  if (!note.empty()) fmt::print(stderr, "splatting on the CPU ({})\n", note);
  return gpu;
}

void report_failure(const splatting::Gpu* gpu) {
  if (gpu == nullptr || gpu->failure().empty()) return;
  fmt::print(stderr, "  note: the GPU has failed ({}); from then on the CPU did the work\n", gpu->failure());
}

}  // namespace photoslam
