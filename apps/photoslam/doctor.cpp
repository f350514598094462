// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <thread>

#include "base/version.h"
#include "commands.h"

namespace photoslam {
namespace {

Status report_machine() {
  fmt::print("photoslam  {} ({})\n", version(), build_description());
  fmt::print("cores      {}\n", std::thread::hardware_concurrency());
  return {};
}

}  // namespace

void add_doctor(CommandLine& line) {
  CLI::App& command =
      line.add("doctor", "Print what this machine offers and what works on it, and why not", "  photoslam doctor\n");
  line.on_run(command, report_machine);
}

}  // namespace photoslam
