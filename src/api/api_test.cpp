// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "photoslam/slam.h"
#include "photoslam/version.h"

namespace photoslam {
namespace {

constexpr double kWallDepth = 2.0;  // [m]
constexpr double kStep = 0.01;      // sideways, per frame [m]
constexpr int64_t kInterval = 33'000'000;

const CameraModel kCamera{.width = 320, .height = 240, .fx = 260, .fy = 262, .cx = 158.2, .cy = 121.7};

/// Brightness of a wall of random squares, 4 cm wide, that lies in the plane z = kWallDepth.
uint8_t wall(double x, double y, uint32_t channel) {
  const auto column = static_cast<uint32_t>(static_cast<int>(std::floor(x / 0.04)));
  const auto row = static_cast<uint32_t>(static_cast<int>(std::floor(y / 0.04)));
  uint32_t h = column * 2654435761u ^ row * 2246822519u ^ channel * 3266489917u;
  h = (h ^ (h >> 15)) * 2654435769u;
  return static_cast<uint8_t>(40 + (h >> 8) % 180);
}

/// The wall as a camera sees it that has moved `offset` to the right and looks straight at it; 3x3 samples per pixel.
RgbdFrame look_at_wall(int index) {
  RgbdFrame frame;
  frame.timestamp_ns = index * kInterval;
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      for (uint32_t channel = 0; channel < 3; ++channel) {
        int sum = 0;
        for (int s = 0; s < 9; ++s) {
          const int column = s % 3 - 1, row = s / 3 - 1;
          const double x = (u + column / 3.0 - kCamera.cx) / kCamera.fx * kWallDepth + kStep * index;
          const double y = (v + row / 3.0 - kCamera.cy) / kCamera.fy * kWallDepth;
          sum += wall(x, y, channel);
        }
        frame.rgb.push_back(static_cast<uint8_t>(sum / 9));
      }
      frame.depth.push_back(static_cast<uint16_t>(1000 * kWallDepth));
    }
  }
  return frame;
}

SlamResult map_wall(int num_frames, const SlamSettings& settings, int broken_frame = -1) {
  int next = 0;
  const RgbdInput input = [&]() -> std::optional<RgbdFrame> {
    if (next == num_frames) return std::nullopt;
    RgbdFrame frame = look_at_wall(next);
    if (next++ == broken_frame) frame.rgb.pop_back();
    return frame;
  };
  return map_frames(kCamera, 0.001, input, settings);
}

SlamSettings deterministic() {
  SlamSettings settings;
  settings.deterministic = true;
  settings.threads = 1;
  return settings;
}

TEST(MapFrames, FollowsTheCameraAndDrawsWhatItSaw) {
  SlamSettings settings = deterministic();
  settings.refine_iterations = 150;
  const SlamResult result = map_wall(12, settings);
  EXPECT_EQ(result.failure, "");
  EXPECT_EQ(result.frames, 12);
  EXPECT_EQ(result.dropped, 0);
  ASSERT_EQ(result.tracked, 12);
  ASSERT_EQ(result.trajectory.size(), 12u);
  for (int i = 0; i < 12; ++i) {
    const CameraPose& pose = result.trajectory[static_cast<size_t>(i)];
    EXPECT_EQ(pose.timestamp_ns, i * kInterval);
    EXPECT_NEAR(pose.position[0], kStep * i, 0.004) << i;
    EXPECT_NEAR(pose.position[1], 0, 0.004) << i;
    EXPECT_NEAR(pose.position[2], 0, 0.004) << i;
    EXPECT_NEAR(pose.orientation[0], 1, 1e-5) << i;
  }
  ASSERT_GT(result.map.num_gaussians(), 100u);

  const std::vector<uint8_t> drawn = result.map.render(result.camera, result.trajectory[0]);
  const std::vector<uint8_t> seen = look_at_wall(0).rgb;
  ASSERT_EQ(drawn.size(), seen.size());
  double squares = 0;
  for (size_t i = 0; i < seen.size(); ++i) squares += std::pow(double{drawn[i] / 255.0} - seen[i] / 255.0, 2);
  const double psnr = -10 * std::log10(squares / static_cast<double>(seen.size()));
  EXPECT_GT(psnr, 18.0);  // a picture without content, the mean colour, scores 14 dB
}

TEST(MapFrames, CountsABrokenFrame) {
  const SlamResult result = map_wall(6, deterministic(), 3);
  EXPECT_EQ(result.frames, 6);
  EXPECT_EQ(result.tracked, 5);
  EXPECT_EQ(result.failure, "");
}

TEST(MapFrames, TrainsWhereItIsAskedTo) {
  SlamSettings settings = deterministic();
  settings.backend = Backend::cpu;
  EXPECT_EQ(map_wall(3, settings).gpu, "");
  settings.backend = Backend::cuda;
  try {
    EXPECT_NE(map_wall(3, settings).gpu, "");
  } catch (const Failure& failure) {
    EXPECT_NE(std::string(failure.what()).find("no GPU"), std::string::npos) << failure.what();
  }
}

TEST(MapFrames, RejectsBadArguments) {
  const RgbdInput none = [] { return std::optional<RgbdFrame>(); };
  EXPECT_THROW(map_frames({}, 0.001, none), Failure);
  EXPECT_THROW(map_frames(kCamera, 0, none), Failure);
  SlamSettings settings;
  settings.configuration = {"pipeline.input_queu=3"};
  EXPECT_THROW(map_frames(kCamera, 0.001, none, settings), Failure);
  EXPECT_THROW(map_dataset("no/such/folder"), Failure);
}

TEST(SplatMap, IsTheSameAfterSavingAndLoading) {
  const SlamResult result = map_wall(3, deterministic());
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "photoslam_api_test.ply";
  result.map.save(file);
  const SplatMap loaded = SplatMap::load(file);
  std::filesystem::remove(file);
  EXPECT_EQ(loaded.num_gaussians(), result.map.num_gaussians());
  EXPECT_EQ(loaded.render(result.camera, result.trajectory[2]), result.map.render(result.camera, result.trajectory[2]));
  EXPECT_THROW(SplatMap::load(file), Failure);
  EXPECT_THROW(loaded.save("/proc/map.ply"), Failure);
}

TEST(SplatMap, WithoutGaussiansIsBlack) {
  const std::vector<uint8_t> drawn = SplatMap().render(kCamera, {});
  EXPECT_THAT(drawn, testing::Each(0));
}

TEST(LibraryVersion, HasThreeNumbers) {
  EXPECT_THAT(std::string(library_version()), testing::MatchesRegex("[0-9]+\\.[0-9]+\\.[0-9]+"));
}

}  // namespace
}  // namespace photoslam
