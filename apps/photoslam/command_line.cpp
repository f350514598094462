// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "command_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <vector>

#include "base/nearest_name.h"
#include "base/version.h"
#include "help_formatter.h"

namespace photoslam {
namespace {

void print_error(const std::string& message) { fmt::print(stderr, "photoslam: error: {}\n", message); }

std::string did_you_mean(const std::string& typed, const std::vector<std::string>& candidates) {
  const std::string nearest = nearest_name(typed, candidates);
  return nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest);
}

std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

/// What is wrong with the first word that nothing took, or "" when every word was taken.
std::string explain_leftover(const CLI::App& command, const std::vector<std::string>& subcommands) {
  std::vector<std::string> left = command.remaining();
  if (left.empty()) return "";
  const auto option = std::find_if(left.begin(), left.end(), [](const auto& word) { return word.starts_with('-'); });
  if (option != left.end()) {
    const std::string name = option->substr(0, option->find('='));
    return fmt::format("unknown option '{}'{}", name, did_you_mean(name, option_names(command)));
  }
  if (command.get_parent() == nullptr)
    return fmt::format("unknown command '{}'{}", left.front(), did_you_mean(left.front(), subcommands));
  return fmt::format("unexpected argument '{}'", left.front());
}

}  // namespace

void check_hold_out(int every) {
  if (every == 1) throw CLI::ValidationError("--hold-out", "1 leaves nothing to map; 2 keeps every other image out");
}

CommandLine::CommandLine()
    : app_(
          "Real-time SLAM that leaves behind a photorealistic map of gaussians.\n"
          "Start with: photoslam doctor, then photoslam run <dataset> --output DIR",
          "photoslam") {
  app_.formatter(std::make_shared<HelpFormatter>());
  app_.require_subcommand(1);
  app_.set_help_flag("-h,--help", "Print this help and exit");
  app_.set_version_flag("--version", fmt::format("photoslam {} ({})", version(), build_description()));
  app_.footer("photoslam <command> --help explains a command, with examples.");
}

CLI::App& CommandLine::add(const std::string& name, const std::string& description, const std::string& examples) {
  CLI::App& command = *app_.add_subcommand(name, description);
  command.set_help_flag("-h,--help", "Print this help and exit");
  command.footer("Examples:\n" + examples);
  return command;
}

void CommandLine::on_run(const CLI::App& command, std::function<Status()> action) {
  actions_[&command] = std::move(action);
}

int CommandLine::explain(const CLI::ParseError& failure) const {
  if (failure.get_exit_code() == kExitOk) return app_.exit(failure);  // --help, --version
  const std::vector<CLI::App*> chosen = app_.get_subcommands();
  const CLI::App& command = chosen.empty() ? app_ : *chosen.front();
  std::vector<std::string> subcommands;
  for (const CLI::App* each : app_.get_subcommands([](const CLI::App*) { return true; }))
    subcommands.push_back(each->get_name());
  std::string problem = explain_leftover(app_, subcommands);
  if (problem.empty()) problem = explain_leftover(command, subcommands);
  if (problem.empty()) problem = chosen.empty() ? "no command given" : failure.what();
  const std::string help = chosen.empty() ? "photoslam --help" : "photoslam " + command.get_name() + " --help";
  print_error(fmt::format("{} (see {})", problem, help));
  return kExitUsage;
}

int CommandLine::run(int argc, const char* const* argv) {
  try {
    app_.parse(argc, argv);
    const Status status = actions_.at(app_.get_subcommands().front())();
    if (status.ok()) return kExitOk;
    print_error(status.error().message);
  } catch (const CLI::ParseError& failure) {
    return explain(failure);
  } catch (const std::exception& failure) {
    print_error(failure.what());
  }
  return kExitFailure;
}

}  // namespace photoslam
