// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <string>

#include "base/result.h"

namespace photoslam {

/// What the shell sees.
inline constexpr int kExitOk = 0;
inline constexpr int kExitFailure = 1;  ///< The work could not be done; one line on stderr says why.
inline constexpr int kExitUsage = 2;    ///< The command line was wrong; nothing was started.

/// Throws CLI::ValidationError for 1: with every frame held out nothing is left to map.
void check_hold_out(int every);

/// The words after `photoslam`: subcommands with their options, and what each of them does.
class CommandLine {
 public:
  CommandLine();

  /// A new subcommand to bind options to; the examples (lines starting with "photoslam") end its --help.
  CLI::App& add(const std::string& name, const std::string& description, const std::string& examples);

  /// The work of a subcommand, done once the whole command line has been understood.
  /// An action that finds a bad combination of options throws CLI::ValidationError (exit code 2).
  void on_run(const CLI::App& command, std::function<Status()> action);

  /// Understands the arguments, runs the subcommand that was given and returns the exit code.
  int run(int argc, const char* const* argv);

 private:
  int explain(const CLI::ParseError& failure) const;

  CLI::App app_;
  std::map<const CLI::App*, std::function<Status()>> actions_;
};

}  // namespace photoslam
