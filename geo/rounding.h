#pragma once

#include <Eigen/Geometry>
#include <bit>
#include <cstdint>

/// Bounds on what rounding in double makes wrong, counted in u, half a step of double at 1 (Higham,
/// Accuracy and Stability of Numerical Algorithms, 2002, section 3.3). Products of errors (u² and less) are
/// covered by whole numbers and inequalities that are never all met at once.
/// threads   safe
namespace terracast::geo {

inline constexpr double kU = 0x1.0p-53;

/// 2^exponent, without a call of the library.
/// valid     exponents of normal numbers, -1022 to 1023
constexpr double power_of_two(int exponent) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(exponent + 1023) << 52);
}

/// The exponent of the greatest power of two that is no larger than a number's size.
/// valid     normal numbers; -1023 of zero and what is smaller, 1024 of infinity and of what is no number
constexpr int exponent_of(double value) {
  return static_cast<int>(std::bit_cast<std::uint64_t>(value) >> 52 & 0x7ff) - 1023;
}

/// By how much the square of a quaternion's length differs from 1, in u.
double length_error(const Eigen::Quaterniond& q);

/// Error of q v as Eigen computes it, in u of v's length, against the rotation that q stands for whatever its
/// length, v -> q v q^-1.
double turn_error(const Eigen::Quaterniond& q);

/// Most that rounding to double changes a value of at most this size; its steps are those of the power of two
/// below. What the size itself errs by is far below the part that is added.
double rounding_of(double largest);

}  // namespace terracast::geo
