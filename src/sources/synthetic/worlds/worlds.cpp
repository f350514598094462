// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/worlds/worlds.h"

#include <algorithm>

#include "base/check.h"
#include "sources/synthetic/room.h"

namespace photoslam {
namespace {

struct Plan {
  WorldInfo info;
  synthetic::SceneModel (*build)(uint64_t seed, SceneQuality quality, Executor& executor);
  synthetic::Tour (*tour)();
};

const std::vector<Plan>& plans() {
  static const std::vector<Plan> kPlans = {
      {{"house", "two rooms and two doorways"}, synthetic::build_house, synthetic::house_tour},
      {{"corridors", "a square of corridors, 64 m round"}, synthetic::build_corridors, synthetic::corridors_tour},
      {{"doors", "a long corridor of doors that are all alike"}, synthetic::build_doors, synthetic::doors_tour},
      {{"courtyard", "houses, trees, sky and far towers"}, synthetic::build_courtyard, synthetic::courtyard_tour},
  };
  return kPlans;
}

class PlannedWorld final : public SyntheticWorld {
 public:
  PlannedWorld(const Plan& plan, uint64_t seed, SceneQuality quality, Executor& executor)
      : SyntheticWorld(plan.build(seed, quality, executor), quality, executor), tour_(plan.tour()) {}

  std::unique_ptr<const CameraPath> path(uint64_t seed, double seconds_per_lap) const override {
    constexpr double kUsualPace = 10;
    return std::make_unique<Walk>(seed, tour_.waypoints, kUsualPace / (seconds_per_lap * tour_.lap_seconds),
                                  static_cast<int>(tour_.waypoints.size()));
  }

 private:
  synthetic::Tour tour_;
};

}  // namespace

std::vector<WorldInfo> synthetic_worlds() {
  std::vector<WorldInfo> worlds = {{"room", "a furnished living room"}};
  for (const Plan& plan : plans()) worlds.push_back(plan.info);
  return worlds;
}

std::shared_ptr<const SyntheticWorld> make_world(const std::string& name, uint64_t seed, Executor& executor,
                                                 SceneQuality quality) {
  if (name == "room") return std::make_shared<const SyntheticRoom>(seed, executor, quality);
  const auto plan = std::ranges::find(plans(), name, [](const Plan& p) { return p.info.name; });
  PHOTOSLAM_CHECK(plan != plans().end(), "no world named '{}'", name);
  return std::make_shared<const PlannedWorld>(*plan, seed, quality, executor);
}

}  // namespace photoslam
