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

std::vector<PosedCamera> two_cameras(const std::filesystem::path& folder) {
  const SE3 a(Quat(Eigen::AngleAxisd(0.7, Vec3(1, -2, 3).normalized())), Vec3(0.1, -2, 3));
  return {{{64, 48, 50, 51, 31.25, 22.5}, a, folder / "images" / "000001.png"},
          {{32, 24, 25, 25.5, 15, 11}, a.inverse(), folder / "images" / "000002.png"}};
}

void expect_equal(const std::vector<PosedCamera>& read, const std::vector<PosedCamera>& written) {
  ASSERT_EQ(read.size(), written.size());
  for (size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].camera, written[i].camera);
    EXPECT_EQ(read[i].image, written[i].image);
    const SE3 difference = read[i].camera_from_world * written[i].camera_from_world.inverse();
    EXPECT_LT(difference.translation.norm(), 1e-7);
    EXPECT_LT(difference.rotation.vec().norm(), 1e-7);
  }
}

TEST(PosedCameras, TransformsComeBack) {
  const std::filesystem::path folder = testing::TempDir();
  const auto cameras = two_cameras(folder);
  const auto path = folder / fmt::format("written_{}.json", ::getpid());
  ASSERT_TRUE(write_transforms_json(path, cameras).ok());
  const auto read = read_transforms_json(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  expect_equal(*read, cameras);
}

TEST(PosedCameras, ColmapModelsComeBack) {
  const auto folder = std::filesystem::path(testing::TempDir()) / fmt::format("colmap_{}", ::getpid());
  std::filesystem::create_directories(folder);
  const auto cameras = two_cameras(folder);
  const std::vector<SparsePoint> points = {{Vec3(1, -2, 0.125), {1, 20, 255}}};
  ASSERT_TRUE(write_colmap_model(folder, cameras, points).ok());
  const auto read = read_colmap_cameras(folder, folder / "images");
  ASSERT_TRUE(read.ok()) << read.error().message;
  expect_equal(*read, cameras);
  const auto read_points = read_colmap_points(folder);
  ASSERT_TRUE(read_points.ok());
  ASSERT_EQ(read_points->size(), 1u);
  EXPECT_EQ(read_points->front().position, points[0].position);
  EXPECT_EQ(read_points->front().color[2], 255);
}

TEST(PosedCameras, ColmapImagesMayHaveFeaturesAndErrorsNameTheLine) {
  const auto folder = std::filesystem::path(testing::TempDir()) / fmt::format("colmap_bad_{}", ::getpid());
  std::filesystem::create_directories(folder);
  const auto put = [&](const char* name, const char* text) {
    ASSERT_TRUE(write_file_atomically(folder / name, text).ok());
  };
  put("cameras.txt", "# comment\n7 SIMPLE_PINHOLE 64 48 50 32 24\n");
  put("images.txt", "# comment\n1 1 0 0 0 0 0 0 7 a.png\n10 20 -1 11 21 -1\n2 1 0 0 0 0 0 1 7 b.png\n\n");
  const auto read = read_colmap_cameras(folder, folder);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->size(), 2u);
  EXPECT_EQ(read->back().camera.cx, 31.5);
  put("images.txt", "# comment\n1 1 0 0 0 0 0 0 7 a.png\n\n2 1 0 0 0 0 0 1 8 b.png\n\n");
  EXPECT_NE(read_colmap_cameras(folder, folder).error().message.find("images.txt:4: camera 8"), std::string::npos);
  put("cameras.txt", "7 OPENCV 64 48 50 50 32 24 0.1 0 0\n");
  EXPECT_NE(read_colmap_cameras(folder, folder).error().message.find("cameras.txt:1: 7 parameters"), std::string::npos);
  put("cameras.txt", "\n7 FOV 64 48 50 50 32 24 0.1\n");
  EXPECT_NE(read_colmap_cameras(folder, folder).error().message.find("cameras.txt:2: camera model FOV"),
            std::string::npos);
  put("cameras.txt", "7 SIMPLE_PINHOLE 64 48 -50 32 24\n");
  EXPECT_NE(read_colmap_cameras(folder, folder).error().message.find("cameras.txt:1: focal lengths"),
            std::string::npos);
}

TEST(PosedCameras, TransformsMayHaveLensesAndIntrinsicsPerFrame) {
  const std::string pose = R"("transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]])";
  const std::string intrinsics = R"("w": 8, "h": 6, "fl_x": 10, "fl_y": 11, "cx": 4, "cy": 3)";
  const auto read = [&](const std::string& all, const std::string& frame) {
    return read_transforms_json(write("{" + intrinsics + all + R"(, "frames": [{)" + pose + frame + "}]}"));
  };
  const auto lens = [&](const std::string& all, const std::string& frame) {
    const auto cameras = read(all, frame);
    EXPECT_TRUE(cameras.ok()) << cameras.error().message;
    return cameras ? cameras->front().distortion : Distortion{};
  };
  EXPECT_TRUE(lens("", "").none());
  EXPECT_EQ(lens(R"(, "k1": 0.1, "k2": 0.2, "p1": 0.3, "p2": 0.4, "k3": 0.5, "k4": 0)", ""),
            (Distortion{.k1 = 0.1, .k2 = 0.2, .p1 = 0.3, .p2 = 0.4, .k3 = 0.5}));
  EXPECT_EQ(lens(R"(, "camera_model": "OPENCV_FISHEYE", "k1": 0.1, "k2": 0.2, "k3": 0.3, "k4": 0.4)", ""),
            (Distortion{.k1 = 0.1, .k2 = 0.2, .k3 = 0.3, .k4 = 0.4, .model = LensModel::kannala_brandt}));
  EXPECT_EQ(lens(R"(, "k1": 0.1)", R"(, "k1": 0.7)").k1, 0.7) << "a frame's own";
  EXPECT_EQ(read("", R"(, "w": 16, "fl_x": 20, "cx": 8)")->front().camera, (PinholeCamera{16, 6, 20, 11, 7.5, 2.5}));
  EXPECT_NE(read(R"(, "k4": 0.1)", "").error().message.find("frame 0: k4"), std::string::npos);
  EXPECT_NE(read(R"(, "camera_model": "EQUIRECTANGULAR")", "").error().message.find("camera_model EQUIRECTANGULAR"),
            std::string::npos);
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
