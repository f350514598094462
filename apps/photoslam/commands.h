// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command_line.h"

namespace photoslam {

/// The subcommands. To add one: write apps/photoslam/<name>.cpp with `void add_<name>(CommandLine&)`, which calls
/// CommandLine::add, binds its options to a struct kept alive by the action, and passes the action to on_run; then
/// declare it here and register it in main.cpp. Only the action may print results (stdout); progress goes to stderr.
void add_run(CommandLine& line);
void add_eval(CommandLine& line);
void add_render(CommandLine& line);
void add_synth(CommandLine& line);
void add_bench(CommandLine& line);
void add_doctor(CommandLine& line);
void add_config(CommandLine& line);
void add_export(CommandLine& line);
void add_train(CommandLine& line);
void add_merge(CommandLine& line);

}  // namespace photoslam
