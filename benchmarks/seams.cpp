// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
//
// Seams: what a loop does to the picture. Usage: seams SESSION OUTPUT [key=value...]
//
// SESSION is that of a run whose loop was left open (--set loop_closure.enabled=false). The loop is closed in it, and
// the keyframes where that leaves seams are rendered before, right after, with the gaussians left where they were in
// the world instead of carried along, and while training goes on. Writes pictures of the keyframe that closed the loop.
#include "photorealistic_mapping/seams.h"

#include <fmt/format.h>

#include "base/clock.h"
#include "evaluation/image_score.h"
#include "image/convert.h"
#include "io/image_file.h"
#include "photorealistic_mapping/view_geometry.h"
#include "pipeline/config.h"
#include "pipeline/session_file.h"
#include "pipeline/system_options.h"

namespace photoslam {
namespace {

/// A loop that was left open, and how the map looks from the keyframes around it.
class OpenLoop {
 public:
  OpenLoop(const SystemOptions& options, const std::string& session)
      : options_(options),
        header_(session_header(session)),
        geometry_(options.geometry_mapping, options.features, header_.sensor.camera, header_.bf),
        mapper_(options.photorealistic_mapping, header_.sensor, 1) {
    Archive reader(session);
    reader(header_, geometry_, mapper_);
  }

  Status measure(const std::filesystem::path& output);

 private:
  /// Mean PSNR over the keyframes at seams.
  double psnr_db() {
    std::vector<FrameScore> scores;
    for (const int view : seams_) {
      const KeyframeComparison pair = mapper_.compare(static_cast<size_t>(view), executor_);
      scores.push_back(score_frame(FrameId(view), 0, to_float(pair.render), pair.picture));
    }
    return summarize(scores).psnr_db.value_or(0);
  }
  ImageU8 render(const FrozenMap& map, const SE3& camera_from_world) {
    std::vector<splatting::Pose> camera_from_anchor;
    camera_from_anchors(camera_from_world, map.anchors_from_world, camera_from_anchor);
    splatting::RenderResult result;
    const splatting::Camera camera = to_splatting(shrink(header_.sensor.camera, 2));
    splatting::Renderer().render(map.gaussians, {camera, camera_from_anchor}, {}, executor_, result);
    return to_u8(to_image(result));
  }

  SystemOptions options_;
  SessionHeader header_;
  GeometryMapper geometry_;
  PhotorealisticMapper mapper_;
  std::vector<int> seams_;
  ThreadPool executor_{1};
};

Status OpenLoop::measure(const std::filesystem::path& output) {
  std::filesystem::create_directories(output);
  auto map = geometry_.snapshot();
  std::vector<Sim3> before;
  for (const auto& view : map->keyframes) {
    before.push_back(anchor_from_world(view->keyframe.camera_from_world, view->keyframe.scale));
  }
  LoopCloser closer(options_.loop_closure, options_.features, header_.sensor.camera, header_.bf);
  while (const auto correction = closer.process(*map)) map = geometry_.correct(*correction);
  if (closer.loops().empty()) return error("no loop was found");
  seams_ = find_seams(options_.photorealistic_mapping.schedule.seam_px, header_.sensor.camera, *map, before);
  std::erase_if(seams_, [&](int view) { return map->keyframe(KeyframeId(view)).keyframe.culled; });  // no picture
  const auto closing = static_cast<size_t>(closer.loops().front().now.value);

  const FrozenMap open = mapper_.freeze();
  const ImageU8 picture = mapper_.compare(closing, executor_).picture,
                seen_open = mapper_.compare(closing, executor_).render;
  fmt::print("{} keyframes, {} at seams, {} gaussians; keyframe {} closed a loop\n", mapper_.num_keyframes(),
             seams_.size(), mapper_.gaussians().size(), closing);
  fmt::print("open            {:.2f} dB\n", psnr_db());
  mapper_.update_poses(*map);
  fmt::print("right after     {:.2f} dB, {} gaussians\n", psnr_db(), mapper_.gaussians().size());

  const FrozenMap closed = mapper_.freeze();
  std::vector<FrameScore> left_behind;
  for (const int view : seams_) {
    const auto i = static_cast<size_t>(view);
    const ImageU8 image = render(open, closed.keyframes_from_world[i]);
    left_behind.push_back(score_frame(FrameId(view), 0, to_float(image), mapper_.compare(i, executor_).picture));
  }
  fmt::print("not carried     {:.2f} dB\n", summarize(left_behind).psnr_db.value_or(0));
  const ImageU8 seen_left_behind = render(open, closed.keyframes_from_world[closing]),
                seen_closed = mapper_.compare(closing, executor_).render;

  const double start = thread_cpu_seconds();
  int iterations = 0;
  for (const double seconds : {1.0, 2.0, 5.0}) {
    while (thread_cpu_seconds() - start < seconds) {
      mapper_.train(std::nullopt, executor_);
      ++iterations;
    }
    fmt::print("after {:.0f} s       {:.2f} dB, {} iterations, {} gaussians\n", seconds, psnr_db(), iterations,
               mapper_.gaussians().size());
  }
  const std::pair<const char*, const ImageU8*> pictures[] = {
      {"picture", &picture}, {"open", &seen_open}, {"carried", &seen_closed}, {"not_carried", &seen_left_behind}};
  for (const auto& [name, image] : pictures) {
    if (Status status = write_png(output / fmt::format("loop_{}.png", name), *image); !status) return status;
  }
  return write_png(output / "loop_trained.png", mapper_.compare(closing, executor_).render);
}

Status run(int argc, char** argv) {
  if (argc < 3) return error("usage: seams SESSION OUTPUT [key=value...]");
  SystemOptions options;
  for (int i = 3; i < argc; ++i) {
    if (Status status = apply_setting(argv[i], options); !status) return status;
  }
  const auto session = read_session(argv[1]);
  if (!session) return session.error();
  return OpenLoop(options, *session).measure(argv[2]);
}

}  // namespace
}  // namespace photoslam

int main(int argc, char** argv) {
  const photoslam::Status status = photoslam::run(argc, argv);
  if (!status) fmt::print(stderr, "{}\n", status.error().message);
  return status ? 0 : 1;
}
