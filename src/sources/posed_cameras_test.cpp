// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/posed_cameras.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "base/file.h"

namespace photoslam {
namespace {

std::filesystem::path write(const std::string& text) {
  const auto path = std::filesystem::path(testing::TempDir()) / fmt::format("transforms_{}.json", ::getpid());
  EXPECT_TRUE(write_file_atomically(path, text).ok());
  return path;
}

TEST(PosedCameras, ConvertsAxesAndPixelCentres) {
  // A camera at (1, 2, 3) that looks along the world's −z with y up: the identity in OpenGL axes.
  const auto cameras = read_transforms_json(write(R"({"w": 8, "h": 6, "fl_x": 10, "fl_y": 11, "cx": 4, "cy": 3,
    "frames": [{"file_path": "a.png", "transform_matrix": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]}]})"));
  ASSERT_TRUE(cameras.ok()) << cameras.error().message;
  const PosedCamera& c = cameras->front();
  EXPECT_DOUBLE_EQ(c.camera.cx, 3.5);
  EXPECT_DOUBLE_EQ(c.camera.cy, 2.5);
  const Vec3 ahead = c.camera_from_world * Vec3(1, 2, 1);
  EXPECT_LT((ahead - Vec3(0, 0, 2)).norm(), 1e-12) << "two metres ahead";
  const Vec3 above = c.camera_from_world * Vec3(1, 3, 3);
  EXPECT_LT((above - Vec3(0, -1, 0)).norm(), 1e-12) << "y points down";
  EXPECT_EQ(c.image.filename(), "a.png");
}

TEST(PosedCameras, BadFilesNameThemselves) {
  for (
      const char* text :
      {"", "{", R"({"frames": []})", R"({"w":1,"h":1,"fl_x":1,"fl_y":1,"cx":0,"cy":0,"k1":0.1,"frames":[]})",
       R"({"w":0,"h":1,"fl_x":1,"fl_y":1,"cx":0,"cy":0,"frames":[{"transform_matrix":[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})",
       R"({"frames": [{"transform_matrix": [[1]]}]})"}) {
    const auto path = write(text);
    const auto cameras = read_transforms_json(path);
    ASSERT_FALSE(cameras.ok()) << text;
    EXPECT_NE(cameras.error().message.find(path.filename().string()), std::string::npos) << cameras.error().message;
  }
}

}  // namespace
}  // namespace photoslam
