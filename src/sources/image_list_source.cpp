// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/image_list_source.h"

#include <algorithm>
#include <utility>

#include "io/image_file.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

class ImageListSource final : public FrameSource {
 public:
  ImageListSource(SourceInfo info, std::vector<ListedFrame> frames)
      : info_(std::move(info)), frames_(std::move(frames)) {}

  const SourceInfo& info() const override { return info_; }

  std::optional<Frame> next() override {
    if (next_ == frames_.size()) return std::nullopt;
    const ListedFrame& listed = frames_[next_];
    Frame frame;
    frame.id = FrameId(static_cast<int32_t>(next_++));
    frame.timestamp_ns = listed.timestamp_ns;
    frame.defect = load(read_image(listed.color), listed.color, info_.camera, frame.color);
    if (frame.defect.empty() && info_.sensor == SensorKind::rgbd) {
      frame.defect = load(read_depth_png(listed.depth), listed.depth, info_.camera, frame.depth);
    }
    if (frame.defect.empty() && info_.sensor == SensorKind::stereo) frame.defect = load_right(listed.right, frame);
    return frame;
  }

 private:
  /// Moves the image into `target` and returns what is wrong with it, if anything.
  template <class T>
  static std::string load(Result<Image<T>> image, const fs::path& path, const PinholeCamera& camera, Image<T>& target) {
    if (!image) return image.error().message;
    if (image->width() != camera.width || image->height() != camera.height) {
      return fmt::format("{} has {}x{} pixels, expected {}x{}", path.string(), image->width(), image->height(),
                         camera.width, camera.height);
    }
    target = std::move(*image);
    return {};
  }

  std::string load_right(const fs::path& path, Frame& frame) const {
    std::string defect = load(read_image(path), path, info_.right->camera, frame.right);
    if (defect.empty() && frame.right.channels() != frame.color.channels()) {
      return fmt::format("{} has {} channels, the left image has {}", path.string(), frame.right.channels(),
                         frame.color.channels());
    }
    return defect;
  }

  SourceInfo info_;
  std::vector<ListedFrame> frames_;
  size_t next_ = 0;
};

std::vector<fs::path> missing_files(const std::vector<ListedFrame>& frames, size_t& complete_frames) {
  std::vector<fs::path> missing;
  for (const ListedFrame& frame : frames) {
    const size_t before = missing.size();
    for (const fs::path& path : {frame.color, frame.depth, frame.right}) {
      std::error_code ignored;
      if (!path.empty() && !fs::exists(path, ignored)) missing.push_back(path);
    }
    complete_frames += missing.size() == before ? 1 : 0;
  }
  return missing;
}

/// "a, b, c and 12 more".
std::string name_some(const std::vector<fs::path>& paths) {
  constexpr size_t kNamed = 3;
  std::string text;
  for (size_t i = 0; i < std::min(kNamed, paths.size()); ++i) text += (i == 0 ? "" : ", ") + paths[i].string();
  return paths.size() > kNamed ? fmt::format("{} and {} more", text, paths.size() - kNamed) : text;
}

/// Compares the first readable colour image with the camera: a wrong calibration file is better refused than found out.
Status check_image_size(const SourceInfo& info, const std::vector<ListedFrame>& frames) {
  constexpr size_t kTried = 5;
  for (size_t i = 0; i < std::min(kTried, frames.size()); ++i) {
    const Result<ImageU8> image = read_image(frames[i].color);
    if (!image) continue;
    if (image->width() == info.camera.width && image->height() == info.camera.height) return {};
    return error("{} has {}x{} pixels, but the camera of {} is calibrated for {}x{}", frames[i].color.string(),
                 image->width(), image->height(), info.name, info.camera.width, info.camera.height);
  }
  return {};
}

/// Of the median step between frames; 0 of a single frame.
double frame_rate(const std::vector<ListedFrame>& frames) {
  std::vector<int64_t> steps;
  for (size_t i = 1; i < frames.size(); ++i) steps.push_back(frames[i].timestamp_ns - frames[i - 1].timestamp_ns);
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return 1e9 / static_cast<double>(*middle);
}

}  // namespace

void set_depth_unit(std::optional<double> depth_scale, double usual, SourceInfo& info) {
  if (!depth_scale) {
    info.notes.push_back(fmt::format("no depth_scale given: taking {} depth units for one metre", usual));
  }
  info.metres_per_depth_unit = 1 / depth_scale.value_or(usual);
}

Result<FrameSize> image_size(const std::vector<ListedFrame>& frames) {
  for (const ListedFrame& frame : frames) {
    if (const Result<ImageU8> image = read_image(frame.color)) return FrameSize{image->width(), image->height()};
  }
  return error("none of the {} listed images can be read", frames.size());
}

Result<std::unique_ptr<FrameSource>> make_image_list_source(SourceInfo info, std::vector<ListedFrame> frames) {
  for (size_t i = 1; i < frames.size(); ++i) {
    PHOTOSLAM_CHECK(frames[i - 1].timestamp_ns < frames[i].timestamp_ns, "frame {}", i);
  }
  PHOTOSLAM_CHECK(info.right.has_value() == (info.sensor == SensorKind::stereo), "{}", info.name);
  size_t complete = 0;
  const std::vector<fs::path> missing = missing_files(frames, complete);
  if (complete * 10 < frames.size() || complete == 0) {
    return error("{}: of {} listed frames only {} have their files; missing: {}", info.name, frames.size(), complete,
                 name_some(missing));
  }
  if (!missing.empty()) {
    info.notes.push_back(fmt::format("{} of {} listed frames lack a file and count as lost: {}",
                                     frames.size() - complete, frames.size(), name_some(missing)));
  }
  if (info.camera.width == 0 || (info.right && info.right->camera.width == 0)) {
    const Result<FrameSize> size = image_size(frames);
    if (!size) return error("{}: {}", info.name, size.error().message);
    for (PinholeCamera* camera : {&info.camera, info.right ? &info.right->camera : &info.camera}) {
      if (camera->width == 0) camera->width = size->width;
      if (camera->height == 0) camera->height = size->height;
    }
  }
  if (const Status status = check_image_size(info, frames); !status) return status.error();
  if (info.frames_per_second <= 0) info.frames_per_second = frame_rate(frames);
  info.num_frames = static_cast<int>(frames.size());
  return std::unique_ptr<FrameSource>(std::make_unique<ImageListSource>(std::move(info), std::move(frames)));
}

}  // namespace photoslam
