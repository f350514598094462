// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
// EuRoC and KITTI: layouts, calibration, truth and what can be wrong with them.
#include <gmock/gmock.h>

#include <cstdlib>

#include "io/image_file.h"
#include "io/temp_folder_test.h"
#include "sources/ground_truth.h"
#include "sources/open_source.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::string_view kLeft =
    "%YAML:1.0\n# a comment\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n"
    "  data: [0, -1, 0, 0.5,  1, 0, 0, 0,  0, 0, 1, 0,  0, 0, 0, 1]\nrate_hz: 20\nresolution: [16, 12]\n"
    "camera_model: pinhole\nintrinsics: [10, 11, 7.5, 5.5] #fu, fv, cu, cv\n"
    "distortion_model: radial-tangential\ndistortion_coefficients: [-0.2, 0.1, 0.001, 0.002]\n";
constexpr std::string_view kRight =
    "T_BS: {cols: 4, rows: 4, data: [0, -1, 0, 0.5,  1, 0, 0, 0.25,  0, 0, 1, 0,  0, 0, 0, 1]}\n"
    "resolution: [16, 12]\nintrinsics: [12, 13, 8, 6]\n"
    "distortion_model: equidistant\ndistortion_coefficients: [0.1, 0.2, 0.3, 0.4]\n";

class RigSourceTest : public TempFolderTest {
 protected:
  void write_grey(const fs::path& name, int value, int channels = 1) const {
    fs::create_directories((folder / name).parent_path());
    EXPECT_TRUE(write_png(folder / name, ImageU8(16, 12, channels, static_cast<uint8_t>(value))).ok());
  }

  /// Three pairs 50 ms apart; values tell camera and frame.
  void write_euroc(bool right = true) const {
    std::string list = "#timestamp [ns],filename\r\n";
    for (int i = 0; i < 3; ++i) {
      const std::string time = std::to_string(1'403'715'273'262'142'976 + i * 50'000'000LL);
      list += time + "," + time + ".png\r\n";
      write_grey("mav0/cam0/data/" + time + ".png", 10 + i);
      if (right) write_grey("mav0/cam1/data/" + time + ".png", 20 + i);
    }
    write("mav0/cam0/data.csv", list);
    write("mav0/cam0/sensor.yaml", kLeft);
    if (!right) return;
    write("mav0/cam1/data.csv", list);
    write("mav0/cam1/sensor.yaml", kRight);
  }

  void write_kitti(const std::string& sequence, int first_camera = 0, int cameras = 2) const {
    std::string times;
    for (int i = 0; i < 3; ++i) {
      times += fmt::format("{}.0e-01\n", i);
      for (int c = first_camera; c < first_camera + cameras; ++c) {
        write_grey(fmt::format("sequences/{}/image_{}/{:06}.png", sequence, c, i), 10 * c + i,
                   first_camera == 2 ? 3 : 1);
      }
    }
    write("sequences/" + sequence + "/times.txt", times);
    write("sequences/" + sequence + "/calib.txt",
          "P0: 10 0 7.5 0 0 10 5.5 0 0 0 1 0\nP1: 10 0 7.5 -5 0 10 5.5 0 0 0 1 0\n"
          "P2: 10 0 7.5 0.6 0 10 5.5 0 0 0 1 0\nP3: 10 0 7.5 -4.4 0 10 5.5 0 0 0 1 0\nTr: 1 2 3\n");
  }

  std::vector<Frame> read_all(FrameSource& source) const {
    std::vector<Frame> frames;
    while (std::optional<Frame> frame = source.next()) frames.push_back(std::move(*frame));
    return frames;
  }
  std::string failure(const SourceOptions& options = {}, const fs::path& below = {}) const {
    const auto source = open_source(folder / below, options);
    return source.ok() ? "no error" : source.error().message;
  }
};

TEST_F(RigSourceTest, ReadsEurocStereo) {
  write_euroc();
  for (const char* path : {"", "mav0"}) {
    const auto source = open_source(folder / path).value();
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.format, "euroc");
    EXPECT_THAT(info.name, HasSubstr(folder.filename().string()));
    EXPECT_EQ(info.sensor, SensorKind::stereo);
    EXPECT_EQ(info.camera, (PinholeCamera{16, 12, 10, 11, 7.5, 5.5}));
    EXPECT_EQ(info.distortion, (Distortion{-0.2, 0.1, 0.001, 0.002}));
    EXPECT_EQ(info.frames_per_second, 20);
    ASSERT_TRUE(info.right.has_value());
    EXPECT_EQ(info.right->camera, (PinholeCamera{16, 12, 12, 13, 8, 6}));
    EXPECT_EQ(info.right->distortion,
              (Distortion{.k1 = 0.1, .k2 = 0.2, .k3 = 0.3, .k4 = 0.4, .model = LensModel::kannala_brandt}));
    // The body's y axis is the camera's x axis; the right camera is 0.25 m along it.
    EXPECT_LT((info.right->right_from_left * Vec3(0, 0, 0) - Vec3(-0.25, 0, 0)).norm(), 1e-12);
    const std::vector<Frame> frames = read_all(*source);
    ASSERT_EQ(frames.size(), 3u);
    EXPECT_EQ(frames[1].timestamp_ns, 1'403'715'273'312'142'976);
    EXPECT_EQ(frames[1].defect, "");
    EXPECT_EQ(frames[1].color(5, 5), 11);
    EXPECT_EQ(frames[1].right(5, 5), 21);
  }
}

TEST_F(RigSourceTest, StereoCanBeReadAsMono) {
  write_euroc();
  const auto source = open_source(folder, {.sensor = SensorKind::mono}).value();
  EXPECT_EQ(source->info().sensor, SensorKind::mono);
  EXPECT_FALSE(source->info().right.has_value());
  EXPECT_TRUE(source->next()->right.empty());
  EXPECT_THAT(failure({.sensor = SensorKind::rgbd}), HasSubstr("can be read as stereo or mono, not as rgbd"));
}

TEST_F(RigSourceTest, EurocWithOneCameraIsMono) {
  write_euroc(/*right=*/false);
  const auto source = open_source(folder).value();
  EXPECT_EQ(source->info().sensor, SensorKind::mono);
  EXPECT_EQ(read_all(*source).size(), 3u);
}

TEST_F(RigSourceTest, EurocPairsThatLackAnImage) {
  write_euroc();
  const std::string list = read_file(folder / "mav0/cam1/data.csv").value();
  write("mav0/cam1/data.csv", list.substr(0, list.rfind('\n', list.size() - 2) + 1));  // no line for the third
  fs::remove(folder / "mav0/cam1/data/1403715273312142976.png");                       // no file for the second
  const auto source = open_source(folder).value();
  EXPECT_THAT(source->info().notes, ElementsAre(HasSubstr("1 of 3 images of cam0 have no partner in cam1 within 5 ms"),
                                                HasSubstr("1 of 2 listed frames lack a file")));
  const std::vector<Frame> frames = read_all(*source);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].defect, "");
  EXPECT_THAT(frames[1].defect, HasSubstr("cam1/data/1403715273312142976.png"));
}

TEST_F(RigSourceTest, RightImageOfOtherKindIsADefect) {
  write_euroc();
  write_grey("mav0/cam1/data/1403715273262142976.png", 1, 3);
  EXPECT_THAT(open_source(folder).value()->next()->defect, HasSubstr("has 3 channels, the left image has 1"));
}

TEST_F(RigSourceTest, ErrorsOfEurocNameFileAndLine) {
  write_euroc();
  const auto with = [&](std::string_view from, std::string_view to) {
    std::string content(kLeft);
    write("mav0/cam0/sensor.yaml", content.replace(content.find(from), from.size(), to));
    return failure();
  };
  EXPECT_THAT(with("[16, 12]", "[16]"), HasSubstr("sensor.yaml:9: expected 'resolution: [width, height]'"));
  EXPECT_THAT(with("[10, 11", "[-10, 11"), HasSubstr("sensor.yaml:11: focal lengths must be positive"));
  EXPECT_THAT(with("radial-tangential", "fov"), HasSubstr("sensor.yaml:12: unknown distortion_model 'fov'"));
  EXPECT_THAT(with("0.002]", "x]"), HasSubstr("sensor.yaml:13: number 4 of distortion_coefficients is not a number"));
  EXPECT_THAT(with("[0, -1", "[0, -2"), HasSubstr("T_BS: the upper left 3x3 numbers are not a rotation"));
  EXPECT_THAT(with("pinhole", "omni"), HasSubstr("sensor.yaml:10: the only known camera_model is 'pinhole'"));
  write("mav0/cam0/sensor.yaml", kLeft);
  write("mav0/cam1/data.csv", "2,b.png\n1,a.png\n");
  EXPECT_THAT(failure(), HasSubstr("cam1/data.csv:2: the time 1 is not after 2 in line 1"));
  write("mav0/cam1/data.csv", "1.5,b.png\n");
  EXPECT_THAT(failure(), HasSubstr("cam1/data.csv:1: '1.5' is not a time in nanoseconds"));
}

TEST_F(RigSourceTest, EurocTruthIsTakenFromBodyToCamera) {
  write_euroc();
  write("mav0/state_groundtruth_estimate0/data.csv",
        "#t,p,q,v,b\n1403715273262142976,1,2,3,1,0,0,0,0,0,0,0,0,0,0,0,0\n1403715273312142976,0,0,0,0,0,0,1,9,9\n");
  const Trajectory truth = read_ground_truth(folder).value();
  ASSERT_EQ(truth.size(), 2u);
  EXPECT_EQ(truth[0].timestamp_ns, 1'403'715'273'262'142'976);
  EXPECT_LT((truth[0].world_from_camera * Vec3(0, 0, 0) - Vec3(1.5, 2, 3)).norm(), 1e-12);
  EXPECT_LT((truth[0].world_from_camera * Vec3(1, 0, 0) - Vec3(1.5, 3, 3)).norm(), 1e-12);
  EXPECT_LT((truth[1].world_from_camera * Vec3(0, 0, 0) - Vec3(-0.5, 0, 0)).norm(), 1e-12);  // turned by 180° about z
  write("mav0/state_groundtruth_estimate0/data.csv", "1403715273262142976,1,2,3,1,0,0\n");
  EXPECT_THAT(read_ground_truth(folder).error().message, HasSubstr("data.csv:1: expected 'time p_x"));
}

TEST_F(RigSourceTest, ReadsKittiStereo) {
  write_kitti("06");
  for (const char* path : {"", "sequences", "sequences/06"}) {
    const auto source = open_source(folder / path).value();
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.format, "kitti");
    EXPECT_EQ(info.name, "06 (KITTI)");
    EXPECT_EQ(info.sensor, SensorKind::stereo);
    EXPECT_EQ(info.camera, (PinholeCamera{16, 12, 10, 10, 7.5, 5.5}));
    EXPECT_NEAR(info.frames_per_second, 10, 1e-9);
    EXPECT_LT((info.right->right_from_left.translation - Vec3(-0.5, 0, 0)).norm(), 1e-12);
    const std::vector<Frame> frames = read_all(*source);
    ASSERT_EQ(frames.size(), 3u);
    EXPECT_EQ(frames[2].timestamp_ns, 200'000'000);
    EXPECT_EQ(frames[2].color(5, 5), 2);
    EXPECT_EQ(frames[2].right(5, 5), 12);
  }
}

TEST_F(RigSourceTest, KittiPrefersColourAndItsTruthFollows) {
  write_kitti("07", 2);
  write("poses/07.txt", "1 0 0 1 0 1 0 0 0 0 1 0\n0 0 1 0 0 1 0 0 -1 0 0 0\n");
  const auto source = open_source(folder).value();
  EXPECT_EQ(source->next()->color(1, 1, 2), 20);
  EXPECT_LT((source->info().right->right_from_left.translation - Vec3(-0.5, 0, 0)).norm(), 1e-12);
  const Trajectory truth = read_ground_truth(folder / "sequences/07").value();
  ASSERT_EQ(truth.size(), 2u);
  EXPECT_EQ(truth[1].timestamp_ns, 100'000'000);
  EXPECT_LT((truth[0].world_from_camera.translation - Vec3(0.94, 0, 0)).norm(), 1e-12);
  EXPECT_LT((truth[1].world_from_camera.translation - Vec3(0, 0, 0.06)).norm(), 1e-12);
  EXPECT_EQ(find_ground_truth(folder), find_ground_truth(folder / "sequences/07"));
}

TEST_F(RigSourceTest, SeveralKittiSequencesAreListed) {
  write_kitti("06");
  write_kitti("07", 2, 1);
  EXPECT_THAT(failure(), HasSubstr("holds the sequences 06, 07; name one of them, as in"));
  EXPECT_EQ(open_source(folder / "sequences/07").value()->info().sensor, SensorKind::mono);
}

TEST_F(RigSourceTest, ErrorsOfKittiNameFileAndLine) {
  write_kitti("06");
  write("sequences/06/calib.txt", "P0: 1 2 3\n");
  EXPECT_THAT(failure(), HasSubstr("calib.txt:1: expected the 12 numbers of a projection matrix, found 3"));
  write("sequences/06/calib.txt", "P0: 10 0 7.5 0 0 10 5.5 0 0 0 1 0\n");
  EXPECT_THAT(failure(), HasSubstr("calib.txt has no line 'P1: …'"));
  write("sequences/06/calib.txt", "Tr: 1\n");
  EXPECT_THAT(failure(), HasSubstr("has no line 'P0: …'"));
  fs::remove(folder / "sequences/06/times.txt");
  EXPECT_THAT(failure(), HasSubstr("times.txt"));
}

TEST_F(RigSourceTest, ColourOfRgbdIsMono) {
  write("camera.yaml", "width: 16\nheight: 12\nfx: 10\nfy: 11\ncx: 7.5\ncy: 5.5\n");
  for (const char* name : {"a", "b"}) write_grey(fmt::format("rgb/{}.png", name), name[0], 3);
  write("rgb.txt", "1.00 rgb/a.png\n1.10 rgb/b.png\n");
  EXPECT_EQ(open_source(folder).value()->info().sensor, SensorKind::mono);
  write("depth.txt", "1.00 depth/a.png\n");
  write("associations.txt", "1.00 rgb/a.png 1.00 depth/a.png\n1.10 rgb/b.png 1.10 depth/b.png\n");
  const auto source = open_source(folder, {.sensor = SensorKind::mono}).value();
  EXPECT_THAT(source->info().notes, IsEmpty());
  const std::vector<Frame> frames = read_all(*source);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[1].defect, "");
  EXPECT_TRUE(frames[1].depth.empty());
}

TEST(RealRigs, AreRecognisedAndComplete) {
  const char* data = std::getenv("PHOTOSLAM_DATA_DIR");
  if (data == nullptr) GTEST_SKIP() << "PHOTOSLAM_DATA_DIR is not set";
  struct Expected {
    const char* path;
    int frames;
    double baseline_m;
    size_t poses;
  };
  for (const auto& [path, frames, baseline_m, poses] :
       {Expected{"zed-stereo", 105, 0.120006, 105}, {"kitti", 51, 0.53715, 51}, {"euroc-v101-still", 10, 0.11008, 0}}) {
    const auto source = open_source(fs::path(data) / path).value();
    EXPECT_EQ(source->info().num_frames, frames) << path;
    EXPECT_EQ(source->info().sensor, SensorKind::stereo);
    EXPECT_THAT(source->info().notes, IsEmpty());
    EXPECT_NEAR(source->info().right->right_from_left.translation.norm(), baseline_m, 1e-4) << path;
    for (int i = 0; i < 10; ++i) {
      const Frame frame = source->next().value();
      EXPECT_EQ(frame.defect, "");
      EXPECT_EQ(frame.right.width(), frame.color.width());
    }
    const auto truth = read_ground_truth(fs::path(data) / path);
    EXPECT_EQ(truth.ok() ? truth->size() : 0, poses) << path;
  }
}

}  // namespace
}  // namespace photoslam
