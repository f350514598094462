// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <map>

namespace photoslam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct KernelOptions {
  double huber_px = 2.5;
  bool robust = true;

  void visit(OptionVisitor& visitor) {
    visitor.value({"huber_px", "px", 0.5, 10, "Residual above which the loss is linear."}, huber_px);
    visitor.value({"robust", "", 0, 1, "Robust loss."}, robust);
  }
};

struct Options {
  int seed = 0;
  std::string name = "map";
  double rate = 0.1;
  int count = 8;
  KernelOptions kernel;

  void visit(OptionVisitor& visitor) {
    visitor.value({"seed", "", 0, std::numeric_limits<double>::max(), "Seed of every random choice."}, seed);
    visitor.value({"name", "", 0, 0, "Name of the map."}, name);
    visitor.begin_group("solver", "The solver.");
    visitor.value({"rate", "1/s", 0, 1, "Learning rate."}, rate);
    visitor.value({"count", "", 1, 100, "Iterations."}, count);
    visitor.group("kernel", "The kernel of the solver.", kernel);
    visitor.end_group();
  }
};

std::string failure(const Status& status) { return status.ok() ? "no error" : status.error().message; }

std::string failure_of(std::string_view toml) {
  Options options;
  return failure(parse_config(toml, "my.toml", options));
}

TEST(Config, SetsWhatTheFileNamesAndKeepsTheRest) {
  Options options;
  const Status status =
      parse_config("name = 'kitchen'\n[solver]\nrate = 1\n[solver.kernel]\nrobust = false\n", "f", options);
  ASSERT_TRUE(status.ok()) << failure(status);
  EXPECT_EQ(options.name, "kitchen");
  EXPECT_EQ(options.rate, 1.0);
  EXPECT_FALSE(options.kernel.robust);
  EXPECT_EQ(options.count, 8);
  EXPECT_EQ(options.kernel.huber_px, 2.5);
}

TEST(Config, DottedKeysMeanTheSameAsGroups) {
  Options options;
  ASSERT_TRUE(parse_config("solver.kernel.huber_px = 3.5", "f", options).ok());
  EXPECT_EQ(options.kernel.huber_px, 3.5);
}

TEST(Config, ErrorsNameFileLineAndColumn) {
  EXPECT_THAT(failure_of("seed = 1\nname = \n"), StartsWith("my.toml:2:"));
  EXPECT_THAT(failure_of("seed = 1\n[solver]\n  cuont = 3\n"),
              AllOf(StartsWith("my.toml:3:3: "), HasSubstr("unknown configuration key 'solver.cuont'"),
                    HasSubstr("did you mean 'solver.count'?")));
  EXPECT_THAT(failure_of("[sovler]\nrate = 0.5\n"), HasSubstr("did you mean 'solver'?"));
  EXPECT_THAT(failure_of("zzzzzzzz = 1"), HasSubstr("photoslam config --defaults"));
  EXPECT_THAT(failure_of("seed = 1\nseed = 2\n"), StartsWith("my.toml:2:"));
}

TEST(Config, WrongTypesAreErrors) {
  EXPECT_EQ(failure_of("seed = 1.5"), "my.toml:1:8: seed must be a whole number");
  EXPECT_EQ(failure_of("seed = '1'"), "my.toml:1:8: seed must be a whole number");
  EXPECT_EQ(failure_of("name = 3"), "my.toml:1:8: name must be text");
  EXPECT_EQ(failure_of("solver.rate = true"), "my.toml:1:15: solver.rate must be a number");
  EXPECT_EQ(failure_of("solver.kernel.robust = 1"), "my.toml:1:24: solver.kernel.robust must be true or false");
  EXPECT_THAT(failure_of("solver = 1"), HasSubstr("write [solver]"));
  EXPECT_THAT(failure_of("seed.x = 1"), HasSubstr("seed must be a whole number"));
}

TEST(Config, ValuesOutOfRangeAreErrors) {
  EXPECT_THAT(failure_of("solver.kernel.huber_px = 11"), HasSubstr("= 11 is out of range (0.5 … 10 px)"));
  EXPECT_THAT(failure_of("seed = -1"), HasSubstr("seed = -1 is out of range (≥ 0)"));
  EXPECT_THAT(failure_of("seed = 4294967296"), HasSubstr("out of range"));
  EXPECT_THAT(failure_of("solver.rate = nan"), HasSubstr("out of range"));
  EXPECT_THAT(failure_of("solver.rate = inf"), HasSubstr("out of range"));
}

TEST(Config, AnErrorChangesNothing) {
  Options options;
  ASSERT_FALSE(parse_config("name = 'kitchen'\nseed = -1\n[solver]\ncount = 3\n", "f", options).ok());
  EXPECT_EQ(options.name, "map");
  EXPECT_EQ(options.count, 8);
}

TEST(Config, MissingFileIsAnErrorWithItsPath) {
  Options options;
  EXPECT_THAT(failure(load_config("no/such/file.toml", options)), HasSubstr("no/such/file.toml"));
}

TEST(Setting, OverridesOneValue) {
  Options options;
  EXPECT_TRUE(apply_setting("solver.kernel.huber_px=4", options).ok());
  EXPECT_TRUE(apply_setting("name=my map", options).ok());
  EXPECT_TRUE(apply_setting("solver.kernel.robust=false", options).ok());
  EXPECT_TRUE(apply_setting("seed=12", options).ok());
  EXPECT_EQ(options.kernel.huber_px, 4.0);
  EXPECT_EQ(options.name, "my map");
  EXPECT_FALSE(options.kernel.robust);
  EXPECT_EQ(options.seed, 12);
}

TEST(Setting, ExplainsMistakes) {
  Options options;
  EXPECT_THAT(failure(apply_setting("seed", options)), HasSubstr("expected key=value"));
  EXPECT_THAT(failure(apply_setting("sede=1", options)), HasSubstr("did you mean 'seed'?"));
  EXPECT_THAT(failure(apply_setting("solver.count=3x", options)), HasSubstr("must be a whole number, not '3x'"));
  EXPECT_THAT(failure(apply_setting("solver.count=101", options)), HasSubstr("out of range (1 … 100)"));
  EXPECT_THAT(failure(apply_setting("solver.rate=", options)), HasSubstr("must be a number"));
}

TEST(ChangedValues, ListsOnlyWhatDiffers) {
  Options options;
  Options defaults;
  EXPECT_TRUE(changed_values(options, defaults).empty());
  options.kernel.huber_px = 3;
  const std::vector<ConfigEntry> changed = changed_values(options, defaults);
  ASSERT_EQ(changed.size(), 1u);
  EXPECT_EQ(changed[0].key, "solver.kernel.huber_px");
  EXPECT_EQ(std::get<double>(changed[0].value), 3.0);
  EXPECT_EQ(config_values(options).size(), 6u);
}

TEST(ConfigAsToml, LoadsBackUnchanged) {
  Options options;
  options.name = "a \"quoted\" \\ name\n";
  options.rate = 1e-7;
  options.kernel.huber_px = 3;
  options.kernel.robust = false;
  const std::string toml = config_as_toml(options);
  Options loaded;
  const Status status = parse_config(toml, "f", loaded);
  ASSERT_TRUE(status.ok()) << failure(status) << "\n" << toml;
  EXPECT_TRUE(changed_values(loaded, options).empty()) << toml;
}

TEST(ConfigAsToml, ExplainsEveryValue) {
  Options options;
  const std::string toml = config_as_toml(options);
  EXPECT_THAT(toml, HasSubstr("# The solver.\n[solver]\n"));
  EXPECT_THAT(toml, HasSubstr("# Residual above which the loss is linear.  [px] 0.5 … 10\nhuber_px = 2.5\n"));
}

TEST(ConfigManual, HasOneRowPerValue) {
  Options options;
  EXPECT_THAT(config_manual(options),
              HasSubstr("| `huber_px` | `2.5` | px | 0.5 … 10 | Residual above which the loss is linear. |\n"));
}

TEST(ConfigDifferences, NamesWhatDiffersOnBothSides) {
  Options then;
  then.kernel.huber_px = 3;
  then.name = "old";
  const std::string toml = config_as_toml(then) + "bent = 1\n[solver.retired]\nstep = 0.5\n";
  Options now;
  now.count = 9;
  const auto differences = config_differences(toml, "f", now);
  ASSERT_TRUE(differences);
  std::map<std::string, std::pair<std::string, std::string>> found;
  for (const ConfigDifference& d : *differences) found[d.key] = {d.in_file, d.in_options};
  EXPECT_EQ(found, (std::map<std::string, std::pair<std::string, std::string>>{
                       {"name", {"\"old\"", "\"map\""}},
                       {"solver.count", {"8", "9"}},
                       {"solver.kernel.huber_px", {"3.0", "2.5"}},
                       {"solver.kernel.bent", {"1", ""}},
                       {"solver.retired.step", {"0.5", ""}},
                   }));
  EXPECT_EQ(now.name, "map") << "nothing is set";
}

TEST(ConfigDifferences, ThereAreNoneToWhatWasWrittenFromThem) {
  Options options;
  options.rate = 1;
  EXPECT_TRUE(config_differences(config_as_toml(options), "f", options)->empty());
  EXPECT_TRUE(config_differences("name = 'map'\nseed = 0\n[solver]\nrate = 1\ncount = 8\n[solver.kernel]\n"
                                 "robust = true\nhuber_px = 2.5\n",
                                 "f", options)
                  ->empty())
      << "1 is 1.0";
}

TEST(ConfigDifferences, WhatTheFileLacksOrCannotMeanDiffers) {
  Options options;
  const auto differences = config_differences("seed = 'x'\n[solver]\nrate = 7.0\n", "f", options);
  ASSERT_TRUE(differences);
  std::map<std::string, std::string> found;
  for (const ConfigDifference& d : *differences) found[d.key] = d.in_file;
  EXPECT_EQ(found["seed"], "\"x\"");
  EXPECT_EQ(found["solver.rate"], "7.0");
  EXPECT_EQ(found.at("solver.kernel.robust"), "");
  EXPECT_EQ(found.size(), 6u);
  EXPECT_FALSE(config_differences("seed = = 1", "f", options));
}

}  // namespace
}  // namespace photoslam
