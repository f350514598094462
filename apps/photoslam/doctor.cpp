// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <hwy/highway.h>
#include <sys/sysinfo.h>
#include <unistd.h>

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include "base/file.h"
#include "base/version.h"
#include "commands.h"
#include "sources/open_source.h"
#include "splatting/gpu.h"

namespace photoslam {
namespace {

void print_row(const std::string& what, const std::string& finding) { fmt::print("{:<12}{}\n", what, finding); }

std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown processor";
}

/// What this process may use, which a container or taskset makes less than what the machine has.
int usable_cores() {
  cpu_set_t set;
  CPU_ZERO(&set);
  return sched_getaffinity(0, sizeof(set), &set) == 0 ? CPU_COUNT(&set) : 1;
}

std::string memory() {
  struct sysinfo info = {};
  if (sysinfo(&info) != 0) return "unknown";
  const double unit = 1e-9 * info.mem_unit;
  return fmt::format("{:.1f} GB, {:.1f} GB of it free", unit * static_cast<double>(info.totalram),
                     unit * static_cast<double>(info.freeram + info.bufferram));
}

/// The instruction sets that are both built in and understood here; the kernels take the first.
std::string instruction_sets() {
  std::string names;
  for (int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1) {
    if (!names.empty()) names += names.find(' ') == std::string::npos ? " in use; also " : ", ";
    names += hwy::TargetName(left & -left);
  }
  return names;
}

std::string write_access() {
  std::error_code ignored;
  const std::string folder = std::filesystem::current_path(ignored).string();
  const Status status = prepare_output_folder(folder);
  return status.ok() ? "yes, in " + folder : "no: " + status.error().message;
}

Status report_machine() {
  print_row("photoslam", fmt::format("{} ({})", version(), build_description()));
  print_row("processor", fmt::format("{}, {} cores usable", processor_name(), usable_cores()));
  print_row("memory", memory());
  print_row("SIMD", instruction_sets());
  print_row("libraries", fmt::format("Eigen {}.{}.{}, Highway {}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION,
                                     EIGEN_MINOR_VERSION, HWY_MAJOR, HWY_MINOR, HWY_PATCH));
  const auto gpu = splatting::describe_gpu();
  print_row("splatting", "cpu: ready; cuda: " + (gpu ? *gpu : gpu.error().message));
  print_row("input", fmt::format("mono, stereo and RGB-D; formats {}", fmt::join(source_formats(), ", ")));
  const Status video = check_video_support();
  print_row("video", video.ok() ? "ready" : "not readable: " + video.error().message);
  const std::vector<std::string> cameras = describe_cameras();
  print_row("cameras", cameras.empty() ? "none found (/dev/video*)" : fmt::format("{}", fmt::join(cameras, "; ")));
  print_row("LPIPS", "not part of this build: image.lpips is null in reports");
  print_row("write", write_access());
  return {};
}

}  // namespace

void add_doctor(CommandLine& line) {
  CLI::App& command =
      line.add("doctor", "Print what this machine offers and what works on it, and why not", "  photoslam doctor\n");
  line.on_run(command, report_machine);
}

}  // namespace photoslam
