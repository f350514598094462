// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "base/executor.h"
#include "base/options.h"
#include "base/wholeness.h"
#include "image/pyramid.h"
#include "map/snapshot.h"
#include "photorealistic_mapping/densification.h"
#include "photorealistic_mapping/doubled_gaussians.h"
#include "photorealistic_mapping/exposure_adjustment.h"
#include "photorealistic_mapping/feature_depth.h"
#include "photorealistic_mapping/keyframe_depth.h"
#include "photorealistic_mapping/keyframe_schedule.h"
#include "photorealistic_mapping/pose_adjustment.h"
#include "photorealistic_mapping/seeding.h"
#include "splatting/trainer.h"

namespace photoslam {

class Archive;

struct LearningRateOptions {
  double mean = 2.4e-4;
  double rotation = 5e-3;
  double log_scale = 0.025;
  double opacity = 0.25;
  double color = 0.0125;
  double color_rest = 6e-4;
  double final_factor = 0.1;
  void visit(OptionVisitor& visitor);
};

struct PhotorealisticOptions {
  double ssim_weight_online = 0.0;
  double ssim_weight = 0.2;
  double depth_weight = 0.1;
  double opacity_weight = 0.0;
  int sh_degree = 3;
  int sh_interval = 100;
  double near_m = 0.01;
  int reseed_interval = 25;
  double reseed_color_error = 0.03;
  double guess_tolerance = 0.1;
  double image_budget_mb = 1000;
  bool handover = true;
  SeedingOptions seeding;
  KeyframeDepthOptions depth;
  FeatureDepthOptions feature_depth;
  ScheduleOptions schedule;
  LearningRateOptions rates;
  DensificationOptions densification;
  DoublingOptions doubling;
  PoseAdjustmentOptions poses;
  ExposureOptions exposure;
  void visit(OptionVisitor& visitor);
};

/// What the mapper knows of the camera.
struct MapperSensor {
  PinholeCamera camera;
  double metres_per_depth_unit = 0.001;  ///< Of depth images.
  double stereo_baseline_m = 0;          ///< Of rectified pairs; 0 = there is no right camera.
  ImageU8 mask = {};                     ///< 0 where pictures have no data; empty = everywhere.
};

/// The gaussians and the keyframe poses at one moment: all that rendering needs.
struct FrozenMap {
  splatting::GaussianModel gaussians;
  std::vector<SE3> anchors_from_world;    ///< [K] geometric keyframe poses: frames of the gaussians.
  std::vector<SE3> keyframes_from_world;  ///< [K] camera_from_world, photometrically adjusted: what trajectories use.
  std::vector<double> keyframe_scales;    ///< [K] Keyframe::scale
  std::vector<splatting::Exposure> keyframe_exposures;  ///< [K] What makes renders as bright as the pictures.
};

/// A keyframe at half its size.
struct KeyframeComparison {
  ImageU8 picture;                   ///< RGB
  ImageU8 render;                    ///< RGB, what the map shows there now.
  std::vector<DepthPixel> features;  ///< In pixels of the full picture; of the newest keyframe only.
};

/// Photorealistic mapping (paper, Sec. 3.3 and 3.4): trains the gaussians of the hyper primitives map on keyframe
/// images by splatting, with geometry-based densification and Gaussian-pyramid learning. Synchronous; deterministic for
/// a seed, at any concurrency of the executor.
class PhotorealisticMapper {
 public:
  /// Trains and draws on the GPU, as long as that works, or (null) on the CPU.
  PhotorealisticMapper(const PhotorealisticOptions& options, MapperSensor sensor, uint64_t seed,
                       std::shared_ptr<splatting::Gpu> gpu = nullptr);

  /// Takes over the poses of all keyframes, and with them moves the gaussians. Where a keyframe's scale has changed,
  /// all that is measured in its frame grows with it. Keyframes that geometry mapping has culled, because others see
  /// what they see, give their gaussians to their parents, and their pictures are forgotten.
  void update_poses(const MapSnapshot& map);

  /// Starts training on the next keyframe (by id) and seeds the part of its image that the map does not explain. An
  /// exposure learnt before is taken over; without one it is found by comparing the image with the map. Without
  /// pictures, or culled already, it is only an anchor; the map may be newer than the keyframe.
  void add_keyframe(const MapSnapshot& map, KeyframeId id, const KeyframeImages& images, Executor& executor,
                    const std::optional<splatting::Exposure>& exposure = {});

  /// Adds gaussians from elsewhere, given in the world frame, to the first keyframe; there must be one. As in append(),
  /// what is too much for the budget goes.
  void add_gaussians(std::span<const splatting::Gaussian> in_world);

  /// Adds all that another mapper has come to, its keyframes counted on from those of this one.
  void append(PhotorealisticMapper other);

  /// Removes what exceeds max_gaussians, as after loading a map that was made with a larger budget. Returns how many.
  size_t keep_gaussian_budget();

  /// One training iteration, Eq. (4). At least one keyframe with pictures is needed. `progress` in [0, 1] says how much
  /// of the refinement is done; empty while frames arrive.
  splatting::StepResult train(std::optional<double> progress, Executor& executor);

  /// Of a keyframe that still has its picture.
  KeyframeComparison compare(size_t keyframe, Executor& executor);

  /// Whether the next iterations go to keyframes where a correction of the map left seams.
  bool has_seams() const { return schedule_.is_revisiting(); }
  size_t num_keyframes() const { return views_.size(); }
  bool has_keyframes() const { return !views_.empty(); }
  /// The newest keyframe that still has its pictures; none: there is nothing to train on.
  std::optional<size_t> newest_with_pictures() const;
  const splatting::GaussianModel& gaussians() const { return model_; }
  int num_iterations() const { return iteration_; }
  /// Running mean of the PSNR of the training views, as rendered [dB]; 0 before the first iteration.
  double training_psnr() const { return training_psnr_; }
  FrozenMap freeze() const;

  /// Writes everything that training has come to, or continues from where it was written: with the same options the
  /// next iterations are those that would have followed. Throws when the map is not whole.
  void serialize(Archive& archive);
  /// False once an exception has left a change half made: such a map is neither written nor changed any more.
  bool is_whole() const { return wholeness_.is_whole(); }

 private:
  /// A keyframe as training material, while its pictures are within the budget.
  struct TrainingView {
    PoseAdjustment adjustment;  // photometric correction of the keyframe's pose
    ExposureAdjustment exposure;
    bool exposure_is_known = false;  // from elsewhere; the map is not asked
    bool lacks_depth = false;        // wanted for seeding, but not to be had yet
    splatting::TargetImage target;
    double metres_per_depth_unit = 0;  // of the target
    DepthPicture picture;              // half the size, for seeding
    ImageU8 right;                     // stereo: grey, half the size
    bool has_images() const { return !target.empty(); }
    void drop_images();
  };

  static constexpr const char* kName = "the photorealistic map";
  Wholeness::Change begin_change() { return {wholeness_, kName}; }
  SE3 view_from_world(size_t view) const;
  splatting::RenderOptions render_options(int factor) const;
  splatting::TrainOptions train_options(std::optional<double> progress, int factor) const;
  void add_pictures(const MapSnapshot& map, const KeyframeImages& images, Executor& executor);
  void set_images(const ImageU8& color, const ImageU16& depth, double metres_per_depth_unit, const ImageU8& mask,
                  TrainingView& view) const;
  size_t nearest_with_exposure(size_t view) const;
  double megabytes(const TrainingView& view) const;
  void retire(size_t view);
  void release_culled(const MapSnapshot& map);
  void keep_image_budget();
  void serialize_view(Archive& archive, const ImageU8& mask, TrainingView* view);
  void hand_over_at(std::span<const int> seams, std::span<const Sim3> before, std::span<const Sim3> after);
  void rescale(size_t view, double factor);
  void seed_keyframe(const MapSnapshot& map, size_t view, Executor& executor);
  void sweep_picture(const MapSnapshot& map, size_t view, Executor& executor);
  ImageF confirm_depth(const MapSnapshot& map, size_t view) const;
  void show(size_t view, Executor& executor);
  /// Of the view that show() has just drawn, which is drawn again where one went.
  void settle_guesses_in(size_t view, Executor& executor);
  /// What show() has drawn of the same view is what need not be seeded.
  void seed(size_t view, const SeedingRound& round, std::span<const DepthPixel> features);
  /// As they come from the view's picture; their values are used up.
  void add_seeds(size_t view, std::span<splatting::Gaussian> seeds, uint32_t tag);
  void render_picture(size_t view, Executor& executor);
  void maintain(std::optional<double> progress, Executor& executor);

  PhotorealisticOptions options_;
  MapperSensor sensor_;
  Wholeness wholeness_;
  Random random_;
  KeyframeSchedule schedule_;
  splatting::GaussianModel model_;
  splatting::Trainer trainer_;
  splatting::Renderer renderer_;
  splatting::RenderResult render_;
  std::vector<splatting::Pose> camera_from_anchor_;
  std::vector<SE3> anchors_from_world_;
  std::vector<double> anchor_scales_;  // Keyframe::scale as taken over last
  std::vector<TrainingView> views_;
  std::vector<DepthPixel> newest_features_;  // of the keyframe seeded last
  int num_corrections_ = 0;                  // of the map, as taken over last
  double scene_depth_ = 1.0;                 // median over keyframes of their median depth [m]
  int iteration_ = 0;
  int swept_at_ = 0;  // the iteration at which depth was measured last
  double training_psnr_ = 0;
};

}  // namespace photoslam
