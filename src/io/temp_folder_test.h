// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string_view>

#include "base/file.h"

namespace photoslam {

/// A test with a fresh folder of its own, removed afterwards.
class TempFolderTest : public testing::Test {
 protected:
  TempFolderTest()
      : folder(
            std::filesystem::path(testing::TempDir()) /
            fmt::format("photoslam_{}_{}", ::getpid(), testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
  }
  ~TempFolderTest() override { std::filesystem::remove_all(folder); }

  /// Writes a text file below the folder, making parents, and returns its path.
  std::filesystem::path write(const std::filesystem::path& name, std::string_view content) const {
    const std::filesystem::path path = folder / name;
    std::filesystem::create_directories(path.parent_path());
    EXPECT_TRUE(write_file_atomically(path, content).ok()) << path;
    return path;
  }

  const std::filesystem::path folder;
};

}  // namespace photoslam
