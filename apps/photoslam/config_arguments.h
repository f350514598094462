// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "pipeline/system_options.h"

namespace photoslam {

/// The options --config and --set of a subcommand.
struct ConfigArguments {
  std::string file;
  std::vector<std::string> settings;  ///< "key=value"

  /// Adds the options to the subcommand; this struct must outlive the parsing.
  void bind(CLI::App& command);
  /// The defaults, changed by the file, then by the settings in the order given.
  Result<SystemOptions> load() const;
};

}  // namespace photoslam
