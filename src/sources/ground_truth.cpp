// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/ground_truth.h"

#include <algorithm>
#include <array>
#include <vector>

#include "base/file.h"
#include "io/text_table.h"
#include "sources/calibration/coefficients.h"
#include "sources/calibration/euroc_sensor.h"
#include "sources/euroc_source.h"
#include "sources/kitti_source.h"
#include "sources/replica_source.h"
#include "sources/timed_list.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

constexpr size_t kReplicaFields = 16;
constexpr size_t kKittiFields = 12;

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

/// The first `count` fields from `first` on, as numbers.
Result<std::vector<double>> parse_numbers(const TextLine& line, size_t first, size_t count) {
  std::vector<double> numbers;
  for (size_t i = first; i < first + count; ++i) {
    const Result<double> number = parse_number(line.fields[i]);
    if (!number) return number.error();
    numbers.push_back(*number);
  }
  return numbers;
}

Result<SE3> parse_matrix(const TextLine& line, size_t count) {
  if (line.fields.size() != count) {
    return error("expected the {} numbers of a pose matrix, found {} fields", count, line.fields.size());
  }
  const auto numbers = parse_numbers(line, 0, count);
  if (!numbers) return numbers.error();
  return rigid_from_rows(*numbers);
}

Result<Trajectory> read_replica_trajectory(const fs::path& path, const std::vector<TextLine>& lines) {
  Trajectory trajectory;
  for (const TextLine& line : lines) {
    const Result<SE3> pose = parse_matrix(line, kReplicaFields);
    if (!pose) return error("{}:{}: {}", path.string(), line.number, pose.error().message);
    trajectory.push_back({internal::replica_time_ns(static_cast<int64_t>(trajectory.size())), *pose});
  }
  return trajectory;
}

/// poses/NN.txt: world_from_cam0; times and the place of the camera come from sequences/NN.
Result<Trajectory> read_kitti_trajectory(const fs::path& path, const std::vector<TextLine>& lines) {
  const fs::path whole = fs::weakly_canonical(path);
  const fs::path folder = whole.parent_path().parent_path() / "sequences" / whole.stem();
  const auto sequence = internal::find_kitti_sequence(folder);
  if (!sequence) return error("{}: the times of these poses are missing: {}", path.string(), sequence.error().message);
  const Result<SE3> camera_from_cam0 = internal::read_kitti_camera_from_cam0(*sequence);
  if (!camera_from_cam0) return camera_from_cam0.error();
  const SE3 cam0_from_camera = camera_from_cam0->inverse();
  std::vector<int64_t> times;
  const Status status = internal::read_timed_list(folder / "times.txt", internal::TimeUnit::seconds, 1, "time",
                                                  [&times](int64_t time, const TextLine&) { times.push_back(time); });
  if (!status) return status.error();
  Trajectory trajectory;
  for (size_t i = 0; i < std::min(lines.size(), times.size()); ++i) {
    const Result<SE3> pose = parse_matrix(lines[i], kKittiFields);
    if (!pose) return error("{}:{}: {}", path.string(), lines[i].number, pose.error().message);
    trajectory.push_back({times[i], *pose * cam0_from_camera});
  }
  return trajectory;
}

/// state_groundtruth_estimate0/data.csv or mocap0/data.csv: time [ns], position, quaternion w x y z of the body. The
/// camera's place on the body comes from cam0/sensor.yaml.
Result<Trajectory> read_euroc_trajectory(const fs::path& path) {
  const fs::path camera = path.parent_path().parent_path() / "cam0" / "sensor.yaml";
  const Result<SE3> body_from_camera = read_body_from_sensor(camera);
  if (!body_from_camera) {
    return error("{}: the camera's place on the body is missing: {}", path.string(), body_from_camera.error().message);
  }
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  Trajectory trajectory;
  for (const TextLine& line : split_table(*content)) {
    const auto fail = [&](const std::string& what) { return error("{}:{}: {}", path.string(), line.number, what); };
    constexpr size_t kPoseFields = 7;
    if (line.fields.size() <= kPoseFields) return fail("expected 'time p_x p_y p_z q_w q_x q_y q_z …'");
    const Result<int64_t> time = internal::parse_time(line.fields[0], internal::TimeUnit::nanoseconds);
    if (!time) return fail(time.error().message);
    const auto v = parse_numbers(line, 1, kPoseFields);
    if (!v) return fail(v.error().message);
    const Quat rotation((*v)[3], (*v)[4], (*v)[5], (*v)[6]);
    if (std::abs(rotation.norm() - 1) > 0.1) return fail("the quaternion's norm is not 1");
    const SE3 world_from_body(rotation.normalized(), Vec3((*v)[0], (*v)[1], (*v)[2]));
    trajectory.push_back({*time, world_from_body * *body_from_camera});
  }
  if (trajectory.empty()) return error("{} holds no poses", path.string());
  std::ranges::stable_sort(trajectory, {}, &StampedPose::timestamp_ns);
  return trajectory;
}

}  // namespace

std::optional<fs::path> find_ground_truth(const fs::path& dataset) {
  std::vector<fs::path> candidates = {dataset / "groundtruth.txt", dataset / "traj.txt"};
  const fs::path whole = fs::weakly_canonical(dataset);
  if (whole.filename() == "results") candidates.push_back(whole.parent_path() / "traj.txt");
  if (const auto folder = internal::find_euroc_folder(dataset)) {
    candidates.push_back(*folder / "state_groundtruth_estimate0" / "data.csv");
    candidates.push_back(*folder / "mocap0" / "data.csv");
  }
  if (const auto sequence = internal::find_kitti_sequence(dataset)) candidates.push_back(sequence->poses);
  const auto found = std::ranges::find_if(candidates, is_file);
  return found == candidates.end() ? std::nullopt : std::optional(*found);
}

Result<Trajectory> read_ground_truth(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    const std::optional<fs::path> file = find_ground_truth(path);
    if (!file) {
      return error(
          "{} has no true trajectory: groundtruth.txt, traj.txt, mav0/state_groundtruth_estimate0/data.csv or "
          "../../poses/NN.txt",
          path.string());
    }
    return read_ground_truth(*file);
  }
  if (path.extension() == ".csv") return read_euroc_trajectory(path);
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  const std::vector<TextLine> lines = split_table(*content);
  if (lines.empty()) return error("{} holds no poses", path.string());
  if (lines.front().fields.size() == kReplicaFields) return read_replica_trajectory(path, lines);
  if (lines.front().fields.size() == kKittiFields && path.parent_path().filename() == "poses") {
    return read_kitti_trajectory(path, lines);
  }
  return read_tum_trajectory(path);
}

}  // namespace photoslam
