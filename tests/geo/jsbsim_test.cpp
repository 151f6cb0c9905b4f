// The rigid body's equations over the turning Earth against JSBSim, a program of its own.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "geo/gravity.h"
#include "geo/vehicles/rigid_body.h"
#include "tests/support/test_data.h"

namespace terracast::geo {
namespace {

using Eigen::Vector3d;
constexpr double kFoot_m = 0.3048;

/// JSBSim: the variable TERRACAST_JSBSIM, or a program of that name on the path; empty: there is none.
std::string jsbsim_program() {
  if (const char* named = std::getenv("TERRACAST_JSBSIM")) return named;
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (std::filesystem::exists(folder + "/JSBSim")) return folder + "/JSBSim";
  return "";
}

/// A body without a surface, thrown eastward from 30 000 ft.
constexpr const char* kBody = R"(<?xml version="1.0"?>
<fdm_config name="stone" version="2.0" release="ALPHA">
  <fileheader><author>terracast</author></fileheader>
  <metrics>
    <wingarea unit="FT2">1</wingarea><wingspan unit="FT">1</wingspan><chord unit="FT">1</chord>
    <htailarea unit="FT2">0</htailarea><htailarm unit="FT">0</htailarm>
    <vtailarea unit="FT2">0</vtailarea><vtailarm unit="FT">0</vtailarm>
    <location name="AERORP" unit="IN"><x>0</x><y>0</y><z>0</z></location>
    <location name="EYEPOINT" unit="IN"><x>0</x><y>0</y><z>0</z></location>
    <location name="VRP" unit="IN"><x>0</x><y>0</y><z>0</z></location>
  </metrics>
  <mass_balance>
    <ixx unit="SLUG*FT2">1</ixx><iyy unit="SLUG*FT2">2</iyy><izz unit="SLUG*FT2">2.5</izz>
    <emptywt unit="LBS">5</emptywt>
    <location name="CG" unit="IN"><x>0</x><y>0</y><z>0</z></location>
  </mass_balance>
  <ground_reactions/><propulsion/><aerodynamics/>
  <output name="drop.csv" type="CSV" rate="100">
    <property>position/ecef-x-ft</property>
    <property>position/ecef-y-ft</property>
    <property>position/ecef-z-ft</property>
  </output>
</fdm_config>
)";
constexpr const char* kStart = R"(<?xml version="1.0"?>
<initialize name="start">
  <ubody unit="FT/SEC">300</ubody><vbody unit="FT/SEC">0</vbody><wbody unit="FT/SEC">0</wbody>
  <latitude unit="DEG" type="geodetic">42.5</latitude><longitude unit="DEG">1.5</longitude>
  <phi unit="DEG">0</phi><theta unit="DEG">0</theta><psi unit="DEG">90</psi>
  <altitude unit="FT">30000</altitude>
</initialize>
)";
constexpr const char* kScript = R"(<?xml version="1.0"?>
<runscript name="drop">
  <use aircraft="stone" initialize="start"/>
  <run start="0" end="30" dt="0.01"/>
</runscript>
)";

/// Attraction of a point mass with the Earth's flattening to J2 alone, which is JSBSim's, with its figures of WGS84.
Vector3d attraction_of_j2(const Vector3d& ecef) {
  constexpr double kMu = 3.986004418e14, kJ2 = 1.08262982e-3;
  const double r = ecef.norm(), ratio = kWgs84SemiMajorAxis_m / r;
  const double sin2 = ecef.z() * ecef.z() / (r * r), j = 1.5 * kJ2 * ratio * ratio;
  const Vector3d shares(1.0 + j * (1.0 - 5.0 * sin2), 1.0 + j * (1.0 - 5.0 * sin2),
                        1.0 + j * (3.0 - 5.0 * sin2));
  return -kMu / (r * r * r) * shares.cwiseProduct(ecef);
}

TEST(RigidBody, FallsOverTheTurningEarthAsJsbsimSays) {
  const std::string program = jsbsim_program();
  if (program.empty())
    GTEST_SKIP() << "no JSBSim: set TERRACAST_JSBSIM to the program (usr/games/JSBSim of Debian's "
                    "package flightgear, which need not be installed)";
  const test::ScratchFolder scratch;
  const std::filesystem::path folder = scratch.path();
  std::filesystem::create_directories(folder / "aircraft/stone");
  std::ofstream(folder / "aircraft/stone/stone.xml") << kBody;
  std::ofstream(folder / "aircraft/stone/start.xml") << kStart;
  std::ofstream(folder / "drop.xml") << kScript;
  const std::string command = "cd '" + folder.string() + "' && '" + program + "' --root='" +
                              folder.string() + "' --script=drop.xml > log.txt 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  std::vector<std::pair<double, Vector3d>> places;
  std::ifstream csv(folder / "drop.csv");
  std::string line;
  std::getline(csv, line);
  while (std::getline(csv, line)) {
    double t = 0.0, x = 0.0, y = 0.0, z = 0.0;
    char comma = ',';
    std::istringstream(line) >> t >> comma >> x >> comma >> y >> comma >> z;
    places.emplace_back(t, kFoot_m * Vector3d(x, y, z));
  }
  ASSERT_GT(places.size(), 2900U);
  const WorldFrame frame({42.5, 1.5, 0.0});
  const Rigid3d world_from_ecef = frame.ecef_from_world().inverse();
  const Vector3d earth = earth_rate_world_radps(frame);
  using Body = Eigen::Matrix<double, rigid_state::kSize, 1>;
  // With gravity to J2, and with that of the normal field.
  for (const bool is_normal : {false, true}) {
    const auto acceleration_at = [&](const Vector3d& place, const Vector3d& velocity) -> Vector3d {
      const Vector3d coriolis = -2.0 * earth.cross(velocity);
      if (is_normal) return gravity_world_mps2(frame, place) + coriolis;
      const Vector3d ecef = frame.ecef_from_world() * place;
      const Vector3d centrifugal =
          kEarthRate_radps * kEarthRate_radps * Vector3d(ecef.x(), ecef.y(), 0.0);
      return world_from_ecef.rotation * (attraction_of_j2(ecef) + centrifugal) + coriolis;
    };
    Body body = Body::Zero();
    set_rotation(body, Eigen::Quaterniond::Identity());
    body.segment<3>(rigid_state::kPosition) = world_from_ecef * places.front().second;
    body.segment<3>(rigid_state::kVelocity) = 300.0 * kFoot_m * Vector3d::UnitX();
    double most_m = 0.0;
    std::size_t next = 1;
    for (int i = 0; next < places.size(); ++i) {
      body = runge_kutta_step(body, 0.0, 1e-2, [&](double, const Body& at) {
        Body rates = Body::Zero();
        set_rigid_rates(at,
                        acceleration_at(at.segment<3>(rigid_state::kPosition),
                                        at.segment<3>(rigid_state::kVelocity)),
                        Vector3d::Zero(), Vector3d(1.0, 2.0, 2.5), earth, rates);
        return rates;
      });
      ASSERT_NEAR(places[next].first, 0.01 * (i + 1), 1e-6);
      most_m = std::max(
          most_m, (frame.ecef_from_world() * Vector3d(body.segment<3>(rigid_state::kPosition)) -
                   places[next].second)
                      .norm());
      ++next;
    }
    RecordProperty(is_normal ? "normal_m" : "j2_m", fmt::format("{:.3g}", most_m));
    // 5e-5 m/s^2 is what the terms beyond J2 come to: 2 cm after 30 s.
    EXPECT_LT(most_m, is_normal ? 0.03 : 1e-3);
  }
}

}  // namespace
}  // namespace terracast::geo
