// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/colmap_binary.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <utility>

#include "base/file.h"
#include "sources/colmap_lens.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "values are copied as they are");

/// Takes values off the front of a file. After the first failure all values are 0.
class Bytes {
 public:
  Bytes(fs::path path, std::string content) : path_(std::move(path)), content_(std::move(content)) {}

  template <class T>
  T take(const char* what) {
    T value{};
    if (!need(sizeof(T), what)) return value;
    std::memcpy(&value, content_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }

  /// A finite number.
  double number(const char* what) {
    const size_t begin = at_;
    const auto value = take<double>(what);
    if (!std::isfinite(value)) fail(begin, fmt::format("{} is not a finite number", what));
    return failed() ? 0 : value;
  }

  /// How many records follow, which take at least so many bytes each.
  uint64_t count(size_t record_size, const char* what) {
    const size_t begin = at_;
    const auto value = take<uint64_t>(what);
    const size_t left = content_.size() - at_;
    if (value > left / record_size) {
      fail(begin, fmt::format("{} {} announced, but only {} bytes follow; is the file complete?", value, what, left));
    }
    return failed() ? 0 : value;
  }

  std::string text(const char* what) {
    const size_t end = content_.find('\0', at_);
    if (failed() || end == std::string::npos) {
      fail(at_, fmt::format("the end of {} is missing", what));
      return {};
    }
    std::string value = content_.substr(at_, end - at_);
    at_ = end + 1;
    return value;
  }

  void skip(uint64_t bytes, const char* what) {
    if (need(bytes, what)) at_ += bytes;
  }

  /// Complains of the values last read, which begin there.
  void fail(size_t at, const std::string& what) {
    if (!failed()) failure_ = fmt::format("{}: byte {}: {}", path_.string(), at, what);
  }

  void expect_end() {
    if (at_ != content_.size()) fail(at_, fmt::format("{} bytes too many", content_.size() - at_));
  }

  size_t at() const { return at_; }
  bool failed() const { return !failure_.empty(); }
  Error failure() const { return Error{failure_}; }

 private:
  bool need(uint64_t bytes, const char* what) {
    if (bytes > content_.size() - at_) fail(at_, fmt::format("the file ends in {}; is it complete?", what));
    return !failed();
  }

  fs::path path_;
  std::string content_;
  size_t at_ = 0;
  std::string failure_;
};

Result<Bytes> open(const fs::path& path) {
  auto content = read_file(path);
  if (!content) return content.error();
  return Bytes(path, std::move(*content));
}

/// One record of cameras.bin.
std::pair<uint32_t, CalibratedCamera> take_camera(Bytes& bytes) {
  const auto id = bytes.take<uint32_t>("a camera's id");
  const size_t begin = bytes.at();
  const auto model = bytes.take<int32_t>("a camera's model");
  const auto width = bytes.take<uint64_t>("a camera's width");
  const auto height = bytes.take<uint64_t>("a camera's height");
  const auto lens = std::ranges::find(colmap_lenses(), model, &ColmapLens::id);
  if (lens == colmap_lenses().end()) {
    bytes.fail(begin, unknown_colmap_lens(fmt::format("number {}", model)).message);
    return {};
  }
  std::vector<double> parameters;
  for (size_t i = 0; i < lens->num_parameters(); ++i) parameters.push_back(bytes.number("a camera's parameters"));
  if (bytes.failed()) return {};
  const auto camera = colmap_camera(*lens, static_cast<double>(width), static_cast<double>(height), parameters);
  if (!camera) {
    bytes.fail(begin, camera.error().message);
    return {};
  }
  return {id, *camera};
}

Result<std::map<uint32_t, CalibratedCamera>> read_cameras(const fs::path& path) {
  auto bytes = open(path);
  if (!bytes) return bytes.error();
  std::map<uint32_t, CalibratedCamera> cameras;
  constexpr size_t kSmallest = 4 + 4 + 2 * 8 + 3 * 8;
  for (uint64_t left = bytes->count(kSmallest, "cameras"); left > 0 && !bytes->failed(); --left)
    cameras.insert(take_camera(*bytes));
  bytes->expect_end();
  if (bytes->failed()) return bytes->failure();
  return cameras;
}

/// One record of images.bin.
PosedCamera take_image(const std::map<uint32_t, CalibratedCamera>& cameras, const fs::path& images, Bytes& bytes) {
  constexpr size_t kFeature = 8 + 8 + 8;  // position and point
  bytes.take<uint32_t>("an image's id");
  const size_t pose = bytes.at();
  double q[4], t[3];
  for (double& value : q) value = bytes.number("an image's rotation");
  for (double& value : t) value = bytes.number("an image's translation");
  const size_t camera_at = bytes.at();
  const auto id = bytes.take<uint32_t>("an image's camera");
  const std::string name = bytes.text("an image's name");
  bytes.skip(kFeature * bytes.count(kFeature, "features of an image"), "an image's features");
  const auto camera = cameras.find(id);
  if (camera == cameras.end()) bytes.fail(camera_at, fmt::format("camera {} is not in cameras.bin", id));
  const Quat rotation(q[0], q[1], q[2], q[3]);
  if (!(rotation.norm() > 0)) bytes.fail(pose, "the rotation is not a quaternion");
  if (bytes.failed()) return {};
  return {camera->second.camera, SE3(rotation.normalized(), Vec3(t[0], t[1], t[2])), images / name,
          camera->second.distortion};
}

}  // namespace

Result<std::vector<PosedCamera>> read_colmap_binary_cameras(const fs::path& folder, const fs::path& images) {
  const auto cameras = read_cameras(folder / "cameras.bin");
  if (!cameras) return cameras.error();
  const fs::path path = folder / "images.bin";
  auto bytes = open(path);
  if (!bytes) return bytes.error();
  std::vector<PosedCamera> posed;
  constexpr size_t kSmallest = 4 + 7 * 8 + 4 + 1 + 8;
  for (uint64_t left = bytes->count(kSmallest, "images"); left > 0 && !bytes->failed(); --left)
    posed.push_back(take_image(*cameras, images, *bytes));
  bytes->expect_end();
  if (bytes->failed()) return bytes->failure();
  if (posed.empty()) return error("{}: no images", path.string());
  return posed;
}

Result<std::vector<SparsePoint>> read_colmap_binary_points(const fs::path& folder) {
  auto bytes = open(folder / "points3D.bin");
  if (!bytes) return bytes.error();
  std::vector<SparsePoint> points;
  constexpr size_t kTrackElement = 4 + 4;  // image and feature
  constexpr size_t kSmallest = 8 + 3 * 8 + 3 + 8 + 8;
  for (uint64_t left = bytes->count(kSmallest, "points"); left > 0 && !bytes->failed(); --left) {
    SparsePoint& point = points.emplace_back();
    bytes->take<uint64_t>("a point's id");
    for (int k = 0; k < 3; ++k) point.position[k] = bytes->number("a point's position");
    for (uint8_t& channel : point.color) channel = bytes->take<uint8_t>("a point's colour");
    bytes->take<double>("a point's error");
    bytes->skip(kTrackElement * bytes->count(kTrackElement, "views of a point"), "a point's views");
  }
  bytes->expect_end();
  if (bytes->failed()) return bytes->failure();
  return points;
}

}  // namespace photoslam
