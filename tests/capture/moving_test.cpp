#include "capture/moving.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "capture/channel.h"
#include "capture/moving_json.h"
#include "core/error.h"
#include "core/instance_id.h"
#include "tests/support/expect_error.h"

namespace terracast::capture {
namespace {

using core::ErrorKind;

MovingBody body(const std::string& name, std::uint32_t thing, std::uint32_t first_triangle) {
  return {.name = name,
          .thing = "helicopter",
          .instance_id = core::kFirstMovingId + thing,
          .first_triangle = first_triangle,
          .semantic_id = static_cast<std::uint32_t>(SemanticClass::Helicopter),
          .box_m = {Eigen::Vector3d(-1.0, -2.0, 0.0), Eigen::Vector3d(3.0, 2.0, 1.5)}};
}

const std::vector<MovingBody> kBodies = {body("a", 0, 0), body("a-rotor1", 0, 40), body("b", 1, 0)};

geo::BodyState state(double x_m) {
  return {.time_s = 0.5,
          .world_from_body = {Eigen::Quaterniond(Eigen::AngleAxisd(
                                  0.3, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())),
                              {x_m, 0.1, 1.0 / 3.0}},
          .velocity_world_mps = {0.7, -0.2, 1e-3},
          .acceleration_world_mps2 = {0.1, 0.2, 0.3},
          .angular_velocity_body_radps = {-4.0, 5.0, 41.0}};
}

TEST(Moving, IsReadAsItWasWritten) {
  const std::string file = "here";
  const Source source{file};
  check_moving(kBodies, ErrorKind::Input, "here");
  EXPECT_EQ(moving_from_json(core::Json::parse(json_from_moving(kBodies).text(), "here"), source),
            kBodies);
  MovingStates states = {state(1.0), std::nullopt, state(-25000.123456789)};
  geo::MotionTerms& terms = states[2]->terms;
  terms.reach_s = 0.01;
  terms.position_world[2] = {1.0, -2e5, 1.0 / 3.0};
  terms.turning_body[3] = {1e6, 0.1, -1.0};
  terms.spin_body_radps = {0.0, 0.0, 40.0};
  terms.error_m = 1e-9;
  EXPECT_EQ(
      states_from_json(core::Json::parse(json_from_states(states).text(), "here"), 0.5, source),
      states);
}

TEST(Moving, MotionsAreFoundByInstanceAndTriangle) {
  const BodyMotions motions(kBodies, {state(1.0), state(2.0), std::nullopt},
                            {state(10.0), std::nullopt, state(30.0)});
  const auto place = [&](std::uint32_t thing, std::uint32_t triangle) {
    const BodyMotion* motion =
        motions.find(core::kFirstMovingId + thing, kObjectPrimitives + triangle);
    return motion == nullptr ? 0.0 : motion->from.world_from_body.translation.x();
  };
  EXPECT_EQ(place(0, 0), 1.0);
  EXPECT_EQ(place(0, 39), 1.0);
  EXPECT_EQ(place(0, 40), 2.0);
  EXPECT_EQ(place(0, 5000), 2.0);
  EXPECT_EQ(place(1, 3), 0.0) << "it is not there";
  EXPECT_EQ(place(2, 3), 0.0) << "nobody has that";
  EXPECT_FALSE(motions.find(core::kFirstMovingId, kObjectPrimitives + 45)->to);
  EXPECT_EQ(motions.find(77, kObjectPrimitives), nullptr) << "of what stands";
  EXPECT_EQ(motions.find(0, 12), nullptr) << "of the ground";
  EXPECT_EQ(body_shown(kBodies, core::kFirstMovingId, kObjectPrimitives + 39), &kBodies[0]);
  EXPECT_EQ(body_shown(kBodies, core::kFirstMovingId, kObjectPrimitives + 40), &kBodies[1]);
  EXPECT_EQ(body_shown(kBodies, core::kFirstMovingId + 1, kObjectPrimitives), &kBodies[2]);
  EXPECT_EQ(body_shown(kBodies, core::kFirstMovingId + 2, kObjectPrimitives), nullptr);
  EXPECT_EQ(body_shown(kBodies, core::kFirstMovingId, 12), nullptr) << "of the ground";
}

TEST(Moving, WhatCannotBeIsRefused) {
  const std::string file = "here";
  const Source source{file};
  const auto refused = [&](std::vector<MovingBody> bodies, const char* message) {
    test::expect_error(ErrorKind::Input, {message},
                       [&] { check_moving(bodies, ErrorKind::Input, "here"); });
  };
  refused({body("a", 1, 0)}, "out of order");
  refused({body("a", 0, 0), body("b", 2, 0)}, "out of order");
  refused({body("a-rotor1", 0, 4)}, "out of order");
  refused({body("a", 0, 0), body("a-rotor1", 0, 8), body("a-rotor2", 0, 8)}, "out of order");
  refused({body("a", 0, 0), body("a", 1, 0)}, "there twice");
  refused({body("../a", 0, 0)}, "1 to 64 letters");
  MovingBody empty = body("a", 0, 0);
  empty.box_m = geo::Box3d();
  refused({empty}, "box");
  core::Json list = core::Json::array();
  core::Json one = json_from_moving({body("a", 0, 0)}).at(0);
  one.set("semantic_id", 400);
  list.push(one);
  test::expect_error(ErrorKind::Input, {"semantic_id"}, [&] { moving_from_json(list, source); });
  test::expect_error(ErrorKind::Input, {"moving must be a list"},
                     [&] { states_from_json(one, 0.0, source); });
  const auto states_refused = [&](const MovingStates& states, std::size_t count,
                                  const char* message) {
    const std::vector<MovingBody> bodies(kBodies.begin(),
                                         kBodies.begin() + static_cast<std::ptrdiff_t>(count));
    test::expect_error(ErrorKind::Input, {message},
                       [&] { check_states(states, bodies, ErrorKind::Input, "here"); });
  };
  states_refused({state(1.0)}, 2, "the states of 1 bodies");
  states_refused({state(1.0), std::nullopt}, 2, "without its thing");
  geo::BodyState fast = state(1.0);
  fast.velocity_world_mps.x() = std::numeric_limits<double>::infinity();
  states_refused({fast}, 1, "not finite");
  geo::BodyState long_rotation = state(1.0);
  long_rotation.world_from_body.rotation.coeffs() *= 1.01;
  states_refused({long_rotation}, 1, "unit length");
}

}  // namespace
}  // namespace terracast::capture
