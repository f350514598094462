// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/photorealistic_mapper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/archive.h"
#include "image/convert.h"
#include "photorealistic_mapping/testing/wall_with_keyframes.h"
#include "photorealistic_mapping/view_geometry.h"

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera = {320, 240, 280, 280, 166.5, 114};
constexpr double kBaseline = 0.2;

SE3 at(double x, double y = 0) { return {Quat::Identity(), Vec3(-x, -y, 0)}; }

class PhotorealisticMapperTest : public ::testing::Test {
 protected:
  void add(PhotorealisticMapper& mapper, const SE3& pose, KeyframeImages images, double gain = 1.0,
           const std::optional<splatting::Exposure>& known = {}) {
    world.add(pose);
    images.color = to_rgb(world.picture(pose));
    for (uint8_t& v : images.color.values()) v = static_cast<uint8_t>(std::lround(std::min(255.0, gain * v)));
    mapper.add_keyframe(*world.snapshot(), KeyframeId(num_added++), images, executor, known);
  }
  /// Share of the gaussians within `tolerance` of the wall's depth, seen from the first keyframe.
  double share_on_the_wall(const PhotorealisticMapper& mapper, double tolerance) const {
    const FrozenMap map = mapper.freeze();
    int near = 0, all = 0;
    map.gaussians.for_each([&](size_t i) {
      const splatting::Gaussian g = map.gaussians.get(i);
      const Vec3 mean(static_cast<double>(g.mean[0]), static_cast<double>(g.mean[1]), static_cast<double>(g.mean[2]));
      const Vec3 p = map.anchors_from_world[static_cast<size_t>(map.gaussians.anchor(i))].inverse() * mean;
      const double wall = 4.0 + world.wall.wall_slope * p.x();
      near += std::abs(p.z() - wall) < tolerance * wall;
      ++all;
    });
    return static_cast<double>(near) / std::max(all, 1);
  }
  KeyframeImages stereo(const SE3& pose) const {
    SE3 right_from_left;
    right_from_left.translation.x() = -kBaseline;
    return {{}, {}, world.picture(right_from_left * pose)};
  }

  testing::WallWithKeyframes world{kCamera};
  ThreadPool executor{2};
  int32_t num_added = 0;
};

TEST_F(PhotorealisticMapperTest, StereoSeedsTheSurfaceFromOneKeyframe) {
  PhotorealisticMapper mapper({}, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
  add(mapper, at(0), stereo(at(0)));
  EXPECT_GT(mapper.gaussians().size(), 800u) << "one per cell of 6 pixels";
  EXPECT_GT(share_on_the_wall(mapper, 0.08), 0.9);
}

TEST_F(PhotorealisticMapperTest, ASingleCameraSeedsBothKeyframesFromTheSecondOn) {
  PhotorealisticMapper mapper({}, {.camera = kCamera}, 1);
  add(mapper, at(0), {});
  const size_t at_features = mapper.gaussians().size();
  EXPECT_LT(at_features, 200u) << "features only: nothing to compare the picture with";
  add(mapper, at(0.3, 0.05), {});
  EXPECT_GT(mapper.gaussians().size(), 800u);
  EXPECT_GT(share_on_the_wall(mapper, 0.08), 0.9);
}

TEST_F(PhotorealisticMapperTest, DepthIsMeasuredForWhatTheMapDoesNotExplainOrWhenThereIsTime) {
  const auto growth = [&](double min_unexplained, int spare_iterations) {
    PhotorealisticOptions options;
    options.depth.min_unexplained = min_unexplained;
    options.depth.spare_iterations = spare_iterations;
    options.reseed_interval = 0;
    options.densification.interval = 1000;
    PhotorealisticMapper mapper(options, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
    world = testing::WallWithKeyframes{kCamera};
    num_added = 0;
    add(mapper, at(0), stereo(at(0)));
    for (int i = 0; i < 60; ++i) mapper.train({}, executor);
    const size_t before = mapper.gaussians().size();
    add(mapper, at(0.6), stereo(at(0.6)));  // an eighth of the picture is new
    return static_cast<int>(mapper.gaussians().size()) - static_cast<int>(before);
  };
  const int measured = growth(0.02, 61), features_only = growth(0.9, 61), with_time = growth(0.9, 60);
  EXPECT_GT(measured, features_only + 100);
  EXPECT_EQ(with_time, measured);
}

TEST_F(PhotorealisticMapperTest, WhatWasGuessedGoesWhenItIsMeasuredFartherAway) {
  PhotorealisticMapper mapper({}, {.camera = kCamera, .metres_per_depth_unit = 0.001}, 1);
  const auto depth = [](uint16_t left, uint16_t right) {
    ImageU16 image(kCamera.width, kCamera.height);
    for (int y = 0; y < kCamera.height; ++y) {
      for (int x = 0; x < kCamera.width; ++x) image(x, y) = x < kCamera.width / 2 ? left : right;
    }
    return image;
  };
  const auto left_half_at = [&](int anchor, float metres) {
    int count = 0;
    mapper.gaussians().for_each([&](size_t i) {
      const splatting::Gaussian g = mapper.gaussians().get(i);
      const bool left = g.mean[0] / g.mean[2] < -0.08f;  // not just: a seed of the right half may reach over
      count += left && mapper.gaussians().anchor(i) == anchor && std::abs(g.mean[2] - metres) < 0.2f;
    });
    return count;
  };
  add(mapper, at(0), {{}, depth(0, 2000), {}});
  EXPECT_GT(left_half_at(0, 2), 800) << "guessed";
  add(mapper, at(0.05), {{}, depth(4000, 4000), {}});
  EXPECT_LE(left_half_at(0, 2), 2 * 240 / 6) << "one column of cells and a half has left the picture";
  EXPECT_GT(left_half_at(1, 4), 700) << "seeded where they were measured";
}

TEST_F(PhotorealisticMapperTest, WhatTwoKeyframesMeasureBeforeWhatIsDrawnIsSeeded) {
  const auto seeds_at = [&](double tolerance, float metres) {
    PhotorealisticOptions options;
    options.seeding.consistency_tolerance = tolerance;
    options.seeding.min_color_error = 3;  // colours are no reason
    options.seeding.inactive_features = options.seeding.active_features = false;
    PhotorealisticMapper mapper(options, {.camera = kCamera, .metres_per_depth_unit = 0.001}, 1);
    world = testing::WallWithKeyframes{kCamera};
    num_added = 0;
    // The first keyframe measures wrongly. The second contradicts it, the third agrees with the second.
    for (const auto& [x, depth] : {std::pair{0.0, 6000}, {0.1, 4000}, {0.2, 4100}}) {
      add(mapper, at(x), {{}, ImageU16(kCamera.width, kCamera.height, 1, static_cast<uint16_t>(depth)), {}});
    }
    std::vector<int> count(3);
    mapper.gaussians().for_each([&](size_t i) {
      const bool there = std::abs(mapper.gaussians().get(i).mean[2] - metres) < 0.05f;
      count[static_cast<size_t>(mapper.gaussians().anchor(i))] += there;
    });
    return count;
  };
  EXPECT_GT(seeds_at(0.05, 6.0f)[0], 800) << "what is drawn";
  EXPECT_LT(seeds_at(0.05, 4.0f)[1], 100) << "a strip at the edge that is new";
  EXPECT_GT(seeds_at(0.05, 4.1f)[2], 800);
  EXPECT_LT(seeds_at(0.0, 4.1f)[2], 100);
  EXPECT_LT(seeds_at(0.01, 4.1f)[2], 100);
}

TEST_F(PhotorealisticMapperTest, ThatGuessesGoChangesNoExposure) {
  PhotorealisticOptions keeps;
  keeps.guess_tolerance = 0;
  const MapperSensor sensor{.camera = kCamera, .metres_per_depth_unit = 0.001};
  PhotorealisticMapper settles({}, sensor, 1), believes(keeps, sensor, 1);
  const auto add_to_both = [&](const SE3& pose, uint16_t depth_at_the_left, double gain) {
    KeyframeImages images{{}, ImageU16(kCamera.width, kCamera.height, 1, 4000), {}};
    for (int y = 0; y < kCamera.height; ++y) std::fill_n(images.depth.row(y), kCamera.width / 8, depth_at_the_left);
    add(settles, pose, images, gain);
    images.color = to_rgb(world.picture(pose));
    for (uint8_t& v : images.color.values()) v = static_cast<uint8_t>(std::lround(gain * v));
    believes.add_keyframe(*world.snapshot(), KeyframeId(num_added - 1), images, executor);
  };
  add_to_both(at(0), 0, 1.0);
  for (int i = 0; i < 60; ++i) {
    settles.train({}, executor);
    believes.train({}, executor);
  }
  add_to_both(at(0.05), 5000, 0.8);
  EXPECT_NE(settles.gaussians().size(), believes.gaussians().size());
  const auto one = settles.freeze().keyframe_exposures.back(), other = believes.freeze().keyframe_exposures.back();
  EXPECT_LT(one.gain[0], 0.95f);
  for (size_t c = 0; c < 3; ++c) EXPECT_EQ(one.gain[c], other.gain[c]);
}

TEST_F(PhotorealisticMapperTest, ASmallBudgetIsSpreadOverThePictureAndKeptByWhatWasLearnt) {
  PhotorealisticOptions options;
  options.densification.max_gaussians = 300;
  options.densification.relocation = true;
  PhotorealisticMapper mapper(options, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
  add(mapper, at(0), stereo(at(0)));
  ASSERT_EQ(mapper.gaussians().size(), 300u);
  int below = 0;
  mapper.gaussians().for_each([&](size_t i) { below += mapper.gaussians().get(i).mean[1] > 0; });
  EXPECT_NEAR(below, 158, 30) << "126 of 240 rows";
  for (int i = 0; i < 20; ++i) mapper.train({}, executor);
  add(mapper, at(5), stereo(at(5)));  // all of it is new
  int first = 0;
  mapper.gaussians().for_each([&](size_t i) { first += mapper.gaussians().anchor(i) == 0; });
  EXPECT_GE(first, 230) << "a tenth makes room";
  EXPECT_LT(first, 300);
  EXPECT_LE(mapper.gaussians().size(), 300u);
}

TEST_F(PhotorealisticMapperTest, TrainingImprovesTheRender) {
  PhotorealisticMapper mapper({}, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
  for (const double x : {0.0, 0.3, 0.6}) add(mapper, at(x), stereo(at(x)));
  const auto first = mapper.train({}, executor);
  splatting::StepResult last{};
  for (int i = 0; i < 150; ++i) last = mapper.train({}, executor);
  EXPECT_LT(last.mse, 0.5f * first.mse);
  EXPECT_EQ(mapper.num_iterations(), 151);
}

TEST_F(PhotorealisticMapperTest, ColorsBecomeViewDependentOneDegreeAfterTheOther) {
  PhotorealisticOptions options;
  options.sh_degree = 2;
  options.sh_interval = 10;
  options.poses.enabled = false;
  PhotorealisticMapper mapper(options, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
  for (const double x : {0.0, 0.3}) add(mapper, at(x), stereo(at(x)));
  // The highest coefficient that is not zero in any gaussian: degree d has those below (d + 1)^2.
  const auto highest = [&] {
    int found = 0;
    mapper.gaussians().for_each([&](size_t i) {
      const splatting::Gaussian g = mapper.gaussians().get(i);
      for (int k = found + 1; k < splatting::kNumShCoefficients; ++k) {
        for (const float value : g.sh[k]) found = value == 0 ? found : k;
      }
    });
    return found;
  };
  const int expected[] = {0, 3, 8, 8};
  for (const int k : expected) {
    for (int i = 0; i < 10; ++i) mapper.train({}, executor);
    EXPECT_EQ(highest(), k) << mapper.num_iterations() << " iterations";
  }
}

TEST_F(PhotorealisticMapperTest, WhatNoPictureNeedsIsRemovedWhileFramesArrive) {
  PhotorealisticOptions options;
  options.seeding.cell_px = 8;  // a wall without gaps that something behind could fill
  PhotorealisticMapper mapper(options, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
  for (const double x : {0.0, 0.3}) add(mapper, at(x), stereo(at(x)));
  splatting::Gaussian hidden{};
  hidden.mean[2] = 9;  // behind the wall at 4 m
  hidden.rotation[0] = 1;
  for (float& s : hidden.log_scale) s = -3;
  mapper.add_gaussians(std::vector(20, hidden));
  const auto num_hidden = [&] {
    int count = 0;
    mapper.gaussians().for_each([&](size_t i) { count += mapper.gaussians().get(i).mean[2] > 8; });
    return count;
  };
  const size_t before = mapper.gaussians().size();
  ASSERT_EQ(num_hidden(), 20);
  // A round has 200 iterations; in the first one the wall is still half transparent.
  for (int i = 0; i < 400; ++i) mapper.train({}, executor);
  EXPECT_EQ(num_hidden(), 0);
  EXPECT_GT(mapper.gaussians().size(), before / 2) << "the wall stays";
}

TEST_F(PhotorealisticMapperTest, ExposureIsToldFromColor) {
  const std::vector<double> gains = {0.8, 0.95, 0.7, 0.85, 0.65};
  double psnr[2];
  for (const bool enabled : {false, true}) {
    PhotorealisticOptions options;
    options.exposure.enabled = enabled;
    PhotorealisticMapper mapper(options, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
    world = testing::WallWithKeyframes(kCamera);
    num_added = 0;
    for (size_t i = 0; i < gains.size(); ++i) {
      const SE3 pose = at(0.15 * static_cast<double>(i));
      add(mapper, pose, stereo(pose), gains[i]);
    }
    for (int i = 0; i < 300; ++i) mapper.train({}, executor);
    psnr[enabled] = mapper.training_psnr();
    const auto exposures = mapper.freeze().keyframe_exposures;
    for (size_t i = 0; i < gains.size(); ++i) {
      const double expected = enabled ? gains[i] / gains[0] : 1.0;
      EXPECT_NEAR(static_cast<double>(exposures[i].gain[1]), expected, enabled && i > 0 ? 0.04 : 0.0) << i;
    }
  }
  EXPECT_GT(psnr[1], psnr[0] + 3);
}

TEST_F(PhotorealisticMapperTest, AKnownExposureIsTakenOver) {
  PhotorealisticMapper mapper({}, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
  add(mapper, at(0), stereo(at(0)));
  const splatting::Exposure known{{0.5f, 0.6f, 0.7f}, {0, 0, 0}};
  add(mapper, at(0.3), stereo(at(0.3)), 0.9, known);
  const auto exposures = mapper.freeze().keyframe_exposures;
  EXPECT_EQ(exposures[0].gain[0], 1);
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(exposures[1].gain[c], known.gain[c], 1e-6f) << "not what the picture says";
}

TEST_F(PhotorealisticMapperTest, GaussiansFollowTheirKeyframe) {
  PhotorealisticMapper mapper({}, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
  add(mapper, at(0), stereo(at(0)));
  const FrozenMap before = mapper.freeze();
  MapSnapshot corrected = *world.snapshot();
  auto moved = std::make_shared<KeyframeView>(corrected.keyframe(KeyframeId(0)));
  moved->keyframe.camera_from_world = SE3(so3_exp(Vec3(0.1, -0.2, 0.3)), Vec3(1, 2, 3));
  corrected.keyframes[0] = moved;
  mapper.update_poses(corrected);
  const FrozenMap after = mapper.freeze();
  // What the keyframe's camera sees is untouched: the gaussians have not changed in its frame, only the frame moved.
  EXPECT_EQ(after.anchors_from_world[0].translation, Vec3(1, 2, 3));
  ASSERT_EQ(after.gaussians.size(), before.gaussians.size());
  after.gaussians.for_each([&](size_t i) {
    const splatting::Gaussian a = after.gaussians.get(i), b = before.gaussians.get(i);
    for (int k = 0; k < 3; ++k) ASSERT_EQ(a.mean[k], b.mean[k]);
  });
}

/// What a camera sees of a map.
std::vector<float> render(const FrozenMap& map, const SE3& camera_from_world, Executor& executor) {
  std::vector<splatting::Pose> camera_from_anchor;
  camera_from_anchors(camera_from_world, map.anchors_from_world, camera_from_anchor);
  splatting::RenderResult result;
  splatting::Renderer().render(map.gaussians, {to_splatting(kCamera), camera_from_anchor}, {}, executor, result);
  return result.rgb;
}

TEST_F(PhotorealisticMapperTest, ASimilarityOfMapAndCamerasLeavesEveryImageTheSame) {
  PhotorealisticOptions options;
  options.sh_degree = 3;
  options.exposure.enabled = false;  // brightness stays
  // Coarse pictures and cells make large splats: few edges, and few that are equally far.
  options.seeding.cell_px = 8;
  options.schedule.online_pixels = kCamera.width * kCamera.height / 4;
  options.schedule.start_pixels = kCamera.width * kCamera.height / 16;
  PhotorealisticMapper mapper(options, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
  for (const double x : {0.0, 0.3, 0.6}) add(mapper, at(x), stereo(at(x)));
  for (int i = 0; i < 60; ++i) mapper.train({}, executor);
  const FrozenMap before = mapper.freeze();
  const SE3 between(so3_exp(Vec3(0.05, -0.1, 0.2)), Vec3(-0.2, 0.1, 0.3));
  const std::vector<SE3> cameras{before.keyframes_from_world[0], before.keyframes_from_world[2], between};

  Random random(5);
  Sim3 total;
  for (int repetition = 0; repetition < 5; ++repetition) {
    Vec7 tangent;
    for (int i = 0; i < 7; ++i) tangent[i] = random.uniform(-0.8, 0.8);
    const Sim3 move = Sim3::exp(tangent);
    total = move * total;
    world.apply({.new_world_from_old_world = {move, move, move}});
    mapper.update_poses(*world.snapshot());
    mapper.update_poses(*world.snapshot());  // once is enough
    const FrozenMap after = mapper.freeze();
    for (const SE3& camera : cameras) {
      const SE3 moved = (Sim3(camera) * total.inverse()).rigid();
      const auto a = render(before, camera, executor), b = render(after, moved, executor);
      // Rounding may carry a splat across the cut-off at alpha = 1/255, or past another that is equally far, which
      // shows in some pixels.
      size_t crossed = 0;
      for (size_t i = 0; i < a.size(); ++i) {
        ASSERT_LT(std::abs(a[i] - b[i]), 1.0f / 255) << i;
        crossed += std::abs(a[i] - b[i]) > 1e-4f;
      }
      EXPECT_LT(crossed, a.size() / 10000) << repetition;
    }
    EXPECT_LT((after.keyframes_from_world[2].translation -
               (Sim3(before.keyframes_from_world[2]) * total.inverse()).rigid().translation)
                  .norm(),
              1e-9);
  }
}

TEST_F(PhotorealisticMapperTest, ContinuesFromAnArchiveAsIfNothingHadHappened) {
  const MapperSensor sensor{.camera = kCamera, .stereo_baseline_m = kBaseline};
  PhotorealisticMapper mapper({}, sensor, 1);
  for (const double x : {0.0, 0.3}) add(mapper, at(x), stereo(at(x)));
  for (int i = 0; i < 40; ++i) mapper.train({}, executor);
  Archive saved;
  mapper.serialize(saved);

  PhotorealisticMapper loaded({}, sensor, 99);
  Archive reader(saved.bytes());
  loaded.serialize(reader);
  EXPECT_TRUE(reader.at_end());
  Archive saved_again;
  loaded.serialize(saved_again);
  EXPECT_TRUE(saved_again.bytes() == saved.bytes());
  for (int i = 0; i < 30; ++i) {
    ASSERT_EQ(mapper.train({}, executor).loss, loaded.train({}, executor).loss) << i;
  }
  world.add(at(0.6));
  for (PhotorealisticMapper* m : {&mapper, &loaded}) {
    KeyframeImages images = stereo(at(0.6));
    images.color = to_rgb(world.picture(at(0.6)));
    m->add_keyframe(*world.snapshot(), KeyframeId(2), images, executor);
  }
  EXPECT_EQ(mapper.gaussians().size(), loaded.gaussians().size());
}

/// Keyframes, all but the first of a known exposure, and corrections, before and after an archive: nothing tells that
/// there was one.
TEST_F(PhotorealisticMapperTest, ContinuesFromAnArchiveThroughCorrectionsAsIfNothingHadHappened) {
  const MapperSensor sensor{.camera = kCamera, .stereo_baseline_m = kBaseline};
  PhotorealisticOptions options;
  options.reseed_interval = 1;  // also in keyframes that no iteration has used yet
  const splatting::Exposure known{{0.5f, 0.6f, 0.7f}, {0, 0, 0}};
  PhotorealisticMapper mapper(options, sensor, 1);
  add(mapper, at(0), stereo(at(0)));
  for (int i = 0; i < 40; ++i) mapper.train({}, executor);
  const auto correct = [&](double x) {
    const Sim3 stay, move(SE3(so3_exp(Vec3(0, 0.02, 0)), Vec3(x, 0, 0)));
    MapCorrection correction;
    correction.new_world_from_old_world.assign(static_cast<size_t>(num_added), move);
    correction.new_world_from_old_world[0] = stay;
    world.apply(correction);
  };
  for (const double x : {0.1, 0.2, 0.3, 0.6}) add(mapper, at(x), stereo(at(x)), 0.9, known);
  correct(0.05);
  mapper.update_poses(*world.snapshot());
  ASSERT_TRUE(mapper.has_seams());

  Archive saved;
  mapper.serialize(saved);
  PhotorealisticMapper loaded(options, sensor, 99);
  Archive reader(saved.bytes());
  loaded.serialize(reader);
  correct(-0.03);
  world.add(at(0.9));
  KeyframeImages images = stereo(at(0.9));
  images.color = to_rgb(world.picture(at(0.9)));
  std::vector<std::string> ends;
  for (PhotorealisticMapper* m : {&mapper, &loaded}) {
    for (int i = 0; i < 8; ++i) m->train({}, executor);
    m->update_poses(*world.snapshot());
    for (int i = 0; i < 8; ++i) m->train({}, executor);
    m->add_keyframe(*world.snapshot(), KeyframeId(5), images, executor);
    for (int i = 0; i < 12; ++i) m->train({}, executor);
    for (int i = 0; i < 5; ++i) m->train(0.1 * i, executor);
    Archive end;
    m->serialize(end);
    ends.push_back(end.take_bytes());
  }
  EXPECT_TRUE(ends[0] == ends[1]);
}

TEST_F(PhotorealisticMapperTest, ThereAreNeverMoreGaussiansThanTheBudgetAllows) {
  constexpr size_t kBudget = 700;
  const MapperSensor sensor{.camera = kCamera, .stereo_baseline_m = kBaseline};
  PhotorealisticOptions options;
  options.densification.max_gaussians = kBudget;
  PhotorealisticMapper mapper(options, sensor, 1), other(options, sensor, 2);
  add(mapper, at(0), stereo(at(0)));
  EXPECT_EQ(mapper.gaussians().size(), kBudget) << "as many cells would like to have one";
  world = testing::WallWithKeyframes(kCamera);
  num_added = 0;
  add(other, at(0.3), stereo(at(0.3)));
  mapper.append(std::move(other));
  EXPECT_EQ(mapper.gaussians().size(), kBudget);
  for (const int anchor : {0, 1}) EXPECT_GT(mapper.gaussians().size(anchor), kBudget / 4) << "both give way";
  const std::vector<splatting::Gaussian> more(50, mapper.gaussians().get(0));
  mapper.add_gaussians(more);
  EXPECT_EQ(mapper.gaussians().size(), kBudget);

  Archive saved;
  mapper.serialize(saved);
  options.densification.max_gaussians = 400;
  PhotorealisticMapper smaller(options, sensor, 1);
  Archive reader(saved.bytes());
  smaller.serialize(reader);
  EXPECT_EQ(smaller.keep_gaussian_budget(), kBudget - 400);
  EXPECT_EQ(smaller.gaussians().size(), 400u);
  EXPECT_EQ(smaller.keep_gaussian_budget(), 0u);
}

TEST_F(PhotorealisticMapperTest, ForgetsPicturesBeyondTheBudgetAndGoesOn) {
  const MapperSensor sensor{.camera = kCamera, .stereo_baseline_m = kBaseline};
  PhotorealisticOptions options;
  options.schedule.start_pixels = 80 * 60;
  options.seeding.cell_px = 8;  // gaussians take little beside pictures
  // 320x240: colour on three levels, half of it again for seeding with depth, and the right image.
  const double one_view_mb = 1e-6 * 320 * 240 * (3 * (1 + 1 / 4.0 + 1 / 16.0) + (3 + 4 + 1) / 4.0);
  options.image_budget_mb = 3.5 * one_view_mb;
  PhotorealisticMapper mapper(options, sensor, 1);
  for (const double x : {0.0, 0.3, 0.31, 0.6, 0.61}) {
    add(mapper, at(x), stereo(at(x)));
    for (int i = 0; i < 15; ++i) mapper.train({}, executor);
  }
  const FrozenMap map = mapper.freeze();
  EXPECT_EQ(map.keyframes_from_world.size(), 5u) << "a keyframe without pictures still carries gaussians";
  Archive saved;
  mapper.serialize(saved);
  EXPECT_LT(static_cast<double>(saved.bytes().size()), 1e6 * (5 * one_view_mb)) << "pictures of three";

  PhotorealisticMapper loaded(options, sensor, 99);
  Archive reader(saved.bytes());
  loaded.serialize(reader);
  for (int i = 0; i < 40; ++i) {
    ASSERT_EQ(mapper.train({}, executor).loss, loaded.train({}, executor).loss) << i;
  }
}

TEST_F(PhotorealisticMapperTest, AKeyframeWithoutPicturesIsAsBrightAsItsNeighbour) {
  PhotorealisticMapper mapper({}, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
  add(mapper, at(0), stereo(at(0)));
  for (int i = 0; i < 100; ++i) mapper.train({}, executor);
  for (const double x : {0.1, 0.2}) {
    world.add(at(x));
    mapper.add_keyframe(*world.snapshot(), KeyframeId(num_added++), {}, executor);
  }
  add(mapper, at(0.3), stereo(at(0.3)), 0.7);
  for (int i = 0; i < 200; ++i) mapper.train({}, executor);
  const auto exposures = mapper.freeze().keyframe_exposures;
  EXPECT_NEAR(exposures[3].gain[1], 0.7f, 0.05f);
  EXPECT_EQ(exposures[1].gain[1], exposures[0].gain[1]);
  EXPECT_EQ(exposures[2].gain[1], exposures[3].gain[1]) << "what it was born with is older";
}

TEST_F(PhotorealisticMapperTest, AKeyframeWithoutPicturesIsAnAnchor) {
  PhotorealisticMapper mapper({}, {.camera = kCamera}, 1);
  const auto add_anchor = [&](double x) {
    world.add(at(x));
    mapper.add_keyframe(*world.snapshot(), KeyframeId(num_added++), {}, executor);
  };
  add_anchor(-0.3);
  EXPECT_FALSE(mapper.newest_with_pictures().has_value()) << "nothing to train on yet";
  add(mapper, at(0), {});
  add_anchor(0.1);
  EXPECT_EQ(mapper.newest_with_pictures(), 1u);
  EXPECT_LT(mapper.gaussians().size(), 200u);
  add(mapper, at(0.3, 0.05), {});
  EXPECT_GT(mapper.gaussians().size(), 800u) << "what the second picture is wanted for may come later";
  EXPECT_GT(share_on_the_wall(mapper, 0.08), 0.9);
  add_anchor(0.4);
  const double before = mapper.train({}, executor).mse;
  double after = before;
  for (int i = 0; i < 40; ++i) after = mapper.train({}, executor).mse;
  EXPECT_LT(after, before);
  EXPECT_EQ(mapper.freeze().keyframes_from_world.size(), 5u);
  EXPECT_EQ(mapper.compare(3, executor).features.empty(), false) << "the newest picture's";

  Archive saved;
  mapper.serialize(saved);
  PhotorealisticMapper loaded({}, {.camera = kCamera}, 99);
  Archive reader(saved.bytes());
  loaded.serialize(reader);
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(mapper.train({}, executor).loss, loaded.train({}, executor).loss) << i;
  }
}

TEST_F(PhotorealisticMapperTest, ACulledKeyframeKeepsItsGaussiansUntilItsParentHasCome) {
  PhotorealisticMapper mapper({}, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
  add(mapper, at(0), stereo(at(0)));
  for (const double x : {0.3, 0.6}) world.add(at(x));
  MapSnapshot map = *world.snapshot();
  auto culled = std::make_shared<KeyframeView>(map.keyframe(KeyframeId(0)));
  culled->keyframe.culled = true;
  culled->keyframe.parent = KeyframeId(2);  // the spanning tree was turned
  map.keyframes[0] = culled;
  const auto of_first = [&] {
    size_t count = 0;
    mapper.gaussians().for_each([&](size_t i) { count += mapper.gaussians().anchor(i) == 0; });
    return count;
  };
  const size_t before = of_first();
  ASSERT_GT(before, 0u);
  mapper.add_keyframe(map, KeyframeId(1), {}, executor);
  mapper.update_poses(map);
  EXPECT_EQ(of_first(), before);
  mapper.add_keyframe(map, KeyframeId(2), {}, executor);
  EXPECT_EQ(of_first(), 0u);
  EXPECT_EQ(mapper.gaussians().size(), before);
}

TEST_F(PhotorealisticMapperTest, AKeyframeThatCameTooLateIsAnAnchor) {
  PhotorealisticMapper mapper({}, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1);
  for (const double x : {0.0, 0.3, 0.6}) world.add(at(x));
  MapSnapshot map = *world.snapshot();
  auto culled = std::make_shared<KeyframeView>(map.keyframe(KeyframeId(1)));
  culled->keyframe.culled = true;
  culled->keyframe.parent = KeyframeId(0);
  map.keyframes[1] = culled;
  for (int32_t k = 0; k < 3; ++k) {
    KeyframeImages images = stereo(at(0.3 * k));
    images.color = to_rgb(world.picture(at(0.3 * k)));
    const size_t before = mapper.gaussians().size();
    mapper.add_keyframe(map, KeyframeId(k), images, executor);
    EXPECT_EQ(mapper.gaussians().size() > before, k != 1) << k;
    EXPECT_EQ(mapper.newest_with_pictures(), k == 2 ? 2u : 0u);
  }
}

}  // namespace
}  // namespace photoslam
