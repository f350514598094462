// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/timed_list.h"

#include <charconv>
#include <optional>

#include "base/file.h"
#include "io/association.h"
#include "io/trajectory_file.h"

namespace photoslam::internal {

Result<int64_t> parse_time(std::string_view text, TimeUnit unit) {
  if (unit == TimeUnit::seconds) return parse_seconds(text);
  int64_t value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size()) {
    return error("'{}' is not a time in nanoseconds", text.substr(0, 40));
  }
  return value;
}

Status read_timed_list(const std::filesystem::path& path, TimeUnit unit, size_t columns, const char* layout,
                       const std::function<void(int64_t, const TextLine&)>& row) {
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  std::optional<int64_t> last;
  TextLine last_line;
  for (const TextLine& line : split_table(*content)) {
    const auto& [number, fields] = line;
    if (fields.size() != columns) {
      return error("{}:{}: expected '{}', found {} fields", path.string(), number, layout, fields.size());
    }
    const Result<int64_t> time = parse_time(fields[0], unit);
    if (!time) return error("{}:{}: {}", path.string(), number, time.error().message);
    if (last && *time <= *last) {
      return error("{}:{}: the time {} is not after {} in line {}; put the lines in order", path.string(), number,
                   fields[0], last_line.fields[0], last_line.number);
    }
    last = *time;
    last_line = line;
    row(*time, line);
  }
  if (!last) return error("{} lists nothing", path.string());
  return {};
}

Result<ImageList> read_image_list(const std::filesystem::path& path, TimeUnit unit,
                                  const std::filesystem::path& folder) {
  ImageList list;
  const Status status = read_timed_list(path, unit, 2, "time file", [&](int64_t time, const TextLine& line) {
    list.times.push_back(time);
    list.paths.push_back(folder / line.fields[1]);
  });
  if (!status) return status.error();
  return list;
}

Result<std::vector<std::pair<size_t, size_t>>> match_image_lists(const ImageList& a, const ImageList& b,
                                                                 int64_t tolerance_ns, const std::string& what,
                                                                 std::vector<std::string>& notes) {
  auto pairs = associate_times(a.times, b.times, tolerance_ns);
  const size_t alone = a.times.size() - pairs.size();
  const std::string lacking =
      fmt::format("{} of {} {} within {} ms", alone, a.times.size(), what, tolerance_ns / 1'000'000);
  if (pairs.empty()) return Error{lacking};
  if (alone > 0) notes.push_back(lacking + " and are left out");
  return pairs;
}

}  // namespace photoslam::internal
