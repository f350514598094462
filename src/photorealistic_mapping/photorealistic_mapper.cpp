// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/photorealistic_mapper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/check.h"
#include "image/convert.h"
#include "math/median.h"
#include "photorealistic_mapping/confirmed_depth.h"
#include "photorealistic_mapping/guesses.h"
#include "photorealistic_mapping/handover.h"
#include "photorealistic_mapping/seams.h"
#include "photorealistic_mapping/view_geometry.h"
#include "photorealistic_mapping/view_redundancy.h"
#include "photorealistic_mapping/world_export.h"

namespace photoslam {
namespace {

constexpr int kSeedingFactor = 2;  // seeds are made on the half-size image: cheaper, and its noise is lower

/// The picture that seeds are made of; without a depth image its depth is empty.
DepthPicture make_picture(const CameraView& full, double metres_per_depth_unit) {
  CameraView small = shrink(full, kSeedingFactor);
  DepthPicture picture{small.camera, std::move(small.color), {}, std::move(small.mask)};
  if (small.depth.empty()) return picture;
  picture.depth = ImageF(small.camera.width, small.camera.height);
  std::ranges::transform(small.depth.values(), picture.depth.values().begin(),
                         [&](uint16_t depth) { return static_cast<float>(depth * metres_per_depth_unit); });
  return picture;
}

/// Side of the cells that are seeded, in pixels of the picture that seeds are made of.
int cell_size(const SeedingOptions& options) { return std::max(1, options.cell_px / kSeedingFactor); }

/// Keeps `count` of them, evenly spread.
void thin(std::vector<splatting::Gaussian>& seeds, size_t count) {
  if (seeds.size() <= count) return;
  for (size_t i = 0; i < count; ++i) seeds[i] = seeds[i * seeds.size() / count];
  seeds.resize(count);
}

/// A GPU has no reason to spare pixels.
ScheduleOptions schedule_options(ScheduleOptions options, bool on_gpu) {
  if (on_gpu) options.online_pixels = std::numeric_limits<int>::max();
  return options;
}

}  // namespace

void LearningRateOptions::visit(OptionVisitor& v) {
  v.value({"mean", "", 0.0, 1.0, "Step of the centres, relative to the depth of the scene."}, mean);
  v.value({"rotation", "", 0.0, 1.0, "Step of the quaternions."}, rotation);
  v.value({"log_scale", "", 0.0, 1.0, "Step of the logarithms of the extents."}, log_scale);
  v.value({"opacity", "", 0.0, 5.0, "Step of the logit of the opacity."}, opacity);
  v.value({"color", "", 0.0, 1.0, "Step of the constant colour coefficient."}, color);
  v.value({"color_rest", "", 0.0, 1.0, "Step of the view-dependent coefficients."}, color_rest);
  v.value({"final_factor", "", 1e-4, 1.0, "Refinement lowers all steps exponentially to this share."}, final_factor);
}

void PhotorealisticOptions::visit(OptionVisitor& v) {
  v.value({"ssim_weight_online", "", 0.0, 1.0, "Weight λ of the structural term in Eq. (4) while frames arrive."},
          ssim_weight_online);
  v.value({"ssim_weight", "", 0.0, 1.0, "The same during refinement."}, ssim_weight);
  v.value({"depth_weight", "", 0.0, 10.0, "Weight of the depth loss where depth is measured."}, depth_weight);
  v.value(
      {"opacity_weight", "", 0.0, 10.0, "Weight of the mean opacity of the gaussians in view: the fewer, the better."},
      opacity_weight);
  v.value({"sh_degree", "", 0, 3, "Degree of the spherical harmonics that make colours depend on the view."},
          sh_degree);
  v.value({"sh_interval", "iterations", 0, 100000,
           "Training begins with constant colours and adds a degree each time so many have passed; 0: all at once."},
          sh_interval);
  v.value({"near_m", "m", 1e-4, 1.0, "Gaussians nearer to the camera are not drawn."}, near_m);
  v.value(
      {"reseed_interval", "iterations", 0, 100000, "Between two rounds of dense seeding in old keyframes; 0: never."},
      reseed_interval);
  v.value({"reseed_color_error", "", 0.0, 3.0, "Squared colour error above which old keyframes are seeded again."},
          reseed_color_error);
  v.value({"guess_tolerance", "", 0.0, 1.0,
           "Gaussians that borrowed their depth go when they lie this share before what is measured; 0: never."},
          guess_tolerance);
  v.value({"image_budget_mb", "MB", 1.0, 1e6,
           "Pictures of keyframes beyond this are forgotten, those first that others resemble most."},
          image_budget_mb);
  v.group("seeding", "Where and how gaussians are born.", seeding);
  v.group("depth", "Depth of keyframes without a depth sensor.", depth);
  v.group("feature_depth", "Depth of features without a landmark.", feature_depth);
  v.group("schedule", "Which keyframe is trained, at which resolution.", schedule);
  v.group("rates", "Step sizes of Adam.", rates);
  v.group("densification", "Split, clone and prune.", densification);
  v.value({"handover", "", 0, 0,
           "Gaussians that a loop would tear from the picture of the keyframe that showed them last go with it."},
          handover);
  v.group("doubling", "What a loop brings together.", doubling);
  v.group("poses", "Photometric refinement of keyframe poses.", poses);
  v.group("exposure", "Brightness of each keyframe's picture.", exposure);
}

PhotorealisticMapper::PhotorealisticMapper(const PhotorealisticOptions& options, MapperSensor sensor, uint64_t seed,
                                           std::shared_ptr<splatting::Gpu> gpu)
    : options_(options),
      sensor_(std::move(sensor)),
      random_(seed),
      schedule_(schedule_options(options.schedule, gpu != nullptr), sensor_.camera.width, sensor_.camera.height,
                seed + 1),
      trainer_(gpu),
      renderer_(std::move(gpu)) {
  model_.set_sh_degree(options.sh_degree);
}

void PhotorealisticMapper::update_poses(const MapSnapshot& map) {
  const auto change = begin_change();
  std::vector<double> depths;
  std::vector<Sim3> before, after;
  for (size_t i = 0; i < anchors_from_world_.size(); ++i) {
    const KeyframeView& view = map.keyframe(KeyframeId(static_cast<int32_t>(i)));
    before.push_back(anchor_from_world(anchors_from_world_[i], anchor_scales_[i]));
    after.push_back(anchor_from_world(view.keyframe.camera_from_world, view.keyframe.scale));
    if (view.median_depth > 0) depths.push_back(view.median_depth);
  }
  if (!depths.empty()) scene_depth_ = lower_median(depths);
  const std::vector<int> seams = find_seams(options_.schedule.seam_px, sensor_.camera, map, before);
  const bool corrected = map.num_corrections != std::exchange(num_corrections_, map.num_corrections);
  if (options_.handover && corrected && !seams.empty()) hand_over_at(seams, before, after);
  for (size_t i = 0; i < anchors_from_world_.size(); ++i) {
    const Keyframe& keyframe = map.keyframe(KeyframeId(static_cast<int32_t>(i))).keyframe;
    anchors_from_world_[i] = keyframe.camera_from_world;
    if (keyframe.scale == anchor_scales_[i]) continue;
    rescale(i, keyframe.scale / anchor_scales_[i]);
    anchor_scales_[i] = keyframe.scale;
  }
  merge_doubled(options_.doubling, before, after, seams, model_);
  release_culled(map);
  schedule_.revisit(seams);
}

/// What would grow with every lap: pictures of places that newer keyframes show as well, and blocks of few gaussians.
/// The next keyframe may still need the newest picture. In a newer map the parent may be one that has not
/// come yet: then its child keeps its gaussians until it has.
void PhotorealisticMapper::release_culled(const MapSnapshot& map) {
  std::vector<Adoption> adoptions;
  const auto newest = newest_with_pictures();
  for (size_t i = 0; i + 1 < views_.size(); ++i) {
    const Keyframe& keyframe = map.keyframe(KeyframeId(static_cast<int32_t>(i))).keyframe;
    if (!keyframe.culled) continue;
    if (views_[i].has_images() && i != newest) retire(i);
    const auto child = static_cast<int>(i), parent = keyframe.parent.value;
    if (model_.size(child) == 0 || keyframe.parent.value >= std::ssize(anchors_from_world_)) continue;
    const SE3& parent_from_world = anchors_from_world_[static_cast<size_t>(parent)];
    adoptions.push_back({child, parent, parent_from_world * anchors_from_world_[i].inverse()});
  }
  adopt(adoptions, model_);
}

/// Before a correction: what keyframes at the seams show goes with them.
void PhotorealisticMapper::hand_over_at(std::span<const int> seams, std::span<const Sim3> before,
                                        std::span<const Sim3> after) {
  SerialExecutor serial;
  LastViewers viewers(model_);
  for (const int seam : seams) {
    const auto view = static_cast<size_t>(seam);
    if (view >= views_.size() || !views_[view].has_images()) continue;
    render_picture(view, serial);
    viewers.show(seam, views_[view].picture.camera, camera_from_anchor_, render_);
  }
  hand_over(options_.schedule.seam_px, sensor_.camera, before, after, viewers, model_);
}

void PhotorealisticMapper::rescale(size_t index, double factor) {
  model_.rescale_anchor(static_cast<int>(index), static_cast<float>(factor));
  TrainingView& view = views_[index];
  view.adjustment.rescale(factor);
  for (float& depth : view.picture.depth.values()) depth *= static_cast<float>(factor);
}

void PhotorealisticMapper::add_keyframe(const MapSnapshot& map, KeyframeId id, const KeyframeImages& images,
                                        Executor& executor, const std::optional<splatting::Exposure>& exposure) {
  PHOTOSLAM_CHECK(static_cast<size_t>(id.value) == views_.size(), "keyframe {} after {}", id.value, views_.size());
  const auto change = begin_change();
  const Keyframe& keyframe = map.keyframe(id).keyframe;
  anchors_from_world_.push_back(keyframe.camera_from_world);
  anchor_scales_.push_back(keyframe.scale);
  model_.add_anchor();
  schedule_.add_view();
  update_poses(map);

  TrainingView& newest = views_.emplace_back();
  newest.exposure_is_known = options_.exposure.enabled && exposure;
  if (newest.exposure_is_known) {
    newest.exposure.start_from(*exposure);
  } else if (views_.size() > 1) {
    newest.exposure.start_from(views_[views_.size() - 2].exposure.exposure());
  }
  if (images.color.empty() || keyframe.culled) {
    schedule_.retire(id.value);
  } else {
    add_pictures(map, images, executor);
  }
}

/// Of the newest keyframe.
void PhotorealisticMapper::add_pictures(const MapSnapshot& map, const KeyframeImages& images, Executor& executor) {
  const size_t index = views_.size() - 1;
  set_images(images.color, images.depth, sensor_.metres_per_depth_unit,
             images.mask.empty() ? sensor_.mask : images.mask, views_[index]);
  if (!images.right.empty()) views_[index].right = shrink_color(images.right, kSeedingFactor);
  // A single camera's first keyframe has none before it to compare with: it gets its depth from the second.
  const auto active = schedule_.active();
  if (active.size() > 1) {
    const auto before = static_cast<size_t>(active[active.size() - 2]);
    if (views_[before].lacks_depth) seed_keyframe(map, before, executor);
  }
  seed_keyframe(map, index, executor);
  prune(options_.densification, scene_depth_, model_);
  keep_image_budget();
}

std::optional<size_t> PhotorealisticMapper::newest_with_pictures() const {
  const auto active = schedule_.active();
  return active.empty() ? std::nullopt : std::optional(static_cast<size_t>(active.back()));
}

/// Of its pictures, with all levels that training may ask for.
double PhotorealisticMapper::megabytes(const TrainingView& view) const {
  const splatting::TargetImage& target = view.target;
  size_t bytes = view.picture.color.values().size() + view.picture.depth.values().size_bytes() +
                 view.picture.mask.values().size() + view.right.values().size() + target.depth().size_bytes();
  for (int level = 0; level <= schedule_.coarsest_level(); ++level)
    bytes += static_cast<size_t>((target.width() >> level) * (target.height() >> level)) * (target.has_mask() ? 4 : 3);
  return 1e-6 * static_cast<double>(bytes);
}

void PhotorealisticMapper::TrainingView::drop_images() {
  target = {};
  picture = {};
  right = {};
}

void PhotorealisticMapper::retire(size_t view) {
  schedule_.retire(static_cast<int>(view));
  views_[view].drop_images();
}

/// The newest keyframe's pictures stay: the next one's depth may need them.
void PhotorealisticMapper::keep_image_budget() {
  const auto newest = newest_with_pictures();
  if (!newest) return;
  const double fitting = options_.image_budget_mb / std::max(megabytes(views_[*newest]), 1e-6);
  while (static_cast<double>(schedule_.active().size()) > std::max(fitting, 2.0)) {
    std::vector<SE3> poses;
    for (const int view : schedule_.active()) poses.push_back(view_from_world(static_cast<size_t>(view)));
    const int dispensable = schedule_.active()[most_redundant_view(poses, scene_depth_)];
    retire(static_cast<size_t>(dispensable));
  }
}

void PhotorealisticMapper::set_images(const ImageU8& color, const ImageU16& depth, double metres_per_depth_unit,
                                      const ImageU8& mask, TrainingView& view) const {
  const CameraView full{sensor_.camera, color, depth, mask};
  view.target = {full.camera.width, full.camera.height, full.color.values(), full.mask.values()};
  if (!depth.empty()) view.target.set_depth(depth.values(), static_cast<float>(metres_per_depth_unit));
  view.metres_per_depth_unit = metres_per_depth_unit;
  view.picture = make_picture(full, metres_per_depth_unit);
}

void PhotorealisticMapper::seed_keyframe(const MapSnapshot& map, size_t view, Executor& executor) {
  DepthPicture& picture = views_[view].picture;
  show(view, executor);
  if (picture.depth.empty() && options_.depth.enabled) {
    const double unexplained = unexplained_share(options_.seeding, picture, render_, cell_size(options_.seeding));
    // What is trained long enough looks right in the next picture, too, wherever it is: colours explain, depth
    // corrects.
    const bool has_time = iteration_ - swept_at_ >= options_.depth.spare_iterations;
    const bool is_wanted = has_time || unexplained >= options_.depth.min_unexplained;
    if (is_wanted) sweep_picture(map, view, executor);
    if (is_wanted) swept_at_ = iteration_;
    views_[view].lacks_depth = is_wanted && picture.depth.empty();
  }
  settle_guesses_in(view, executor);
  const Keyframe& keyframe = map.keyframe(KeyframeId(static_cast<int32_t>(view))).keyframe;
  newest_features_ = feature_depths(options_.feature_depth, map, keyframe, picture, kSeedingFactor);
  SeedingRound round{cell_size(options_.seeding), options_.seeding.min_color_error};
  round.confirmed = confirm_depth(map, view);
  seed(view, round, newest_features_);
}

/// By the depths of the keyframes that see most of what it sees.
ImageF PhotorealisticMapper::confirm_depth(const MapSnapshot& map, size_t index) const {
  const DepthPicture& picture = views_[index].picture;
  if (picture.depth.empty() || options_.seeding.consistency_tolerance <= 0) return {};
  const SE3 world_from_view = anchors_from_world_[index].inverse();
  std::vector<MeasuredView> others;
  const auto has_depth = [&](KeyframeId other) {
    return static_cast<size_t>(other.value) < views_.size() &&
           !views_[static_cast<size_t>(other.value)].picture.depth.empty();
  };
  for (const KeyframeId other :
       keyframes_to_compare(options_.depth, map, KeyframeId(static_cast<int32_t>(index)), has_depth)) {
    const auto i = static_cast<size_t>(other.value);
    others.push_back({&views_[i].picture, anchors_from_world_[i] * world_from_view});
  }
  return confirmed_depth(picture, others, options_.seeding.consistency_tolerance);
}

void PhotorealisticMapper::sweep_picture(const MapSnapshot& map, size_t index, Executor& executor) {
  TrainingView& view = views_[index];
  const KeyframeId id(static_cast<int32_t>(index));
  const auto range = search_range(map, map.keyframe(id));
  if (!range) return;
  const SE3 world_from_reference = anchors_from_world_[index].inverse();
  std::vector<SweepView> others;
  if (!view.right.empty()) {
    SE3 right_from_left;
    right_from_left.translation.x() = -sensor_.stereo_baseline_m;
    others.push_back({&view.right, view.picture.camera, right_from_left});
  }
  auto neighbours = sweep_neighbours(options_.depth, map, id, [&](KeyframeId other) {
    return static_cast<size_t>(other.value) < views_.size() && views_[static_cast<size_t>(other.value)].has_images();
  });
  if (!others.empty() && !neighbours.empty()) neighbours.pop_back();  // the right image does for one of them
  std::vector<ImageU8> pictures;
  pictures.reserve(neighbours.size());
  for (const KeyframeId neighbour : neighbours) {
    const auto i = static_cast<size_t>(neighbour.value);
    pictures.push_back(to_grey(views_[i].picture.color));
    others.push_back({&pictures.back(), view.picture.camera, anchors_from_world_[i] * world_from_reference});
  }
  if (others.empty()) return;
  const ImageU8 grey = to_grey(view.picture.color);
  view.picture.depth = sweep_depth(options_.depth.sweep, grey, view.picture.camera, others, *range, executor);
  for (size_t i = 0; i < view.picture.depth.values().size(); ++i) {
    if (!view.picture.has_data(i)) view.picture.depth.values()[i] = 0;
  }
}

SE3 PhotorealisticMapper::view_from_world(size_t view) const {
  return views_[view].adjustment.correction() * anchors_from_world_[view];
}

splatting::RenderOptions PhotorealisticMapper::render_options(int factor) const {
  splatting::RenderOptions render;
  render.near = static_cast<float>(options_.near_m);
  render.shrink_factor = factor;
  return render;
}

/// The map as the view's small picture shows it, before any exposure.
void PhotorealisticMapper::render_picture(size_t index, Executor& executor) {
  camera_from_anchors(view_from_world(index), anchors_from_world_, camera_from_anchor_);
  const splatting::Camera camera = to_splatting(views_[index].picture.camera);
  renderer_.render(model_, {camera, camera_from_anchor_}, render_options(kSeedingFactor), executor, render_);
}

/// The map as the view's small picture shows it, as bright as the picture; for a view that was not trained yet that is
/// found out by comparing the two.
void PhotorealisticMapper::show(size_t index, Executor& executor) {
  TrainingView& view = views_[index];
  render_picture(index, executor);
  if (!options_.exposure.enabled) return;
  const bool unused = schedule_.uses(static_cast<int>(index)) == 0;
  if (index > 0 && unused && !view.exposure_is_known) view.exposure.match(view.picture, render_);
  apply(view.exposure.exposure(), render_);
}

void PhotorealisticMapper::settle_guesses_in(size_t index, Executor& executor) {
  const TrainingView& view = views_[index];
  if (settle_guesses(view.picture, camera_from_anchor_, options_.near_m, options_.guess_tolerance, model_) == 0) return;
  render_picture(index, executor);
  if (options_.exposure.enabled) apply(view.exposure.exposure(), render_);
}

void PhotorealisticMapper::seed(size_t index, const SeedingRound& round, std::span<const DepthPixel> features) {
  const DepthPicture& picture = views_[index].picture;
  auto [measured, guessed] = seed_cells(options_.seeding, picture, render_, round);
  const auto at_features = seed_features(options_.seeding, picture, kSeedingFactor, render_, features);
  measured.insert(measured.end(), at_features.begin(), at_features.end());
  const auto limit = static_cast<size_t>(options_.densification.max_gaussians);
  // A picture may want more seeds than the budget has; they must not push out all that was learnt.
  const size_t wanted = measured.size() + guessed.size();
  if (options_.densification.relocation) make_room(options_.densification, std::min(wanted, limit / 10), model_);
  const size_t room = limit - std::min(limit, model_.size());
  if (wanted > room) {
    thin(measured, room * measured.size() / wanted);
    thin(guessed, room - measured.size());
  }
  add_seeds(index, measured, 0);
  add_seeds(index, guessed, kGuessTag);
}

void PhotorealisticMapper::add_seeds(size_t index, std::span<splatting::Gaussian> seeds, uint32_t tag) {
  const TrainingView& view = views_[index];
  const splatting::Exposure exposure = view.exposure.exposure();
  // Seeds are made in the frame of the adjusted view; the anchor is the geometric keyframe.
  const SE3 anchor_from_view = view.adjustment.correction().inverse();
  const ShRotation rotation(anchor_from_view.matrix3());
  for (splatting::Gaussian& g : seeds) {
    if (options_.exposure.enabled) remove(exposure, g);
    g = transform(g, anchor_from_view, rotation);
  }
  model_.add(static_cast<int>(index), seeds, tag, static_cast<uint32_t>(iteration_));
}

void PhotorealisticMapper::add_gaussians(std::span<const splatting::Gaussian> in_world) {
  PHOTOSLAM_CHECK(has_keyframes(), "gaussians need a keyframe to be anchored to");
  const auto change = begin_change();
  const SE3& anchor_from_world = anchors_from_world_.front();
  const ShRotation rotation(anchor_from_world.matrix3());
  std::vector<splatting::Gaussian> in_anchor;
  for (const splatting::Gaussian& g : in_world) in_anchor.push_back(transform(g, anchor_from_world, rotation));
  model_.add(0, in_anchor, 0, static_cast<uint32_t>(iteration_));
  keep_gaussian_budget();
}

size_t PhotorealisticMapper::keep_gaussian_budget() {
  const auto change = begin_change();
  return keep_budget(options_.densification, model_);
}

void PhotorealisticMapper::append(PhotorealisticMapper other) {
  const auto change = begin_change();
  anchors_from_world_.insert(anchors_from_world_.end(), other.anchors_from_world_.begin(),
                             other.anchors_from_world_.end());
  anchor_scales_.insert(anchor_scales_.end(), other.anchor_scales_.begin(), other.anchor_scales_.end());
  std::ranges::move(other.views_, std::back_inserter(views_));
  model_.append(other.model_);
  schedule_.append(other.schedule_);
  keep_gaussian_budget();
  keep_image_budget();
}

splatting::TrainOptions PhotorealisticMapper::train_options(std::optional<double> progress, int factor) const {
  const double decay = progress ? std::pow(options_.rates.final_factor, *progress) : 1.0;
  splatting::TrainOptions train;
  train.render = render_options(factor);
  if (options_.sh_interval > 0)
    train.render.sh_degree = std::min(iteration_ / options_.sh_interval, options_.sh_degree);
  const auto rate = [&](double value) { return static_cast<float>(decay * value); };
  train.rates = {.mean = rate(options_.rates.mean * scene_depth_),
                 .rotation = rate(options_.rates.rotation),
                 .log_scale = rate(options_.rates.log_scale),
                 .opacity = rate(options_.rates.opacity),
                 .sh_dc = rate(options_.rates.color),
                 .sh_rest = rate(options_.rates.color_rest)};
  train.beta2 = 0.99f;
  train.ssim_weight = static_cast<float>(progress ? options_.ssim_weight : options_.ssim_weight_online);
  train.depth_weight = static_cast<float>(options_.depth_weight);
  train.opacity_weight = static_cast<float>(options_.opacity_weight);
  return train;
}

splatting::StepResult PhotorealisticMapper::train(std::optional<double> progress, Executor& executor) {
  const auto change = begin_change();
  const KeyframeSchedule::Choice choice = schedule_.next(progress.has_value());
  const auto index = static_cast<size_t>(choice.view);
  TrainingView& view = views_[index];
  splatting::TrainOptions options = train_options(progress, 1 << choice.level);
  options.exposure = view.exposure.exposure();
  camera_from_anchors(view_from_world(index), anchors_from_world_, camera_from_anchor_);
  const splatting::Camera camera = to_splatting(shrink(sensor_.camera, options.render.shrink_factor));
  const splatting::StepResult result =
      trainer_.step(model_, {camera, camera_from_anchor_}, view.target, options, executor);

  // The first keyframe defines the world, and what is bright in it.
  if (choice.view > 0) {
    const double decay = progress ? std::pow(options_.rates.final_factor, *progress) : 1.0;
    if (options_.poses.enabled) view.adjustment.step(options_.poses, scene_depth_, decay, result.pose_gradient);
    if (options_.exposure.enabled) view.exposure.step(options_.exposure, decay, result.exposure_gradient);
  }
  schedule_.report(choice.view, static_cast<double>(result.loss));
  const double psnr = -10.0 * std::log10(std::max(static_cast<double>(result.mse), 1e-10));
  constexpr double kMemory = 0.98;
  training_psnr_ = iteration_ == 0 ? psnr : kMemory * training_psnr_ + (1.0 - kMemory) * psnr;
  ++iteration_;
  maintain(progress, executor);
  return result;
}

void PhotorealisticMapper::maintain(std::optional<double> progress, Executor& executor) {
  constexpr double kGrowthEnd = 0.6;  // share of the refinement after which the map only settles
  const bool growing = !progress || *progress < kGrowthEnd;
  if (growing && options_.reseed_interval > 0 && iteration_ % options_.reseed_interval == 0) {
    const auto active = schedule_.active();
    const auto view = static_cast<size_t>(active[static_cast<size_t>(random_.index(static_cast<int>(active.size())))]);
    show(view, executor);
    const int cell = cell_size(options_.seeding);
    const bool measured = !views_[view].picture.depth.empty();  // what holes borrow is coarse
    const bool has_holes = !views_[view].lacks_depth && view != newest_with_pictures();
    seed(view, {measured ? std::max(1, cell / 2) : cell, options_.reseed_color_error, has_holes}, {});
  }
  if (iteration_ % options_.densification.interval != 0) return;
  if (progress && growing && options_.densification.enabled) {
    densify(options_.densification, scene_depth_, random_, model_);
  } else {
    prune_idle(options_.densification, model_);
  }
  prune(options_.densification, scene_depth_, model_);
}

KeyframeComparison PhotorealisticMapper::compare(size_t keyframe, Executor& executor) {
  PHOTOSLAM_CHECK(keyframe < views_.size(), "keyframe {} of {}", keyframe, views_.size());
  render_picture(keyframe, executor);
  apply(views_[keyframe].exposure.exposure(), render_);
  const bool newest = keyframe == newest_with_pictures();
  return {to_rgb(views_[keyframe].picture.color), to_u8(to_image(render_)),
          newest ? newest_features_ : std::vector<DepthPixel>()};
}

/// The keyframe nearest in time, mostly itself, whose exposure is more than a guess.
size_t PhotorealisticMapper::nearest_with_exposure(size_t index) const {
  const auto has_exposure = [&](size_t i) {
    return i < views_.size() &&
           (views_[i].has_images() || views_[i].exposure_is_known || schedule_.uses(static_cast<int>(i)) > 0);
  };
  for (size_t distance = 0; distance < views_.size(); ++distance) {
    if (distance <= index && has_exposure(index - distance)) return index - distance;
    if (has_exposure(index + distance)) return index + distance;
  }
  return index;
}

FrozenMap PhotorealisticMapper::freeze() const {
  FrozenMap frozen;
  frozen.anchors_from_world = anchors_from_world_;
  frozen.keyframe_scales = anchor_scales_;
  frozen.gaussians.set_sh_degree(model_.sh_degree());
  std::vector<std::vector<splatting::Gaussian>> of_anchor(views_.size());
  model_.for_each([&](size_t i) { of_anchor[static_cast<size_t>(model_.anchor(i))].push_back(model_.get(i)); });
  for (size_t i = 0; i < views_.size(); ++i) {
    frozen.keyframes_from_world.push_back(view_from_world(i));
    frozen.keyframe_exposures.push_back(views_[nearest_with_exposure(i)].exposure.exposure());
    frozen.gaussians.add(frozen.gaussians.add_anchor(), of_anchor[i]);
  }
  return frozen;
}

}  // namespace photoslam
