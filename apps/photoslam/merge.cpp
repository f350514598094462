// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <thread>

#include "base/file.h"
#include "commands.h"
#include "config_arguments.h"
#include "io/gaussian_ply.h"
#include "io/trajectory_file.h"
#include "photorealistic_mapping/world_export.h"
#include "pipeline/session_file.h"
#include "pipeline/session_merge.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

struct MergeArguments {
  fs::path first, second;
  fs::path output = "output/merged";
  int threads = 0;
  ConfigArguments config;
};

Status write_merged(const fs::path& folder, const MergedSessions& merged) {
  if (Status status = prepare_output_folder(folder); !status) return status;
  if (Status status = write_session(folder / kSessionFile, merged.session); !status) return status;
  // Files show one world, that of the first session's beginning; the session keeps what hangs together with nothing.
  Trajectory keyframes;
  std::vector<uint8_t> connected;
  for (size_t i = 0; i < merged.keyframe_times_ns.size(); ++i) {
    connected.push_back(merged.component_of_keyframe[i] == 0 ? 1 : 0);
    if (connected.back() == 0) continue;
    keyframes.push_back({merged.keyframe_times_ns[i], merged.map.keyframes_from_world[i].inverse()});
  }
  if (Status status = write_tum_trajectory(folder / "keyframes.tum", keyframes); !status) return status;
  const auto written =
      write_gaussian_ply(folder / "map.ply", to_world(merged.map.gaussians, merged.map.anchors_from_world, connected));
  return written ? Status{} : written.error();
}

Status merge(const MergeArguments& arguments) {
  const auto options = arguments.config.load();
  if (!options) return options.error();
  const auto first = read_session(arguments.first);
  if (!first) return first.error();
  const auto second = read_session(arguments.second);
  if (!second) return second.error();
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  ThreadPool executor(arguments.threads > 0 ? arguments.threads : cores);
  const auto merged = merge_sessions(*options, *first, *second, executor);
  if (!merged)
    return error("{} and {}: {}", arguments.first.string(), arguments.second.string(), merged.error().message);
  if (Status status = write_merged(arguments.output, *merged); !status) return status;
  const auto num_keyframes = static_cast<int>(merged->keyframe_times_ns.size());
  fmt::print("{} + {} keyframes, {} loop(s) closed, {} gaussians: {}\n", merged->num_keyframes_of_first,
             num_keyframes - merged->num_keyframes_of_first, merged->num_loops, merged->map.gaussians.size(),
             arguments.output.string());
  return {};
}

}  // namespace

void add_merge(CommandLine& line) {
  auto arguments = std::make_shared<MergeArguments>();
  CLI::App& command = line.add("merge", "Join two sessions of the same place into one map",
                               "  photoslam merge output/monday output/tuesday --output output/both\n"
                               "  photoslam run wednesday --load-map output/both\n");
  MergeArguments& a = *arguments;
  command.add_option("first", a.first, "Session whose world stays: session.photoslam or the folder of its run")
      ->required();
  command.add_option("second", a.second, "Session that is brought into it, made with the same camera")->required();
  command.add_option("--output", a.output, "Folder for session.photoslam, map.ply and keyframes.tum")
      ->capture_default_str();
  command.add_option("--threads", a.threads, "Threads to use; 0 = one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  a.config.bind(command);
  line.on_run(command, [arguments] { return merge(*arguments); });
}

}  // namespace photoslam
