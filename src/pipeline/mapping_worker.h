// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>

#include "base/archive.h"
#include "base/clock.h"
#include "base/executor.h"
#include "base/result.h"
#include "pipeline/autosave.h"
#include "pipeline/frame_feed.h"
#include "pipeline/mapping_queue.h"
#include "pipeline/system_options.h"

namespace photoslam {

/// Runs photorealistic mapping behind a message queue, freezes the map that counts as the online result, and keeps the
/// figures that others may read at any time.
class MappingWorker {
 public:
  MappingWorker(const SystemOptions& options, const RunSettings& settings, MapperSensor sensor, Executor& executor,
                Autosave& autosave);

  void handle(const MappingMessage& message);
  /// Trains once; false when there is nothing to train on.
  bool train_while_idle();
  /// Freezes the online map at the first opportunity after this time.
  void set_freeze_time(SteadyTime time) { freeze_time_ = time.time_since_epoch().count(); }
  /// The online map; frozen now if it has not been before. Call after the stage has finished.
  FrozenMap take_online();

  /// The last picture of the newest keyframe beside its render, about a second old at most while training; null without
  /// RunSettings::preview. From any thread.
  std::shared_ptr<const KeyframeComparison> comparison() const;
  /// Brings comparison() up to date. Call after the stage has finished.
  void show_newest();
  /// Trains once more after the input has ended; `progress` as in PhotorealisticMapper::train().
  void refine(double progress);

  PhotorealisticMapper& mapper() { return mapper_; }
  Executor& executor() { return executor_; }

  // Figures for progress and report; readable from any thread.
  std::atomic<int> iterations{0};
  std::atomic<size_t> gaussians{0};
  std::atomic<double> training_psnr{0};
  std::atomic<double> cpu_seconds{0};  ///< Of the mapping thread and its helpers.

  /// Appends the photorealistic map and writes the file.
  Status save(Archive& session);

 private:
  void train(int count);
  void freeze_if_due();
  void update_figures();
  void compare(size_t keyframe);

  PhotorealisticMapper mapper_;
  Executor& executor_;
  Autosave& autosave_;
  std::filesystem::path session_file_;
  std::atomic<SteadyTime::rep> freeze_time_{std::numeric_limits<SteadyTime::rep>::max()};
  std::optional<FrozenMap> online_;
  bool preview_;
  Stopwatch since_comparison_;
  mutable std::mutex mutex_;
  std::shared_ptr<const KeyframeComparison> comparison_;
};

}  // namespace photoslam
