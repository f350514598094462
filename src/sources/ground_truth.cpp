// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/ground_truth.h"

#include <Eigen/LU>
#include <vector>

#include "base/file.h"
#include "io/text_table.h"
#include "sources/replica_source.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMatrixFields = 16;

Result<SE3> parse_matrix(const TextLine& line) {
  if (line.fields.size() != kMatrixFields) {
    return error("expected the 16 numbers of a pose matrix, found {} fields", line.fields.size());
  }
  Eigen::Matrix4d matrix;
  for (size_t i = 0; i < kMatrixFields; ++i) {
    const Result<double> number = parse_number(line.fields[i]);
    if (!number) return number.error();
    matrix(static_cast<int>(i / 4), static_cast<int>(i % 4)) = *number;
  }
  const Mat3 rotation = matrix.topLeftCorner<3, 3>();
  constexpr double kTolerance = 1e-2;
  if ((rotation * rotation.transpose() - Mat3::Identity()).norm() > kTolerance || rotation.determinant() < 0) {
    return error("the upper left 3x3 numbers are not a rotation");
  }
  if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > kTolerance) {
    return error("the last four numbers are not 0 0 0 1");
  }
  return SE3::from_matrix(matrix);
}

Result<Trajectory> read_replica_trajectory(const fs::path& path, const std::vector<TextLine>& lines) {
  Trajectory trajectory;
  for (const TextLine& line : lines) {
    const Result<SE3> pose = parse_matrix(line);
    if (!pose) return error("{}:{}: {}", path.string(), line.number, pose.error().message);
    trajectory.push_back({internal::replica_time_ns(static_cast<int64_t>(trajectory.size())), *pose});
  }
  return trajectory;
}

}  // namespace

std::optional<fs::path> find_ground_truth(const fs::path& dataset) {
  std::vector<fs::path> candidates = {dataset / "groundtruth.txt", dataset / "traj.txt"};
  const fs::path whole = fs::weakly_canonical(dataset);
  if (whole.filename() == "results") candidates.push_back(whole.parent_path() / "traj.txt");
  for (const fs::path& path : candidates) {
    std::error_code ignored;
    if (fs::is_regular_file(path, ignored)) return path;
  }
  return std::nullopt;
}

Result<Trajectory> read_ground_truth(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    const std::optional<fs::path> file = find_ground_truth(path);
    if (!file) return error("{} has neither groundtruth.txt nor traj.txt", path.string());
    return read_ground_truth(*file);
  }
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  const std::vector<TextLine> lines = split_table(*content);
  if (lines.empty()) return error("{} holds no poses", path.string());
  if (lines.front().fields.size() == kMatrixFields) return read_replica_trajectory(path, lines);
  return read_tum_trajectory(path);
}

}  // namespace photoslam
