// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <map>
#include <memory>
#include <set>
#include <thread>

#include "base/file.h"
#include "commands.h"
#include "evaluation/map_scoring.h"
#include "evaluation/run_evaluation.h"
#include "evaluation/seen_surfaces.h"
#include "evaluation/true_trajectory.h"
#include "result_table.h"
#include "run_folder.h"
#include "sources/ground_truth.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

struct EvalArguments {
  fs::path folder;
  fs::path truth;
  std::string frames = "all";
  std::string poses = "estimate";
  fs::path table;
  double seen_until = 0;
  bool json = false;
};

/// What a run has left in its folder, and the truth about its trajectory where there is any.
struct FinishedRun {
  RunDescription description;
  FrameLog log;
  Trajectory estimate, online;
  std::optional<Trajectory> truth;
};

/// Whether a frame of the log is among those asked for.
bool is_chosen(const FrameRecord& frame, const std::string& which, int hold_out) {
  if (which == "keyframes") return frame.keyframe.valid();
  if (which == "held-out") return hold_out > 0 && frame.frame.value % hold_out == hold_out - 1;
  return true;
}

/// The true poses of the estimate's frames in the estimate's world. Positions alone hardly tell how a short walk is
/// turned, and renders are sensitive to that: the worlds are aligned by mean rotation and mean position.
Result<Trajectory> true_poses(const Trajectory& estimate, const std::optional<Trajectory>& truth, bool with_scale) {
  const auto alignment = truth ? absolute_error(estimate, *truth, with_scale) : std::nullopt;
  if (!alignment) return error("--poses truth needs a true trajectory of the sequence: --truth");
  Trajectory poses;
  Vec3 own_centre = Vec3::Zero(), true_centre = Vec3::Zero();
  Eigen::Vector4d rotation_sum = Eigen::Vector4d::Zero();
  const auto pairs = associate(estimate, *truth);
  for (const auto& [own, theirs] : pairs) {
    const SE3 &own_pose = estimate[own].world_from_camera, &true_pose = (*truth)[theirs].world_from_camera;
    poses.push_back({estimate[own].timestamp_ns, true_pose});
    own_centre += own_pose.translation / static_cast<double>(pairs.size());
    true_centre += true_pose.translation / static_cast<double>(pairs.size());
    const Eigen::Vector4d rotation = (own_pose.rotation * true_pose.rotation.conjugate()).coeffs();
    rotation_sum += rotation.dot(rotation_sum) < 0 ? Eigen::Vector4d(-rotation) : rotation;
  }
  Sim3 estimate_from_truth(1 / alignment->scale, Quat(rotation_sum).normalized(), Vec3::Zero());
  estimate_from_truth.translation = own_centre - estimate_from_truth * true_centre;
  return aligned(poses, estimate_from_truth);
}

/// The first seconds have seen what they show; of later frames those pixels count whose surface those seconds saw, by
/// true poses. Frames without a true pose are not scored.
void count_only_seen(double seconds, const FinishedRun& run, double metres_per_depth_unit, ScoringTask& task) {
  std::map<int64_t, SE3> pose_at;
  for (const auto& [own, theirs] : associate(run.estimate, *run.truth)) {
    pose_at[run.estimate[own].timestamp_ns] = (*run.truth)[theirs].world_from_camera.inverse();
  }
  std::map<FrameId, SE3> poses;
  std::set<FrameId> early;
  for (const FrameRecord& frame : run.log) {
    const auto pose = pose_at.find(frame.timestamp_ns);
    const auto id = static_cast<size_t>(frame.frame.value);
    if (pose != pose_at.end()) {
      poses[frame.frame] = pose->second;
      if (1e-9 * static_cast<double>(frame.timestamp_ns - run.log.front().timestamp_ns) <= seconds)
        early.insert(frame.frame);
    } else if (id < task.camera_from_world.size()) {
      task.camera_from_world[id].reset();
    }
  }
  auto seen = std::make_shared<SeenSurfaces>(run.description.camera, metres_per_depth_unit);
  task.mask = [seen, poses = std::move(poses), early = std::move(early)](FrameId id, const ImageU16& depth) {
    const auto pose = poses.find(id);
    if (pose == poses.end()) return ImageU8();
    if (!early.contains(id)) return seen->mask(pose->second, depth);
    seen->add_view(pose->second, depth);
    return ImageU8();
  };
}

Result<std::vector<FrameScore>> score_run(const EvalArguments& arguments, const FinishedRun& run, FrameSource& source,
                                          const Trajectory& poses) {
  const auto table = read_gaussian_ply(arguments.folder / "map.ply");
  if (!table) return table.error();
  const auto exposures = read_run_exposures(arguments.folder);
  if (!exposures) return exposures.error();
  const splatting::GaussianModel model = from_world(*table);
  const std::vector<SE3> world = {SE3{}};

  std::map<int64_t, SE3> pose_at;
  for (const StampedPose& pose : poses) pose_at[pose.timestamp_ns] = pose.world_from_camera.inverse();
  ScoringTask task{&model, world, {}};
  for (const FrameRecord& frame : run.log) {
    const auto pose = pose_at.find(frame.timestamp_ns);
    if (pose == pose_at.end() || !is_chosen(frame, arguments.frames, run.description.hold_out)) continue;
    const auto id = static_cast<size_t>(frame.frame.value);
    if (task.camera_from_world.size() <= id) {
      task.camera_from_world.resize(id + 1);
      task.exposures.resize(id + 1);
    }
    task.camera_from_world[id] = pose->second;
    task.exposures[id] = nearest_exposure(*exposures, frame.timestamp_ns);
  }
  if (arguments.seen_until > 0) {
    if (!run.truth || source.info().sensor != SensorKind::rgbd) {
      return error("--seen-until needs measured depth and a true trajectory; {} lacks {}",
                   run.description.dataset.string(), run.truth ? "depth images" : "the trajectory (--truth)");
    }
    count_only_seen(arguments.seen_until, run, source.info().metres_per_depth_unit, task);
  }
  ThreadPool executor(std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
  return score_maps(source, std::span(&task, 1), {}, executor).front().scores;
}

std::string as_csv(const std::vector<FrameScore>& scores) {
  std::string csv = "frame,timestamp,psnr_db,ssim,share\n";
  for (const FrameScore& s : scores) {
    csv += fmt::format("{},{:.9f},{:.4f},{:.5f},{:.4f}\n", s.frame.value, 1e-9 * static_cast<double>(s.timestamp_ns),
                       s.psnr_db, s.ssim, s.share);
  }
  return csv;
}

Result<FinishedRun> read_run(const EvalArguments& arguments, const RunDescription& description,
                             const SourceInfo& source) {
  FinishedRun run;
  run.description = description;
  const auto take = [](auto read, auto& target) -> Status {
    if (!read) return read.error();
    target = std::move(*read);
    return {};
  };
  const fs::path& folder = arguments.folder;
  if (Status s = take(read_tum_trajectory(folder / "trajectory.tum"), run.estimate); !s) return s.error();
  if (Status s = take(read_tum_trajectory(folder / "trajectory_online.tum"), run.online); !s) return s.error();
  if (Status s = take(read_frame_log(folder / "frames.csv"), run.log); !s) return s.error();
  const auto truth = arguments.truth.empty() ? find_ground_truth(description.dataset) : std::optional(arguments.truth);
  if (!truth) return run;
  if (Status s = take(read_true_trajectory(*truth, source), run.truth); !s) return s.error();
  if (!absolute_error(run.estimate, *run.truth, false)) {
    return error("{}: fewer than three poses within 20 ms of those of {}", truth->string(),
                 (folder / "trajectory.tum").string());
  }
  return run;
}

/// All image figures but those of the map at the end of the input, which only the run had.
void set_images(const std::vector<FrameScore>& scores, const FinishedRun& run, Report& report) {
  const auto among = [&](const std::string& which) {
    std::set<FrameId> chosen;
    for (const FrameRecord& frame : run.log) {
      if (is_chosen(frame, which, run.description.hold_out)) chosen.insert(frame.frame);
    }
    return summarize(scores, chosen);
  };
  report.image = summarize(scores);
  report.image_keyframes = among("keyframes");
  report.image_held_out = among("held-out");
  report.image_online = {};
}

Status eval(const EvalArguments& arguments) {
  HtmlReport html;
  auto report = read_report(arguments.folder / "report.json");
  if (!report) return report.error();
  html.report = std::move(*report);
  auto description = read_run_description(arguments.folder);
  if (!description) return description.error();
  auto source = open_run_source(arguments.folder, *description);
  if (!source) return source.error();
  const auto run = read_run(arguments, *description, (*source)->info());
  if (!run) return run.error();
  const bool with_scale = (*source)->info().sensor == SensorKind::mono;
  if (arguments.seen_until > 0) {  // depth that the run did not use tells what was seen
    description->source.sensor.reset();
    source = open_run_source(arguments.folder, *description);
    if (!source) return source.error();
  }
  if (run->truth) evaluate_trajectories(run->estimate, run->online, *run->truth, with_scale, html);

  const auto poses = arguments.poses == "truth" ? true_poses(run->estimate, run->truth, with_scale)
                                                : Result<Trajectory>(run->estimate);
  if (!poses) return poses.error();
  const auto scores = score_run(arguments, *run, **source, *poses);
  if (!scores) return scores.error();
  if (scores->empty()) return error("{}: no frames to score among '{}'", arguments.folder.string(), arguments.frames);
  if (!arguments.table.empty()) {
    if (Status status = write_file_atomically(arguments.table, as_csv(*scores)); !status) return status;
  }
  set_images(*scores, *run, html.report);
  fmt::print("{}", arguments.json ? to_json(html.report) : result_table(html.report));
  return {};
}

}  // namespace

void add_eval(CommandLine& line) {
  auto arguments = std::make_shared<EvalArguments>();
  CLI::App& command = line.add("eval", "Measure a finished run again: trajectory and images",
                               "  photoslam eval output/desk\n"
                               "  photoslam eval output/desk --truth groundtruth.txt --frames keyframes\n");
  command.add_option("run", arguments->folder, "Output folder of a run")->required();
  command.add_option("--truth", arguments->truth, "True trajectory of the left camera: a file or a sequence folder");
  command.add_option("--frames", arguments->frames, "Frames whose images are scored")
      ->check(CLI::IsMember({"all", "keyframes", "held-out"}))
      ->capture_default_str();
  command
      .add_option("--poses", arguments->poses,
                  "Where images are rendered: at the run's own poses, or at the true ones, brought into its world by "
                  "one alignment: what better poses alone would change")
      ->check(CLI::IsMember({"estimate", "truth"}))
      ->capture_default_str();
  command
      .add_option("--seen-until", arguments->seen_until,
                  "Of the frames after the first so many seconds count only the pixels whose surface was seen in them, "
                  "by measured depth and true poses: how a map made of the beginning generalises [s]")
      ->check(CLI::Range(0.0, 1e9));
  command.add_option("--table", arguments->table,
                     "Also write of each frame PSNR, SSIM and the share of its pixels that count to this CSV file");
  command.add_flag("--json", arguments->json, "Print JSON instead of the table");
  line.on_run(command, [arguments] { return eval(*arguments); });
}

}  // namespace photoslam
