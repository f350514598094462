// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/frame_log.h"

#include <array>
#include <charconv>

#include "base/file.h"
#include "io/text_table.h"
#include "io/trajectory_file.h"

namespace photoslam {
namespace {

constexpr std::string_view kHeader =
    "frame,timestamp,state,reason,inliers,active_ratio,queue_wait_ms,tracking_ms,blocked_ms,latency_ms,keyframe";
constexpr size_t kColumns = 11;
constexpr std::array kStates = {FrameState::tracked, FrameState::coasted, FrameState::initializing, FrameState::lost,
                                FrameState::dropped};

/// Text in quotes where the separator or a quote would break the line apart; quotes inside are doubled.
std::string csv_text(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"') result += '"';
    result += c == '\n' || c == '\r' ? ' ' : c;
  }
  return result + '"';
}

std::string number_or_nothing(const std::optional<double>& value) { return value ? fmt::format("{:.4f}", *value) : ""; }

/// The fields of a line, quotes removed.
std::vector<std::string> split_fields(std::string_view line) {
  std::vector<std::string> fields(1);
  bool in_quotes = false;
  for (size_t i = 0; i < line.size(); ++i) {
    const bool doubled = in_quotes && line[i] == '"' && i + 1 < line.size() && line[i + 1] == '"';
    if (doubled) {
      fields.back() += line[i++];
    } else if (line[i] == '"') {
      in_quotes = !in_quotes;
    } else if (line[i] == ',' && !in_quotes) {
      fields.emplace_back();
    } else {
      fields.back() += line[i];
    }
  }
  return fields;
}

/// Takes the fields of one line and remembers the first that is wrong.
class RecordParser {
 public:
  explicit RecordParser(std::vector<std::string> fields) : fields_(std::move(fields)) {}

  Result<FrameRecord> parse() {
    FrameRecord record;
    record.frame = FrameId(integer(0).value_or(-1));
    const Result<int64_t> time = parse_seconds(fields_[1]);
    if (!time) return time.error();
    record.timestamp_ns = *time;
    record.state = state(2);
    record.reason = fields_[3];
    record.inliers = integer(4).value_or(0);
    record.active_ratio = number(5);
    record.queue_wait_ms = number(6);
    record.tracking_ms = number(7);
    record.blocked_ms = number(8);
    record.latency_ms = number(9);
    record.keyframe = KeyframeId(integer(10).value_or(-1));
    if (!failure_.empty()) return Error{failure_};
    return record;
  }

 private:
  void fail(size_t column, const char* expected) {
    if (failure_.empty()) failure_ = fmt::format("'{}' is not {}", fields_[column].substr(0, 40), expected);
  }

  std::optional<int32_t> integer(size_t column) {
    const std::string& field = fields_[column];
    if (field.empty()) return std::nullopt;
    int32_t value = 0;
    const auto [end, code] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (code != std::errc() || end != field.data() + field.size()) fail(column, "a whole number");
    return value;
  }

  std::optional<double> number(size_t column) {
    if (fields_[column].empty()) return std::nullopt;
    const Result<double> value = parse_number(fields_[column]);
    if (!value) fail(column, "a number");
    return value ? *value : 0.0;
  }

  FrameState state(size_t column) {
    for (const FrameState candidate : kStates) {
      if (fields_[column] == to_string(candidate)) return candidate;
    }
    fail(column, "a state (tracked, coasted, initializing, lost, dropped)");
    return FrameState::lost;
  }

  const std::vector<std::string> fields_;
  std::string failure_;
};

}  // namespace

const char* to_string(FrameState state) {
  switch (state) {
    case FrameState::tracked:
      return "tracked";
    case FrameState::coasted:
      return "coasted";
    case FrameState::initializing:
      return "initializing";
    case FrameState::lost:
      return "lost";
    case FrameState::dropped:
      return "dropped";
  }
  return "unknown";
}

Status write_frame_log(const std::filesystem::path& path, const FrameLog& log) {
  std::string content(kHeader);
  content += '\n';
  for (const FrameRecord& r : log) {
    content += fmt::format("{},{},{},{},{},{},{},{},{},{},{}\n", r.frame.value, format_seconds(r.timestamp_ns),
                           to_string(r.state), csv_text(r.reason), r.inliers, number_or_nothing(r.active_ratio),
                           number_or_nothing(r.queue_wait_ms), number_or_nothing(r.tracking_ms),
                           number_or_nothing(r.blocked_ms), number_or_nothing(r.latency_ms),
                           r.keyframe.valid() ? std::to_string(r.keyframe.value) : "");
  }
  return write_file_atomically(path, content);
}

Result<FrameLog> read_frame_log(const std::filesystem::path& path) {
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  std::string_view rest = *content;
  FrameLog log;
  for (int number = 1; !rest.empty(); ++number) {
    const size_t end = std::min(rest.find('\n'), rest.size());
    std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (number == 1) {
      if (line != kHeader) return error("{}:1: expected the header '{}'", path.string(), kHeader);
      continue;
    }
    std::vector<std::string> fields = split_fields(line);
    if (fields.size() != kColumns) {
      return error("{}:{}: expected {} fields, found {}", path.string(), number, kColumns, fields.size());
    }
    const Result<FrameRecord> record = RecordParser(std::move(fields)).parse();
    if (!record) return error("{}:{}: {}", path.string(), number, record.error().message);
    log.push_back(*record);
  }
  return log;
}

}  // namespace photoslam
