// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/autosave.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>

#include "base/file.h"
#include "pipeline/session_file.h"
#include "pipeline/system.h"
#include "pipeline/testing/corner_source.h"

namespace photoslam {
namespace {

using testing::CornerSource;
using ::testing::HasSubstr;

/// A camera that walks and then stands still until the run is stopped.
class RestingCamera final : public FrameSource {
 public:
  explicit RestingCamera(int walk) : walk_(walk), camera_(walk) {}
  const SourceInfo& info() const override { return camera_.info(); }
  std::optional<Frame> next() override {
    if (next_ < walk_) last_ = *camera_.next();
    last_.id = FrameId(next_);
    last_.timestamp_ns = static_cast<int64_t>(next_++) * 1'000'000'000 / 30;
    return last_;
  }

 private:
  int walk_;
  int next_ = 0;
  CornerSource camera_;
  Frame last_;
};

class AutosaveTest : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder); }
  void TearDown() override { std::filesystem::remove_all(folder); }

  RunSettings settings() const {
    RunSettings result;
    result.threads = 2;
    result.session_file = folder / "session.photoslam";
    result.autosave_s = 0.05;
    return result;
  }
  /// The session that is on disk, if there is one; it is deleted, so that the next one is a new one.
  std::shared_ptr<const std::string> take_session() const {
    const std::filesystem::path file = folder / "session.photoslam";
    if (!std::filesystem::exists(file)) return nullptr;
    auto session = read_session(file);
    EXPECT_TRUE(session) << session.error().message;
    std::filesystem::remove(file);
    return std::make_shared<const std::string>(std::move(*session));
  }
  /// What is in a session: it is loaded, and nothing is added.
  static RunOutcome content(std::shared_ptr<const std::string> session) {
    RunSettings settings;
    settings.deterministic = true;
    settings.loaded_session = std::move(session);
    settings.localize_only = true;
    CornerSource source(12);
    return run_slam({}, settings, source);
  }
  static RunOutcome run(const RunSettings& settings, FrameSource& source,
                        const std::function<bool(const Progress&)>& go_on) {
    std::stop_source stop;
    return run_slam({}, settings, source, stop.get_token(), [&](const Progress& progress) {
      if (!go_on(progress)) stop.request_stop();
    });
  }

  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("photoslam-autosave-{}", ::getpid());
};

TEST_F(AutosaveTest, IsDueOncePerInterval) {
  Autosave never(0), often(1e-9);
  EXPECT_FALSE(never.begin());
  EXPECT_TRUE(often.begin());
  EXPECT_FALSE(often.begin()) << "the first one has not ended";
  often.ended();
  EXPECT_TRUE(often.begin());
  EXPECT_TRUE(often.take_failures().empty());
  often.ended(error("the disk is full"));
  often.begin();
  often.ended(error("the disk is full"));
  const auto failures = often.take_failures();
  ASSERT_EQ(failures.size(), 2u);
  EXPECT_THAT(failures[0], HasSubstr("the disk is full"));
  EXPECT_TRUE(often.take_failures().empty());
  Autosave rarely(1000);
  EXPECT_FALSE(rarely.begin()) << "nothing is worth saving at the start";
}

TEST_F(AutosaveTest, SavesWithTheCameraAtRest) {
  RestingCamera camera(8);
  int keyframes = 0, saved = 0;
  std::shared_ptr<const std::string> newest;
  const RunOutcome outcome = run(settings(), camera, [&](const Progress& progress) {
    const bool resting = progress.frames > 40;
    if (auto session = take_session(); session && resting && progress.keyframes == keyframes) {
      newest = session;
      ++saved;
    }
    keyframes = progress.keyframes;
    return saved < 4 && progress.frames < 1000;
  });
  EXPECT_EQ(outcome.failure, "");
  ASSERT_GE(saved, 4) << "one more may end with the run";
  const RunOutcome loaded = content(newest);
  EXPECT_EQ(loaded.final.keyframes_from_world.size(), outcome.final.keyframes_from_world.size());
  EXPECT_GT(loaded.final.gaussians.size(), 200u);
  EXPECT_TRUE(loaded.frames.back().has_pose);
}

TEST_F(AutosaveTest, SavesWhatRefinementHasComeTo) {
  RunSettings refining = settings();
  refining.pace = Pace::asap;
  refining.refine_seconds = 1000;
  CornerSource source(12);
  std::shared_ptr<const std::string> first, last;
  run(refining, source, [&](const Progress& progress) {
    auto session = take_session();
    if (progress.phase != Progress::Phase::refining || !session) return true;
    if (!first) {
      first = session;
    } else {
      last = session;
    }
    return !last;
  });
  ASSERT_TRUE(first && last);
  const FrozenMap a = content(first).final, b = content(last).final;
  ASSERT_EQ(a.keyframes_from_world.size(), b.keyframes_from_world.size());
  EXPECT_NE(*first, *last) << "it went on";
  EXPECT_NE(a.gaussians.get(0).opacity_logit, b.gaussians.get(0).opacity_logit);
}

TEST_F(AutosaveTest, LeavesADeterministicRunAsItIs) {
  std::string expected;
  for (const int threads : {1, 2}) {
    for (const double interval : {0.0, 1e-6}) {
      RunSettings deterministic = settings();
      deterministic.deterministic = true;
      deterministic.threads = threads;
      deterministic.autosave_s = interval;
      deterministic.refine_iterations = 10;
      CornerSource source(20);
      int saved = 0;
      run_slam({}, deterministic, source, {}, [&](const Progress& progress) {
        const auto session = take_session();
        if (!session) return;
        ++saved;
        if (threads == 1 && progress.frames == 15) {
          EXPECT_GT(content(session).final.keyframes_from_world.size(), 0u);
        }
      });
      // With threads the run may end before the first report.
      if (threads == 1) {
        EXPECT_EQ(saved > 0, interval > 0);
      }
      const std::string bytes = *take_session();
      if (expected.empty()) expected = bytes;
      EXPECT_TRUE(bytes == expected) << threads << " threads, every " << interval << " s";
    }
  }
}

TEST_F(AutosaveTest, AFailureIsToldAndTheRunGoesOn) {
  RunSettings blocked = settings();
  blocked.session_file = folder / "plugged" / "session.photoslam";
  ASSERT_TRUE(write_file_atomically(folder / "plugged", std::string_view("a file where a folder should be")));
  RestingCamera camera(8);
  std::vector<std::string> messages;
  const RunOutcome outcome = run(blocked, camera, [&](const Progress& progress) {
    messages.insert(messages.end(), progress.messages.begin(), progress.messages.end());
    if (messages.size() >= 2 && std::filesystem::is_regular_file(folder / "plugged")) {
      std::filesystem::remove(folder / "plugged");
      std::filesystem::create_directory(folder / "plugged");
    }
    return !std::filesystem::exists(blocked.session_file) && progress.frames < 1000;
  });
  ASSERT_GE(messages.size(), 2u);
  for (const std::string& message : messages) {
    EXPECT_THAT(message, HasSubstr((folder / "plugged" / "session.photoslam").string()));
    EXPECT_THAT(message, HasSubstr("Not a directory"));
  }
  EXPECT_EQ(outcome.failure, "");
  EXPECT_TRUE(read_session(folder / "plugged")) << "the save at the end";
}

}  // namespace
}  // namespace photoslam
