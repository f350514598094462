// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "commands.h"

int main(int argc, char** argv) {
  photoslam::CommandLine line;
  photoslam::add_run(line);
  photoslam::add_eval(line);
  photoslam::add_render(line);
  photoslam::add_export(line);
  photoslam::add_train(line);
  photoslam::add_merge(line);
  photoslam::add_synth(line);
  photoslam::add_bench(line);
  photoslam::add_doctor(line);
  photoslam::add_config(line);
  return line.run(argc, argv);
}
