#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "job/moving.h"
#include "job/traffic/traffic.h"
#include "tests/support/traffic_town.h"
#include "tiler/objects/gait.h"

namespace terracast::job {
namespace {

using namespace test;

bool is_leg(const scene::TurningPart& part) { return part.name.starts_with("leg"); }

double stature_of(const MovingThing& walker) {
  return tiler::find_thing(walker.shape.thing)->size_m.z();
}

/// Lowest and middle places of a leg's sole in its thing's frame, at an angle, by its own vertices.
struct Sole {
  double lowest_m = 0.0;
  double middle_x_m = 0.0;
};
Sole sole_at(const scene::TurningPart& leg, double angle_rad) {
  Sole sole{.lowest_m = 1e9};
  double sum = 0.0;
  int num = 0;
  double foot_m = 0.0;
  for (const Eigen::Vector3i& vertex : leg.shape.shown->shape.vertices_steps)
    foot_m = std::min(foot_m, vertex.z() * kHeightStep_m);
  for (const Eigen::Vector3i& vertex : leg.shape.shown->shape.vertices_steps) {
    const Vector3d at = vertex.cast<double>() * kHeightStep_m;
    const Vector3d turned = Eigen::AngleAxisd(angle_rad, leg.axis) * at + leg.origin_m;
    sole.lowest_m = std::min(sole.lowest_m, turned.z());
    // Where the leg's own axis meets the ground below the ankle.
    if (at.z() > foot_m + 0.001) continue;
    sum += turned.x() - (Eigen::AngleAxisd(angle_rad, leg.axis) * Vector3d(at.x(), 0, 0)).x();
    ++num;
  }
  sole.middle_x_m = sum / num;
  return sole;
}

std::vector<MovingThing> walkers(const std::string& keys) {
  return traffic_of(checkerboard().network,
                    "kind = \"people\"\namount = 6.0\nmost = 200\nreach_m = 300.0\n" + keys,
                    frames_at(5.0, 11));
}

TEST(Walkers, TakeStepsOfPublishedLengthsAndCadences) {
  // Adults: a walk ratio of 6.5 mm of a step a minute, so 0.72 m at 111 a minute at 1.34 m/s.
  EXPECT_NEAR(tiler::step_length_m(1.75, 1.34), 0.723, 0.001);
  for (const double speed_mps : {0.8, 1.1, 1.34, 1.6, 1.9}) {
    const double step_m = tiler::step_length_m(1.75, speed_mps);
    EXPECT_NEAR(step_m / (60.0 * speed_mps / step_m), 0.0065, 1e-12);
  }
  // Half the stature is as far as legs go.
  EXPECT_EQ(tiler::step_length_m(1.75, 3.5), 0.875);
  EXPECT_NEAR(tiler::usual_walk_mps(1.75), 1.34, 1e-12);
  int num = 0;
  for (const MovingThing& walker : walkers("")) {
    ASSERT_EQ(walker.parts.size(), 4U);
    const double speed_mps = walker.states.front()->velocity_world_mps.norm();
    for (const scene::TurningPart& part : walker.parts) {
      EXPECT_GT(part.swing_rad, 0.1);
      EXPECT_LT(part.swing_rad, 0.46);
      EXPECT_EQ(part.rate_radps, 0.0);
      const double step_m = std::numbers::pi / part.per_metre_rad;
      // Who comes out of a bend is slower there than their steps are for.
      EXPECT_GT(step_m, tiler::step_length_m(stature_of(walker), speed_mps) - 1e-6);
      num += std::abs(step_m - tiler::step_length_m(stature_of(walker), speed_mps)) < 1e-6 ? 1 : 0;
    }
  }
  EXPECT_GT(num, 100);
}

TEST(Walkers, FeetStayInPlaceWhileTheyCarryAndLegsTakeTurns) {
  double most_slide_m = 0.0, deepest_m = 0.0, highest_m = 0.0;
  for (const MovingThing& walker : walkers("speed = 1.1\n")) {
    std::vector<const scene::TurningPart*> legs;
    for (const scene::TurningPart& part : walker.parts)
      if (is_leg(part)) legs.push_back(&part);
    ASSERT_EQ(legs.size(), 2U);
    const double step_m = std::numbers::pi / legs[0]->per_metre_rad;
    const auto angle_at = [&](const scene::TurningPart& leg, double gone_m) {
      return scene::turn_of_part(leg, 0.0, gone_m, 0.0).angle_rad;
    };
    // A leg carries while it goes back: over one step in two.
    for (const scene::TurningPart* leg : legs) {
      double begin_m = -leg->phase_rad / leg->per_metre_rad - 0.5 * step_m;
      EXPECT_NEAR(angle_at(*leg, begin_m), -leg->swing_rad, 1e-9);
      EXPECT_NEAR(angle_at(*leg, begin_m + step_m), leg->swing_rad, 1e-9);
      double least = 1e9, most = -1e9;
      for (int k = 0; k <= 100; ++k) {
        const double gone_m = begin_m + 0.01 * k * step_m;
        const Sole sole = sole_at(*leg, angle_at(*leg, gone_m));
        deepest_m = std::max(deepest_m, -sole.lowest_m);
        highest_m = std::max(highest_m, sole.lowest_m);
        if (k < 10 || k > 90) continue;  // near its ends the other carries too
        least = std::min(least, gone_m + sole.middle_x_m);
        most = std::max(most, gone_m + sole.middle_x_m);
      }
      most_slide_m = std::max(most_slide_m, (most - least) / stature_of(walker) * 1.75);
    }
    // The other leg, and the arm at its side, are half a turn of the phase behind.
    for (double gone_m = 0.0; gone_m < 2.0; gone_m += 0.05) {
      EXPECT_NEAR(angle_at(*legs[0], gone_m), -angle_at(*legs[1], gone_m), 1e-9);
      for (const scene::TurningPart& part : walker.parts)
        if (!is_leg(part) && part.origin_m.y() * legs[0]->origin_m.y() > 0.0) {
          EXPECT_LE(angle_at(part, gone_m) * angle_at(*legs[0], gone_m), 1e-12);
        }
    }
  }
  RecordProperty("slide_m", fmt::format("{}", most_slide_m));
  RecordProperty("deepest_m", fmt::format("{}", deepest_m));
  RecordProperty("highest_m", fmt::format("{}", highest_m));
  EXPECT_LT(most_slide_m, 0.016);
  EXPECT_LT(deepest_m, 0.015);
  EXPECT_LT(highest_m, 0.055);
}

TEST(Walkers, AreInDifferentStepsAndInTheSameAgain) {
  const auto phases = [](const std::string& keys) {
    std::vector<double> all;
    for (const MovingThing& walker : walkers(keys)) all.push_back(walker.parts[0].phase_rad);
    return all;
  };
  const std::vector<double> once = phases("");
  EXPECT_EQ(phases(""), once);
  EXPECT_NE(phases("seed = 2\n"), once);
  std::set<long> parts;
  for (const double phase_rad : once)
    parts.insert(std::lround(std::fmod(phase_rad, 2.0 * std::numbers::pi) * 2.0));
  EXPECT_GT(parts.size(), 10U);
}

TEST(Walkers, StandWithStraightLegsWhileTheyDoNotGo) {
  for (const char* name : {"person", "child"}) {
    const MovingThing someone = moving_thing("someone", *tiler::find_thing(name), 0);
    ASSERT_EQ(someone.parts.size(), 4U);
    for (const scene::TurningPart& part : someone.parts)
      for (const double time_s : {0.0, 1.3, 100.0}) {
        const scene::PartTurn turn = scene::turn_of_part(part, time_s, 0.0, 0.0);
        EXPECT_NEAR(turn.angle_rad, 0.0, 1e-12);
        EXPECT_EQ(turn.rate_radps, 0.0);
      }
  }
}

}  // namespace
}  // namespace terracast::job
