// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
// Pictures of a ray-traced room through lenses, against what the ray tracer sees without a lens.
#include "sources/common_camera.h"

#include <gtest/gtest.h>

#include <cmath>

#include "image/rectification.h"
#include "io/temp_folder_test.h"
#include "sources/synthetic/room.h"
#include "sources/synthetic/sensor_model.h"

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera = {.width = 240, .height = 180, .fx = 197, .fy = 196.5, .cx = 121.2, .cy = 87.6};
constexpr Distortion kRadial = {.k1 = -0.28, .k2 = 0.074, .p1 = 0.0002, .p2 = -0.0003};
constexpr Distortion kFisheye = {
    .k1 = 0.004, .k2 = 0.002, .k3 = -0.003, .k4 = 0.0005, .model = LensModel::kannala_brandt};

class CommonCameraTest : public TempFolderTest {
 protected:
  static void SetUpTestSuite() {
    SerialExecutor serial;
    room = std::make_shared<const SyntheticRoom>(1, serial, SceneQuality::draft);
  }
  static void TearDownTestSuite() { room.reset(); }

  static SE3 pose() { return room->path(1, 10)->world_from_camera(0.5); }

  static ImageU8 photograph(const PinholeCamera& camera, const Distortion& distortion) {
    SerialExecutor serial;
    const CameraRays rays(camera, distortion);
    return expose(room->render({rays, [](int, double) { return pose(); }}, serial), 0, 0, 0);
  }

  /// PSNR [dB] over the pixels with data.
  static double psnr(const CommonCamera::Picture& picture, const ImageU8& truth) {
    double sum = 0;
    int count = 0;
    for (int y = 0; y < truth.height(); ++y) {
      for (int x = 0; x < truth.width(); ++x) {
        if (picture.mask && (*picture.mask)(x, y) == 0) continue;
        for (int c = 0; c < 3; ++c) sum += std::pow(picture.color(x, y, c) - truth(x, y, c), 2);
        count += 3;
      }
    }
    EXPECT_GT(count, truth.width() * truth.height()) << "a third of the picture";
    return 10 * std::log10(255.0 * 255.0 * count / sum);
  }

  static inline std::shared_ptr<const SyntheticRoom> room;
};

TEST_F(CommonCameraTest, PicturesOfItsOwnPassUnchanged) {
  CommonCamera common(kCamera);
  const ImageU8 raw = photograph(kCamera, {});
  const auto picture = common.take({kCamera, {}, "a.png"}, raw);
  ASSERT_TRUE(picture.ok());
  EXPECT_EQ(picture->color, raw);
  EXPECT_EQ(picture->mask, nullptr);
}

TEST_F(CommonCameraTest, LensesAndOtherCamerasShowWhatThePinholeSees) {
  const PinholeCamera other = {.width = 300, .height = 200, .fx = 150, .fy = 155, .cx = 149, .cy = 104};
  const PinholeCamera wide = {.width = 480, .height = 360, .fx = 187, .fy = 187, .cx = 242, .cy = 176};
  const ImageU8 truth = photograph(kCamera, {});
  CommonCamera common(kCamera);
  for (const CalibratedCamera& lens : {CalibratedCamera{kCamera, kRadial}, {other, {}}, {wide, kFisheye}}) {
    const ImageU8 raw = photograph(lens.camera, lens.distortion);
    const auto picture = common.take({lens.camera, {}, "a.png", lens.distortion}, raw);
    ASSERT_TRUE(picture.ok()) << picture.error().message;
    PinholeCamera shifted = lens.camera;
    shifted.cx += 0.5;
    const auto beside = common.take({shifted, {}, "a.png", lens.distortion}, raw);
    ASSERT_TRUE(beside.ok());
    const double exact = psnr(*picture, truth), half_a_pixel = psnr(*beside, truth);
    EXPECT_GT(exact, 28) << lens.camera.fx;
    EXPECT_GT(exact, half_a_pixel + 1) << lens.camera.fx;
  }
}

TEST_F(CommonCameraTest, WhatTheLensDidNotSeeIsMasked) {
  CommonCamera common(kCamera);
  const PinholeCamera narrow = {.width = 240, .height = 180, .fx = 394, .fy = 393, .cx = 121.2, .cy = 87.6};
  const auto picture = common.take({narrow, {}, "a.png"}, ImageU8(240, 180, 3, 9));
  ASSERT_TRUE(picture.ok());
  ASSERT_TRUE(picture->mask);
  EXPECT_EQ((*picture->mask)(20, 90), 0);
  EXPECT_EQ((*picture->mask)(120, 90), 255);
  const auto again = common.take({narrow, {}, "b.png"}, ImageU8(240, 180, 3, 9));
  EXPECT_EQ(again->mask, picture->mask) << "shared";
}

TEST_F(CommonCameraTest, ErrorsNameThePicture) {
  CommonCamera common(kCamera);
  EXPECT_NE(common.take({kCamera, {}, "a.png"}, ImageU8(24, 18, 3)).error().message.find("a.png: 24x18"),
            std::string::npos);
  // A polynomial that turns rays around from the axis on.
  const auto blind = common.take({kCamera, {}, "a.png", {.k1 = -1e9}}, ImageU8(240, 180, 3));
  ASSERT_FALSE(blind.ok());
  EXPECT_NE(blind.error().message.find("a.png: its lens leaves nothing"), std::string::npos);
}

}  // namespace
}  // namespace photoslam
