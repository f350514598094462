// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/tum_source.h"

#include <array>

#include "sources/calibration/calibration.h"
#include "sources/image_list_source.h"
#include "sources/sensor_choice.h"
#include "sources/timed_list.h"

namespace photoslam::internal {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kLargestTimeDifference = 20'000'000;  // ns
constexpr double kDefaultDepthScale = 5000;

std::optional<fs::path> find_associations(const fs::path& folder) {
  for (const char* name : {"associations.txt", "associate.txt", "association.txt"}) {
    if (fs::is_regular_file(folder / name)) return folder / name;
  }
  return std::nullopt;
}

Result<std::vector<ListedFrame>> read_associations(const fs::path& path) {
  std::vector<ListedFrame> frames;
  const fs::path folder = path.parent_path();
  const Status status = read_timed_list(
      path, TimeUnit::seconds, 4, "time colour-file time depth-file", [&](int64_t time, const TextLine& line) {
        frames.push_back({time, folder / line.fields[1], folder / line.fields[3], {}});
      });
  if (!status) return status.error();
  return frames;
}

Result<std::vector<ListedFrame>> match_lists(const fs::path& folder, SensorKind sensor,
                                             std::vector<std::string>& notes) {
  const Result<ImageList> color = read_image_list(folder / "rgb.txt", TimeUnit::seconds, folder);
  if (!color) return color.error();
  std::vector<ListedFrame> frames;
  if (sensor == SensorKind::mono) {
    for (size_t i = 0; i < color->times.size(); ++i) frames.push_back({color->times[i], color->paths[i], {}, {}});
    return frames;
  }
  const Result<ImageList> depth = read_image_list(folder / "depth.txt", TimeUnit::seconds, folder);
  if (!depth) return depth.error();
  const auto pairs =
      match_image_lists(*color, *depth, kLargestTimeDifference, "colour images have no depth image", notes);
  if (!pairs) return error("{}: {}", folder.string(), pairs.error().message);
  for (const auto& [i, j] : *pairs) frames.push_back({color->times[i], color->paths[i], depth->paths[j], {}});
  return frames;
}

/// Published calibrations of the three Kinects of the TUM RGB-D benchmark, for its folders that come without one.
std::optional<CameraFile> known_camera(const fs::path& folder) {
  struct Known {
    std::array<const char*, 2> names;
    CameraFile file;
  };
  static const std::array<Known, 3> kKnown = {{
      {{"freiburg1", "fr1"},
       {{640, 480, 517.306408, 516.469215, 318.643040, 255.313989},
        {0.262383, -0.953104, -0.005358, 0.002628, 1.163314},
        {},
        {}}},
      {{"freiburg2", "fr2"},
       {{640, 480, 520.908620, 521.007327, 325.141442, 249.701764},
        {0.231222, -0.784899, -0.003257, -0.000105, 0.917205},
        {},
        {}}},
      {{"freiburg3", "fr3"}, {{640, 480, 535.4, 539.2, 320.1, 247.6}, {}, {}, {}}},
  }};
  const std::string name = fs::weakly_canonical(folder).filename().string();
  for (const auto& [names, file] : kKnown) {
    for (const char* part : names) {
      if (name.find(part) != std::string::npos) return file;
    }
  }
  return std::nullopt;
}

Result<CameraFile> find_camera(const fs::path& folder, const SourceOptions& options,
                               const std::vector<ListedFrame>& frames, std::vector<std::string>& notes) {
  if (!options.camera.empty()) return read_calibration(options.camera);
  if (fs::exists(folder / "camera.yaml")) return read_calibration(folder / "camera.yaml");
  if (const std::optional<CameraFile> known = known_camera(folder)) {
    notes.push_back(
        fmt::format("no camera.yaml: using the calibration published for the TUM RGB-D benchmark's camera, "
                    "chosen by the folder's name (fx = {}, fy = {})",
                    known->camera.fx, known->camera.fy));
    return *known;
  }
  if (options.fov_deg > 0) {
    const auto size = image_size(frames);
    if (!size) return size.error();
    Result<std::optional<CameraFile>> guess = chosen_camera({}, options.fov_deg, size->width, size->height, notes);
    if (!guess) return guess.error();
    return std::move(guess->value());
  }
  return error(
      "{} has no camera.yaml; write one with width, height, fx, fy, cx, cy and depth_scale, or name one with --camera",
      folder.string());
}

}  // namespace

bool looks_like_tum(const fs::path& folder) {
  return find_associations(folder).has_value() || fs::is_regular_file(folder / "rgb.txt");
}

Result<std::unique_ptr<FrameSource>> open_tum(const fs::path& folder, const SourceOptions& options) {
  SourceInfo info;
  info.format = "tum";
  info.name = fmt::format("{} (TUM RGB-D)", fs::weakly_canonical(folder).filename().string());
  const std::optional<fs::path> associations = find_associations(folder);
  std::vector<SensorKind> available;
  if (associations || fs::is_regular_file(folder / "depth.txt")) available.push_back(SensorKind::rgbd);
  available.push_back(SensorKind::mono);
  const Result<SensorKind> sensor = choose_sensor(options.sensor, available, info.name);
  if (!sensor) return sensor.error();
  info.sensor = *sensor;
  Result<std::vector<ListedFrame>> frames =
      associations ? read_associations(*associations) : match_lists(folder, info.sensor, info.notes);
  if (!frames) return frames.error();
  const Result<CameraFile> camera = find_camera(folder, options, *frames, info.notes);
  if (!camera) return camera.error();

  info.camera = camera->camera;
  info.distortion = camera->distortion;
  info.camera_is_guess = camera->is_guess;
  info.frames_per_second = camera->frames_per_second.value_or(0);
  if (info.sensor == SensorKind::rgbd) {
    set_depth_unit(camera->depth_scale, kDefaultDepthScale, info);
  } else {
    for (ListedFrame& frame : *frames) frame.depth.clear();
  }
  return make_image_list_source(std::move(info), std::move(*frames));
}

}  // namespace photoslam::internal
