// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
// Damaged lists, calibrations and poses must give a source or an error, never a crash.
#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "io/image_file.h"
#include "io/mutation_test.h"
#include "io/temp_folder_test.h"
#include "sources/camera_file.h"
#include "sources/ground_truth.h"
#include "sources/open_source.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCamera =
    "model: pinhole\nwidth: 16\nheight: 12\nfx: 10.5\nfy: 11\ncx: 7.5\ncy: 5.5\n"
    "distortion: [0.1, -0.2, 0.001, 0.002, 0.3]\nfps: 30\ndepth_scale: 1000\n";

class SourceRobustnessTest : public TempFolderTest {
 protected:
  void SetUp() override {
    for (const char* sub : {"rgb", "depth", "results"}) fs::create_directories(folder / sub);
    for (int i = 0; i < 3; ++i) {
      const ImageU8 color(16, 12, 3, 90);
      const ImageU16 depth(16, 12, 1, 900);
      ASSERT_TRUE(write_png(folder / fmt::format("rgb/{}.png", i), color).ok());
      ASSERT_TRUE(write_png(folder / fmt::format("depth/{}.png", i), depth).ok());
      ASSERT_TRUE(write_png(folder / fmt::format("results/frame{}.png", i), color).ok());
      ASSERT_TRUE(write_png(folder / fmt::format("results/depth{}.png", i), depth).ok());
    }
  }

  void write_fast(const fs::path& name, const std::string& content) const {
    fs::remove(folder / name);  // overwriting would wait for the disk
    std::ofstream(folder / name, std::ios::binary) << content;
  }

  /// Opens the folder and reads it to the end.
  void read_all(const char* format) const {
    auto source = open_source(folder, {.format = format});
    if (!source.ok()) {
      EXPECT_FALSE(source.error().message.empty());
      return;
    }
    int64_t last = std::numeric_limits<int64_t>::min();
    while (const std::optional<Frame> frame = (*source)->next()) {
      EXPECT_GT(frame->timestamp_ns, last);
      last = frame->timestamp_ns;
    }
  }

  /// Damages one file of a good dataset again and again.
  void survive(const fs::path& name, std::string_view content, int count, const char* format) const {
    Random random(content.size());
    for (int i = 0; i < count; ++i) {
      write_fast(name, mutated(std::string(content), random));
      read_all(format);
    }
    write_fast(name, std::string(content));
    auto source = open_source(folder, {.format = format});
    ASSERT_TRUE(source.ok()) << source.error().message;
    EXPECT_EQ((*source)->info().num_frames, 3);
  }
};

TEST_F(SourceRobustnessTest, DamagedTumLists) {
  write_fast("camera.yaml", std::string(kCamera));
  const char* color = "# color\n1.00 rgb/0.png\n1.03 rgb/1.png\n1.06 rgb/2.png\n";
  const char* depth = "# depth\n1.01 depth/0.png\n1.04 depth/1.png\n1.07 depth/2.png\n";
  write_fast("rgb.txt", color);
  write_fast("depth.txt", depth);
  survive("rgb.txt", color, 700, "tum");
  survive("depth.txt", depth, 700, "tum");
  survive("camera.yaml", kCamera, 1500, "tum");
  survive("associations.txt",
          "1.00 rgb/0.png 1.01 depth/0.png\n1.03 rgb/1.png 1.04 depth/1.png\n1.06 rgb/2.png 1.07 depth/2.png\n", 700,
          "tum");
}

TEST_F(SourceRobustnessTest, DamagedReplicaCalibration) {
  survive("cam_params.json",
          R"({"camera": {"w": 16, "h": 12, "fx": 10.0, "fy": 10.0, "cx": 7.5, "cy": 5.5, "scale": 6553.5}})", 1500,
          "replica");
}

TEST_F(SourceRobustnessTest, DamagedEuroc) {
  constexpr std::string_view kSensor =
      "%YAML:1.0\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0, -1, 0, 1, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nrate_hz: 20\n"
      "resolution: [16, 12]\nintrinsics: [10, 11, 7.5, 5.5]\ndistortion_model: radial-tangential\n"
      "distortion_coefficients: [-0.2, 0.1, 0.001, 0.002]\n";
  const char* list = "#timestamp [ns],filename\n1000000000,0.png\n1050000000,1.png\n1100000000,2.png\n";
  for (const char* camera : {"cam0", "cam1"}) {
    fs::create_directories(folder / "mav0" / camera);
    fs::rename(folder / (camera == std::string("cam0") ? "rgb" : "depth"), folder / "mav0" / camera / "data");
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(write_png(folder / "mav0" / camera / fmt::format("data/{}.png", i), ImageU8(16, 12, 1, 9)).ok());
    }
    write_fast(fmt::format("mav0/{}/sensor.yaml", camera), std::string(kSensor));
    write_fast(fmt::format("mav0/{}/data.csv", camera), list);
  }
  survive("mav0/cam1/sensor.yaml", kSensor, 700, "euroc");
  survive("mav0/cam1/data.csv", list, 300, "euroc");
}

TEST_F(SourceRobustnessTest, DamagedKitti) {
  fs::create_directories(folder / "image_0");
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(write_png(folder / fmt::format("image_0/{:06}.png", i), ImageU8(16, 12, 1, 9)).ok());
  }
  fs::create_directories(folder / "image_1");
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(write_png(folder / fmt::format("image_1/{:06}.png", i), ImageU8(16, 12, 1, 9)).ok());
  }
  const char* calib = "P0: 10 0 7.5 0 0 10 5.5 0 0 0 1 0\nP1: 10 0 7.5 -5 0 10 5.5 0 0 0 1 0\n";
  const char* times = "0.0e+00\n1.0e-01\n2.0e-01\n";
  write_fast("calib.txt", calib);
  write_fast("times.txt", times);
  survive("calib.txt", calib, 700, "kitti");
  survive("times.txt", times, 500, "kitti");
}

TEST_F(SourceRobustnessTest, DamagedGroundTruth) {
  const std::string replica = "1 0 0 4.5 0 1 0 5 0 0 1 6 0 0 0 1\n0 -1 0 7 1 0 0 8 0 0 1 9 0.0e+00 0 0 1\n";
  const std::string tum = "# t\n1305031102.175304 1.2334 -0.0113 1.6941 0.7907 0.4393 -0.1770 -0.3879\n";
  Random random(1);
  for (int i = 0; i < 3000; ++i) {
    write_fast("traj.txt", mutated(i % 2 == 0 ? replica : tum, random));
    const auto truth = read_ground_truth(folder / "traj.txt");
    if (!truth.ok()) {
      EXPECT_NE(truth.error().message.find("traj.txt"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace photoslam
