// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/exposure_file.h"

#include <algorithm>
#include <cmath>

#include "base/file.h"
#include "io/text_table.h"
#include "io/trajectory_file.h"

namespace photoslam {
namespace {

constexpr std::string_view kFormat = "# photoslam exposures 1";
constexpr std::string_view kColumns =
    "# timestamp gain_r gain_g gain_b bias_r bias_g bias_b (picture = gain * render + bias)";

Result<StampedExposure> parse_exposure(const TextLine& line) {
  if (line.fields.size() != 7) return error("expected 7 fields, found {}", line.fields.size());
  const auto timestamp = parse_seconds(line.fields[0]);
  if (!timestamp) return timestamp.error();
  StampedExposure entry{*timestamp, {}};
  for (size_t i = 0; i < 6; ++i) {
    const auto number = parse_number(line.fields[i + 1]);
    if (!number) return number.error();
    const auto value = static_cast<float>(*number);
    if (!std::isfinite(value) || (i < 3 && !(value > 0))) {
      return error("'{}' is not {}", line.fields[i + 1], i < 3 ? "a gain" : "a bias");
    }
    (i < 3 ? entry.exposure.gain[i] : entry.exposure.bias[i - 3]) = value;
  }
  return entry;
}

}  // namespace

splatting::Exposure nearest_exposure(const ExposureTrack& track, int64_t timestamp_ns) {
  if (track.empty()) return {};
  auto nearest = std::ranges::lower_bound(track, timestamp_ns, {}, &StampedExposure::timestamp_ns);
  if (nearest == track.end() || (nearest != track.begin() && timestamp_ns - std::prev(nearest)->timestamp_ns <=
                                                                 nearest->timestamp_ns - timestamp_ns)) {
    --nearest;
  }
  return nearest->exposure;
}

Status write_exposures(const std::filesystem::path& path, const ExposureTrack& track) {
  std::string content = fmt::format("{}\n{}\n", kFormat, kColumns);
  for (const auto& [timestamp_ns, exposure] : track) {
    content += format_seconds(timestamp_ns);
    for (const float value : exposure.gain) content += fmt::format(" {:.9g}", value);
    for (const float value : exposure.bias) content += fmt::format(" {:.9g}", value);
    content += '\n';
  }
  return write_file_atomically(path, content);
}

Result<ExposureTrack> read_exposures(const std::filesystem::path& path) {
  const auto content = read_file(path);
  if (!content) return content.error();
  const std::string_view first = std::string_view(*content).substr(0, content->find_first_of("\r\n"));
  if (first != kFormat) return error("{}:1: expected '{}', found '{}'", path.string(), kFormat, first.substr(0, 40));
  ExposureTrack track;
  for (const TextLine& line : split_table(*content)) {
    const auto entry = parse_exposure(line);
    if (!entry) return error("{}:{}: {}", path.string(), line.number, entry.error().message);
    track.push_back(*entry);
  }
  std::ranges::stable_sort(track, {}, &StampedExposure::timestamp_ns);
  return track;
}

}  // namespace photoslam
