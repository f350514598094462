// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/session_file.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstring>

#include "base/check.h"
#include "base/file.h"
#include "photorealistic_mapping/world_export.h"
#include "pipeline/loaded_session.h"
#include "pipeline/system.h"
#include "pipeline/testing/corner_source.h"

namespace photoslam {
namespace {

using ::testing::AllOf;
using testing::CornerSource;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using ::testing::UnorderedElementsAre;

/// A walk of 60 frames, saved as a session.
class SessionTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = std::filesystem::temp_directory_path() / fmt::format("photoslam-session-{}", ::getpid());
    std::filesystem::create_directories(folder);
    first = new RunOutcome(run(60, settings("session.photoslam")));
    bytes = std::make_shared<const std::string>(*read_session(folder));
  }
  static void TearDownTestSuite() {
    delete first;
    bytes.reset();
    std::filesystem::remove_all(folder);
  }

  static RunSettings settings(const std::string& file) {
    RunSettings result;
    result.deterministic = true;
    result.threads = 2;
    if (!file.empty()) result.session_file = folder / file;
    return result;
  }
  static RunSettings continuing(const std::string& file) {
    RunSettings result = settings(file);
    result.loaded_session = bytes;
    return result;
  }
  static RunOutcome run(int num_frames, const RunSettings& settings, int start_at = 0) {
    SystemOptions options;
    options.pipeline.iterations_per_frame = 1;
    CornerSource source(num_frames);
    source.start_at = start_at;
    return run_slam(options, settings, source);
  }

  inline static std::filesystem::path folder;
  inline static RunOutcome* first = nullptr;
  inline static std::shared_ptr<const std::string> bytes;
};

TEST_F(SessionTest, HasTheSameBytesAtAnyNumberOfThreads) {
  RunSettings one = settings("one");
  one.threads = 1;
  run(60, one);
  EXPECT_TRUE(*read_session(folder / "one") == *bytes);
}

TEST_F(SessionTest, LoadedAndSavedAgainHasTheSameBytes) {
  run(0, continuing("again"));
  EXPECT_TRUE(*read_session(folder / "again") == *bytes);
}

TEST_F(SessionTest, LocalizesInTheLoadedMapWithinASecondAnywhere) {
  RunSettings localize = continuing("never-written");
  localize.localize_only = true;
  int found = 0;
  for (int place = 0; place < 50; ++place) {
    const RunOutcome outcome = run(12, localize, place);
    EXPECT_EQ(outcome.failure, "");
    EXPECT_EQ(outcome.final.keyframes_from_world.size(), first->final.keyframes_from_world.size());
    const FrameOutcome& last = outcome.frames.back();
    if (!last.has_pose) continue;
    const SE3 error =
        camera_from_world(last, outcome.final).value() * CornerSource::camera_from_world(place + 11).inverse();
    if (error.translation.norm() < 0.05) ++found;
  }
  EXPECT_GE(found, 48);
  EXPECT_FALSE(std::filesystem::exists(folder / "never-written"));
}

TEST_F(SessionTest, LocalizingLeavesTheMapAsItIs) {
  RunSettings localize = continuing("");
  localize.localize_only = true;
  const RunOutcome outcome = run(30, localize, 10);
  ASSERT_EQ(outcome.final.gaussians.size(), first->final.gaussians.size());
  outcome.final.gaussians.for_each([&](size_t i) {
    const splatting::Gaussian a = outcome.final.gaussians.get(i), b = first->final.gaussians.get(i);
    ASSERT_EQ(std::memcmp(&a, &b, sizeof(a)), 0) << i;
  });
}

TEST_F(SessionTest, GoesOnMappingWhereTheOtherEnded) {
  const RunOutcome outcome = run(60, continuing("longer"), 50);
  EXPECT_EQ(outcome.failure, "");
  EXPECT_GT(outcome.final.keyframes_from_world.size(), first->final.keyframes_from_world.size());
  const auto known = static_cast<int>(first->final.keyframes_from_world.size());
  size_t of_new_keyframes = 0;
  outcome.final.gaussians.for_each([&](size_t i) { of_new_keyframes += outcome.final.gaussians.anchor(i) >= known; });
  EXPECT_GT(of_new_keyframes, 0u);
  const auto pose = camera_from_world(outcome.frames.back(), outcome.final);
  ASSERT_TRUE(pose.has_value());
  const SE3 error = *pose * CornerSource::camera_from_world(109).inverse();
  EXPECT_LT(error.translation.norm(), 0.05);
  EXPECT_GT(read_session(folder / "longer")->size(), bytes->size());
}

/// Its pictures have a row too many from some frame on: tracking does not mind, photorealistic mapping throws.
class TallFrames final : public FrameSource {
 public:
  TallFrames(int num_frames, int first_tall) : first_tall_(first_tall), frames_(num_frames) {}
  const SourceInfo& info() const override { return frames_.info(); }
  std::optional<Frame> next() override {
    std::optional<Frame> frame = frames_.next();
    if (!frame || frame->id.value < first_tall_) return frame;
    ImageU8 tall(frame->color.width(), frame->color.height() + 1, 3);
    std::ranges::copy(frame->color.values(), tall.values().begin());
    frame->color = std::move(tall);
    return frame;
  }

 private:
  int first_tall_;
  CornerSource frames_;
};

TEST_F(SessionTest, OneThatAFailureLeftHalfDoneDoesNotReplaceTheOneBefore) {
  for (const int threads : {1, 2}) {
    const std::filesystem::path file = folder / "before";
    std::filesystem::copy_file(folder / "session.photoslam", file, std::filesystem::copy_options::overwrite_existing);
    RunSettings failing = settings("before");
    failing.threads = threads;
    TallFrames source(60, 3);
    const RunOutcome outcome = run_slam({}, failing, source);
    EXPECT_TRUE(outcome.failure.starts_with("photorealistic mapping: ")) << outcome.failure;
    EXPECT_TRUE(*read_session(file) == *bytes);
    ASSERT_EQ(outcome.messages.size(), 1u);
    EXPECT_THAT(outcome.messages[0], AllOf(StartsWith("session: "), HasSubstr("gaussians half changed"),
                                           HasSubstr(file.string() + " is left as it is"), HasSubstr("--load-map")));
    EXPECT_GT(outcome.final.gaussians.size(), 0u) << "the map itself is not lost";
  }
}

TEST_F(SessionTest, WhatWasSavedInBetweenSurvivesAFailure) {
  for (const double interval : {1e-6, 0.0}) {
    RunSettings failing = settings("in-between");
    failing.threads = 1;
    failing.autosave_s = interval;
    TallFrames source(60, 30);
    const RunOutcome outcome = run_slam({}, failing, source);
    EXPECT_TRUE(outcome.failure.starts_with("photorealistic mapping: ")) << outcome.failure;
    ASSERT_EQ(outcome.messages.size(), 1u);
    const std::string file = (folder / "in-between").string();
    if (interval == 0) {
      EXPECT_THAT(outcome.messages[0], HasSubstr(file + " was never written"));
      continue;
    }
    EXPECT_THAT(outcome.messages[0], HasSubstr(file + " is left as it is"));
    RunSettings continuing = settings("");
    continuing.loaded_session = std::make_shared<const std::string>(*read_session(file));
    const RunOutcome continued = run(20, continuing, 20);
    EXPECT_EQ(continued.failure, "");
    EXPECT_TRUE(continued.frames.back().has_pose);
    EXPECT_GT(continued.final.gaussians.size(), 200u);
    std::filesystem::remove(file);
  }
}

TEST_F(SessionTest, ASmallerBudgetOfGaussiansHoldsForTheLoadedMap) {
  const auto budget = static_cast<int>(first->final.gaussians.size() / 2);
  SystemOptions options;
  options.pipeline.iterations_per_frame = 1;
  options.photorealistic_mapping.densification.max_gaussians = budget;
  for (const int num_frames : {0, 20}) {
    CornerSource source(num_frames);
    source.start_at = 50;
    const RunOutcome outcome = run_slam(options, continuing("smaller"), source);
    EXPECT_EQ(outcome.failure, "");
    EXPECT_GT(outcome.final.gaussians.size(), 0u);
    EXPECT_LE(outcome.final.gaussians.size(), static_cast<size_t>(budget)) << num_frames << " frames";
    ASSERT_EQ(outcome.messages.size(), 1u);
    EXPECT_NE(outcome.messages[0].find("max_gaussians"), std::string::npos);
  }
  RunSettings localize = continuing("");
  localize.localize_only = true;
  CornerSource source(12);
  EXPECT_EQ(run_slam(options, localize, source).final.gaussians.size(), first->final.gaussians.size())
      << "it is left as it is";
}

TEST_F(SessionTest, AnAdjustmentThatIsDueIsMadeWhenItIsContinued) {
  LoadedSession parts({}, *bytes);
  EXPECT_FALSE(parts.geometry.snapshot()->adjustment_is_due);
  EXPECT_EQ(parts.header.num_settled, static_cast<int>(parts.mapper.num_keyframes()));
  const auto map = parts.geometry.correct({.adjustment_is_due = true});
  parts.mapper.update_poses(*map);
  Archive due;
  due(parts.header, parts.geometry, parts.mapper);

  RunSettings at_once = settings("adjusted");
  at_once.deterministic = false;
  at_once.loaded_session = std::make_shared<const std::string>(due.bytes());
  for (const bool localize_only : {true, false}) {
    at_once.localize_only = localize_only;
    EXPECT_EQ(run(0, at_once).failure, "");
    EXPECT_EQ(std::filesystem::exists(folder / "adjusted"), !localize_only);
  }
  LoadedSession adjusted({}, *read_session(folder / "adjusted"));
  EXPECT_FALSE(adjusted.geometry.snapshot()->adjustment_is_due);
  EXPECT_EQ(adjusted.geometry.snapshot()->num_corrections, map->num_corrections + 1);
}

/// What training makes of it.
GaussianTable trained(PhotorealisticMapper& mapper) {
  ThreadPool executor{2};
  for (int i = 0; i < 30; ++i) mapper.train(std::nullopt, executor);
  const FrozenMap map = mapper.freeze();
  return to_world(map.gaussians, map.anchors_from_world);
}

TEST_F(SessionTest, PicturesKeepTheirMaskAndTheirUnitOfDepth) {
  CornerSource pairs(20, 240, 180, SensorKind::stereo);  // whose lenses do not see the rectified corners
  ASSERT_EQ(run_slam({}, settings("pairs"), pairs).failure, "");
  for (const std::string& session : {*bytes, *read_session(folder / "pairs")}) {
    LoadedSession same({}, session), other({}, session);
    MapperSensor sensor = same.header.sensor;
    sensor.metres_per_depth_unit *= 2;
    const bool was_masked = !sensor.mask.empty();
    EXPECT_EQ(was_masked, sensor.stereo_baseline_m > 0);
    sensor.mask = was_masked ? ImageU8() : ImageU8(sensor.camera.width, sensor.camera.height, 1);
    PhotorealisticMapper elsewhere({}, sensor, 1), again({}, sensor, 1);
    Archive reader(session);
    reader(other.header, other.geometry, elsewhere);
    // Also when the other sensor's mapper has written it.
    Archive saved;
    saved(elsewhere);
    Archive(saved.bytes())(again);

    const GaussianTable expected = trained(same.mapper);
    ASSERT_GT(expected.size(), 0u);
    for (PhotorealisticMapper* mapper : {&elsewhere, &again}) {
      const GaussianTable found = trained(*mapper);
      ASSERT_EQ(found.size(), expected.size());
      for (size_t i = 0; i < found.size(); ++i) ASSERT_TRUE(std::ranges::equal(found.row(i), expected.row(i))) << i;
    }
  }
}

TEST_F(SessionTest, TellsWhichOptionsDifferFromThoseItWasMadeWith) {
  SystemOptions options;
  options.pipeline.iterations_per_frame = 1;
  SessionHeader header = session_header(*bytes);
  EXPECT_TRUE(describe_changed_options(header, options).empty());
  options.localization.min_inliers = 33;
  options.features.num_levels = 5;
  header.configuration += "[retired]\nstep = 0.5\n";
  EXPECT_THAT(describe_changed_options(header, options),
              UnorderedElementsAre(AllOf(StartsWith("localization.min_inliers = 33 applies"), EndsWith("had 20")),
                                   AllOf(StartsWith("features.num_levels = 5 applies"), HasSubstr("had 8; landmarks")),
                                   AllOf(StartsWith("retired.step = 0.5 in the session"), EndsWith("ignored"))));
  header.configuration = "no [ TOML";
  EXPECT_THAT(describe_changed_options(header, options), ElementsAre(HasSubstr("cannot be compared")));
}

TEST_F(SessionTest, IsThereBeforeTrainingBegins) {
  RunSettings at_once = continuing("");
  at_once.deterministic = false;
  at_once.pace = Pace::asap;
  for (int i = 0; i < 10; ++i) {
    const RunOutcome outcome = run(3, at_once, 20);
    EXPECT_EQ(outcome.failure, "");
    EXPECT_GE(outcome.final.keyframes_from_world.size(), first->final.keyframes_from_world.size());
  }
}

TEST_F(SessionTest, AnotherCameraIsRefused) {
  const SessionHeader header = session_header(*bytes);
  EXPECT_TRUE(check_session_sensor(header, header.sensor.camera, header.bf));
  EXPECT_NE(header.configuration.find("[localization"), std::string::npos);
  PinholeCamera other = header.sensor.camera;
  other.fx *= 1.01;
  const Status status = check_session_sensor(header, other, header.bf);
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message.find("same camera"), std::string::npos);
}

TEST_F(SessionTest, AnotherMeasureOfDepthIsRefused) {
  CornerSource same(3), mono(3, 240, 180, SensorKind::mono);
  EXPECT_TRUE(check_session(*bytes, {}, same.info()));
  const auto message = [](const SystemOptions& options, const SourceInfo& info) {
    const Status status = check_session(*bytes, options, info);
    return status ? std::string() : status.error().message;
  };
  EXPECT_NE(message({}, mono.info()).find("this sensor measures none"), std::string::npos);
  SystemOptions other_unit;
  other_unit.depth.virtual_baseline_m *= 2;
  EXPECT_NE(message(other_unit, same.info()).find("virtual_baseline_m"), std::string::npos);
  // Nothing runs, so that nothing is overwritten.
  RunSettings wrong = continuing("never-written");
  EXPECT_THROW(run_slam({}, wrong, mono), CheckError);
  EXPECT_FALSE(std::filesystem::exists(folder / "never-written"));
}

}  // namespace
}  // namespace photoslam
