// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/checked_file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/archive.h"
#include "base/file.h"
#include "base/random.h"

namespace photoslam {
namespace {

constexpr FileKind kKind{"test", "TESTFILE", 3};

class CheckedFile : public ::testing::Test {
 protected:
  CheckedFile() : folder(std::filesystem::temp_directory_path() / fmt::format("photoslam-checked-{}", ::getpid())) {
    std::filesystem::create_directories(folder);
  }
  ~CheckedFile() override { std::filesystem::remove_all(folder); }

  std::string message_after_writing(const std::string& bytes) const {
    EXPECT_TRUE(write_file_atomically(path(), bytes));
    const auto read = read_checked_file(path(), kKind);
    return read ? "" : read.error().message;
  }
  std::filesystem::path path() const { return folder / "file"; }

  std::filesystem::path folder;
};

TEST_F(CheckedFile, ReadsWhatWasWritten) {
  for (const std::string& content : {std::string(), std::string("x"), std::string(100000, 'y')}) {
    ASSERT_TRUE(write_checked_file(path(), kKind, content));
    const auto read = read_checked_file(path(), kKind);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(*read, content);
  }
}

TEST_F(CheckedFile, SaysWhatIsWrong) {
  ASSERT_TRUE(write_checked_file(path(), kKind, "some content that matters"));
  const std::string good = *read_file(path());
  EXPECT_NE(message_after_writing(good.substr(0, 12)).find("truncated"), std::string::npos);
  EXPECT_NE(message_after_writing(good.substr(0, good.size() - 1)).find("truncated"), std::string::npos);
  EXPECT_NE(message_after_writing(good + "x").find("damaged"), std::string::npos);
  EXPECT_NE(message_after_writing("PNG image, 40 bytes of something else..").find("not a test file"),
            std::string::npos);
  ASSERT_TRUE(write_checked_file(path(), {"test", "TESTFILE", 4}, "from the future"));
  EXPECT_NE(read_checked_file(path(), kKind).error().message.find("newer"), std::string::npos);
  FileKind newer = kKind;
  newer.oldest = newer.version = 5;
  EXPECT_NE(read_checked_file(path(), newer).error().message.find("the photoslam that wrote it"), std::string::npos);
  EXPECT_FALSE(read_checked_file(folder / "missing", kKind));
}

TEST_F(CheckedFile, EveryDamageIsNoticed) {
  std::string content(3000, '\0');
  Random random(1);
  for (char& c : content) c = static_cast<char>(random.index(256));
  ASSERT_TRUE(write_checked_file(path(), kKind, content));
  const std::string good = *read_file(path());
  for (int i = 0; i < 500; ++i) {
    std::string bad = good;
    const auto at = static_cast<size_t>(random.index(static_cast<int>(bad.size())));
    bad[at] = static_cast<char>(bad[at] ^ (1 << random.index(8)));
    EXPECT_NE(message_after_writing(bad), "") << at;
  }
  for (int i = 0; i < 50; ++i) {
    EXPECT_NE(message_after_writing(good.substr(0, static_cast<size_t>(random.index(static_cast<int>(good.size()))))),
              "");
  }
}

TEST_F(CheckedFile, AKillWhileWritingKeepsOneWholeFile) {
  Random random(2);
  ASSERT_TRUE(write_checked_file(path(), kKind, std::string(200000, 'a')));
  for (int i = 0; i < 200; ++i) {
    const pid_t child = ::fork();
    if (child == 0) {
      for (char c = 'b';; c = c == 'z' ? 'b' : static_cast<char>(c + 1)) {
        (void)write_checked_file(path(), kKind, std::string(200000, c)).ok();
      }
    }
    ::usleep(static_cast<useconds_t>(random.index(3000)));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    const auto read = read_checked_file(path(), kKind);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->size(), 200000u);
    ASSERT_EQ(read->find_first_not_of((*read)[0]), std::string::npos);
  }
}

struct Inner {
  double value = 0;
  std::vector<std::string> names;
  void serialize(Archive& a) { a(value, names); }
};

TEST(Archive, ReadsWhatItWrote) {
  std::vector<Inner> inner{{1.5, {"a", ""}}, {-2, {}}};
  std::array<uint8_t, 3> bytes{1, 2, 3};
  FrameId id(7);
  Archive writer;
  writer(inner, bytes, id);
  std::vector<Inner> inner2;
  std::array<uint8_t, 3> bytes2{};
  FrameId id2;
  Archive reader(writer.bytes());
  reader(inner2, bytes2, id2);
  EXPECT_TRUE(reader.at_end());
  EXPECT_EQ(inner2.size(), 2u);
  EXPECT_EQ(inner2[0].names, inner[0].names);
  EXPECT_EQ(bytes2, bytes);
  EXPECT_EQ(id2, id);
  Archive again;
  again(inner2, bytes2, id2);
  EXPECT_EQ(again.bytes(), writer.bytes());
}

TEST(Archive, RefusesToReadPastTheEnd) {
  Archive writer;
  std::vector<double> values(4, 1.0);
  writer(values);
  for (size_t size = 0; size < writer.bytes().size(); ++size) {
    Archive reader(std::string_view(writer.bytes()).substr(0, size));
    EXPECT_THROW(reader(values), CheckError) << size;
  }
}

}  // namespace
}  // namespace photoslam
