// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/mapping_worker.h"

#include "base/clock.h"
#include "pipeline/session_file.h"

namespace photoslam {

MappingWorker::MappingWorker(const SystemOptions& options, const RunSettings& settings, MapperSensor sensor,
                             Executor& executor, Autosave& autosave)
    : mapper_(options.photorealistic_mapping, std::move(sensor), settings.seed, settings.gpu),
      executor_(executor),
      autosave_(autosave),
      session_file_(settings.session_file),
      preview_(settings.preview) {}

void MappingWorker::freeze_if_due() {
  if (online_ || std::chrono::steady_clock::now().time_since_epoch().count() < freeze_time_) return;
  online_ = mapper_.freeze();
}

void MappingWorker::handle(const MappingMessage& message) {
  freeze_if_due();
  if (message.update.map && !message.update.keyframe.valid()) {
    mapper_.update_poses(*message.update.map);
  } else if (message.update.map) {
    const KeyframeImages none;
    const KeyframeImages& images = message.update.images ? *message.update.images : none;
    mapper_.add_keyframe(*message.update.map, message.update.keyframe, images, executor_);
  }
  if (message.update.session) autosave_.ended(save(*message.update.session));
  train(message.iterations);
}

Status MappingWorker::save(Archive& session) {
  mapper_.serialize(session);
  return write_session(session_file_, session);
}

bool MappingWorker::train_while_idle() {
  freeze_if_due();
  if (!mapper_.newest_with_pictures()) return false;
  train(1);
  return true;
}

void MappingWorker::train(int count) {
  for (int i = 0; i < count && mapper_.newest_with_pictures(); ++i) {
    mapper_.train({}, executor_);
    ++iterations;
  }
  update_figures();
  cpu_seconds = thread_cpu_seconds() + executor_.helper_cpu_seconds();
}

void MappingWorker::refine(double progress) {
  mapper_.train(progress, executor_);
  ++iterations;
  update_figures();
}

void MappingWorker::update_figures() {
  constexpr double kComparisonSeconds = 1.0;
  gaussians = mapper_.gaussians().size();
  training_psnr = mapper_.training_psnr();
  const auto newest = mapper_.newest_with_pictures();
  if (!preview_ || !newest || since_comparison_.seconds() < kComparisonSeconds) return;
  since_comparison_.restart();
  compare(*newest);
}

void MappingWorker::compare(size_t keyframe) {
  auto comparison = std::make_shared<const KeyframeComparison>(mapper_.compare(keyframe, executor_));
  std::lock_guard lock(mutex_);
  comparison_ = std::move(comparison);
}

void MappingWorker::show_newest() {
  if (const auto newest = mapper_.newest_with_pictures(); newest && preview_) compare(*newest);
}

std::shared_ptr<const KeyframeComparison> MappingWorker::comparison() const {
  std::lock_guard lock(mutex_);
  return comparison_;
}

FrozenMap MappingWorker::take_online() {
  if (!online_) online_ = mapper_.freeze();
  return std::move(*online_);
}

}  // namespace photoslam
