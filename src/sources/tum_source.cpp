// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/tum_source.h"

#include <algorithm>
#include <array>

#include "base/file.h"
#include "io/association.h"
#include "io/text_table.h"
#include "io/trajectory_file.h"
#include "sources/camera_file.h"
#include "sources/image_list_source.h"

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

/// Calls row(fields) for every line of a list whose lines have `columns` fields and begin with increasing times.
template <class Row>
Status read_list(const fs::path& path, size_t columns, const char* layout, Row row) {
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  std::optional<int64_t> last;
  int last_line = 0;
  for (const auto& [number, fields] : split_table(*content)) {
    if (fields.size() != columns) {
      return error("{}:{}: expected '{}', found {} fields", path.string(), number, layout, fields.size());
    }
    const Result<int64_t> time = parse_seconds(fields[0]);
    if (!time) return error("{}:{}: {}", path.string(), number, time.error().message);
    if (last && *time <= *last) {
      return error("{}:{}: the time {} is not after {} in line {}; put the lines in order", path.string(), number,
                   fields[0], format_seconds(*last), last_line);
    }
    last = *time;
    last_line = number;
    row(*time, fields);
  }
  if (!last) return error("{} lists nothing", path.string());
  return {};
}

Result<std::vector<ListedFrame>> read_associations(const fs::path& path) {
  std::vector<ListedFrame> frames;
  const fs::path folder = path.parent_path();
  const Status status = read_list(path, 4, "time colour-file time depth-file", [&](int64_t time, const auto& fields) {
    frames.push_back({time, folder / fields[1], folder / fields[3]});
  });
  if (!status) return status.error();
  return frames;
}

struct ImageList {
  std::vector<int64_t> times;
  std::vector<fs::path> paths;
};

Result<ImageList> read_image_list(const fs::path& path) {
  ImageList list;
  const Status status = read_list(path, 2, "time file", [&](int64_t time, const auto& fields) {
    list.times.push_back(time);
    list.paths.push_back(path.parent_path() / fields[1]);
  });
  if (!status) return status.error();
  return list;
}

Result<std::vector<ListedFrame>> match_lists(const fs::path& folder, std::vector<std::string>& notes) {
  const Result<ImageList> color = read_image_list(folder / "rgb.txt");
  if (!color) return color.error();
  const Result<ImageList> depth = read_image_list(folder / "depth.txt");
  if (!depth) return depth.error();
  std::vector<ListedFrame> frames;
  for (const auto& [i, j] : associate_times(color->times, depth->times, kLargestTimeDifference)) {
    frames.push_back({color->times[i], color->paths[i], depth->paths[j]});
  }
  if (frames.empty()) {
    return error("{}: no colour image of rgb.txt has a depth image of depth.txt within 20 ms", folder.string());
  }
  if (frames.size() < color->times.size()) {
    notes.push_back(fmt::format("{} of {} colour images have no depth image within 20 ms and are left out",
                                color->times.size() - frames.size(), color->times.size()));
  }
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

Result<CameraFile> find_camera(const fs::path& folder, const fs::path& chosen, std::vector<std::string>& notes) {
  if (!chosen.empty()) return read_camera_yaml(chosen);
  if (fs::exists(folder / "camera.yaml")) return read_camera_yaml(folder / "camera.yaml");
  if (const std::optional<CameraFile> known = known_camera(folder)) {
    notes.push_back(
        fmt::format("no camera.yaml: using the calibration published for the TUM RGB-D benchmark's camera, "
                    "chosen by the folder's name (fx = {}, fy = {})",
                    known->camera.fx, known->camera.fy));
    return *known;
  }
  return error(
      "{} has no camera.yaml; write one with width, height, fx, fy, cx, cy and depth_scale, or name one with --camera",
      folder.string());
}

/// Of the median step between frames.
double frame_rate(const std::vector<ListedFrame>& frames) {
  std::vector<int64_t> steps;
  for (size_t i = 1; i < frames.size(); ++i) steps.push_back(frames[i].timestamp_ns - frames[i - 1].timestamp_ns);
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return 1e9 / static_cast<double>(*middle);
}

}  // namespace

bool looks_like_tum(const fs::path& folder) {
  return find_associations(folder).has_value() ||
         (fs::is_regular_file(folder / "rgb.txt") && fs::is_regular_file(folder / "depth.txt"));
}

Result<std::unique_ptr<FrameSource>> open_tum(const fs::path& folder, const fs::path& camera_file) {
  SourceInfo info;
  info.format = "tum";
  info.name = fmt::format("{} (TUM RGB-D)", fs::weakly_canonical(folder).filename().string());
  const Result<CameraFile> camera = find_camera(folder, camera_file, info.notes);
  if (!camera) return camera.error();
  const std::optional<fs::path> associations = find_associations(folder);
  Result<std::vector<ListedFrame>> frames =
      associations ? read_associations(*associations) : match_lists(folder, info.notes);
  if (!frames) return frames.error();

  info.camera = camera->camera;
  info.distortion = camera->distortion;
  if (!camera->depth_scale) {
    info.notes.push_back(fmt::format("no depth_scale given: taking {} depth units for one metre", kDefaultDepthScale));
  }
  info.metres_per_depth_unit = 1 / camera->depth_scale.value_or(kDefaultDepthScale);
  info.frames_per_second = camera->frames_per_second.value_or(frame_rate(*frames));
  return make_image_list_source(std::move(info), std::move(*frames));
}

}  // namespace photoslam::internal
