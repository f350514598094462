// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// The mapper with its gaussians on a GPU, which is the host in its role, against the same mapper on the CPU; and with a
// GPU that fails.
#ifndef __SANITIZE_THREAD__  // it does not know fibers

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <utility>

#include "base/archive.h"
#include "image/convert.h"
#include "image/metrics.h"
#include "photorealistic_mapping/photorealistic_mapper.h"
#include "photorealistic_mapping/testing/wall_with_keyframes.h"
#include "photorealistic_mapping/view_geometry.h"
#include "splatting/gpu.h"
#include "splatting/testing/host_gpu.h"

namespace photoslam {
namespace {

using splatting::cuda::HostFaults;
using splatting::testing::make_host_gpu;

/// An RGB-D camera before the wall. Slow is what runs on the GPU: pictures are small.
class Story {
 public:
  explicit Story(const PinholeCamera& camera) : camera_(camera), world_(camera) {}

  MapperSensor sensor() const { return {.camera = camera_}; }

  /// A keyframe that is believed to be at `pose`.
  void next_keyframe(const SE3& pose) { world_.add(pose); }
  /// What it saw, with all values multiplied by a gain.
  KeyframeImages look(const SE3& pose, double gain) const {
    KeyframeImages images{
        to_rgb(world_.wall.picture(camera_, pose, gain)), ImageU16(camera_.width, camera_.height), {}};
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = 0; x < camera_.width; ++x)
        images.depth(x, y) = static_cast<uint16_t>(std::lround(1000 * world_.wall.look(camera_, pose, x, y).depth));
    }
    return images;
  }
  void correct(const std::vector<Sim3>& new_world_from_old_world) {
    world_.apply({.new_world_from_old_world = new_world_from_old_world});
  }
  std::shared_ptr<const MapSnapshot> map() { return world_.snapshot(); }

 private:
  PinholeCamera camera_;
  testing::WallWithKeyframes world_;
};

SE3 at(double x, double y = 0, double z = 0) { return {Quat::Identity(), Vec3(-x, -y, -z)}; }

/// A mapper on the GPU. Whatever is done to it is also done to one on the CPU that starts from the same state, and what
/// comes of it compared: that way nothing grows apart, and any difference is of that deed.
class Compared {
 public:
  Compared(const PhotorealisticOptions& options, const MapperSensor& sensor)
      : options_(options), sensor_(sensor), remote(options, sensor, 1, gpu) {}

  template <class Deed>
  void both(const char* name, Deed&& deed) {
    SCOPED_TRACE(name);
    Archive saved;
    remote.serialize(saved);
    PhotorealisticMapper cpu(options_, sensor_, 99);
    Archive reader(saved.bytes());
    cpu.serialize(reader);
    for (PhotorealisticMapper* mapper : {&remote, &cpu}) {
      // Values on the host are old when the deed is done, and the optimiser goes on from what it leaves.
      for (int i = 0; i < 2 && mapper->has_keyframes(); ++i) mapper->train({}, executor_);
      deed(*mapper);
      mapper->train({}, executor_);
    }
    expect_close(remote.freeze(), cpu.freeze());
    EXPECT_NEAR(remote.training_psnr(), cpu.training_psnr(), 1e-3);
    EXPECT_EQ(gpu->failure(), "");
  }

 private:
  /// Adam takes steps of full size where gradients are next to nothing, so parameters that do not matter may differ:
  /// what is compared is what the keyframes' cameras see.
  void expect_close(const FrozenMap& got, const FrozenMap& want) {
    ASSERT_EQ(got.keyframes_from_world.size(), want.keyframes_from_world.size());
    for (size_t k = 0; k < want.keyframes_from_world.size(); ++k) {
      const SE3 difference = got.keyframes_from_world[k] * want.keyframes_from_world[k].inverse();
      EXPECT_LT(difference.log().norm(), 2e-4) << k;
      EXPECT_EQ(got.keyframe_scales[k], want.keyframe_scales[k]);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(got.keyframe_exposures[k].gain[c], want.keyframe_exposures[k].gain[c], 2e-4f) << k;
      ASSERT_EQ(got.gaussians.size(static_cast<int>(k)), want.gaussians.size(static_cast<int>(k))) << k;
      const std::vector<float> a = render(got, k), b = render(want, k);
      double sum = 0;
      for (size_t i = 0; i < a.size(); ++i) sum += std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i]));
      EXPECT_LT(sum / static_cast<double>(a.size()), 1e-3) << k;
    }
  }
  std::vector<float> render(const FrozenMap& map, size_t keyframe) {
    std::vector<splatting::Pose> camera_from_anchor;
    camera_from_anchors(map.keyframes_from_world[keyframe], map.anchors_from_world, camera_from_anchor);
    splatting::RenderResult result;
    splatting::Renderer().render(map.gaussians, {to_splatting(sensor_.camera), camera_from_anchor}, {}, executor_,
                                 result);
    return result.rgb;
  }

  PhotorealisticOptions options_;
  MapperSensor sensor_;
  SerialExecutor executor_;

 public:
  std::shared_ptr<splatting::Gpu> gpu = make_host_gpu();
  PhotorealisticMapper remote;
};

/// Seeds for small pictures, and training as large as on a GPU, which spares no pixels, wherever it happens.
PhotorealisticOptions test_options() {
  PhotorealisticOptions options;
  options.seeding.cell_px = 8;
  options.schedule.online_pixels = 1000000;
  return options;
}

size_t num_gaussians(const PhotorealisticMapper& mapper) { return mapper.gaussians().size(); }

TEST(MapperOnGpu, DoesWhatItDoesOnTheCpu) {
  Story story({96, 72, 84, 84, 50, 34});
  SerialExecutor executor;
  PhotorealisticOptions options = test_options();
  options.reseed_interval = 7;
  options.densification.interval = 5;
  // All that is seen doubles, and only what is hardly seen goes: none is at the thresholds.
  options.densification.gradient_threshold = 1e-9;
  options.densification.min_weight = 1e-3;
  options.depth_weight = 0.1;
  options.opacity_weight = 0.01;
  options.schedule.start_pixels = 48 * 36;
  Compared mappers(options, story.sensor());
  PhotorealisticMapper& mapper = mappers.remote;

  int count = 0;
  const auto add = [&](const SE3& believed, const SE3& truth, double gain) {
    story.next_keyframe(believed);
    mappers.both("a keyframe", [&](PhotorealisticMapper& m) {
      m.add_keyframe(*story.map(), KeyframeId(count), story.look(truth, gain), executor);
    });
    ++count;
  };
  const SE3 drift(so3_exp(Vec3(0, 0.05, 0)), Vec3(0.15, 0, 0.6));
  add(at(0), at(0), 1.0);
  add(at(0.3), at(0.3), 0.8);
  add(at(0.1, 0.1), at(0.1, 0.1), 0.9);
  add(drift * at(0.2), at(0.2), 0.7);
  EXPECT_LT(mapper.freeze().keyframe_exposures[1].gain[1], 0.95f);

  // A loop: the drift is taken back and scale with it. Gaussians change hands, and some prove to be the same.
  const FrozenMap before = mapper.freeze();
  const Sim3 undrifted = Sim3(at(0.2).inverse() * (drift * at(0.2)));
  story.correct({Sim3(), Sim3(), Sim3(), undrifted});
  mappers.both("a loop", [&](PhotorealisticMapper& m) { m.update_poses(*story.map()); });
  EXPECT_TRUE(mapper.has_seams());
  EXPECT_GT(mapper.gaussians().size(3), before.gaussians.size(3)) << "nothing was handed over";
  story.correct({Sim3(), Sim3(), {1.1, Quat::Identity(), Vec3::Zero()}, Sim3()});
  mappers.both("a scale", [&](PhotorealisticMapper& m) { m.update_poses(*story.map()); });

  mappers.both("a culled keyframe", [&](PhotorealisticMapper& m) {
    MapSnapshot map = *story.map();
    auto culled = std::make_shared<KeyframeView>(map.keyframe(KeyframeId(1)));
    culled->keyframe.culled = true;
    culled->keyframe.parent = KeyframeId(0);
    map.keyframes[1] = culled;
    m.update_poses(map);
  });
  EXPECT_EQ(mapper.gaussians().size(1), 0u);

  mappers.both("refinement", [&](PhotorealisticMapper& m) {
    for (int i = 0; i < 3; ++i) m.train(0.1 * i, executor);
  });
  mappers.both("settling", [&](PhotorealisticMapper& m) {
    for (int i = 0; i < 2; ++i) m.train(0.8, executor);
  });
  mappers.both("gaussians from elsewhere", [&](PhotorealisticMapper& m) {
    const std::vector<splatting::Gaussian> more(3, m.gaussians().get(0));
    m.add_gaussians(more);
  });
  mappers.both("another map", [&](PhotorealisticMapper& m) {
    PhotorealisticMapper other(options, story.sensor(), 7);
    Story elsewhere({96, 72, 84, 84, 50, 34});
    elsewhere.next_keyframe(at(0.5));
    other.add_keyframe(*elsewhere.map(), KeyframeId(0), elsewhere.look(at(0.5), 1.0), executor);
    m.append(std::move(other));
  });
  EXPECT_GT(num_gaussians(mapper), 200u);
}

/// Two views of the same part of the wall, the second believed to be elsewhere.
struct DoubledWall {
  Story story{{64, 48, 56, 56, 33, 23}};
  SE3 drift{Quat::Identity(), Vec3(0.7, 0, 0)};
  SerialExecutor executor;

  void show(Compared& mappers) {
    for (const SE3& error : {SE3(), drift}) {
      story.next_keyframe(error);
      const auto id = KeyframeId(static_cast<int32_t>(mappers.remote.num_keyframes()));
      mappers.both("a keyframe", [&](PhotorealisticMapper& m) {
        m.add_keyframe(*story.map(), id, story.look(at(0), 1.0), executor);
      });
    }
  }
};

TEST(MapperOnGpu, MergesWhatALoopHasDoubledAsOnTheCpu) {
  for (const bool enabled : {true, false}) {
    DoubledWall wall;
    PhotorealisticOptions options = test_options();
    options.handover = false;
    options.doubling.enabled = enabled;
    options.doubling.max_distance = 3;  // seeds of a cell need not be at the same pixel
    Compared mappers(options, wall.story.sensor());
    wall.show(mappers);
    const size_t before = num_gaussians(mappers.remote);
    wall.story.correct({Sim3(), Sim3(wall.drift)});
    mappers.both("a loop", [&](PhotorealisticMapper& m) { m.update_poses(*wall.story.map()); });
    const size_t after = num_gaussians(mappers.remote);
    EXPECT_EQ(after + 10 < before, enabled) << before << " " << after;
  }
}

TEST(MapperOnGpu, RelocatesUnderTheCapAsOnTheCpu) {
  for (const bool enabled : {true, false}) {
    DoubledWall wall;
    PhotorealisticOptions options = test_options();
    options.densification.relocation = enabled;
    options.densification.max_gaussians = 80;
    Compared mappers(options, wall.story.sensor());
    wall.show(mappers);
    EXPECT_EQ(num_gaussians(mappers.remote), 80u);
    EXPECT_EQ(mappers.remote.gaussians().size(1) > 0, enabled) << "what is idle makes room, or nothing does";
  }
}

TEST(MapperOnGpu, WeighsOpacityAsOnTheCpu) {
  Story story({96, 72, 84, 84, 50, 34});
  SerialExecutor executor;
  double sums[2] = {};
  for (const double weight : {0.0, 20.0}) {
    PhotorealisticOptions options = test_options();
    options.opacity_weight = weight;
    PhotorealisticMapper remote(options, story.sensor(), 1, make_host_gpu()), cpu(options, story.sensor(), 1);
    if (weight == 0) story.next_keyframe(at(0));
    for (PhotorealisticMapper* mapper : {&remote, &cpu}) {
      mapper->add_keyframe(*story.map(), KeyframeId(0), story.look(at(0), 1.0), executor);
      for (int i = 0; i < 3; ++i) mapper->train({}, executor);
    }
    ASSERT_EQ(num_gaussians(remote), num_gaussians(cpu));
    cpu.gaussians().for_each([&](size_t i) {
      const float want = cpu.gaussians().get(i).opacity_logit, got = remote.gaussians().get(i).opacity_logit;
      // All gradients that count have the regulariser's sign: Adam's steps are equal.
      if (weight > 0) {
        EXPECT_NEAR(got, want, 2e-3f) << i;
      }
      sums[weight > 0 ? 1 : 0] += static_cast<double>(got);
    });
  }
  EXPECT_LT(sums[1], sums[0] - 50) << "opacities have not fallen";
}

/// A short run that uses the GPU in every way: two keyframes, a correction, densification, drawing, saving.
struct ShortRun {
  int iterations;
  double psnr;  // of the newest picture at the end
  bool failed;  // the GPU
  size_t gaussians;

  /// Gaussians larger than `split_size` of the scene depth are split, others cloned.
  ShortRun(HostFaults* faults, double split_size, bool trains = true) {
    Story story({48, 36, 42, 42, 24, 18});
    SerialExecutor executor;
    PhotorealisticOptions options = test_options();
    options.reseed_interval = 2;
    options.densification.interval = 3;
    options.densification.gradient_threshold = 5e-5;
    options.densification.split_size = split_size;
    options.depth_weight = 0.01;
    options.schedule.start_pixels = 24 * 18;
    std::shared_ptr<splatting::Gpu> gpu = make_host_gpu(faults);
    PhotorealisticMapper mapper(options, story.sensor(), 1, gpu);
    for (const double x : {0.0, 0.4}) {
      story.next_keyframe(at(x));
      const auto id = KeyframeId(static_cast<int32_t>(mapper.num_keyframes()));
      mapper.add_keyframe(*story.map(), id, story.look(at(x), 1.0), executor);
      if (trains) mapper.train({}, executor);
    }
    story.correct({Sim3(), Sim3::exp((Vec7() << 0.1, 0, 0.2, 0, 0.02, 0, 0.05).finished())});
    mapper.update_poses(*story.map());
    for (const double progress : {0.1, 0.3}) {
      if (trains) mapper.train(progress, executor);
    }
    Archive saved;
    mapper.serialize(saved);
    Archive reader(saved.bytes());
    PhotorealisticMapper loaded(options, story.sensor(), 9);
    loaded.serialize(reader);
    iterations = loaded.num_iterations();
    gaussians = loaded.gaussians().size();
    const KeyframeComparison comparison = loaded.compare(loaded.num_keyframes() - 1, executor);
    psnr = photoslam::psnr(to_float(comparison.picture), to_float(comparison.render));
    failed = !gpu->failure().empty();
    EXPECT_TRUE(!failed || mapper.gaussians().remote() == nullptr);
  }
};

/// Tries what happens when something goes wrong, at each of many places: there a child process takes the wrong way and
/// says in the end whether all was well, while the parent goes on.
class Branches {
 public:
  bool is_child() const { return is_child_; }
  int count() const { return count_; }

  /// True in a child, once.
  bool take() {
    if (is_child_) return false;
    ++count_;
    std::fflush(nullptr);
    const pid_t child = ::fork();
    is_child_ = child == 0;
    int status = 0;
    if (!is_child_) ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0) << "branch " << count_;
    return is_child_;
  }
  /// The end of a child.
  void end() const {
    if (!is_child_) return;
    std::fflush(nullptr);
    ::_exit(::testing::Test::HasFailure() ? 1 : 0);
  }

 private:
  bool is_child_ = false;
  int count_ = 0;
};

TEST(MapperOnGpu, GoesOnWithoutItWhereverMemoryRunsOut) {
  constexpr double kSplitAll = 1e-5;
  const ShortRun want(nullptr, kSplitAll);
  EXPECT_FALSE(want.failed);
  for (const bool for_good : {false, true}) {
    Branches branches;
    HostFaults faults;
    faults.no_memory = [&, is_first = true]() mutable {
      if (std::exchange(is_first, false)) return false;  // when it is opened
      return branches.take() || (for_good && branches.is_child());
    };
    const ShortRun got(&faults, kSplitAll);
    EXPECT_EQ(got.iterations, want.iterations);
    EXPECT_NEAR(got.psnr, want.psnr, 0.5);
    branches.end();
    EXPECT_GT(branches.count(), 50);
  }
}

TEST(MapperOnGpu, GoesOnWithoutItWheneverItIsLost) {
  // Splitting opens gaps that lost training would have closed; cloning does not.
  constexpr double kCloneAll = 10;
  const ShortRun want(nullptr, kCloneAll), untrained(nullptr, kCloneAll, false);
  Branches branches;
  HostFaults faults;
  faults.lost = [&] { return branches.take(); };
  const ShortRun got(&faults, kCloneAll);
  EXPECT_EQ(got.failed, branches.is_child());
  EXPECT_EQ(got.iterations, want.iterations);
  // What was not fetched is lost: of the training, all in the worst case.
  EXPECT_GT(got.psnr, untrained.psnr - 1);
  branches.end();
  EXPECT_GT(branches.count(), 300);
}

}  // namespace
}  // namespace photoslam

#endif  // __SANITIZE_THREAD__
