// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/config.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/check.h"
#include "base/file.h"
#include "base/nearest_name.h"

namespace photoslam {
namespace {

using Target = std::variant<bool*, int*, double*, std::string*>;

struct Leaf {
  std::string key;
  OptionInfo info;
  Target target;
};

struct Group {
  std::string key;  ///< "" for the values outside every group.
  std::string doc;
  std::vector<Leaf> leaves;
};

/// Flattens nested options into groups, each with the values directly in it.
class GroupCollector final : public OptionVisitor {
 public:
  explicit GroupCollector(const OptionsRef& options) : groups_(1), path_({0}) { options.visit(*this); }

  std::vector<Group> take() { return std::move(groups_); }

  void begin_group(const char* name, const char* doc) override {
    path_.push_back(groups_.size());
    groups_.push_back({full_key(groups_[path_[path_.size() - 2]].key, name), doc, {}});
  }
  void end_group() override { path_.pop_back(); }
  void value(const OptionInfo& info, bool& v) override { add(info, &v); }
  void value(const OptionInfo& info, int& v) override { add(info, &v); }
  void value(const OptionInfo& info, double& v) override { add(info, &v); }
  void value(const OptionInfo& info, std::string& v) override { add(info, &v); }

 private:
  static std::string full_key(const std::string& group, const char* name) {
    return group.empty() ? name : group + "." + name;
  }
  void add(const OptionInfo& info, Target target) {
    Group& group = groups_[path_.back()];
    group.leaves.push_back({full_key(group.key, info.name), info, target});
  }

  std::vector<Group> groups_;
  std::vector<size_t> path_;  // indices of the open groups, outermost first
};

std::vector<Group> collect(const OptionsRef& options) { return GroupCollector(options).take(); }

const Leaf* find_leaf(const std::vector<Group>& groups, std::string_view key) {
  for (const Group& group : groups)
    for (const Leaf& leaf : group.leaves)
      if (leaf.key == key) return &leaf;
  return nullptr;
}

bool is_group(const std::vector<Group>& groups, std::string_view key) {
  for (const Group& group : groups)
    if (group.key == key) return true;
  return false;
}

Error unknown_key(const std::string& where, std::string_view key, const std::vector<Group>& groups) {
  std::vector<std::string> known;
  for (const Group& group : groups) {
    if (!group.key.empty()) known.push_back(group.key);
    for (const Leaf& leaf : group.leaves) known.push_back(leaf.key);
  }
  const std::string nearest = nearest_name(key, known);
  return error(
      "{}unknown configuration key '{}'{}", where, key,
      nearest.empty() ? " (photoslam config --defaults lists all)" : fmt::format("; did you mean '{}'?", nearest));
}

std::string type_name(const Target& target) {
  constexpr const char* names[] = {"true or false", "a whole number", "a number", "text"};
  return names[target.index()];
}

std::string number(double v) {
  std::string text = fmt::format("{}", v);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

/// "0.5 … 10", "≥ 1", or "" when everything is allowed.
std::string range_text(const Leaf& leaf) {
  if (std::holds_alternative<bool*>(leaf.target) || std::holds_alternative<std::string*>(leaf.target)) return "";
  const bool below = leaf.info.min > std::numeric_limits<double>::lowest();
  const bool above = leaf.info.max < std::numeric_limits<double>::max();
  if (below && above) return fmt::format("{} … {}", leaf.info.min, leaf.info.max);
  if (below) return fmt::format("≥ {}", leaf.info.min);
  return above ? fmt::format("≤ {}", leaf.info.max) : "";
}

/// `where` begins the message: "file:line:column: " or "--set: ".
Status check_range(const std::string& where, const Leaf& leaf, double value) {
  if (value >= leaf.info.min && value <= leaf.info.max) return {};
  const std::string unit = *leaf.info.unit != '\0' ? fmt::format(" {}", leaf.info.unit) : "";
  return error("{}{} = {} is out of range ({}{})", where, leaf.key, value, range_text(leaf), unit);
}

void assign(const Leaf& leaf, const ConfigValue& value) {
  if (bool* const* v = std::get_if<bool*>(&leaf.target)) **v = std::get<bool>(value);
  if (int* const* v = std::get_if<int*>(&leaf.target)) **v = std::get<int>(value);
  if (double* const* v = std::get_if<double*>(&leaf.target)) **v = std::get<double>(value);
  if (std::string* const* v = std::get_if<std::string*>(&leaf.target)) **v = std::get<std::string>(value);
}

ConfigValue current_value(const Leaf& leaf) {
  return std::visit([](const auto* v) { return ConfigValue(*v); }, leaf.target);
}

/// The numbers of the configuration are written the same way in TOML and after --set.
Result<ConfigValue> checked_integer(const std::string& where, const Leaf& leaf, int64_t value) {
  if (Status status = check_range(where, leaf, static_cast<double>(value)); !status.ok()) return status.error();
  if (std::in_range<int>(value)) return ConfigValue(static_cast<int>(value));
  return error("{}{} = {} is out of range", where, leaf.key, value);
}

Result<ConfigValue> checked_number(const std::string& where, const Leaf& leaf, double value) {
  if (Status status = check_range(where, leaf, value); !status.ok()) return status.error();
  return ConfigValue(value);
}

std::string position(std::string_view file, const toml::source_region& region) {
  return fmt::format("{}:{}:{}: ", file, region.begin.line, region.begin.column);
}

Result<ConfigValue> read_node(const std::string& where, const Leaf& leaf, const toml::node& node) {
  if (std::holds_alternative<bool*>(leaf.target) && node.is_boolean()) return ConfigValue(node.ref<bool>());
  if (std::holds_alternative<std::string*>(leaf.target) && node.is_string())
    return ConfigValue(node.ref<std::string>());
  if (std::holds_alternative<int*>(leaf.target) && node.is_integer())
    return checked_integer(where, leaf, node.ref<int64_t>());
  if (std::holds_alternative<double*>(leaf.target) && node.is_number())
    return checked_number(where, leaf, *node.value<double>());
  return error("{}{} must be {}", where, leaf.key, type_name(leaf.target));
}

/// Checks one table of a configuration file and gathers what it assigns.
class TableReader {
 public:
  TableReader(std::string_view file, const std::vector<Group>& groups) : file_(file), groups_(groups) {}

  Status read(const toml::table& table, const std::string& prefix) {
    for (const auto& [name, node] : table) {
      const std::string key = prefix.empty() ? std::string(name.str()) : fmt::format("{}.{}", prefix, name.str());
      if (const Leaf* leaf = find_leaf(groups_, key)) {
        Result<ConfigValue> value = read_node(position(file_, node.source()), *leaf, node);
        if (!value.ok()) return value.error();
        assignments_.emplace_back(leaf, std::move(*value));
      } else if (!is_group(groups_, key)) {
        return unknown_key(position(file_, name.source()), key, groups_);
      } else if (!node.is_table()) {
        return error("{}{} is a group of values: write [{}] above them", position(file_, node.source()), key, key);
      } else if (Status status = read(*node.as_table(), key); !status.ok()) {
        return status;
      }
    }
    return {};
  }

  void apply() const {
    for (const auto& [leaf, value] : assignments_) assign(*leaf, value);
  }

 private:
  std::string_view file_;
  const std::vector<Group>& groups_;
  std::vector<std::pair<const Leaf*, ConfigValue>> assignments_;
};

/// A value of a file whose key is unknown.
std::string as_written(const toml::node& node) {
  if (const auto v = node.value_exact<bool>()) return to_toml(*v);
  if (const auto v = node.value_exact<int64_t>()) return fmt::format("{}", *v);
  if (const auto v = node.value_exact<double>()) return to_toml(*v);
  if (const auto v = node.value_exact<std::string>()) return to_toml(*v);
  return "…";
}

void compare(const toml::table& table, const std::string& prefix, const std::vector<Group>& groups,
             std::vector<std::string>& found, std::vector<ConfigDifference>& differences) {
  for (const auto& [name, node] : table) {
    const std::string key = prefix.empty() ? std::string(name.str()) : fmt::format("{}.{}", prefix, name.str());
    if (const toml::table* inner = node.as_table()) {
      compare(*inner, key, groups, found, differences);
      continue;
    }
    found.push_back(key);
    const Leaf* leaf = find_leaf(groups, key);
    if (leaf == nullptr) {
      differences.push_back({key, as_written(node), ""});
      continue;
    }
    const Result<ConfigValue> value = read_node("", *leaf, node);
    if (value && *value == current_value(*leaf)) continue;
    differences.push_back({key, value ? to_toml(*value) : as_written(node), to_toml(current_value(*leaf))});
  }
}

template <class Number>
std::optional<Number> parse_whole(std::string_view text) {
  Number value{};
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  return code == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

Result<ConfigValue> read_text(const std::string& where, const Leaf& leaf, std::string_view text) {
  if (std::holds_alternative<std::string*>(leaf.target)) return ConfigValue(std::string(text));
  if (std::holds_alternative<bool*>(leaf.target) && (text == "true" || text == "false"))
    return ConfigValue(text == "true");
  if (std::holds_alternative<int*>(leaf.target))
    if (const auto value = parse_whole<int64_t>(text)) return checked_integer(where, leaf, *value);
  if (std::holds_alternative<double*>(leaf.target))
    if (const auto value = parse_whole<double>(text)) return checked_number(where, leaf, *value);
  return error("{}{} must be {}, not '{}'", where, leaf.key, type_name(leaf.target), text);
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    if (static_cast<unsigned char>(c) < 0x20)
      result += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
    else
      result += c;
  }
  return result + '"';
}

/// "[px], 0.5 … 10: " as far as there is a unit and a range.
std::string unit_and_range(const Leaf& leaf) {
  const std::string range = range_text(leaf);
  std::string text = *leaf.info.unit != '\0' ? fmt::format("[{}]", leaf.info.unit) : "";
  if (!range.empty()) text += (text.empty() ? "" : " ") + range;
  return text;
}

}  // namespace

Status load_config(const std::filesystem::path& file, const OptionsRef& options) {
  const Result<std::string> content = read_file(file);
  if (!content.ok()) return content.error();
  return parse_config(*content, file.string(), options);
}

Status parse_config(std::string_view toml, std::string_view name, const OptionsRef& options) {
  const std::vector<Group> groups = collect(options);
  TableReader reader(name, groups);
  try {
    const toml::table table = toml::parse(toml, name);
    if (Status status = reader.read(table, ""); !status.ok()) return status;
  } catch (const toml::parse_error& failure) {
    return error("{}{}", position(name, failure.source()), failure.description());
  }
  reader.apply();
  return {};
}

Status apply_setting(std::string_view assignment, const OptionsRef& options) {
  const size_t equals = assignment.find('=');
  if (equals == std::string_view::npos || equals == 0)
    return error("--set {}: expected key=value, such as --set seed=7", assignment);
  const std::vector<Group> groups = collect(options);
  const std::string_view key = assignment.substr(0, equals);
  const Leaf* leaf = find_leaf(groups, key);
  if (leaf == nullptr) return unknown_key("--set: ", key, groups);
  const Result<ConfigValue> value = read_text("--set: ", *leaf, assignment.substr(equals + 1));
  if (!value.ok()) return value.error();
  assign(*leaf, *value);
  return {};
}

std::vector<ConfigEntry> config_values(const OptionsRef& options) {
  std::vector<ConfigEntry> entries;
  for (const Group& group : collect(options))
    for (const Leaf& leaf : group.leaves) entries.push_back({leaf.key, current_value(leaf)});
  return entries;
}

std::vector<ConfigEntry> changed_values(const OptionsRef& options, const OptionsRef& defaults) {
  std::vector<ConfigEntry> changed = config_values(options);
  const std::vector<ConfigEntry> original = config_values(defaults);
  PHOTOSLAM_CHECK(changed.size() == original.size(), "{} values, {} defaults", changed.size(), original.size());
  size_t index = 0;
  std::erase_if(changed, [&](const ConfigEntry& entry) { return entry.value == original[index++].value; });
  return changed;
}

Result<std::vector<ConfigDifference>> config_differences(std::string_view toml, std::string_view name,
                                                         const OptionsRef& options) {
  const std::vector<Group> groups = collect(options);
  std::vector<ConfigDifference> differences;
  std::vector<std::string> found;
  try {
    compare(toml::parse(toml, name), "", groups, found, differences);
  } catch (const toml::parse_error& failure) {
    return error("{}{}", position(name, failure.source()), failure.description());
  }
  for (const Group& group : groups) {
    for (const Leaf& leaf : group.leaves) {
      if (std::ranges::find(found, leaf.key) != found.end()) continue;
      differences.push_back({leaf.key, "", to_toml(current_value(leaf))});
    }
  }
  return differences;
}

std::string to_toml(const ConfigValue& value) {
  if (const bool* v = std::get_if<bool>(&value)) return *v ? "true" : "false";
  if (const int* v = std::get_if<int>(&value)) return fmt::format("{}", *v);
  if (const double* v = std::get_if<double>(&value)) return number(*v);
  return quoted(std::get<std::string>(value));
}

std::string config_as_toml(const OptionsRef& options) {
  std::string text;
  for (const Group& group : collect(options)) {
    if (!group.key.empty()) text += fmt::format("\n# {}\n[{}]\n", group.doc, group.key);
    for (const Leaf& leaf : group.leaves) {
      const std::string limits = unit_and_range(leaf);
      text += fmt::format("# {}{}{}\n", leaf.info.doc, limits.empty() ? "" : "  ", limits);
      text += fmt::format("{} = {}\n", leaf.info.name, to_toml(current_value(leaf)));
    }
  }
  return text;
}

std::string config_manual(const OptionsRef& defaults) {
  std::string text;
  for (const Group& group : collect(defaults)) {
    if (!group.key.empty()) text += fmt::format("\n## `[{}]`\n\n{}\n", group.key, group.doc);
    if (group.leaves.empty()) continue;
    text += "\n| key | default | unit | range | effect |\n|---|---|---|---|---|\n";
    for (const Leaf& leaf : group.leaves)
      text += fmt::format("| `{}` | `{}` | {} | {} | {} |\n", leaf.info.name, to_toml(current_value(leaf)),
                          leaf.info.unit, range_text(leaf), leaf.info.doc);
  }
  return text;
}

}  // namespace photoslam
