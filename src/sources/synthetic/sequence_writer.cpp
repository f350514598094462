// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/sequence_writer.h"

#include <unistd.h>

#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "base/file.h"
#include "io/image_file.h"
#include "sources/synthetic/sensor_model.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

constexpr int kJpegQuality = 95;
constexpr int kPngCompression = 1;  // noise does not compress anyway
constexpr int kDetailStride = 10;
constexpr double kReplicaUnitsPerMetre = 6553.5;

/// A folder that takes its final name when complete, and disappears otherwise.
class PendingFolder {
 public:
  explicit PendingFolder(const fs::path& folder) : folder_(fs::absolute(folder).lexically_normal()) {
    if (!folder_.has_filename()) folder_ = folder_.parent_path();
    pending_ = folder_;
    pending_ += fmt::format(".{}.partial", ::getpid());
  }
  ~PendingFolder() {
    std::error_code ignored;
    if (created_) fs::remove_all(pending_, ignored);
  }
  PendingFolder(const PendingFolder&) = delete;
  PendingFolder& operator=(const PendingFolder&) = delete;

  const fs::path& path() const { return pending_; }

  Status create() {
    std::error_code code;
    if (fs::exists(folder_, code) && (!fs::is_directory(folder_, code) || !fs::is_empty(folder_, code))) {
      return error("{} exists and is not an empty folder; remove it or choose another one", folder_.string());
    }
    created_ = true;
    return prepare_output_folder(pending_);
  }

  Status complete() {
    std::error_code code;
    fs::rename(pending_, folder_, code);
    if (code) return error("cannot rename {} to {}: {}", pending_.string(), folder_.string(), code.message());
    created_ = false;
    return {};
  }

 private:
  fs::path folder_, pending_;
  bool created_ = false;
};

/// Names and units of one layout.
class Layout {
 public:
  Layout(const SyntheticCamera& camera, const SequenceSettings& settings, fs::path folder)
      : camera_(camera), settings_(settings), folder_(std::move(folder)) {}

  double metres_per_depth_unit() const {
    return tum() ? SyntheticCamera::kMetresPerDepthUnit : 1 / kReplicaUnitsPerMetre;
  }

  Status prepare() const {
    for (const char* part : tum() ? std::vector{"rgb", "depth"} : std::vector{"results"}) {
      if (Status status = prepare_output_folder(folder_ / part); !status) return status;
    }
    return {};
  }

  Status write_frame(const Frame& frame) const {
    const fs::path color = folder_ / color_name(frame.id.value), depth = folder_ / depth_name(frame.id.value);
    const Status written = color.extension() == ".png" ? write_png(color, frame.color, kPngCompression)
                                                       : write_jpeg(color, frame.color, kJpegQuality);
    if (!written) return written;
    return write_png(depth, frame.depth, kPngCompression);
  }

  Status write_description() const { return tum() ? write_tum_description() : write_replica_description(); }

 private:
  bool tum() const { return settings_.layout == SequenceLayout::tum; }
  std::string time(int index) const { return format_seconds(camera_.timestamp_ns(index)); }
  std::string color_name(int index) const {
    if (!tum()) return fmt::format("results/frame{:06}.jpg", index);
    return fmt::format("rgb/{}.{}", time(index), settings_.lossless_color ? "png" : "jpg");
  }
  std::string depth_name(int index) const {
    return tum() ? fmt::format("depth/{}.png", time(index)) : fmt::format("results/depth{:06}.png", index);
  }

  Status write_tum_description() const {
    std::string colors = "# timestamp filename\n", depths = colors, pairs,
                truth = "# timestamp tx ty tz qx qy qz qw (world_from_camera)\n";
    for (int i = 0; i < camera_.options().num_frames; ++i) {
      colors += fmt::format("{} {}\n", time(i), color_name(i));
      depths += fmt::format("{} {}\n", time(i), depth_name(i));
      pairs += fmt::format("{0} {1} {0} {2}\n", time(i), color_name(i), depth_name(i));
      const SE3 pose = camera_.world_from_camera(i);
      const Vec3& t = pose.translation;
      const Quat& q = pose.rotation;
      truth += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", time(i), t.x(), t.y(), t.z(), q.x(),
                           q.y(), q.z(), q.w());
    }
    const PinholeCamera& c = camera_.options().camera;
    const std::string calibration = fmt::format(
        "# colour camera; depth is registered to it\nmodel: pinhole\nwidth: {}\nheight: {}\nfx: {}\nfy: {}\ncx: {}\n"
        "cy: {}\ndistortion: []\nfps: {}\ndepth_scale: {:.1f}  # stored value / depth_scale = metres\n",
        c.width, c.height, c.fx, c.fy, c.cx, c.cy, camera_.options().frames_per_second, 1 / metres_per_depth_unit());
    const std::pair<const char*, const std::string*> files[] = {{"rgb.txt", &colors},
                                                                {"depth.txt", &depths},
                                                                {"associations.txt", &pairs},
                                                                {"groundtruth.txt", &truth},
                                                                {"camera.yaml", &calibration}};
    for (const auto& [name, content] : files) {
      if (Status status = write_file_atomically(folder_ / name, *content); !status) return status;
    }
    return {};
  }

  Status write_replica_description() const {
    std::string poses;
    for (int i = 0; i < camera_.options().num_frames; ++i) {
      const Eigen::Matrix4d m = camera_.world_from_camera(i).matrix();
      for (int k = 0; k < 16; ++k) poses += fmt::format("{:.12e}{}", m(k / 4, k % 4), k < 15 ? ' ' : '\n');
    }
    if (Status status = write_file_atomically(folder_ / "traj.txt", poses); !status) return status;
    const PinholeCamera& c = camera_.options().camera;
    const nlohmann::json calibration = {{"camera",
                                         {{"w", c.width},
                                          {"h", c.height},
                                          {"fx", c.fx},
                                          {"fy", c.fy},
                                          {"cx", c.cx},
                                          {"cy", c.cy},
                                          {"scale", kReplicaUnitsPerMetre}}}};
    return write_file_atomically(folder_ / "cam_params.json", calibration.dump(2) + "\n");
  }

  const SyntheticCamera& camera_;
  const SequenceSettings& settings_;
  fs::path folder_;
};

/// Figures of every kDetailStride-th frame, each in its own place, so that their mean does not depend on the threads.
class DetailCollector {
 public:
  explicit DetailCollector(int num_frames)
      : figures_(static_cast<size_t>((num_frames + kDetailStride - 1) / kDetailStride)) {}
  void add(int index, const RoomView& view) {
    if (index % kDetailStride == 0)
      figures_[static_cast<size_t>(index / kDetailStride)] = measure_detail(expose(view, 0, 0, 0));
  }
  DetailFigures mean() const {
    DetailFigures sum;
    for (const DetailFigures& f : figures_) {
      sum.shrunk_psnr_db += f.shrunk_psnr_db / static_cast<double>(figures_.size());
      sum.horizontal_difference += f.horizontal_difference / static_cast<double>(figures_.size());
    }
    return sum;
  }

 private:
  std::vector<DetailFigures> figures_;
};

}  // namespace

Result<SequenceSummary> write_sequence(const SyntheticCamera& camera, const SequenceSettings& settings,
                                       const fs::path& folder, Executor& executor,
                                       const std::function<void(int)>& progress, std::stop_token stop) {
  PendingFolder pending(folder);
  if (Status status = pending.create(); !status) return status.error();
  const Layout layout(camera, settings, pending.path());
  if (Status status = layout.prepare(); !status) return status.error();

  const int num_frames = camera.options().num_frames;
  DetailCollector detail(num_frames);
  std::mutex mutex;
  std::optional<Error> failure;  // guarded by the mutex, as is done
  int done = 0;
  executor.for_each(num_frames, [&](int index, int) {
    {
      std::lock_guard lock(mutex);
      if (!failure && stop.stop_requested()) failure = error("stopped after {} of {} frames", done, num_frames);
      if (failure) return;
    }
    SerialExecutor serial;
    const RoomView view = camera.view(index, serial);
    detail.add(index, view);
    const Status status = layout.write_frame(camera.sense(index, view, layout.metres_per_depth_unit()));
    std::lock_guard lock(mutex);
    if (!status && !failure) failure = status.error();
    if (failure) return;
    ++done;
    if (progress) progress(done);
  });
  if (failure) return *failure;
  if (Status status = layout.write_description(); !status) return status.error();
  if (Status status = pending.complete(); !status) return status.error();
  return SequenceSummary{num_frames, detail.mean()};
}

}  // namespace photoslam
