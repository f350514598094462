// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/file.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>

namespace photoslam {
namespace {

namespace fs = std::filesystem;

class FileTest : public testing::Test {
 protected:
  FileTest() : folder(fs::path(testing::TempDir()) / fmt::format("file_test_{}", ::getpid())) {
    fs::remove_all(folder);
    fs::create_directories(folder);
  }
  ~FileTest() override { fs::remove_all(folder); }
  fs::path folder;
};

TEST_F(FileTest, WritesAndReadsBack) {
  const std::string content("a\0b\nc", 5);
  ASSERT_TRUE(write_file_atomically(folder / "x", content).ok());
  EXPECT_EQ(read_file(folder / "x").value(), content);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1) << "a temporary file is left behind";
}

TEST_F(FileTest, AFailedWriteKeepsTheOldFileAndLeavesNothing) {
  fs::create_directories(folder / "target" / "occupied");  // a folder cannot be replaced by a file
  EXPECT_FALSE(write_file_atomically(folder / "target", "new").ok());
  EXPECT_TRUE(fs::is_directory(folder / "target" / "occupied"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
}

TEST_F(FileTest, ErrorsNameThePath) {
  EXPECT_NE(read_file(folder / "absent").error().message.find("absent"), std::string::npos);
  EXPECT_NE(read_file(folder).error().message.find("is a folder"), std::string::npos);
}

TEST_F(FileTest, OutputFolderIsCreated) {
  ASSERT_TRUE(prepare_output_folder(folder / "a" / "b").ok());
  EXPECT_TRUE(fs::is_empty(folder / "a" / "b"));
}

TEST_F(FileTest, OnlyTemporaryFilesOfKilledProcessesAreRemoved) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(0);
  ASSERT_EQ(::waitpid(child, nullptr, 0), child);  // a process that is no more
  const auto make = [&](const std::string& name, int minutes_old) {
    std::ofstream(folder / name) << "half";
    fs::last_write_time(folder / name, fs::file_time_type::clock::now() - std::chrono::minutes(minutes_old));
  };
  make(fmt::format("session.photoslam.{}.photoslam.tmp", child), 5);
  const std::vector<std::string> others = {fmt::format("session.photoslam.{}.photoslam.tmp", ::getpid()),
                                           fmt::format("fresh.{}.photoslam.tmp", child),
                                           fmt::format("other.{}.tmp", child), "name.x1.photoslam.tmp"};
  for (const std::string& name : others) make(name, name.starts_with("fresh") ? 0 : 5);
  ASSERT_TRUE(prepare_output_folder(folder).ok());
  for (const std::string& name : others) EXPECT_TRUE(fs::exists(folder / name)) << name;
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), static_cast<std::ptrdiff_t>(others.size()));
}

}  // namespace
}  // namespace photoslam
