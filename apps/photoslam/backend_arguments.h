// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "splatting/gpu.h"

namespace photoslam {

/// --backend and --gpu-memory.
struct BackendArguments {
  std::string backend = "auto";
  double memory_mb = 2000;

  void bind(CLI::App& command);
  /// The GPU to splat on, or null for the CPU; says on stderr which, and why not the GPU.
  Result<std::shared_ptr<splatting::Gpu>> open() const;
};

/// Says on stderr that the GPU has failed on the way, if it has.
void report_failure(const splatting::Gpu* gpu);

}  // namespace photoslam
