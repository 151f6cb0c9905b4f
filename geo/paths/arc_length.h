#pragma once

#include <memory>
#include <vector>

#include "geo/paths/path.h"

namespace terracast::geo {

/// Length along a path, both ways.
/// accuracy   1e-9 of a piece's length (Gauss-Legendre of order 16 on pieces halved until
///            both halves agree)
class ArcLength {
 public:
  explicit ArcLength(std::shared_ptr<const Path> path);

  double total_m() const { return pieces_.back().start_m + pieces_.back().length_m; }
  double length_at(double u) const;
  double parameter_at(double length_m) const;

  /// Where a metre of path takes the most parameter: near a stop or a turning back.
  struct Slowest {
    double u;
    double metres_per_u;
  };
  const Slowest& slowest() const { return slowest_; }

 private:
  struct Piece {
    double begin, end;  ///< parameters
    double start_m, length_m;
  };
  void add(double begin, double end, double length_m, int depth);

  std::shared_ptr<const Path> path_;
  std::vector<Piece> pieces_;
  Slowest slowest_;
};

}  // namespace terracast::geo
