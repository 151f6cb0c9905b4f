#include "geo/paths/arc_length.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace terracast::geo {
namespace {

/// Gauss-Legendre, 8 points.
double length_between(const Path& path, double begin, double end) {
  constexpr double kNodes[] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                               0.9602898564975363};
  constexpr double kWeights[] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                 0.1012285362903763};
  const double half = 0.5 * (end - begin);
  const double middle = 0.5 * (begin + end);
  double sum = 0.0;
  for (int i = 0; i < 4; ++i) {
    sum += kWeights[i] * (path.at(middle - half * kNodes[i]).first.norm() +
                          path.at(middle + half * kNodes[i]).first.norm());
  }
  return half * sum;
}

}  // namespace

ArcLength::ArcLength(std::shared_ptr<const Path> path) : path_(std::move(path)) {
  const std::vector<double> joints = path_->joints();
  for (std::size_t i = 0; i + 1 < joints.size(); ++i)
    add(joints[i], joints[i + 1], length_between(*path_, joints[i], joints[i + 1]), 0);
  TERRACAST_CHECK(!pieces_.empty());
  slowest_ = {0.0, path_->at(0.0).first.norm()};
  const auto look_at = [&](double u) {
    const double metres_per_u = path_->at(u).first.norm();
    if (metres_per_u < slowest_.metres_per_u) slowest_ = {u, metres_per_u};
  };
  constexpr int kLooksAPiece = 8;
  for (const Piece& piece : pieces_)
    for (int i = 1; i <= kLooksAPiece; ++i)
      look_at(piece.begin + (piece.end - piece.begin) * i / kLooksAPiece);
}

void ArcLength::add(double begin, double end, double length_m, int depth) {
  constexpr int kMostHalvings = 12;
  constexpr double kTolerance = 1e-11;
  const double middle = 0.5 * (begin + end);
  const double left_m = length_between(*path_, begin, middle);
  const double right_m = length_between(*path_, middle, end);
  if (depth < kMostHalvings && std::abs(left_m + right_m - length_m) > kTolerance * length_m) {
    add(begin, middle, left_m, depth + 1);
    add(middle, end, right_m, depth + 1);
    return;
  }
  const double start_m = pieces_.empty() ? 0.0 : total_m();
  pieces_.push_back({begin, end, start_m, left_m + right_m});
}

double ArcLength::length_at(double u) const {
  const auto after = std::upper_bound(pieces_.begin() + 1, pieces_.end(), u,
                                      [](double value, const Piece& p) { return value < p.begin; });
  const Piece& piece = *(after - 1);
  if (u >= piece.end) return piece.start_m + piece.length_m;
  return piece.start_m + length_between(*path_, piece.begin, u);
}

double ArcLength::parameter_at(double length_m) const {
  const auto after =
      std::upper_bound(pieces_.begin() + 1, pieces_.end(), length_m,
                       [](double value, const Piece& p) { return value < p.start_m; });
  const Piece& piece = *(after - 1);
  const double wanted_m = std::clamp(length_m - piece.start_m, 0.0, piece.length_m);
  // Newton: the derivative of length by parameter is the first derivative's norm, never near 0.
  constexpr double kTolerance_m = 1e-11;
  double u = piece.begin + (piece.end - piece.begin) * (wanted_m / piece.length_m);
  for (int i = 0; i < 12; ++i) {
    const double excess_m = length_between(*path_, piece.begin, u) - wanted_m;
    if (std::abs(excess_m) < kTolerance_m) break;
    u = std::clamp(u - excess_m / path_->at(u).first.norm(), piece.begin, piece.end);
  }
  return u;
}

}  // namespace terracast::geo
