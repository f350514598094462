// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "run_folder.h"

#include <nlohmann/json.hpp>

#include "base/file.h"
#include "evaluation/run_evaluation.h"
#include "io/gaussian_ply.h"
#include "sources/sensor_choice.h"

namespace photoslam {

namespace fs = std::filesystem;

namespace {

/// A path that means the same from any folder; nothing stays nothing.
fs::path anywhere(const fs::path& path) { return path.empty() ? path : fs::absolute(path); }

}  // namespace

Status write_run_description(const fs::path& folder, const RunDescription& description) {
  const PinholeCamera& c = description.camera;
  const nlohmann::ordered_json json = {
      {"dataset", (is_camera(description.dataset) ? description.dataset : anywhere(description.dataset)).string()},
      {"format", description.source.format},
      {"sensor", description.source.sensor ? sensor_name(*description.source.sensor) : "auto"},
      {"fov_deg", description.source.fov_deg},
      {"frames_per_second", description.source.frames_per_second},
      {"camera_file", anywhere(description.source.camera).string()},
      {"camera", {{"width", c.width}, {"height", c.height}, {"fx", c.fx}, {"fy", c.fy}, {"cx", c.cx}, {"cy", c.cy}}},
      {"hold_out", description.hold_out}};
  return write_file_atomically(folder / "run.json", json.dump(2) + "\n");
}

Result<RunDescription> read_run_description(const fs::path& folder) {
  const fs::path path = folder / "run.json";
  const auto text = read_file(path);
  if (!text) return error("{} is not the output folder of a run: {}", folder.string(), text.error().message);
  try {
    const auto json = nlohmann::json::parse(*text);
    RunDescription description;
    description.dataset = json.at("dataset").get<std::string>();
    description.source.format = json.at("format").get<std::string>();
    const auto sensor = parse_sensor(json.value("sensor", "auto"));
    if (!sensor) return error("{}: {}", path.string(), sensor.error().message);
    description.source.sensor = *sensor;
    description.source.fov_deg = json.value("fov_deg", 0.0);
    description.source.frames_per_second = json.value("frames_per_second", 0.0);
    description.source.camera = json.at("camera_file").get<std::string>();
    const auto& camera = json.at("camera");
    description.camera = {camera.at("width"), camera.at("height"), camera.at("fx"),
                          camera.at("fy"),    camera.at("cx"),     camera.at("cy")};
    description.hold_out = json.at("hold_out");
    return description;
  } catch (const nlohmann::json::exception& e) {
    return error("{}: {}", path.string(), e.what());
  }
}

Result<std::unique_ptr<FrameSource>> open_run_source(const fs::path& folder, const RunDescription& description) {
  if (is_camera(description.dataset)) {
    return error(
        "{}: the images of this run came from the live camera {} and were not kept, but they are needed here; record a "
        "video, then run and measure that",
        folder.string(), description.dataset.string());
  }
  std::error_code ignored;
  if (!fs::exists(description.dataset, ignored)) {
    return error(
        "{}, the sequence of this run, does not exist any more; where it has moved, write its new place into {}",
        description.dataset.string(), (folder / "run.json").string());
  }
  return open_source(description.dataset, description.source);
}

Result<ExposureTrack> read_run_exposures(const fs::path& folder) {
  if (!fs::exists(folder / kExposuresFile)) return ExposureTrack{};
  return read_exposures(folder / kExposuresFile);
}

Status write_run_results(const fs::path& folder, const RunOutcome& run, size_t& map_bytes) {
  for (const auto& [name, trajectory] : {std::pair{"trajectory.tum", final_trajectory(run)},
                                         {"trajectory_online.tum", online_trajectory(run)},
                                         {"keyframes.tum", keyframe_trajectory(run)}}) {
    if (Status status = write_tum_trajectory(folder / name, trajectory); !status) return status;
  }
  if (Status status = write_frame_log(folder / "frames.csv", frame_log(run)); !status) return status;
  if (Status status = write_exposures(folder / kExposuresFile, keyframe_exposures(run, run.final)); !status)
    return status;
  const fs::path map = folder / "map.ply";
  const GaussianTable connected = to_world(run.final.gaussians, run.final.anchors_from_world, connected_keyframes(run));
  const auto written = write_gaussian_ply(map, connected);
  if (!written) return written.error();
  std::error_code ignored;
  map_bytes = fs::file_size(map, ignored);
  return {};
}

}  // namespace photoslam
