// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "base/check.h"
#include "base/file.h"
#include "io/text_table.h"
#include "sources/colmap_binary.h"
#include "sources/colmap_lens.h"
#include "sources/posed_cameras.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

/// A line of numbers and names with the place to name in errors.
class Fields {
 public:
  Fields(const fs::path& path, const TextLine& line) : path_(path), line_(line) {}
  bool has(size_t count) const { return line_.fields.size() >= count; }
  std::string text(size_t i) const { return std::string(line_.fields.at(i)); }
  /// From a field to the end of the line: a name that may have blanks.
  std::string rest(size_t i) const {
    const std::string_view last = line_.fields.back();
    return {line_.fields.at(i).data(), last.data() + last.size()};
  }
  double number(size_t i) {
    const auto value = parse_number(line_.fields.at(i));
    if (!value && failure_.empty()) failure_ = value.error().message;
    return value ? *value : 0;
  }
  Error failure(const std::string& what) const { return error("{}:{}: {}", path_.string(), line_.number, what); }
  bool failed() const { return !failure_.empty(); }
  Error failure() const { return failure(failure_); }

 private:
  const fs::path& path_;
  const TextLine& line_;
  std::string failure_;
};

Result<std::map<std::string, CalibratedCamera>> read_cameras(const fs::path& path) {
  const auto content = read_file(path);
  if (!content) return content.error();
  std::map<std::string, CalibratedCamera> cameras;
  for (const TextLine& line : split_table(*content)) {
    Fields fields(path, line);
    if (!fields.has(5)) return fields.failure("expected: id model width height parameters");
    const auto lens = std::ranges::find(colmap_lenses(), line.fields[1], &ColmapLens::name);
    if (lens == colmap_lenses().end()) return fields.failure(unknown_colmap_lens(line.fields[1]).message);
    if (line.fields.size() != 4 + lens->num_parameters()) {
      return fields.failure(fmt::format("{} parameters of the camera; {} has {}", line.fields.size() - 4, lens->name,
                                        lens->num_parameters()));
    }
    std::vector<double> parameters;
    for (size_t i = 4; i < line.fields.size(); ++i) parameters.push_back(fields.number(i));
    const auto camera = colmap_camera(*lens, fields.number(2), fields.number(3), parameters);
    if (fields.failed()) return fields.failure();
    if (!camera) return fields.failure(camera.error().message);
    cameras[fields.text(0)] = *camera;
  }
  return cameras;
}

/// Every other line: between those of the images stand their features, which may be none.
std::string without_features(const std::string& content) {
  std::string kept;
  bool features = false;
  for (size_t begin = 0; begin < content.size();) {
    const size_t end = std::min(content.find('\n', begin), content.size());
    const std::string line = content.substr(begin, end - begin);
    const bool comment = !line.empty() && line[0] == '#';
    kept += (comment || features ? "" : line) + "\n";  // line numbers stay
    if (!comment) features = !features;
    begin = end + 1;
  }
  return kept;
}

std::string calibration_key(const PinholeCamera& c) {
  return fmt::format("{} {} {} {} {} {}", c.width, c.height, c.fx, c.fy, c.cx + 0.5, c.cy + 0.5);
}

Result<std::vector<PosedCamera>> read_text_cameras(const fs::path& folder, const fs::path& images) {
  const auto cameras = read_cameras(folder / "cameras.txt");
  if (!cameras) return cameras.error();
  const fs::path path = folder / "images.txt";
  const auto content = read_file(path);
  if (!content) return content.error();
  const std::string lines = without_features(*content);
  std::vector<PosedCamera> posed;
  for (const TextLine& line : split_table(lines)) {
    Fields fields(path, line);
    if (!fields.has(10)) return fields.failure("expected: id qw qx qy qz tx ty tz camera name");
    const auto camera = cameras->find(fields.text(8));
    if (camera == cameras->end()) return fields.failure("camera " + fields.text(8) + " is not in cameras.txt");
    const Quat rotation(fields.number(1), fields.number(2), fields.number(3), fields.number(4));
    const Vec3 translation(fields.number(5), fields.number(6), fields.number(7));
    if (fields.failed()) return fields.failure();
    if (!(rotation.norm() > 0)) return fields.failure("the rotation is not a quaternion");
    posed.push_back({camera->second.camera, SE3(rotation.normalized(), translation), images / fields.rest(9),
                     camera->second.distortion});
  }
  if (posed.empty()) return error("{}: no images", path.string());
  return posed;
}

Result<std::vector<SparsePoint>> read_text_points(const fs::path& folder) {
  const fs::path path = folder / "points3D.txt";
  const auto content = read_file(path);
  if (!content) return content.error();
  std::vector<SparsePoint> points;
  for (const TextLine& line : split_table(*content)) {
    Fields fields(path, line);
    if (!fields.has(7)) return fields.failure("expected: id x y z red green blue");
    SparsePoint& point = points.emplace_back();
    point.position = {fields.number(1), fields.number(2), fields.number(3)};
    for (size_t c = 0; c < 3; ++c) point.color[c] = static_cast<uint8_t>(std::clamp(fields.number(4 + c), 0.0, 255.0));
    if (fields.failed()) return fields.failure();
  }
  return points;
}

}  // namespace

Status write_colmap_model(const fs::path& folder, std::span<const PosedCamera> cameras,
                          std::span<const SparsePoint> points) {
  std::map<std::string, size_t> ids;
  std::string camera_lines = "# CAMERA_ID MODEL WIDTH HEIGHT FX FY CX CY\n";
  std::string image_lines = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of features (none)\n";
  for (size_t i = 0; i < cameras.size(); ++i) {
    const PosedCamera& posed = cameras[i];
    PHOTOSLAM_CHECK(posed.distortion.none(), "{}", posed.image.string());
    const auto [entry, is_new] = ids.try_emplace(calibration_key(posed.camera), ids.size() + 1);
    if (is_new) {
      camera_lines += fmt::format("{} PINHOLE {}\n", entry->second, entry->first);
    }
    const Quat& q = posed.camera_from_world.rotation;
    const Vec3& t = posed.camera_from_world.translation;
    image_lines += fmt::format("{} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {} {}\n\n", i + 1, q.w(), q.x(),
                               q.y(), q.z(), t.x(), t.y(), t.z(), entry->second, posed.image.filename().string());
  }
  std::string point_lines = "# POINT3D_ID X Y Z R G B ERROR TRACK\n";
  for (size_t i = 0; i < points.size(); ++i) {
    const SparsePoint& p = points[i];
    point_lines += fmt::format("{} {:.6g} {:.6g} {:.6g} {} {} {} 0\n", i + 1, p.position.x(), p.position.y(),
                               p.position.z(), p.color[0], p.color[1], p.color[2]);
  }
  for (const auto& [name, content] :
       {std::pair{"cameras.txt", &camera_lines}, {"images.txt", &image_lines}, {"points3D.txt", &point_lines}}) {
    if (Status status = write_file_atomically(folder / name, *content); !status) return status;
  }
  return {};
}

fs::path find_colmap_model(const fs::path& dataset) {
  for (const char* below : {"sparse/0", "sparse", "."}) {
    for (const char* name : {"images.bin", "images.txt"}) {
      if (fs::exists(dataset / below / name)) return dataset / below;
    }
  }
  return {};
}

Result<std::vector<PosedCamera>> read_colmap_cameras(const fs::path& folder, const fs::path& images) {
  auto posed = fs::exists(folder / "images.bin") ? read_colmap_binary_cameras(folder, images)
                                                 : read_text_cameras(folder, images);
  if (posed) std::ranges::sort(*posed, {}, &PosedCamera::image);
  return posed;
}

Result<std::vector<SparsePoint>> read_colmap_points(const fs::path& folder) {
  return fs::exists(folder / "images.bin") ? read_colmap_binary_points(folder) : read_text_points(folder);
}

}  // namespace photoslam
