// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/module.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace photoslam {
namespace {

namespace fs = std::filesystem;

TEST(Module, SaysWhatIsMissingOrDamaged) {
  const auto missing = find_in_module("no_such_module.so", "entry");
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().message.find("no usable no_such_module.so beside the program"), std::string::npos);

  const fs::path damaged = fs::read_symlink("/proc/self/exe").parent_path() / "damaged_module_of_a_test.so";
  std::ofstream(damaged) << "no shared object";
  const auto unusable = find_in_module(damaged.filename().string(), "entry");
  fs::remove(damaged);
  ASSERT_FALSE(unusable.ok());
  EXPECT_NE(unusable.error().message.find('('), std::string::npos) << unusable.error().message;
}

}  // namespace
}  // namespace photoslam
