// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// As much of GoogleTest as the engine's tests need, for machines without the package.

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace tiny_test {

struct Test {
  const char* suite;
  const char* name;
  void (*run)();
};

/// All tests, and how many expectations have failed.
inline std::vector<Test>& tests() {
  static std::vector<Test> all;
  return all;
}
inline int& failures() {
  static int count = 0;
  return count;
}
inline bool add(const char* suite, const char* name, void (*run)()) {
  tests().push_back({suite, name, run});
  return true;
}

struct Message {
  std::ostringstream text;
  template <class T>
  Message& operator<<(const T& value) {
    text << value;
    return *this;
  }
};

/// Reports a failure; assignment binds looser than <<, and returns nothing, as `return` in a test has to.
struct Report {
  const char* file;
  int line;
  void operator=(const Message& message) const {
    ++failures();
    std::printf("%s:%d: %s\n", file, line, message.text.str().c_str());
  }
};

template <class Function>
bool throws(Function&& function) {
  try {
    function();
    return false;
  } catch (const std::exception&) {
    return true;
  }
}

/// Arguments are substrings of "Suite.Name"; without any all tests run.
inline int run_all(int argc, char** argv) {
  int failed = 0, ran = 0;
  for (const Test& test : tests()) {
    const std::string name = std::string(test.suite) + "." + test.name;
    bool wanted = argc < 2;
    for (int i = 1; i < argc; ++i) wanted = wanted || name.find(argv[i]) != std::string::npos;
    if (!wanted) continue;
    const int before = failures();
    const auto start = std::chrono::steady_clock::now();
    try {
      test.run();
    } catch (const std::exception& error) {
      ++failures();
      std::printf("%s\n", error.what());
    }
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    std::printf("[%s] %s (%.0f ms)\n", failures() == before ? "  OK  " : "FAILED", name.c_str(), took.count());
    std::fflush(stdout);
    failed += failures() != before ? 1 : 0;
    ++ran;
  }
  std::printf("%d of %d tests passed\n", ran - failed, ran);
  return failed == 0 && ran > 0 ? 0 : 1;
}

}  // namespace tiny_test

#define TEST(suite, name)                                                                   \
  static void suite##_##name();                                                             \
  static const bool suite##_##name##_added = tiny_test::add(#suite, #name, suite##_##name); \
  static void suite##_##name()

#define TINY_TEST_CHECK(condition, text, action) \
  switch (0)                                     \
  case 0:                                        \
  default:                                       \
    if (condition)                               \
      ;                                          \
    else                                         \
      action tiny_test::Report{__FILE__, __LINE__} = tiny_test::Message() << "not so: " << (text) << " "

#define EXPECT_TRUE(a) TINY_TEST_CHECK(static_cast<bool>(a), #a, )
#define EXPECT_FALSE(a) TINY_TEST_CHECK(!static_cast<bool>(a), "not " #a, )
#define EXPECT_EQ(a, b) TINY_TEST_CHECK((a) == (b), #a " == " #b, )
#define EXPECT_NE(a, b) TINY_TEST_CHECK((a) != (b), #a " != " #b, )
#define EXPECT_LE(a, b) TINY_TEST_CHECK((a) <= (b), #a " <= " #b, )
#define EXPECT_LT(a, b) TINY_TEST_CHECK((a) < (b), #a " < " #b, )
#define EXPECT_GE(a, b) TINY_TEST_CHECK((a) >= (b), #a " >= " #b, )
#define EXPECT_GT(a, b) TINY_TEST_CHECK((a) > (b), #a " > " #b, )
#define EXPECT_NEAR(a, b, c) \
  TINY_TEST_CHECK(std::abs(static_cast<double>(a) - static_cast<double>(b)) <= static_cast<double>(c), #a " near " #b, )
#define EXPECT_ANY_THROW(statement) TINY_TEST_CHECK(tiny_test::throws([&] { statement; }), "throws: " #statement, )
#define EXPECT_NO_THROW(statement) TINY_TEST_CHECK(!tiny_test::throws([&] { statement; }), "throws not: " #statement, )

#define ASSERT_TRUE(a) TINY_TEST_CHECK(static_cast<bool>(a), #a, return)
#define ASSERT_GE(a, b) TINY_TEST_CHECK((a) >= (b), #a " >= " #b, return)
#define ASSERT_EQ(a, b) TINY_TEST_CHECK((a) == (b), #a " == " #b, return)
#define ASSERT_NEAR(a, b, c)                                                                                           \
  TINY_TEST_CHECK(std::abs(static_cast<double>(a) - static_cast<double>(b)) <= static_cast<double>(c), #a " near " #b, \
                  return)
