// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/mapping_queue.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <semaphore>

#include "pipeline/session_file.h"
#include "pipeline/system.h"
#include "pipeline/testing/corner_source.h"
#include "splatting/cuda/engine.h"
#include "splatting/cuda/host_device.h"
#include "splatting/gpu.h"

namespace photoslam {
namespace {

using testing::CornerSource;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A queue that nobody empties, of keyframes with pictures of 0.1 MB each.
struct Waiting {
  explicit Waiting(double limit_mb) : limit(limit_mb) {}

  void post(MapUpdate update) {
    const MappingMessage message{.update = std::move(update)};
    limit.make_way(message, queue);
    queue.push_back(message);
  }
  /// The next keyframe, in a map of its own.
  void post_keyframe() {
    const KeyframeId id(static_cast<int32_t>(newest->keyframes.size()));
    auto map = std::make_shared<MapSnapshot>(*newest);
    map->keyframes.push_back(std::make_shared<KeyframeView>());
    newest = map;
    auto images = std::make_shared<KeyframeImages>(ImageU8(100, 100, 3), ImageU16(100, 200), ImageU8(100, 300));
    post({newest, id, std::move(images), nullptr});
  }
  void post_poses() {
    newest = std::make_shared<MapSnapshot>(*newest);
    post({newest, {}, nullptr, nullptr});
  }
  void post_session() { post({nullptr, {}, nullptr, std::make_shared<Archive>()}); }
  void cull(KeyframeId id) {
    auto map = std::make_shared<MapSnapshot>(*newest);
    auto culled = std::make_shared<KeyframeView>();
    culled->keyframe.culled = true;
    map->keyframes[static_cast<size_t>(id.value)] = culled;
    newest = map;
  }

  std::vector<int> with_pictures() const {
    std::vector<int> ids;
    for (const MappingMessage& message : queue) {
      if (message.update.images) ids.push_back(message.update.keyframe.value);
    }
    return ids;
  }

  MappingQueueLimit limit;
  std::deque<MappingMessage> queue;
  std::shared_ptr<const MapSnapshot> newest = std::make_shared<MapSnapshot>();
};

TEST(MappingQueueLimit, PicturesStayWithinItAndAreMissedNowhereForLong) {
  Waiting waiting(1.0);
  for (int posted = 1; posted <= 200; ++posted) {
    waiting.post_keyframe();
    ASSERT_EQ(waiting.queue.size(), static_cast<size_t>(posted)) << "no keyframe is lost";
    const std::vector<int> kept = waiting.with_pictures();
    ASSERT_EQ(kept.size(), static_cast<size_t>(std::min(posted, 10))) << "10 * 0.1 MB";
    EXPECT_EQ(kept.front(), 0);
    EXPECT_EQ(kept.back(), posted - 1);
    // Nine holes cannot all be smaller than their mean.
    const int best = (posted - 1 + 8) / 9;
    for (size_t i = 1; i < kept.size(); ++i) EXPECT_LE(kept[i] - kept[i - 1], 2 * best) << posted;
  }
  EXPECT_EQ(waiting.limit.num_without_pictures(), 190);
}

TEST(MappingQueueLimit, EverySecondKeyframeLosesItsPicturesFirst) {
  Waiting waiting(0.5);
  for (int i = 0; i < 8; ++i) waiting.post_keyframe();
  EXPECT_THAT(waiting.with_pictures(), ElementsAre(0, 2, 4, 6, 7));
}

TEST(MappingQueueLimit, ThePicturesOfOneKeyframeAlwaysFit) {
  Waiting waiting(0.05);
  for (int i = 0; i < 4; ++i) {
    waiting.post_keyframe();
    EXPECT_THAT(waiting.with_pictures(), ElementsAre(i));
  }
}

TEST(MappingQueueLimit, KeyframesThatOthersMadeRedundantNeedNone) {
  Waiting waiting(1.0);
  for (int i = 0; i < 4; ++i) waiting.post_keyframe();
  waiting.cull(KeyframeId(2));
  waiting.post_keyframe();
  EXPECT_THAT(waiting.with_pictures(), ElementsAre(0, 1, 3, 4));
  EXPECT_EQ(waiting.limit.num_without_pictures(), 0);
}

TEST(MappingQueueLimit, OldMapsAreForgottenButNotThatOfASession) {
  Waiting waiting(1.0);
  waiting.post_keyframe();
  waiting.post_keyframe();
  const auto saved = waiting.newest;
  waiting.post_session();
  waiting.post_keyframe();
  waiting.post_keyframe();
  ASSERT_EQ(waiting.queue.size(), 5u);
  EXPECT_EQ(waiting.queue[0].update.map, saved);
  EXPECT_EQ(waiting.queue[1].update.map, saved);
  EXPECT_EQ(waiting.queue[3].update.map, waiting.newest);
  EXPECT_EQ(waiting.queue[4].update.map, waiting.newest);
}

TEST(MappingQueueLimit, OnlyPosesAreReplacedByNewerOnes) {
  Waiting waiting(1.0);
  waiting.post_keyframe();
  waiting.post_poses();
  EXPECT_EQ(waiting.queue.size(), 2u) << "a keyframe is not replaced";
  waiting.post_poses();
  EXPECT_EQ(waiting.queue.size(), 2u);
  waiting.post_keyframe();
  EXPECT_EQ(waiting.queue.size(), 2u) << "it brings all poses as well";
  waiting.post_poses();
  waiting.post_session();
  EXPECT_EQ(waiting.queue.size(), 4u) << "what is saved with them has them";
  waiting.post_poses();
  EXPECT_EQ(waiting.queue.size(), 5u) << "a session is not replaced";
  waiting.queue.back().iterations = 1;
  waiting.post_poses();
  EXPECT_EQ(waiting.queue.size(), 6u) << "nor is training";
}

/// While every frame arrives, photorealistic mapping hangs in its first keyframe.
class StuckMapper {
 public:
  StuckMapper() {
    using splatting::cuda::HostDevice;
    // The "GPU" answers when the input has ended, and then is lost: the CPU takes over.
    faults_.lost = [this] {
      input_ended_.acquire();
      return true;
    };
    settings.gpu = std::make_shared<splatting::Gpu>(
        std::make_unique<splatting::cuda::Engine<HostDevice>>(
            HostDevice(splatting::cuda::ThreadOrder::forwards, &faults_), uint64_t{1} << 30),
        "host");
    settings.threads = 2;
    // Keyframes as close as they may be, and all of them stay.
    options.localization.keyframes.min_interval_s = 0;
    options.localization.keyframes.max_rotation_deg = 1;
    options.localization.keyframes.max_translation = 0.01;
    options.geometry_mapping.keyframe_culling.enabled = false;
  }
  RunOutcome run(CornerSource source) {
    return run_slam(options, settings, source, {}, [this](const Progress& progress) {
      if (progress.phase == Progress::Phase::draining) input_ended_.release();
    });
  }

  SystemOptions options;
  RunSettings settings;

 private:
  std::binary_semaphore input_ended_{0};
  splatting::cuda::HostFaults faults_;
};

TEST(SlowMapping, TakesLittleMemoryAndLosesNoKeyframe) {
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("photoslam-slow-{}", ::getpid());
  std::filesystem::create_directories(folder);
  StuckMapper stuck;
  stuck.settings.session_file = folder / "session.photoslam";
  stuck.options.pipeline.waiting_pictures_mb = 1;
  const RunOutcome outcome = stuck.run(CornerSource(60));  // 240x180 with depth: 0.216 MB each
  EXPECT_EQ(outcome.failure, "");
  int keyframes = 0;
  for (const FrameOutcome& frame : outcome.frames) {
    EXPECT_TRUE(frame.has_pose || frame.dropped) << frame.frame.value << ": " << frame.reason;
    keyframes += frame.keyframe.valid();
  }
  ASSERT_GE(keyframes, 10);
  EXPECT_EQ(outcome.final.keyframes_from_world.size(), static_cast<size_t>(keyframes));
  EXPECT_GE(outcome.keyframes_without_pictures, keyframes - 5) << "four may wait, and one is being handled";
  EXPECT_LT(outcome.keyframes_without_pictures, keyframes);
  EXPECT_GT(outcome.final.gaussians.size(), 200u);
  ASSERT_EQ(outcome.messages.size(), 1u);
  EXPECT_THAT(outcome.messages[0], HasSubstr("pipeline.waiting_pictures_mb"));

  RunSettings continuing;
  continuing.deterministic = true;
  continuing.loaded_session = std::make_shared<const std::string>(*read_session(folder));
  CornerSource source(30);
  source.start_at = 50;
  const RunOutcome continued = run_slam(stuck.options, continuing, source);
  EXPECT_EQ(continued.failure, "");
  EXPECT_TRUE(continued.frames.back().has_pose) << continued.frames.back().reason;
  EXPECT_GT(continued.final.keyframes_from_world.size(), static_cast<size_t>(keyframes));
  std::filesystem::remove_all(folder);
}

TEST(SlowMapping, KeepsAllPicturesThatFit) {
  StuckMapper stuck;
  const RunOutcome outcome = stuck.run(CornerSource(20));
  EXPECT_EQ(outcome.failure, "");
  EXPECT_EQ(outcome.keyframes_without_pictures, 0);
  EXPECT_TRUE(outcome.messages.empty());
}

}  // namespace
}  // namespace photoslam
