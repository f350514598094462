// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/sequence_writer.h"

#include <unistd.h>

#include <mutex>
#include <optional>
#include <vector>

#include "base/file.h"
#include "sources/synthetic/layouts.h"
#include "sources/synthetic/sensor_model.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

constexpr int kDetailStride = 10;

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
    if (Status status = check_sequence_folder(folder_); !status) return status;
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

/// Figures of every kDetailStride-th frame, each in its own place, so that their mean does not depend on the threads.
class DetailCollector {
 public:
  explicit DetailCollector(int num_frames)
      : figures_(static_cast<size_t>((num_frames + kDetailStride - 1) / kDetailStride)) {}
  void add(int index, const SceneView& view) {
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

Status check_layout(SequenceLayout layout, const SyntheticOptions& options) {
  const bool holds_depth = layout == SequenceLayout::tum || layout == SequenceLayout::replica;
  if (options.sensor == SensorKind::rgbd && !holds_depth)
    return error("this layout holds no depth; use tum or replica");
  if (options.sensor == SensorKind::stereo && holds_depth) {
    return error("this layout holds no stereo pairs; use euroc or kitti");
  }
  if (options.sensor == SensorKind::mono && layout == SequenceLayout::replica) {
    return error("this layout is for RGB-D; use tum, euroc or kitti");
  }
  const bool holds_lens = layout == SequenceLayout::tum || layout == SequenceLayout::euroc;
  if (!options.distortion.none() && !holds_lens) return error("this layout holds no distortion; use tum or euroc");
  return {};
}

Status check_sequence_folder(const fs::path& folder) {
  std::error_code code;
  if (fs::exists(folder, code) && (!fs::is_directory(folder, code) || !fs::is_empty(folder, code))) {
    return error("{} exists and is not an empty folder; remove it or choose another one", folder.string());
  }
  fs::path parent = fs::absolute(folder).lexically_normal();
  while (parent.has_relative_path() && !fs::exists(parent, code)) parent = parent.parent_path();
  if (!fs::is_directory(parent, code) || ::access(parent.c_str(), W_OK) != 0) {
    return error("cannot write to {}: {} is not a folder that can be written", folder.string(), parent.string());
  }
  return {};
}

Result<SequenceSummary> write_sequence(const SyntheticCamera& camera, const SequenceSettings& settings,
                                       const fs::path& folder, Executor& executor,
                                       const std::function<void(int)>& progress, std::stop_token stop) {
  if (Status status = check_layout(settings.layout, camera.options()); !status) return status.error();
  PendingFolder pending(folder);
  if (Status status = pending.create(); !status) return status.error();
  const auto layout = synthetic::make_layout(camera, settings, pending.path());
  if (Status status = layout->prepare(); !status) return status.error();

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
    const SceneView view = camera.view(index, serial);
    detail.add(index, view);
    const Status status = layout->write_frame(camera.sense(index, view, layout->metres_per_depth_unit(), serial));
    std::lock_guard lock(mutex);
    if (!status && !failure) failure = status.error();
    if (failure) return;
    ++done;
    if (progress) progress(done);
  });
  if (failure) return *failure;
  if (Status status = layout->write_description(); !status) return status.error();
  if (Status status = pending.complete(); !status) return status.error();
  return SequenceSummary{num_frames, detail.mean()};
}

}  // namespace photoslam
