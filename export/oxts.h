#pragma once

#include <string>

#include "capture/frame.h"
#include "export/imu_states.h"
#include "geo/geodesy.h"

/// What KITTI raw records of a vehicle's motion: the packets of an OXTS inertial and satellite unit
/// that stands at the body's reference point, its axes the body's.
namespace terracast::exporters {

/// A packet: 30 numbers parted by single blanks.
///  1-3    latitude, longitude, deg; height above the ellipsoid, m
///  4-6    roll, pitch, yaw, rad: Rz(yaw) Ry(pitch) Rx(roll) takes the body's axes to the east,
///         north, up of that very place
///  7-11   velocity, m/s: north, east; forward and left (level), up
/// 12-17   specific force, m/s^2: the acceleration against the Earth, and standard gravity upwards;
///         along the body's axes, then levelled (forward, left, up)
/// 18-23   turn rate against the Earth, rad/s, in the same two frames
/// 24-25   largest error of position, m, and velocity, m/s: what the decimals cut off
/// 26-30   states of a satellite receiver: there is none, -1
/// accuracy   positions 1e-6 m, angles 1e-9 rad, all else within its decimals (9 and 12)
std::string oxts_packet(const geo::WorldFrame& world, const capture::FrameRecord& record);

/// The same of a sample of an IMU: places, attitudes and velocities are those of the body's reference point, in truth;
/// forces and rates are what the IMU shows where it is mounted, turned into the body's axes, with the Earth's turning.
/// body_from_imu   the mount
std::string oxts_packet_of_imu(const ImuState& state, const geo::Rigid3d& body_from_imu);

/// dataformat.txt: a line for each number of a packet.
std::string oxts_format();

}  // namespace terracast::exporters
