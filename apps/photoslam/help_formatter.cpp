// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "help_formatter.h"

#include <fmt/format.h>

#include <algorithm>

namespace photoslam {

HelpFormatter::HelpFormatter() { column_width(34); }

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  if (option->get_type_size() == 0 || option->get_positional()) return "";
  // CLI11 writes "TYPE:{choice,choice}", "TYPE:TYPE in [low - high]" or just the type.
  const std::string type = option->get_type_name();
  const size_t brace = type.find('{');
  if (brace != std::string::npos) {
    std::string choices = type.substr(brace + 1, type.find('}') - brace - 1);
    std::replace(choices.begin(), choices.end(), ',', '|');
    return " " + choices;
  }
  const std::string base = type.substr(0, type.find(':'));
  if (base == "INT" || base == "UINT") return " N";
  if (base == "FLOAT" || base == "NUMBER") return " X";
  return base == "TEXT" ? " PATH" : " " + base;
}

std::string HelpFormatter::make_option_desc(const CLI::Option* option) const {
  const std::string standard = option->get_default_str();
  return standard.empty() ? option->get_description()
                          : fmt::format("{} [default: {}]", option->get_description(), standard);
}

std::string HelpFormatter::make_usage(const CLI::App* app, std::string name) const {
  std::string usage = "Usage: " + name;
  if (app->get_parent() == nullptr) return usage + " <command> [options]\n";
  for (const CLI::Option* option : app->get_options([](const CLI::Option* o) { return o->get_positional(); }))
    usage += fmt::format(" <{}>", option->get_name(true));
  return usage + " [options]\n";
}

}  // namespace photoslam
