// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/session_maps.h"

#include <gmock/gmock.h>

#include "base/archive.h"
#include "base/check.h"
#include "image/convert.h"
#include "photorealistic_mapping/testing/wall_with_keyframes.h"

namespace photoslam {
namespace {

using ::testing::HasSubstr;

constexpr PinholeCamera kCamera = {160, 120, 140, 140, 80, 60};
constexpr double kBaseline = 0.2;

/// Two keyframes in either map.
class SessionMapsTest : public ::testing::Test {
 protected:
  SessionMapsTest() {
    Map map(1.2, 8);
    for (int32_t i = 0; i < 2; ++i) {
      const SE3 pose = at(0.3 * i);
      auto frame = std::make_shared<FeatureFrame>();
      frame->frame = FrameId(i);
      map.add_keyframe(KeyframeId(i), frame, pose);
      draw(pose);
    }
    map.set_parent(KeyframeId(1), KeyframeId(0));
    geometry.set_map(std::move(map));
  }

  static SE3 at(double x) { return {Quat::Identity(), Vec3(-x, 0, 0)}; }
  void draw(const SE3& pose) {
    world.add(pose);
    SE3 right_from_left;
    right_from_left.translation.x() = -kBaseline;
    const KeyframeImages images{to_rgb(world.picture(pose)), {}, world.picture(right_from_left * pose)};
    mapper.add_keyframe(*world.snapshot(), KeyframeId(static_cast<int32_t>(mapper.num_keyframes())), images, executor);
  }
  std::string problem() const {
    const Status status = check_session_maps(geometry, mapper);
    return status ? "" : status.error().message;
  }
  /// Everything moves, and then it turns out that two keyframes that are to be joined hang together already.
  static MapCorrection impossible_correction() {
    const Sim3 move(SE3(Quat::Identity(), Vec3(1, 2, 3)));
    return {.new_world_from_old_world = {move, move}, .joints = {{KeyframeId(1), KeyframeId(0)}}};
  }

  testing::WallWithKeyframes world{kCamera};
  SerialExecutor executor;
  GeometryMapper geometry{{}, {}, kCamera, kBaseline* kCamera.fx};
  PhotorealisticMapper mapper{{}, {.camera = kCamera, .stereo_baseline_m = kBaseline}, 1};
};

TEST_F(SessionMapsTest, FitWithTheSameKeyframes) {
  EXPECT_EQ(problem(), "");
  draw(at(0.6));
  EXPECT_THAT(problem(), HasSubstr("gaussians for 3 of 2 keyframes"));
}

TEST_F(SessionMapsTest, ACorrectionThatFailsHalfwayIsNeverWritten) {
  const SE3 before = geometry.map().keyframe(KeyframeId(0)).camera_from_world;
  EXPECT_THROW(geometry.correct(impossible_correction()), CheckError);
  ASSERT_NE(geometry.map().keyframe(KeyframeId(0)).camera_from_world.translation, before.translation)
      << "half of it has happened";
  EXPECT_THAT(problem(), HasSubstr("geometric map half changed"));
  Archive session;
  EXPECT_THROW(session(geometry), CheckError);
  EXPECT_TRUE(session.bytes().empty());
  EXPECT_THROW(geometry.correct({}), CheckError) << "nothing is built on it";
}

class NoMemory final : public Executor {
 public:
  int concurrency() const override { return 1; }
  void for_each(int, const std::function<void(int, int)>&) override { throw std::bad_alloc(); }
};

TEST_F(SessionMapsTest, AKeyframeThatFailsHalfwayIsNeverWritten) {
  const SE3 pose = at(0.6);
  world.add(pose);
  NoMemory no_memory;
  const KeyframeImages images{to_rgb(world.picture(pose)), {}, {}};
  EXPECT_THROW(mapper.add_keyframe(*world.snapshot(), KeyframeId(2), images, no_memory), std::bad_alloc);
  EXPECT_THAT(problem(), HasSubstr("gaussians half changed"));
  Archive session;
  EXPECT_THROW(session(mapper), CheckError);
  EXPECT_TRUE(session.bytes().empty());
}

}  // namespace
}  // namespace photoslam
