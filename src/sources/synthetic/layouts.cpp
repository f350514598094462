// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/layouts.h"

#include <nlohmann/json.hpp>

#include "base/file.h"
#include "io/image_file.h"
#include "sources/calibration/coefficients.h"
#include "sources/camera_file.h"

namespace photoslam::synthetic {
namespace {

namespace fs = std::filesystem;

constexpr int kJpegQuality = 95;
constexpr int kPngCompression = 1;  // noise does not compress anyway

Status write_color(const fs::path& path, const ImageU8& image) {
  return path.extension() == ".png" ? write_png(path, image, kPngCompression) : write_jpeg(path, image, kJpegQuality);
}

Status prepare_all(const fs::path& folder, const std::vector<const char*>& parts) {
  for (const char* part : parts) {
    if (Status status = prepare_output_folder(folder / part); !status) return status;
  }
  return {};
}

struct TextFile {
  const char* name;
  const std::string& content;
};

Status write_all(const fs::path& folder, const std::vector<TextFile>& files) {
  for (const TextFile& file : files) {
    if (Status status = write_file_atomically(folder / file.name, file.content); !status) return status;
  }
  return {};
}

class TumLayout final : public LayoutWriter {
 public:
  TumLayout(const SyntheticCamera& camera, bool lossless, fs::path folder)
      : camera_(camera), lossless_(lossless), folder_(std::move(folder)) {}

  Status prepare() const override {
    return prepare_all(folder_, depth() ? std::vector{"rgb", "depth"} : std::vector{"rgb"});
  }

  Status write_frame(const Frame& frame) const override {
    const Status written = write_color(folder_ / color_name(frame.id.value), frame.color);
    if (!written || !depth()) return written;
    return write_png(folder_ / depth_name(frame.id.value), frame.depth, kPngCompression);
  }

  Status write_description() const override {
    std::string colors = "# timestamp filename\n", depths = colors, pairs,
                truth = "# timestamp tx ty tz qx qy qz qw (world_from_camera)\n";
    for (int i = 0; i < camera_.options().num_frames; ++i) {
      colors += fmt::format("{} {}\n", time(i), color_name(i));
      depths += fmt::format("{} {}\n", time(i), depth_name(i));
      pairs += fmt::format("{0} {1} {0} {2}\n", time(i), color_name(i), depth_name(i));
      const SE3 pose = camera_.world_from_camera(i);
      const Vec3& t = pose.translation;
      const Quat& q = pose.rotation;
      truth += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", time(i), t.x(), t.y(), t.z(), q.x(),
                           q.y(), q.z(), q.w());
    }
    CameraFile camera = {.camera = camera_.options().camera, .distortion = camera_.options().distortion};
    camera.frames_per_second = camera_.options().frames_per_second;
    if (depth()) camera.depth_scale = 1 / metres_per_depth_unit();
    const std::string calibration = camera_yaml(camera);
    std::vector<TextFile> files = {{"rgb.txt", colors}, {"groundtruth.txt", truth}, {"camera.yaml", calibration}};
    if (depth()) {
      files.push_back({"depth.txt", depths});
      files.push_back({"associations.txt", pairs});
    }
    return write_all(folder_, files);
  }

 private:
  bool depth() const { return camera_.options().sensor == SensorKind::rgbd; }
  std::string time(int index) const { return format_seconds(camera_.timestamp_ns(index)); }
  std::string color_name(int index) const { return fmt::format("rgb/{}.{}", time(index), lossless_ ? "png" : "jpg"); }
  std::string depth_name(int index) const { return fmt::format("depth/{}.png", time(index)); }

  const SyntheticCamera& camera_;
  bool lossless_;
  fs::path folder_;
};

class ReplicaLayout final : public LayoutWriter {
 public:
  ReplicaLayout(const SyntheticCamera& camera, fs::path folder) : camera_(camera), folder_(std::move(folder)) {}

  double metres_per_depth_unit() const override { return 1 / kUnitsPerMetre; }
  Status prepare() const override { return prepare_all(folder_, {"results"}); }

  Status write_frame(const Frame& frame) const override {
    const fs::path results = folder_ / "results";
    const Status written = write_color(results / fmt::format("frame{:06}.jpg", frame.id.value), frame.color);
    if (!written) return written;
    return write_png(results / fmt::format("depth{:06}.png", frame.id.value), frame.depth, kPngCompression);
  }

  Status write_description() const override {
    std::string poses;
    for (int i = 0; i < camera_.options().num_frames; ++i) {
      const Eigen::Matrix4d m = camera_.world_from_camera(i).matrix();
      for (int k = 0; k < 16; ++k) poses += fmt::format("{:.12e}{}", m(k / 4, k % 4), k < 15 ? ' ' : '\n');
    }
    const PinholeCamera& c = camera_.options().camera;
    const nlohmann::json calibration = {{"camera",
                                         {{"w", c.width},
                                          {"h", c.height},
                                          {"fx", c.fx},
                                          {"fy", c.fy},
                                          {"cx", c.cx},
                                          {"cy", c.cy},
                                          {"scale", kUnitsPerMetre}}}};
    return write_all(folder_, {{"traj.txt", poses}, {"cam_params.json", calibration.dump(2) + "\n"}});
  }

 private:
  static constexpr double kUnitsPerMetre = 6553.5;
  const SyntheticCamera& camera_;
  fs::path folder_;
};

class EurocLayout final : public LayoutWriter {
 public:
  EurocLayout(const SyntheticCamera& camera, bool lossless, const fs::path& folder)
      : camera_(camera), lossless_(lossless), folder_(folder / "mav0") {}

  Status prepare() const override {
    std::vector<const char*> parts = {"cam0/data", "state_groundtruth_estimate0"};
    if (stereo()) parts.push_back("cam1/data");
    return prepare_all(folder_, parts);
  }

  Status write_frame(const Frame& frame) const override {
    const std::string name = file_name(frame.id.value);
    const Status written = write_color(folder_ / "cam0/data" / name, frame.color);
    if (!written || !stereo()) return written;
    return write_color(folder_ / "cam1/data" / name, frame.right);
  }

  Status write_description() const override {
    std::string list = "#timestamp [ns],filename\n";
    std::string truth =
        "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n";
    const SE3 camera_from_body = body_from_left().inverse();
    for (int i = 0; i < camera_.options().num_frames; ++i) {
      list += fmt::format("{},{}\n", time(i), file_name(i));
      const SE3 body = camera_.world_from_camera(i) * camera_from_body;
      const Vec3& t = body.translation;
      const Quat& q = body.rotation;
      truth += fmt::format("{},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}\n", time(i), t.x(), t.y(), t.z(), q.w(),
                           q.x(), q.y(), q.z());
    }
    const SyntheticOptions& o = camera_.options();
    const std::string left = sensor_yaml(o.camera, o.distortion, body_from_left());
    const RightCamera rig = right_camera(o);
    const std::string right = sensor_yaml(rig.camera, rig.distortion, body_from_left() * rig.right_from_left.inverse());
    std::vector<TextFile> files = {
        {"cam0/data.csv", list}, {"cam0/sensor.yaml", left}, {"state_groundtruth_estimate0/data.csv", truth}};
    if (stereo()) {
      files.push_back({"cam1/data.csv", list});
      files.push_back({"cam1/sensor.yaml", right});
    }
    return write_all(folder_, files);
  }

 private:
  bool stereo() const { return camera_.options().sensor == SensorKind::stereo; }
  int64_t time(int index) const { return camera_.timestamp_ns(index); }
  std::string file_name(int index) const { return fmt::format("{:019}.{}", time(index), lossless_ ? "png" : "jpg"); }

  /// The body looks along its x axis with z up, a little behind and below the camera.
  static SE3 body_from_left() {
    Mat3 axes;
    axes << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    return {Quat(axes), Vec3(0.07, 0.05, 0.03)};
  }

  std::string sensor_yaml(const PinholeCamera& c, const Distortion& d, const SE3& body_from_camera) const {
    std::string pose;
    const Eigen::Matrix4d m = body_from_camera.matrix();
    for (int k = 0; k < 16; ++k) pose += fmt::format("{:.12f}{}", m(k / 4, k % 4), k < 15 ? ", " : "");
    return fmt::format(
        "sensor_type: camera\ncomment: synthetic\nT_BS:\n  cols: 4\n  rows: 4\n  data: [{}]\nrate_hz: {}\n"
        "resolution: [{}, {}]\ncamera_model: pinhole\nintrinsics: [{}, {}, {}, {}] #fu, fv, cu, cv\n"
        "distortion_model: {}\ndistortion_coefficients: [{}]\n",
        pose, camera_.options().frames_per_second, c.width, c.height, c.fx, c.fy, c.cx, c.cy,
        d.model == LensModel::kannala_brandt ? "equidistant" : "radial-tangential", coefficients_text(d));
  }

  const SyntheticCamera& camera_;
  bool lossless_;
  fs::path folder_;
};

class KittiLayout final : public LayoutWriter {
 public:
  KittiLayout(const SyntheticCamera& camera, const fs::path& folder)
      : camera_(camera), folder_(folder), sequence_(folder / "sequences/00") {}

  Status prepare() const override {
    std::vector<const char*> parts = {"poses", "sequences/00/image_2"};
    if (stereo()) parts.push_back("sequences/00/image_3");
    return prepare_all(folder_, parts);
  }

  Status write_frame(const Frame& frame) const override {
    const std::string name = fmt::format("{:06}.png", frame.id.value);
    const Status written = write_color(sequence_ / "image_2" / name, frame.color);
    if (!written || !stereo()) return written;
    return write_color(sequence_ / "image_3" / name, frame.right);
  }

  Status write_description() const override {
    std::string times, poses, calibration;
    for (int i = 0; i < camera_.options().num_frames; ++i) {
      times += format_seconds(camera_.timestamp_ns(i)) + "\n";
      const Eigen::Matrix4d m = camera_.world_from_camera(i).matrix();
      for (int k = 0; k < 12; ++k) poses += fmt::format("{:.12e}{}", m(k / 4, k % 4), k < 11 ? ' ' : '\n');
    }
    const PinholeCamera& c = camera_.options().camera;
    // Camera 2 stands where camera 0 would: the poses are its own.
    for (int camera = 0; camera < 4; ++camera) {
      const double shift = camera % 2 == 1 ? -c.fx * camera_.options().baseline_m : 0;
      calibration += fmt::format("P{}: {:.12e} 0 {:.12e} {:.12e} 0 {:.12e} {:.12e} 0 0 0 1 0\n", camera, c.fx, c.cx,
                                 shift, c.fy, c.cy);
    }
    return write_all(
        folder_, {{"sequences/00/times.txt", times}, {"sequences/00/calib.txt", calibration}, {"poses/00.txt", poses}});
  }

 private:
  bool stereo() const { return camera_.options().sensor == SensorKind::stereo; }

  const SyntheticCamera& camera_;
  fs::path folder_, sequence_;
};

}  // namespace

std::unique_ptr<const LayoutWriter> make_layout(const SyntheticCamera& camera, const SequenceSettings& settings,
                                                const fs::path& folder) {
  switch (settings.layout) {
    case SequenceLayout::tum:
      return std::make_unique<TumLayout>(camera, settings.lossless_color, folder);
    case SequenceLayout::replica:
      return std::make_unique<ReplicaLayout>(camera, folder);
    case SequenceLayout::euroc:
      return std::make_unique<EurocLayout>(camera, settings.lossless_color, folder);
    case SequenceLayout::kitti:
      return std::make_unique<KittiLayout>(camera, folder);
  }
  return nullptr;
}

}  // namespace photoslam::synthetic
