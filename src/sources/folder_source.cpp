// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/folder_source.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "io/image_file.h"
#include "sources/calibration/calibration.h"
#include "sources/image_list_source.h"
#include "sources/sensor_choice.h"

namespace photoslam::internal {
namespace {

namespace fs = std::filesystem;

constexpr double kUsualRate = 30;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool is_image(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension == ".jpg" || extension == ".jpeg" || extension == ".png";
}

std::vector<fs::path> list_images(const fs::path& folder) {
  std::vector<fs::path> images;
  std::error_code code;
  for (const auto& entry : fs::directory_iterator(folder, code)) {
    if (is_image(entry.path()) && !entry.path().filename().string().starts_with('.')) images.push_back(entry.path());
  }
  std::ranges::sort(images, [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return images;
}

}  // namespace

bool natural_less(const std::string& a, const std::string& b) {
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
      continue;
    }
    const auto number = [](const std::string& text, size_t& at) {
      while (at + 1 < text.size() && text[at] == '0' && is_digit(text[at + 1])) ++at;
      const size_t begin = at;
      while (at < text.size() && is_digit(text[at])) ++at;
      return std::string_view(text).substr(begin, at - begin);
    };
    const std::string_view x = number(a, i), y = number(b, j);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  if ((i < a.size()) != (j < b.size())) return j < b.size();
  return a < b;  // "01" and "1"
}

bool looks_like_images(const fs::path& folder) { return !list_images(folder).empty(); }

Result<std::unique_ptr<FrameSource>> open_images(const fs::path& folder, const SourceOptions& options) {
  SourceInfo info;
  info.format = "images";
  info.name = fmt::format("{} (images)", fs::weakly_canonical(folder).filename().string());
  constexpr std::array<SensorKind, 1> kAvailable = {SensorKind::mono};
  const Result<SensorKind> sensor = choose_sensor(options.sensor, kAvailable, info.name);
  if (!sensor) return sensor.error();
  info.sensor = *sensor;
  const std::vector<fs::path> images = list_images(folder);
  if (images.empty()) return error("{} holds no .jpg or .png images", folder.string());
  Result<ImageU8> first = read_image(images.front());
  for (size_t i = 1; !first && i < std::min<size_t>(images.size(), 20); ++i) first = read_image(images[i]);
  if (!first) return error("{}: none of the first images can be read: {}", info.name, first.error().message);

  const bool own = options.camera.empty() && fs::exists(folder / "camera.yaml");
  const auto camera = chosen_camera(own ? folder / "camera.yaml" : options.camera, options.fov_deg, first->width(),
                                    first->height(), info.notes);
  if (!camera) return camera.error();
  if (!*camera) {
    return error("{} has no calibration: name one with --camera FILE, or guess with --fov DEGREES (phones: about 70)",
                 folder.string());
  }
  if (Status status = apply_camera(**camera, options.camera.string(), info); !status) return status.error();
  if (options.frames_per_second > 0) info.frames_per_second = options.frames_per_second;
  if (info.frames_per_second <= 0) {
    info.frames_per_second = kUsualRate;
    info.notes.push_back(fmt::format("no frame rate given: taking {} Hz; --fps tells", kUsualRate));
  }
  std::vector<ListedFrame> frames;
  for (const fs::path& image : images) {
    const auto time = static_cast<int64_t>(static_cast<double>(frames.size()) * 1e9 / info.frames_per_second);
    frames.push_back({time, image, {}, {}});
  }
  return make_image_list_source(std::move(info), std::move(frames));
}

}  // namespace photoslam::internal
