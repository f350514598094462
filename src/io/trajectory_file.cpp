// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/trajectory_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "base/file.h"
#include "io/text_table.h"

namespace photoslam {
namespace {

constexpr int64_t kNanosecondsPerSecond = 1'000'000'000;

/// A decimal number taken apart: ±digits · 10^exponent.
struct Decimal {
  bool negative = false;
  std::string digits;
  int exponent = 0;
};

std::optional<Decimal> parse_decimal(std::string_view text) {
  Decimal decimal;
  if (text.starts_with('-') || text.starts_with('+')) {
    decimal.negative = text.front() == '-';
    text.remove_prefix(1);
  }
  const size_t mantissa_end = std::min(text.find_first_of("eE"), text.size());
  if (mantissa_end < text.size()) {
    std::string_view exponent = text.substr(mantissa_end + 1);
    if (exponent.starts_with('+')) exponent.remove_prefix(1);
    const char* const last = exponent.data() + exponent.size();
    const auto [end, code] = std::from_chars(exponent.data(), last, decimal.exponent);
    if (code != std::errc() || end != last || std::abs(decimal.exponent) > 40) return std::nullopt;
  }
  bool after_point = false;
  for (const char c : text.substr(0, mantissa_end)) {
    if (c == '.' && !after_point) {
      after_point = true;
    } else if (c >= '0' && c <= '9') {
      decimal.digits.push_back(c);
      decimal.exponent -= after_point ? 1 : 0;
    } else {
      return std::nullopt;
    }
  }
  if (decimal.digits.empty()) return std::nullopt;
  return decimal;
}

Result<StampedPose> parse_pose(const TextLine& line) {
  if (line.fields.size() != 8) {
    return error("expected 8 fields 'timestamp tx ty tz qx qy qz qw', found {}", line.fields.size());
  }
  const Result<int64_t> timestamp = parse_seconds(line.fields[0]);
  if (!timestamp) return timestamp.error();
  std::array<double, 7> v{};
  for (size_t i = 0; i < v.size(); ++i) {
    const Result<double> number = parse_number(line.fields[i + 1]);
    if (!number) return number.error();
    v[i] = *number;
  }
  const Quat rotation(v[6], v[3], v[4], v[5]);
  if (std::abs(rotation.norm() - 1) > 0.1) {
    return error("the quaternion has norm {:.3g}, expected 1", rotation.norm());
  }
  return StampedPose{*timestamp, SE3(rotation.normalized(), Vec3(v[0], v[1], v[2]))};
}

}  // namespace

Result<int64_t> parse_seconds(std::string_view text) {
  const std::optional<Decimal> decimal = parse_decimal(text);
  if (!decimal) return error("'{}' is not a time in seconds", text.substr(0, 40));
  // Digits in front of the nanosecond's decimal place count; the first one behind it rounds.
  const int whole = static_cast<int>(decimal->digits.size()) + decimal->exponent + 9;
  int64_t nanoseconds = 0;
  for (int i = 0; i < whole; ++i) {
    const auto index = static_cast<size_t>(i);
    const int64_t digit = index < decimal->digits.size() ? decimal->digits[index] - '0' : 0;
    if (nanoseconds > (INT64_MAX - digit) / 10) return error("the time '{}' is out of range", text.substr(0, 40));
    nanoseconds = nanoseconds * 10 + digit;
  }
  if (whole >= 0 && static_cast<size_t>(whole) < decimal->digits.size() && nanoseconds < INT64_MAX) {
    nanoseconds += decimal->digits[static_cast<size_t>(whole)] >= '5' ? 1 : 0;
  }
  return decimal->negative ? -nanoseconds : nanoseconds;
}

std::string format_seconds(int64_t timestamp_ns) {
  const uint64_t bits = static_cast<uint64_t>(timestamp_ns);
  const uint64_t magnitude = timestamp_ns < 0 ? 0 - bits : bits;
  return fmt::format("{}{}.{:09}", timestamp_ns < 0 ? "-" : "", magnitude / kNanosecondsPerSecond,
                     magnitude % kNanosecondsPerSecond);
}

Result<Trajectory> read_tum_trajectory(const std::filesystem::path& path) {
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  Trajectory trajectory;
  for (const TextLine& line : split_table(*content)) {
    const Result<StampedPose> pose = parse_pose(line);
    if (!pose) return error("{}:{}: {}", path.string(), line.number, pose.error().message);
    trajectory.push_back(*pose);
  }
  std::ranges::stable_sort(trajectory, {}, &StampedPose::timestamp_ns);
  return trajectory;
}

Status write_tum_trajectory(const std::filesystem::path& path, const Trajectory& trajectory) {
  std::string content = "# timestamp tx ty tz qx qy qz qw (world_from_camera)\n";
  for (const auto& [timestamp_ns, pose] : trajectory) {
    const Vec3& t = pose.translation;
    const Quat& q = pose.rotation;
    content += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", format_seconds(timestamp_ns), t.x(),
                           t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return write_file_atomically(path, content);
}

}  // namespace photoslam
