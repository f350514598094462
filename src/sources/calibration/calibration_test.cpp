// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/calibration/calibration.h"

#include <gmock/gmock.h>

#include <numbers>

#include "io/image_file.h"
#include "io/temp_folder_test.h"
#include "sources/folder_source.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

class CalibrationTest : public TempFolderTest {
 protected:
  CameraFile read(std::string_view content) const {
    const auto file = read_calibration(write("file.yaml", content));
    EXPECT_TRUE(file.ok()) << file.error().message;
    return file.ok() ? *file : CameraFile{};
  }
  std::string failure(std::string_view content) const {
    return read_calibration(write("file.yaml", content)).error().message;
  }
};

TEST_F(CalibrationTest, ReadsCameraYamlAndFisheye) {
  const CameraFile file = read(
      "model: fisheye\nwidth: 16\nheight: 12\nfx: 10\nfy: 11\ncx: 7.5\ncy: 5.5\ndistortion: [0.1, 0.2, 0.3, 0.4]\n");
  EXPECT_EQ(file.camera, (PinholeCamera{16, 12, 10, 11, 7.5, 5.5}));
  EXPECT_EQ(file.distortion,
            (Distortion{.k1 = 0.1, .k2 = 0.2, .k3 = 0.3, .k4 = 0.4, .model = LensModel::kannala_brandt}));
}

TEST_F(CalibrationTest, ReadsOpenCvFileStorage) {
  const CameraFile file = read(
      "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n"
      "   dt: d\n   data: [ 500., 0., 320., 0., 501., 240., 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 8\n   dt: d\n   data: [ 1., 2., 3., 4., 5., 6., "
      "7., 8. ]\n");
  EXPECT_EQ(file.camera, (PinholeCamera{640, 480, 500, 501, 320, 240}));
  EXPECT_EQ(file.distortion, (Distortion{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_THAT(failure("camera_matrix: [500, 0, 320]\n"), HasSubstr("expected 9 numbers of 'camera_matrix', found 3"));
}

TEST_F(CalibrationTest, FourCoefficientsNeedAModel) {
  const std::string four = "camera_matrix: [50, 0, 32, 0, 51, 24, 0, 0, 1]\ndistortion_coefficients: [1, 2, 3, 4]\n";
  EXPECT_THAT(failure(four), HasSubstr("file.yaml:2: distortion_coefficients: four numbers may be k1 k2 p1 p2 or"));
  const Distortion fisheye{.k1 = 1, .k2 = 2, .k3 = 3, .k4 = 4, .model = LensModel::kannala_brandt};
  EXPECT_EQ(read(four + "distortion_model: plumb_bob\n").distortion, (Distortion{1, 2, 3, 4}));
  EXPECT_EQ(read(four + "distortion_model: equidistant\n").distortion, fisheye);
  EXPECT_EQ(read(four + "fisheye_model: 1\n").distortion, fisheye) << "as OpenCV's calibration sample writes it";
  EXPECT_EQ(read(four + "fisheye_model: 0\n").distortion, (Distortion{1, 2, 3, 4}));
  EXPECT_THAT(failure(four + "distortion_model: fov\n"), HasSubstr("file.yaml:3: unknown distortion_model 'fov'"));
  EXPECT_TRUE(read("camera_matrix: [50, 0, 32, 0, 51, 24, 0, 0, 1]\ndistortion_coefficients: [0, 0, 0, 0]\n")
                  .distortion.none());
}

TEST_F(CalibrationTest, ReadsOpenCvStereo) {
  const auto matrix = [](const char* name, int rows, int cols, const char* data) {
    return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n", name, rows, cols,
                       data);
  };
  const std::string intrinsics = "%YAML:1.0\n---\n" + matrix("M1", 3, 3, "50., 0., 32., 0., 51., 24., 0., 0., 1.") +
                                 matrix("D1", 1, 5, "-0.3, 0.1, 0., 0., 0.02") +
                                 matrix("M2", 3, 3, "52., 0., 33., 0., 53., 25., 0., 0., 1.") +
                                 matrix("D2", 1, 5, "-0.2, 0.1, 0., 0., 0.");
  // The right camera is turned by 90° about z: x_right = R x_left + T.
  const std::string rotation = matrix("R", 3, 3, "0., 1., 0., -1., 0., 0., 0., 0., 1.");
  const CameraFile file = read(intrinsics + rotation + matrix("T", 3, 1, "-0.12, 0.01, 0.") + "image_width: 64\n");
  EXPECT_EQ(file.camera, (PinholeCamera{64, 0, 50, 51, 32, 24}));
  EXPECT_EQ(file.distortion, (Distortion{-0.3, 0.1, 0, 0, 0.02}));
  ASSERT_TRUE(file.right.has_value());
  EXPECT_EQ(file.right->camera, (PinholeCamera{64, 0, 52, 53, 33, 25}));
  EXPECT_EQ(file.right->distortion, (Distortion{-0.2, 0.1}));
  EXPECT_LT((file.right->right_from_left * Vec3(1, 2, 3) - Vec3(2 - 0.12, -1 + 0.01, 3)).norm(), 1e-12);
  EXPECT_THAT(failure(intrinsics), HasSubstr("the pair's R and T are missing"));
  EXPECT_THAT(failure(intrinsics + rotation + matrix("T", 3, 1, "-120., 1., 0.")), HasSubstr("T must be in metres"));
}

TEST_F(CalibrationTest, ReadsRosCameraInfo) {
  const CameraFile file = read(
      "image_width: 64\nimage_height: 48\ncamera_name: left\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
      "  data: [50, 0, 32, 0, 51, 24, 0, 0, 1]\ndistortion_model: equidistant\ndistortion_coefficients:\n  rows: 1\n"
      "  cols: 4\n  data: [0.1, 0.2, 0.3, 0.4]\n");
  EXPECT_EQ(file.distortion.model, LensModel::kannala_brandt);
  EXPECT_EQ(file.distortion.k4, 0.4);
}

TEST_F(CalibrationTest, ReadsOrbSlamSettings) {
  const CameraFile two = read(
      "%YAML:1.0\nCamera.fx: 517.3\nCamera.fy: 516.5\nCamera.cx: 318.6\nCamera.cy: 255.3\nCamera.k1: 0.26\n"
      "Camera.k2: -0.95\nCamera.p1: -0.005\nCamera.p2: 0.0026\nCamera.k3: 1.16\nCamera.width: 640\n"
      "Camera.height: 480\nCamera.fps: 30.0\nCamera.bf: 40.0\nDepthMapFactor: 5000.0\nThDepth: 40.0\n");
  EXPECT_EQ(two.camera, (PinholeCamera{640, 480, 517.3, 516.5, 318.6, 255.3}));
  EXPECT_EQ(two.distortion, (Distortion{0.26, -0.95, -0.005, 0.0026, 1.16}));
  EXPECT_EQ(two.frames_per_second, 30);
  EXPECT_EQ(two.depth_scale, 5000);
  EXPECT_NEAR(two.right->right_from_left.translation.x(), -40.0 / 517.3, 1e-12);

  const CameraFile three = read(
      "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"KannalaBrandt8\"\nCamera1.fx: 190\nCamera1.fy: 191\n"
      "Camera1.cx: 254\nCamera1.cy: 256\nCamera1.k1: 0.003\nCamera1.k2: 0.001\nCamera1.k3: -0.002\nCamera1.k4: 0.0002\n"
      "Camera2.fx: 192\nCamera2.fy: 193\nCamera2.cx: 252\nCamera2.cy: 255\nCamera2.k1: 0.004\n"
      "Stereo.T_c1_c2: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: f\n"
      "  data: [1, 0, 0, 0.1, 0, 1, 0, 0.02, 0, 0, 1, 0, 0, 0, 0, 1]\n");
  EXPECT_EQ(three.camera, (PinholeCamera{0, 0, 190, 191, 254, 256}));
  EXPECT_EQ(three.distortion.model, LensModel::kannala_brandt);
  EXPECT_EQ(three.right->camera.fx, 192);
  EXPECT_EQ(three.right->distortion.k1, 0.004);
  EXPECT_LT((three.right->right_from_left.translation - Vec3(-0.1, -0.02, 0)).norm(), 1e-12);
  EXPECT_THAT(failure("Camera.fx: 1\nCamera.fy: x\nCamera.cx: 0\nCamera.cy: 0\n"),
              HasSubstr("file.yaml:2: Camera.fy is not a number"));
}

TEST_F(CalibrationTest, RecoversTheRigBehindRectification) {
  // Left turned by 90° about x, right not at all: p_right = R_r⁻¹ (R_l p_left − b).
  const CameraFile file = read(
      "LEFT.height: 480\nLEFT.width: 752\nLEFT.K: [458, 0, 367, 0, 457, 248, 0, 0, 1]\nLEFT.D: [-0.28, 0.07, 0, 0, 0]\n"
      "LEFT.R: [1, 0, 0, 0, 0, -1, 0, 1, 0]\nLEFT.P: [435, 0, 367, 0, 0, 435, 252, 0, 0, 0, 1, 0]\n"
      "RIGHT.height: 480\nRIGHT.width: 752\nRIGHT.K: [457, 0, 379, 0, 456, 255, 0, 0, 1]\n"
      "RIGHT.D: [-0.28, 0.07, 0, 0, 0]\nRIGHT.R: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
      "RIGHT.P: [400, 0, 367, -44, 0, 400, 252, 0, 0, 0, 1, 0]\n");
  EXPECT_EQ(file.camera, (PinholeCamera{752, 480, 458, 457, 367, 248}));
  EXPECT_LT((file.right->right_from_left * Vec3(1, 2, 3) - Vec3(1 - 0.11, -3, 2)).norm(), 1e-12);
}

TEST_F(CalibrationTest, ReadsKittiAndEuroc) {
  const CameraFile kitti = read("P0: 10 0 7.5 0 0 10 5.5 0 0 0 1 0\nP1: 10 0 7.5 -5 0 10 5.5 0 0 0 1 0\n");
  EXPECT_EQ(kitti.camera, (PinholeCamera{0, 0, 10, 10, 7.5, 5.5}));
  EXPECT_NEAR(kitti.right->right_from_left.translation.x(), -0.5, 1e-12);
  const CameraFile euroc = read("intrinsics: [10, 11, 7.5, 5.5]\nresolution: [16, 12]\nrate_hz: 20\n");
  EXPECT_EQ(euroc.camera, (PinholeCamera{16, 12, 10, 11, 7.5, 5.5}));
  EXPECT_THAT(failure("fx: 10\n"), HasSubstr("the key 'width' is missing"));
}

TEST(GuessedCamera, HasTheFieldOfView) {
  const PinholeCamera camera = guess_camera(90, 640, 480).camera;
  EXPECT_NEAR(camera.fx, 320, 1e-9);
  EXPECT_EQ(camera.cx, 319.5);
}

TEST(NaturalOrder, ComparesDigitsAsNumbers) {
  using internal::natural_less;
  for (const auto& [a, b] : {std::pair{"2.jpg", "10.jpg"},
                             {"a2b10", "a10b2"},
                             {"img9", "img010"},
                             {"a", "b"},
                             {"1", "1a"},
                             {"f1_2", "f1_10"},
                             {"01", "1"}}) {
    EXPECT_TRUE(natural_less(a, b)) << a << " " << b;
    EXPECT_FALSE(natural_less(b, a)) << a << " " << b;
  }
  EXPECT_FALSE(natural_less("x1", "x1"));
}

class ImageFolderTest : public TempFolderTest {};

TEST_F(ImageFolderTest, ReadsImagesInNaturalOrder) {
  for (const int i : {1, 2, 10}) {
    ASSERT_TRUE(write_png(folder / fmt::format("img{}.png", i), ImageU8(16, 12, 3, static_cast<uint8_t>(i))).ok());
  }
  EXPECT_THAT(open_source(folder).error().message, HasSubstr("has no calibration: name one with --camera FILE"));
  const auto source = open_source(folder, {.fov_deg = 90, .frames_per_second = 10}).value();
  EXPECT_EQ(source->info().format, "images");
  EXPECT_EQ(source->info().sensor, SensorKind::mono);
  EXPECT_NEAR(source->info().camera.fx, 8, 1e-9);
  EXPECT_THAT(source->info().notes, ElementsAre(HasSubstr("a rough guess from --fov 90")));
  const int expected[] = {1, 2, 10};
  for (int i = 0; i < 3; ++i) {
    const Frame frame = source->next().value();
    EXPECT_EQ(frame.timestamp_ns, i * 100'000'000);
    EXPECT_EQ(frame.color(0, 0), expected[i]);
  }
  EXPECT_FALSE(source->next().has_value());
  write("camera.yaml", "width: 16\nheight: 12\nfx: 10\nfy: 11\ncx: 7.5\ncy: 5.5\n");
  EXPECT_THAT(open_source(folder, {.fov_deg = 90}).error().message, HasSubstr("has a calibration, and --fov 90"));
  EXPECT_EQ(open_source(folder).value()->info().camera.fx, 10);
  EXPECT_THAT(open_source(folder).value()->info().notes, ElementsAre(HasSubstr("no frame rate given: taking 30 Hz")));
}

}  // namespace
}  // namespace photoslam
