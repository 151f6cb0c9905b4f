#include "validate/readers/oxts.h"

#include "core/error.h"
#include "validate/text.h"

namespace terracast::validate {

Pose OxtsPacket::ecef_from_imu() const {
  return {enu_from_ecef(place).transpose() * enu_from_imu(), ecef_from_geodetic(place)};
}

OxtsPacket parse_oxts(std::string_view text, const std::string& where) {
  const std::vector<TextLine> lines = split_lines(text);
  if (lines.size() != 1)
    core::fail(core::ErrorKind::Input, "{}: {} lines where a packet is one", where, lines.size());
  const std::vector<double> n = parse_numbers(lines[0].text, 30, where);
  if (!(std::abs(n[0]) <= 90.0) || !(std::abs(n[1]) <= 360.0) || !(std::abs(n[2]) < 1e6))
    core::fail(core::ErrorKind::Input, "{}: latitude {}, longitude {}, height {} is no place",
               where, n[0], n[1], n[2]);
  for (std::size_t i = 25; i < n.size(); ++i)
    if (n[i] != -1.0)
      core::fail(core::ErrorKind::Input, "{}: {} for number {} of a packet, of no receiver: -1",
                 where, n[i], i + 1);
  // Of the packet's own decimals; a millimetre is what places must agree within.
  constexpr double kMostAccuracy = 1e-3;
  for (const std::size_t i : {23, 24})
    if (!(n[i] > 0.0 && n[i] <= kMostAccuracy))
      core::fail(core::ErrorKind::Input, "{}: an accuracy of {}", where, n[i]);
  const auto vector = [&](std::size_t at) { return Eigen::Vector3d(n[at], n[at + 1], n[at + 2]); };
  OxtsPacket packet;
  packet.place = {n[0], n[1], n[2]};
  packet.roll_rad = n[3];
  packet.pitch_rad = n[4];
  packet.yaw_rad = n[5];
  packet.level_from_imu = (Eigen::AngleAxisd(n[4], Eigen::Vector3d::UnitY()) *
                           Eigen::AngleAxisd(n[3], Eigen::Vector3d::UnitX()))
                              .toRotationMatrix();
  packet.velocity_enu_mps = {n[7], n[6], n[10]};
  packet.velocity_level_mps = {n[8], n[9]};
  packet.force_imu_mps2 = vector(11);
  packet.force_level_mps2 = vector(14);
  packet.rate_imu_radps = vector(17);
  packet.rate_level_radps = vector(20);
  return packet;
}

}  // namespace terracast::validate
