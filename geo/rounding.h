#pragma once

#include <Eigen/Geometry>

/// Bounds on what rounding in double makes wrong, counted in u, half a step of double at 1 (Higham,
/// Accuracy and Stability of Numerical Algorithms, 2002, section 3.3). Products of errors (u² and less) are
/// covered by whole numbers and inequalities that are never all met at once.
/// threads   safe
namespace terracast::geo {

inline constexpr double kU = 0x1.0p-53;

/// By how much the square of a quaternion's length differs from 1, in u.
double length_error(const Eigen::Quaterniond& q);

/// Error of q v as Eigen computes it, in u of v's length, against the rotation that q stands for whatever its
/// length, v -> q v q^-1.
double turn_error(const Eigen::Quaterniond& q);

/// Most that rounding to double changes a value of at most this size; its steps are those of the power of two
/// below. What the size itself errs by is far below the part that is added.
double rounding_of(double largest);

}  // namespace terracast::geo
