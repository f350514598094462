// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "config_arguments.h"

#include "pipeline/config.h"

namespace photoslam {

void ConfigArguments::bind(CLI::App& command) {
  command.add_option("--config", file, "TOML file with configuration values (see photoslam config)")
      ->type_name("FILE.toml");
  command.add_option("--set", settings, "Set one configuration value; may be given several times")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);  // the next word may be the dataset
}

Result<SystemOptions> ConfigArguments::load() const {
  SystemOptions options;
  if (!file.empty()) {
    if (Status status = load_config(file, options); !status.ok()) return status.error();
  }
  for (const std::string& setting : settings) {
    if (Status status = apply_setting(setting, options); !status.ok()) {
      throw CLI::ValidationError("--set", status.error().message);
    }
  }
  return options;
}

}  // namespace photoslam
