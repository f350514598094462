// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/system.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <variant>

#include "base/check.h"
#include "base/clock.h"
#include "map/connected_components.h"
#include "map/map_spacing.h"
#include "pipeline/autosave.h"
#include "pipeline/config.h"
#include "pipeline/localization_worker.h"
#include "pipeline/mapping_worker.h"
#include "pipeline/session_file.h"
#include "pipeline/session_maps.h"
#include "pipeline/stage.h"
#include "splatting/gpu.h"

namespace photoslam {
namespace {

constexpr size_t kStageQueue = 16;
constexpr auto kProgressInterval = std::chrono::milliseconds(250);
constexpr double kOnlineGraceSeconds = 1.0;  // the online result is the map at most this long after the last frame

int num_threads(const RunSettings& settings) {
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  return settings.threads > 0 ? settings.threads : cores;
}

void in_background() { lower_thread_priority(ThreadPriority::background); }

/// Loop closure has found something.
struct CorrectionMessage {};
/// The session is to be saved as it is now.
struct SaveMessage {};
using GeometryMessage = std::variant<NewKeyframe, CorrectionMessage, SaveMessage>;
/// The map has changed.
struct LoopMessage {};

/// The running system. Frames flow feed → localization → geometry mapping → photorealistic mapping.
///
/// In real time each stage takes the newest state of the others; loop closure watches the map on a thread of its own
/// and sends corrections to geometry mapping. By logical time a keyframe made at frame k reaches tracking and
/// photorealistic mapping exactly at frame k + lag, and mapping trains a fixed number of iterations per frame, and
/// loops are closed before the keyframe is passed on: what happens does not depend on how fast anything runs.
class Session {
 public:
  Session(const SystemOptions& options, const RunSettings& settings, FrameSource& source, std::stop_token stop)
      : options_(options),
        settings_(settings),
        num_frames_(source.info().num_frames),
        logical_time_(settings.deterministic || settings.logical_time),
        threaded_(!(logical_time_ && num_threads(settings) == 1)),
        outer_stop_(std::move(stop)),
        forward_stop_(outer_stop_, [this] { stop_.request_stop(); }),
        failures_(stop_),
        executor_(num_threads(settings), in_background),
        localization_(options, settings, source.info()),
        geometry_(options.geometry_mapping, options.features, localization_.camera(), localization_.bf()),
        loop_closer_(options.loop_closure, options.features, localization_.camera(), localization_.bf()),
        autosave_(settings.session_file.empty() || settings.localize_only ? 0 : settings.autosave_s),
        mapping_(options, settings, localization_.sensor(), executor_, autosave_),
        mapping_limit_(options.pipeline.waiting_pictures_mb),
        newest_map_(settings_.loaded_session ? load_session() : nullptr),
        visible_map_(newest_map_),
        mapping_stage_(kStageQueue, threaded_, mapping_work(), failures_),
        geometry_stage_(kStageQueue, threaded_, geometry_work(), failures_),
        loop_stage_(kStageQueue, threaded_, loop_work(), failures_),
        feed_(source, logical_time_ ? Pace::asap : settings.pace, static_cast<size_t>(options.pipeline.input_queue),
              threaded_, stop_.get_token(), failures_) {}

  RunOutcome run(const std::function<void(const Progress&)>& on_progress);

 private:
  Stage<GeometryMessage>::Work geometry_work();
  Stage<LoopMessage>::Work loop_work();
  Stage<MappingMessage>::Work mapping_work();
  void localize_all(const std::function<void()>& after_each_frame);
  void localize(FedFrame fed);
  void record(FrameOutcome outcome);
  void add_keyframe(NewKeyframe keyframe);
  void take_correction();
  void look_for_loops();
  void close_remaining_loops();
  std::shared_ptr<const MapSnapshot> load_session();
  void drop_gaussians_beyond_budget();
  std::shared_ptr<Archive> begin_session();
  void save_session();
  void report_missing_pictures();
  void save_if_due();
  void save_in_between();
  void deliver(MapUpdate update);
  void receive_due_updates();
  void refine(const std::function<void(const Progress&)>& on_progress);
  Progress progress(Progress::Phase phase);
  void tell(const std::function<void(const Progress&)>& on_progress, const Progress& progress);

  SystemOptions options_;
  RunSettings settings_;
  int num_frames_;
  bool logical_time_;
  bool threaded_;
  std::stop_source stop_;
  std::stop_token outer_stop_;
  std::stop_callback<std::function<void()>> forward_stop_;
  FailureReport failures_;
  Stopwatch clock_;
  RunOutcome outcome_;

  ThreadPool executor_;
  LocalizationWorker localization_;
  GeometryMapper geometry_;
  LoopCloser loop_closer_;
  Autosave autosave_;
  MappingWorker mapping_;
  MappingQueueLimit mapping_limit_;

  // Real time: the newest map. Logical time: results in order, each taken when its frame has come.
  mutable std::mutex mutex_;
  std::condition_variable update_arrived_;
  std::condition_variable localization_ended_;
  std::shared_ptr<const MapSnapshot> newest_map_;
  std::deque<MapUpdate> updates_;
  std::optional<MapCorrection> found_correction_;  // by loop closure, on its way to the map
  bool localization_done_ = false;
  std::vector<FrameOutcome> outcomes_;
  int num_dropped_ = 0;

  // Localization thread only.
  std::shared_ptr<const MapSnapshot> visible_map_;
  std::deque<int> update_due_;  // logical frame numbers
  int frame_number_ = 0;
  int next_frame_id_ = 0;

  // Whoever reports progress only.
  std::vector<Vec3> shown_positions_;
  size_t num_shown_ = 0;

  Stage<MappingMessage> mapping_stage_;
  Stage<GeometryMessage> geometry_stage_;
  Stage<LoopMessage> loop_stage_;
  FrameFeed feed_;
};

/// Every component goes on where it was, before any stage or the feed begins to work.
std::shared_ptr<const MapSnapshot> Session::load_session() {
  Archive reader(*settings_.loaded_session);
  SessionHeader header;
  reader(header);
  const Status fits = check_session_sensor(header, localization_.camera(), localization_.bf());
  PHOTOSLAM_CHECK(fits.ok(), "{}", fits.error().message);
  reader(geometry_, mapping_.mapper());
  const Status whole = check_session_maps(geometry_, mapping_.mapper());
  PHOTOSLAM_CHECK(whole.ok(), "the session cannot be continued: {}; begin a new one", whole.error().message);
  if (!settings_.localize_only) drop_gaussians_beyond_budget();
  auto map = geometry_.snapshot();
  loop_closer_.resume(*map, header.num_settled);
  localization_.resume(static_cast<int>(map->keyframes.size()), next_free_place(*map));
  mapping_.gaussians = mapping_.mapper().gaussians().size();
  return map;
}

/// The loaded map may have been made with a larger budget.
void Session::drop_gaussians_beyond_budget() {
  const size_t dropped = mapping_.mapper().keep_gaussian_budget();
  if (dropped == 0) return;
  outcome_.messages.push_back(
      fmt::format("{} gaussians of the loaded map are gone: photorealistic_mapping.densification.max_gaussians is {}",
                  dropped, options_.photorealistic_mapping.densification.max_gaussians));
}

/// Header and geometric map; the photorealistic map follows.
std::shared_ptr<Archive> Session::begin_session() {
  auto session = std::make_shared<Archive>();
  SessionHeader header{localization_.sensor(), localization_.bf(), config_as_toml(options_),
                       loop_closer_.num_settled()};
  (*session)(header, geometry_);
  return session;
}

/// After all stages have ended. A session whose maps are no pair could not be continued; an older one can.
void Session::save_session() {
  if (settings_.session_file.empty() || settings_.localize_only || !mapping_.mapper().has_keyframes()) return;
  std::string problem;
  try {
    if (const Status maps = check_session_maps(geometry_, mapping_.mapper()); !maps) {
      problem = maps.error().message;
    } else if (const Status saved = mapping_.save(*begin_session()); !saved) {
      problem = saved.error().message;
    }
  } catch (...) {
    problem = exception_text();
  }
  if (problem.empty()) return;
  problem = describe_unsaved_session(settings_.session_file, problem);
  if (!failures_.text().empty()) outcome_.messages.push_back("session: " + problem);  // the cause is told already
  failures_.report("session", problem);
}

void Session::report_missing_pictures() {
  outcome_.keyframes_without_pictures = mapping_limit_.num_without_pictures();
  if (outcome_.keyframes_without_pictures == 0) return;
  outcome_.messages.push_back(fmt::format(
      "{} keyframes were mapped without their pictures: photorealistic mapping was so slow that more than {:g} MB of "
      "them waited (pipeline.waiting_pictures_mb)",
      outcome_.keyframes_without_pictures, options_.pipeline.waiting_pictures_mb));
}

/// While frames arrive: asks for it, and waits for nothing.
void Session::save_if_due() {
  if (autosave_.begin()) geometry_stage_.post(SaveMessage{});
}

/// On the geometry thread. Photorealistic mapping adds its part as soon as it has come as far.
void Session::save_in_between() {
  if (geometry_.map().num_keyframes() == 0) return autosave_.ended();
  MapUpdate update{.map = nullptr, .keyframe = {}, .images = nullptr, .session = begin_session()};
  if (!logical_time_) {
    mapping_stage_.post({std::move(update)});
    return;
  }
  std::lock_guard lock(mutex_);
  updates_.push_back(std::move(update));
}

Stage<GeometryMessage>::Work Session::geometry_work() {
  const auto handle = [this](GeometryMessage message) {
    if (auto* keyframe = std::get_if<NewKeyframe>(&message)) {
      add_keyframe(std::move(*keyframe));
    } else if (std::holds_alternative<CorrectionMessage>(message)) {
      take_correction();
    } else {
      save_in_between();
    }
  };
  return {.name = "geometry mapping", .handle = handle, .on_start = [] {
            lower_thread_priority(ThreadPriority::supporting);
          }};
}

Stage<LoopMessage>::Work Session::loop_work() {
  return {.name = "loop closure", .handle = [this](LoopMessage) { look_for_loops(); }, .on_start = in_background};
}

void Session::add_keyframe(NewKeyframe keyframe) {
  const KeyframeProposal& proposal = keyframe.proposal;
  const auto interrupted = [this] { return !logical_time_ && geometry_stage_.backlog() > 0; };
  GeometryUpdate update = geometry_.process(proposal, interrupted);
  const auto stopped = [this] { return stop_.stop_requested(); };
  while (logical_time_ && !stopped()) {
    const auto correction = loop_closer_.process(*update.map, stopped);
    if (!correction) break;
    update.map = geometry_.correct(*correction);
  }
  if (const auto& initial = proposal.initial) {
    deliver({update.map, initial->id, std::move(keyframe.initial_images), nullptr});
  }
  deliver({std::move(update.map), update.keyframe, std::move(keyframe.images), nullptr});
}

/// On the geometry thread.
void Session::take_correction() {
  std::optional<MapCorrection> correction;
  {
    std::lock_guard lock(mutex_);
    correction.swap(found_correction_);
  }
  if (correction) deliver({geometry_.correct(*correction), KeyframeId{}, nullptr, nullptr});
}

/// On the thread of loop closure.
void Session::look_for_loops() {
  if (stop_.stop_requested()) return;
  std::shared_ptr<const MapSnapshot> map;
  {
    std::lock_guard lock(mutex_);
    map = newest_map_;
  }
  std::optional<MapCorrection> correction = loop_closer_.process(*map, [this] { return stop_.stop_requested(); });
  if (!correction) return;
  {
    std::lock_guard lock(mutex_);
    found_correction_ = std::move(correction);
  }
  geometry_stage_.post(CorrectionMessage{});
}

/// After both stages have ended: what loop closure found last, and what it has not looked at yet.
void Session::close_remaining_loops() {
  if (logical_time_ || settings_.localize_only) return;
  take_correction();
  const auto stopped = [this] { return stop_.stop_requested(); };
  while (newest_map_ && !stopped()) {
    const auto correction = loop_closer_.process(*newest_map_, stopped);
    if (!correction) return;
    deliver({geometry_.correct(*correction), KeyframeId{}, nullptr, nullptr});
  }
}

Stage<MappingMessage>::Work Session::mapping_work() {
  Stage<MappingMessage>::Work work;
  work.name = "photorealistic mapping";
  work.handle = [this](const MappingMessage& message) { mapping_.handle(message); };
  if (!logical_time_ && !settings_.localize_only) work.idle = [this] { return mapping_.train_while_idle(); };
  work.on_start = in_background;
  // At real-time pace nothing that is tracked or placed waits for gaussians. Where time plays no role it does, and no
  // keyframe loses its pictures.
  if (!logical_time_ && settings_.pace == Pace::realtime) {
    work.make_way = [this](const auto& newer, auto& waiting) { mapping_limit_.make_way(newer, waiting); };
  }
  return work;
}

void Session::deliver(MapUpdate update) {
  {
    std::lock_guard lock(mutex_);
    newest_map_ = update.map;
    if (logical_time_) updates_.push_back(update);
  }
  update_arrived_.notify_all();
  if (logical_time_) return;
  mapping_stage_.post({std::move(update)});
  // One message is enough for loop closure to look at the newest map.
  if (options_.loop_closure.enabled && loop_stage_.backlog() == 0) loop_stage_.post({});
}

void Session::receive_due_updates() {
  if (!logical_time_) {
    std::lock_guard lock(mutex_);
    visible_map_ = newest_map_;
    return;
  }
  while (true) {
    std::unique_lock lock(mutex_);
    const bool is_due = !update_due_.empty() && update_due_.front() <= frame_number_;
    const auto ready = [&] { return !updates_.empty() || !failures_.text().empty(); };
    while (is_due && !update_arrived_.wait_for(lock, kProgressInterval, ready)) {
    }
    const bool is_change = !updates_.empty() && updates_.front().map != nullptr;  // else a session to save
    if (updates_.empty() || (is_change && !is_due)) return;
    MapUpdate update = std::move(updates_.front());
    updates_.pop_front();
    lock.unlock();
    if (is_change) {
      update_due_.pop_front();
      visible_map_ = update.map;
    }
    mapping_stage_.post({std::move(update)});
  }
}

void Session::localize(FedFrame fed) {
  receive_due_updates();
  // Frames that the device or the queue has dropped never came here.
  for (; next_frame_id_ < fed.frame.id.value; ++next_frame_id_) {
    FrameOutcome dropped;
    dropped.frame = FrameId(next_frame_id_);
    dropped.timestamp_ns = feed_.timestamp_ns(dropped.frame);
    dropped.dropped = true;
    dropped.reason = feed_.was_read(dropped.frame) ? "came too fast" : "dropped by the camera";
    record(std::move(dropped));
  }
  next_frame_id_ = fed.frame.id.value + 1;

  const bool mapping_keeps_up =
      !settings_.localize_only &&
      (logical_time_ || geometry_stage_.backlog() < static_cast<size_t>(options_.pipeline.keyframe_queue));
  std::optional<NewKeyframe> keyframe;
  record(localization_.process(std::move(fed), visible_map_, mapping_keeps_up, keyframe));
  if (keyframe) {
    const size_t num_updates = keyframe->proposal.initial ? 2 : 1;
    update_due_.insert(update_due_.end(), num_updates, frame_number_ + options_.pipeline.keyframe_lag_frames);
    geometry_stage_.post(std::move(*keyframe));
  }
  if (logical_time_ && !settings_.localize_only)
    mapping_stage_.post({.update = {}, .iterations = options_.pipeline.iterations_per_frame});
  ++frame_number_;
}

void Session::localize_all(const std::function<void()>& after_each_frame) {
  try {
    while (auto fed = feed_.next()) {
      localize(std::move(*fed));
      after_each_frame();
    }
  } catch (...) {
    failures_.report("localization", exception_text());
  }
  geometry_stage_.finish();
  loop_stage_.finish();
  try {
    close_remaining_loops();
  } catch (...) {
    failures_.report("loop closure", exception_text());
  }
  frame_number_ = std::numeric_limits<int>::max();
  receive_due_updates();
}

void Session::record(FrameOutcome outcome) {
  std::lock_guard lock(mutex_);
  if (outcome.dropped) ++num_dropped_;
  outcomes_.push_back(std::move(outcome));
}

/// The tracker takes the same mutex for every frame: under it only what is new since the last call is read.
Progress Session::progress(Progress::Phase phase) {
  Progress p;
  {
    std::lock_guard lock(mutex_);
    p.frames = static_cast<int>(outcomes_.size());
    if (!outcomes_.empty()) p.state = outcomes_.back().state;
    p.dropped = num_dropped_;
    p.keyframes = newest_map_ ? static_cast<int>(newest_map_->keyframes.size()) : 0;
    for (; settings_.preview && num_shown_ < outcomes_.size(); ++num_shown_) {
      const FrameOutcome& frame = outcomes_[num_shown_];
      if (frame.has_pose) shown_positions_.push_back(frame.online_camera_from_world.inverse().translation);
    }
  }
  p.phase = phase;
  p.messages = autosave_.take_failures();
  p.num_frames = num_frames_;
  p.frames_per_second = p.frames / std::max(clock_.seconds(), 1e-3);
  p.gaussians = mapping_.gaussians;
  p.iterations = mapping_.iterations;
  p.training_psnr_db = mapping_.training_psnr;
  if (settings_.preview) {
    p.comparison = mapping_.comparison();
    p.positions = shown_positions_;
  }
  return p;
}

/// What the listener throws ends the run as the failure of a component does, and loses nothing.
void Session::tell(const std::function<void(const Progress&)>& on_progress, const Progress& progress) {
  if (!on_progress) return;
  try {
    on_progress(progress);
  } catch (...) {
    failures_.report("progress report", exception_text());
  }
}

void Session::refine(const std::function<void(const Progress&)>& on_progress) {
  if (!mapping_.mapper().newest_with_pictures() || settings_.localize_only) return;
  const Stopwatch clock;
  double last_report = 0;
  autosave_.ended();  // what was asked for while the stages ended
  for (int i = 0; !stop_.stop_requested(); ++i) {
    const double elapsed = clock.seconds();
    const double done = settings_.refine_iterations > 0 ? static_cast<double>(i) / settings_.refine_iterations
                                                        : elapsed / std::max(settings_.refine_seconds, 1e-9);
    if (done >= 1.0 || (settings_.refine_iterations == 0 && settings_.refine_seconds <= 0)) break;
    try {
      mapping_.refine(done);
      if (autosave_.begin()) autosave_.ended(mapping_.save(*begin_session()));
    } catch (...) {
      failures_.report("photorealistic mapping", exception_text());
      break;
    }
    if (elapsed - last_report < 1e-3 * static_cast<double>(kProgressInterval.count())) continue;
    last_report = elapsed;
    outcome_.refinement.push_back({elapsed, mapping_.iterations, mapping_.training_psnr, mapping_.gaussians});
    Progress p = progress(Progress::Phase::refining);
    p.refined = done;
    tell(on_progress, p);
  }
  outcome_.seconds_refine = clock.seconds();
}

RunOutcome Session::run(const std::function<void(const Progress&)>& on_progress) {
  const double busy_before = settings_.gpu ? settings_.gpu->busy_seconds() : 0;
  // What a loaded session left undone.
  if (newest_map_ && !logical_time_ && !settings_.localize_only && options_.loop_closure.enabled) loop_stage_.post({});
  if (!threaded_) {
    localize_all([&] {
      save_if_due();
      tell(on_progress, progress(Progress::Phase::online));
    });
  } else {
    std::thread localization([this] {
      localize_all([] {});
      std::lock_guard lock(mutex_);
      localization_done_ = true;
      localization_ended_.notify_all();
    });
    std::unique_lock lock(mutex_);
    while (!localization_ended_.wait_for(lock, kProgressInterval, [&] { return localization_done_; })) {
      lock.unlock();
      save_if_due();
      tell(on_progress, progress(Progress::Phase::online));
      lock.lock();
    }
    lock.unlock();
    localization.join();
  }
  outcome_.seconds_online = clock_.seconds();

  const Stopwatch drain;
  if (!logical_time_) {
    mapping_.set_freeze_time(std::chrono::steady_clock::now() +
                             std::chrono::milliseconds(static_cast<int>(1e3 * kOnlineGraceSeconds)));
  }
  tell(on_progress, progress(Progress::Phase::draining));
  mapping_stage_.finish();
  outcome_.online = mapping_.take_online();
  outcome_.seconds_drain = drain.seconds();
  refine(on_progress);
  if (failures_.text().empty()) mapping_.show_newest();
  tell(on_progress, progress(Progress::Phase::done));
  outcome_.final = mapping_.mapper().freeze();
  save_session();

  report_missing_pictures();
  outcome_.frames = std::move(outcomes_);
  if (newest_map_) outcome_.component_of_keyframe = connected_components(*newest_map_);
  outcome_.iterations = mapping_.iterations;
  outcome_.loops_closed = loop_closer_.num_closed();
  outcome_.loops_reconnected = loop_closer_.num_reconnected();
  outcome_.mapping_cpu_seconds = mapping_.cpu_seconds;
  outcome_.seconds_total = clock_.seconds();
  if (settings_.gpu) {
    outcome_.gpu =
        GpuUse{settings_.gpu->peak_mb(), settings_.gpu->busy_seconds() - busy_before, localization_.gpu_failure()};
  }
  outcome_.interrupted = outer_stop_.stop_requested();
  outcome_.failure = failures_.text();
  for (std::string& message : autosave_.take_failures()) outcome_.messages.push_back(std::move(message));
  return std::move(outcome_);
}

}  // namespace

Status check_session(const std::string& session, const SystemOptions& options, const SourceInfo& info) {
  const LocalizationWorker localization(options, {}, info);
  return check_session_sensor(session_header(session), localization.camera(), localization.bf());
}

RunOutcome run_slam(const SystemOptions& options, const RunSettings& settings, FrameSource& source,
                    std::stop_token stop, const std::function<void(const Progress&)>& on_progress) {
  return Session(options, settings, source, std::move(stop)).run(on_progress);
}

}  // namespace photoslam
