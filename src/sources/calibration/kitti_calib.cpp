// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/calibration/kitti_calib.h"

#include <array>

#include "base/file.h"
#include "io/text_table.h"

namespace photoslam {
namespace {

constexpr size_t kNumbers = 12;

/// The number n of a line "Pn: …", or "P_rect_0n: …" as in the raw recordings; -1 of other lines.
int camera_number(std::string_view label) {
  for (const std::string_view prefix : {std::string_view("P_rect_0"), std::string_view("P")}) {
    if (label.size() == prefix.size() + 2 && label.starts_with(prefix) && label.back() == ':') {
      const char digit = label[prefix.size()];
      if (digit >= '0' && digit <= '9') return digit - '0';
    }
  }
  return -1;
}

Result<KittiCamera> parse_projection(const TextLine& line) {
  if (line.fields.size() != kNumbers + 1) {
    return error("expected the 12 numbers of a projection matrix, found {} fields", line.fields.size() - 1);
  }
  std::array<double, kNumbers> p{};
  for (size_t i = 0; i < kNumbers; ++i) {
    const Result<double> number = parse_number(line.fields[i + 1]);
    if (!number) return number.error();
    p[i] = *number;
  }
  if (!(p[0] > 0 && p[5] > 0) || p[1] != 0 || p[4] != 0 || p[8] != 0 || p[9] != 0 || p[10] != 1) {
    return error("not the projection matrix of a rectified camera: expected fx 0 cx · 0 fy cy · 0 0 1 ·");
  }
  KittiCamera camera{p[0], p[5], p[2], p[6], {}};
  const double tz = p[11];
  camera.camera_from_cam0 = {(p[3] - camera.cx * tz) / camera.fx, (p[7] - camera.cy * tz) / camera.fy, tz};
  return camera;
}

}  // namespace

Result<std::map<int, KittiCamera>> read_kitti_calib(const std::filesystem::path& path) {
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  std::map<int, KittiCamera> cameras;
  for (const TextLine& line : split_table(*content)) {
    const int number = camera_number(line.fields.front());
    if (number < 0) continue;
    const Result<KittiCamera> camera = parse_projection(line);
    if (!camera) return error("{}:{}: {}", path.string(), line.number, camera.error().message);
    cameras[number] = *camera;
  }
  if (cameras.empty()) return error("{} has no line 'P0: …' with a projection matrix", path.string());
  return cameras;
}

}  // namespace photoslam
