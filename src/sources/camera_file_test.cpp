// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/camera_file.h"

#include <gmock/gmock.h>

#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

using testing::HasSubstr;

constexpr std::string_view kComplete = R"(# colour camera
model: pinhole
width: 640
height: 480
fx: 525.5
fy: 524
cx: 319.5
cy: 240.25
distortion: [0.1, -0.2, 0.001, 0.002, 0.3]
fps: 15
depth_scale: 1000.0  # stored value / depth_scale = metres
)";

class CameraFileTest : public TempFolderTest {
 protected:
  /// Reads the complete file with one text in it replaced.
  Result<CameraFile> read_with(std::string_view from, std::string_view to) const {
    std::string content(kComplete);
    return read_camera_yaml(write("camera.yaml", content.replace(content.find(from), from.size(), to)));
  }
  std::string failure(std::string_view from, std::string_view to) const { return read_with(from, to).error().message; }
};

TEST_F(CameraFileTest, ReadsEveryKey) {
  const CameraFile file = read_camera_yaml(write("camera.yaml", kComplete)).value();
  EXPECT_EQ(file.camera, (PinholeCamera{640, 480, 525.5, 524, 319.5, 240.25}));
  EXPECT_EQ(file.distortion, (Distortion{0.1, -0.2, 0.001, 0.002, 0.3}));
  EXPECT_EQ(file.frames_per_second, 15);
  EXPECT_EQ(file.depth_scale, 1000);
}

TEST_F(CameraFileTest, WhatIsWrittenIsRead) {
  CameraFile fisheye;
  fisheye.camera = {320, 240, 190.125, 190.25, 160.5, 120.75};
  fisheye.distortion = {.k1 = 0.01, .k2 = -0.02, .k3 = 0.003, .k4 = 1e-5, .model = LensModel::kannala_brandt};
  fisheye.depth_scale = 0.04;
  for (const CameraFile& file : {read_camera_yaml(write("camera.yaml", kComplete)).value(), fisheye}) {
    const CameraFile read = read_camera_yaml(write("written.yaml", camera_yaml(file))).value();
    EXPECT_EQ(read.camera, file.camera);
    EXPECT_EQ(read.distortion, file.distortion);
    EXPECT_EQ(read.frames_per_second, file.frames_per_second);
    EXPECT_EQ(read.depth_scale, file.depth_scale);
  }
}

TEST_F(CameraFileTest, WhatIsOptionalMayBeAbsent) {
  EXPECT_TRUE(read_with("[0.1, -0.2, 0.001, 0.002, 0.3]", "[]")->distortion.none());
  EXPECT_TRUE(read_with("distortion: [0.1, -0.2, 0.001, 0.002, 0.3]", "")->distortion.none());
  EXPECT_EQ(read_with("0.002, 0.3]", "0.002]")->distortion.k3, 0);
  EXPECT_FALSE(read_with("fps: 15", "")->frames_per_second.has_value());
  EXPECT_FALSE(read_with("depth_scale: 1000.0", "")->depth_scale.has_value());
}

TEST_F(CameraFileTest, ErrorsNameFileAndLine) {
  EXPECT_THAT(failure("fy: 524", "fz: 524"), HasSubstr("camera.yaml:6: unknown key 'fz'; did you mean 'fx'?"));
  EXPECT_THAT(failure("fps: 15", "depthscale: 15"), HasSubstr("unknown key 'depthscale'; did you mean 'depth_scale'?"));
  EXPECT_THAT(failure("fy: 524", ""), HasSubstr("camera.yaml: the key 'fy' is missing"));
  EXPECT_THAT(failure("fy: 524", "fy: wide"), HasSubstr("camera.yaml:6: fy is not a number"));
  EXPECT_THAT(failure("fy: 524", "fy: .nan"), HasSubstr("camera.yaml:6: fy is not a number"));
  EXPECT_THAT(failure("fy: 524", "fy: -1"), HasSubstr("camera.yaml:6: fy = -1 lies outside"));
  EXPECT_THAT(failure("pinhole", "pinhoel"), HasSubstr("camera.yaml:2: unknown model 'pinhoel'"));
  EXPECT_THAT(failure("[0.1, -0.2, 0.001, 0.002, 0.3]", "[1, 2]"),
              HasSubstr("camera.yaml:9: found 2 distortion coefficients, expected 4, 5 or 8"));
  EXPECT_THAT(failure("[0.1, -0.2, 0.001, 0.002, 0.3]", "0.1"), HasSubstr("camera.yaml:9: distortion is not a list"));
  EXPECT_THAT(failure("fx: 525.5", "fx: [525.5"), HasSubstr("camera.yaml:"));
  EXPECT_THAT(read_camera_yaml(write("camera.yaml", "fx")).error().message, HasSubstr("expected lines like"));
  EXPECT_THAT(read_camera_yaml(write("camera.yaml", "")).error().message, HasSubstr("expected lines like"));
  EXPECT_THAT(read_camera_yaml(folder / "absent.yaml").error().message, HasSubstr("absent.yaml"));
}

}  // namespace
}  // namespace photoslam
