// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "base/options.h"
#include "base/result.h"

namespace photoslam {

/// Any options struct with `void visit(OptionVisitor&)`, seen without its type; refers to it, does not own it.
class OptionsRef {
 public:
  template <class Options>
    requires(!std::is_same_v<Options, OptionsRef> && !std::is_const_v<Options>)
  OptionsRef(Options& options)  // NOLINT(google-explicit-constructor)
      : visit_([&options](OptionVisitor& visitor) { options.visit(visitor); }) {}

  void visit(OptionVisitor& visitor) const { visit_(visitor); }

 private:
  std::function<void(OptionVisitor&)> visit_;
};

using ConfigValue = std::variant<bool, int, double, std::string>;

/// One value with its full key, such as "localization.huber_px".
struct ConfigEntry {
  std::string key;
  ConfigValue value;
};

/// Sets the options that a TOML file names and leaves the others alone.
///
/// Syntax errors, unknown keys (with the nearest known one), wrong types and values out of range are errors that start
/// with file:line:column; then no option is changed.
Status load_config(const std::filesystem::path& file, const OptionsRef& options);

/// The same for TOML text; `name` stands for the file in messages.
Status parse_config(std::string_view toml, std::string_view name, const OptionsRef& options);

/// Sets one option from "key=value", as given to --set. Text needs no quotes.
Status apply_setting(std::string_view assignment, const OptionsRef& options);

/// Every value, in the order of the visit.
std::vector<ConfigEntry> config_values(const OptionsRef& options);

/// The values that differ from those of `defaults`, which must be of the same type.
std::vector<ConfigEntry> changed_values(const OptionsRef& options, const OptionsRef& defaults);

/// A value that a configuration file has otherwise than the options.
struct ConfigDifference {
  std::string key;
  std::string in_file, in_options;  ///< As TOML writes them; empty where there is no such value.
};

/// What the TOML text says otherwise than the options, which it leaves alone; keys of other versions differ, too. An
/// error where the text is no TOML.
Result<std::vector<ConfigDifference>> config_differences(std::string_view toml, std::string_view name,
                                                         const OptionsRef& options);

/// The value as TOML writes it.
std::string to_toml(const ConfigValue& value);

/// A complete configuration file: every value with unit, range and explanation as comments. Loads back unchanged.
std::string config_as_toml(const OptionsRef& options);

/// The reference manual of the configuration in Markdown: one table per group, the values being the defaults.
std::string config_manual(const OptionsRef& defaults);

}  // namespace photoslam
