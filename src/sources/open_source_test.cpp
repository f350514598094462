// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/open_source.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>

#include "io/image_file.h"
#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::string_view kCamera = "width: 16\nheight: 12\nfx: 10\nfy: 11\ncx: 7.5\ncy: 5.5\ndepth_scale: 1000\n";

/// Writes small sequences and reads them back.
class OpenSourceTest : public TempFolderTest {
 protected:
  /// Images whose values tell which frame they belong to.
  void write_color(const fs::path& name, int value) const {
    fs::create_directories((folder / name).parent_path());
    const ImageU8 image(16, 12, 3, static_cast<uint8_t>(value));
    EXPECT_TRUE((name.extension() == ".jpg" ? write_jpeg(folder / name, image) : write_png(folder / name, image)).ok());
  }
  void write_depth(const fs::path& name, int value) const {
    fs::create_directories((folder / name).parent_path());
    EXPECT_TRUE(write_png(folder / name, ImageU16(16, 12, 1, static_cast<uint16_t>(value))).ok());
  }
  void write_frame(const std::string& name, int value) const {
    write_color("rgb/" + name + ".png", value);
    write_depth("depth/" + name + ".png", 100 * value);
  }

  /// A TUM sequence with associations at 1.0, 1.1, … s.
  void write_associated_sequence(int count) const {
    write("camera.yaml", kCamera);
    std::string lines;
    for (int i = 0; i < count; ++i) {
      const std::string name = fmt::format("1.{}", i);
      write_frame(name, i);
      lines += fmt::format("{0} rgb/{0}.png {0} depth/{0}.png\n", name);
    }
    write("associations.txt", lines);
  }

  std::vector<Frame> read_all(FrameSource& source) const {
    std::vector<Frame> frames;
    while (std::optional<Frame> frame = source.next()) frames.push_back(std::move(*frame));
    EXPECT_FALSE(source.next().has_value());
    return frames;
  }
  std::string failure(const SourceOptions& options = {}) const {
    const auto source = open_source(folder, options);
    return source.ok() ? "no error" : source.error().message;
  }
};

TEST_F(OpenSourceTest, ReadsTumWithAssociations) {
  write_associated_sequence(4);
  const auto source = open_source(folder).value();
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.format, "tum");
  EXPECT_EQ(info.sensor, SensorKind::rgbd);
  EXPECT_EQ(info.camera, (PinholeCamera{16, 12, 10, 11, 7.5, 5.5}));
  EXPECT_EQ(info.metres_per_depth_unit, 0.001);
  EXPECT_NEAR(info.frames_per_second, 10, 1e-9);
  EXPECT_EQ(info.num_frames, 4);
  EXPECT_THAT(info.notes, IsEmpty());
  const std::vector<Frame> frames = read_all(*source);
  ASSERT_EQ(frames.size(), 4u);
  for (int i = 0; i < 4; ++i) {
    const Frame& frame = frames[static_cast<size_t>(i)];
    EXPECT_EQ(frame.id.value, i);
    EXPECT_EQ(frame.timestamp_ns, 1'000'000'000 + i * 100'000'000);
    EXPECT_EQ(frame.color(15, 11, 2), i);
    EXPECT_EQ(frame.depth(15, 11), 100 * i);
    EXPECT_EQ(frame.defect, "");
  }
}

TEST_F(OpenSourceTest, MatchesTumListsByTime) {
  write("camera.yaml", kCamera);
  for (const char* name : {"a", "b", "c"}) write_color(fmt::format("rgb/{}.png", name), name[0]);
  for (const char* name : {"d", "e", "f"}) write_depth(fmt::format("depth/{}.png", name), name[0]);
  write("rgb.txt", "# color images\n# file: 'x'\n1.00 rgb/a.png\n1.10 rgb/b.png\n1.20 rgb/c.png\n");
  write("depth.txt", "0.985 depth/d.png\n1.01 depth/e.png\n1.215 depth/f.png\n");
  const auto source = open_source(folder).value();
  EXPECT_THAT(source->info().notes, ElementsAre(HasSubstr("1 of 3 colour images have no depth image within 20 ms")));
  const std::vector<Frame> frames = read_all(*source);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].timestamp_ns, 1'000'000'000);
  EXPECT_EQ(frames[0].depth(0, 0), 'e');
  EXPECT_EQ(frames[1].color(0, 0), 'c');
  EXPECT_EQ(frames[1].depth(0, 0), 'f');
}

TEST_F(OpenSourceTest, ReadsReplica) {
  write("cam_params.json",
        R"({"camera": {"w": 16, "h": 12, "fx": 10.0, "fy": 10.0, "cx": 7.5, "cy": 5.5, "scale": 6553.5}})");
  for (const int number : {0, 1, 3}) {
    write_color(fmt::format("room/results/frame{:06}.jpg", number), 50 * number);
    write_depth(fmt::format("room/results/depth{:06}.png", number), number);
  }
  for (const char* path : {"room", "room/results", "room/"}) {
    const auto source = open_source(folder / path).value();
    EXPECT_EQ(source->info().format, "replica");
    EXPECT_EQ(source->info().camera, (PinholeCamera{16, 12, 10, 10, 7.5, 5.5}));
    EXPECT_EQ(source->info().metres_per_depth_unit, 1 / 6553.5);
    EXPECT_EQ(source->info().frames_per_second, 30);
    const std::vector<Frame> frames = read_all(*source);
    ASSERT_EQ(frames.size(), 3u);
    EXPECT_EQ(frames[1].timestamp_ns, 33'333'333);
    EXPECT_EQ(frames[2].timestamp_ns, 100'000'000);
    EXPECT_EQ(frames[2].depth(3, 3), 3);
    EXPECT_NEAR(frames[2].color(3, 3), 150, 2);
  }
}

TEST_F(OpenSourceTest, DamagedImagesAreDefectsOfTheirFrame) {
  write_associated_sequence(5);
  const std::string png = read_file(folder / "rgb/1.1.png").value();
  write("rgb/1.1.png", png.substr(0, png.size() / 2));
  write("depth/1.2.png", "");
  ASSERT_TRUE(write_png(folder / "depth/1.3.png", ImageU16(8, 12)).ok());
  ASSERT_TRUE(write_png(folder / "depth/1.4.png", ImageU8(16, 12)).ok());
  const auto source = open_source(folder).value();
  const std::vector<Frame> frames = read_all(*source);
  ASSERT_EQ(frames.size(), 5u);
  EXPECT_EQ(frames[0].defect, "");
  EXPECT_THAT(frames[1].defect, HasSubstr("rgb/1.1.png: damaged PNG"));
  EXPECT_THAT(frames[2].defect, HasSubstr("depth/1.2.png is empty (0 bytes)"));
  EXPECT_THAT(frames[3].defect, HasSubstr("depth/1.3.png has 8x12 pixels, expected 16x12"));
  EXPECT_THAT(frames[4].defect, HasSubstr("expected a PNG with one channel of 16 bits"));
}

TEST_F(OpenSourceTest, MissingFilesAreNamedAndTheirFramesDefective) {
  write_associated_sequence(4);
  fs::remove(folder / "depth/1.2.png");
  const auto source = open_source(folder).value();
  ASSERT_EQ(source->info().notes.size(), 1u);
  EXPECT_THAT(source->info().notes[0], HasSubstr("1 of 4 listed frames lack a file and count as lost"));
  EXPECT_THAT(source->info().notes[0], HasSubstr("depth/1.2.png"));
  const std::vector<Frame> frames = read_all(*source);
  EXPECT_EQ(frames[1].defect, "");
  EXPECT_THAT(frames[2].defect, HasSubstr("depth/1.2.png"));
}

TEST_F(OpenSourceTest, StopsWhereTooFewFramesRemain) {
  write_associated_sequence(9);
  fs::remove_all(folder / "rgb");
  EXPECT_THAT(failure(), HasSubstr("of 9 listed frames only 0 have their files; missing: "));
  EXPECT_THAT(failure(), HasSubstr("rgb/1.2.png and 6 more"));
}

TEST_F(OpenSourceTest, SaysWhatItLookedFor) {
  EXPECT_THAT(failure(), HasSubstr("is empty"));
  write("notes.txt", "rgb");
  EXPECT_THAT(failure(), HasSubstr("cannot tell the format"));
  EXPECT_THAT(failure({.format = "tam"}), HasSubstr("unknown format 'tam' (did you mean 'tum'?)"));
  EXPECT_THAT(failure({.format = "tum"}), HasSubstr("rgb.txt"));
  EXPECT_THAT(failure({.format = "replica"}), HasSubstr("cam_params.json"));
  EXPECT_THAT(open_source(folder / "notes.txt").error().message, HasSubstr("notes.txt"));
  EXPECT_THAT(open_source(folder / "absent").error().message, HasSubstr("does not exist"));
}

TEST_F(OpenSourceTest, ErrorsInListsNameTheLine) {
  write_associated_sequence(2);
  const auto failure_of = [&](std::string_view lines) {
    write("associations.txt", lines);
    return failure();
  };
  EXPECT_THAT(failure_of("1.0 rgb/1.0.png 1.0\n"), HasSubstr("associations.txt:1: expected 'time colour-file"));
  EXPECT_THAT(failure_of("# c\none rgb/1.0.png 1.0 depth/1.0.png\n"), HasSubstr("associations.txt:2: 'one' is not"));
  EXPECT_THAT(failure_of("1.1 rgb/1.1.png 1.1 depth/1.1.png\n\n1.0 rgb/1.0.png 1.0 depth/1.0.png\n"),
              HasSubstr("associations.txt:3: the time 1.0 is not after 1.1 in line 1"));
  EXPECT_THAT(failure_of("# nothing\n"), HasSubstr("lists nothing"));
}

TEST_F(OpenSourceTest, AnOtherCameraCanBeNamed) {
  write_associated_sequence(2);
  std::string other(kCamera);
  other.replace(other.find("fx: 10"), 6, "fx: 99");
  write("other.yaml", other);
  EXPECT_EQ(open_source(folder, {.format = "auto", .camera = folder / "other.yaml"}).value()->info().camera.fx, 99);
  write("other.yaml", "width: 640\nheight: 480\nfx: 1\nfy: 1\ncx: 1\ncy: 1\n");
  EXPECT_THAT(failure({.format = "auto", .camera = folder / "other.yaml"}),
              HasSubstr("(TUM RGB-D) is calibrated for 640x480"));
}

TEST_F(OpenSourceTest, CamParamsAreChecked) {
  write_color("results/frame0.jpg", 1);
  write_depth("results/depth0.png", 1);
  EXPECT_THAT(failure(), HasSubstr("has cam_params.json"));
  write("cam_params.json", "{");
  EXPECT_THAT(failure(), HasSubstr("is not a JSON object"));
  write("cam_params.json", "{}");
  EXPECT_THAT(failure(), HasSubstr("has no object 'camera'"));
  write("cam_params.json", R"({"camera": {"w": 16, "h": "12"}})");
  EXPECT_THAT(failure(), HasSubstr("camera.h must be a positive number"));
}

TEST(RealSequences, AreRecognisedAndComplete) {
  const char* data = std::getenv("PHOTOSLAM_DATA_DIR");
  if (data == nullptr) GTEST_SKIP() << "PHOTOSLAM_DATA_DIR is not set";
  const auto source = open_source(fs::path(data) / "redkitchen-rgbd").value();
  EXPECT_EQ(source->info().num_frames, 500);
  EXPECT_EQ(source->info().frames_per_second, 15);
  EXPECT_THAT(source->info().notes, IsEmpty());
  int64_t last = -1;
  for (int i = 0; i < 20; ++i) {
    const Frame frame = source->next().value();
    EXPECT_EQ(frame.defect, "");
    EXPECT_GT(frame.timestamp_ns, last);
    last = frame.timestamp_ns;
  }
  const auto incomplete = open_source(fs::path(data) / "tum-fr1-desk-9");
  ASSERT_FALSE(incomplete.ok());
  EXPECT_THAT(incomplete.error().message, HasSubstr("of 573 listed frames only 9 have their files"));
}

}  // namespace
}  // namespace photoslam
