#pragma once

#include <array>
#include <string>
#include <vector>

#include "batch/dataset/splits.h"
#include "core/image.h"
#include "core/json.h"

namespace terracast::batch {

/// How often values occur, split by split, in bins of equal width: of the values, or of their
/// logarithms.
class Histogram {
 public:
  struct Axis {
    std::string title;   ///< "height above ground"
    std::string unit;    ///< "m"
    double least = 0.0;  ///< left edge of the first bin
    double greatest = 1.0;
    int num_bins = 40;
    bool is_logarithmic = false;
  };
  /// throws   Internal: no bins, or edges that cannot be
  explicit Histogram(Axis axis);

  /// Values beyond the edges are counted apart.
  void add(double value, Split split, double weight = 1.0);

  const Axis& axis() const { return axis_; }
  double edge(int index) const;  ///< left one of a bin; num_bins: right one of the last
  double weight(int bin, Split split) const;
  double weight_outside(Split split) const;

  /// {"title", "unit", "logarithmic", "edges", "train": [...], "val", "test", "outside": {...}}
  core::Json json() const;
  /// Bars with the splits upon each other, axes with round numbers, shares of all that was added.
  core::Image8 draw() const;

 private:
  Axis axis_;
  std::array<std::vector<double>, 3> weights_;
  std::array<double, 3> outside_ = {};
};

}  // namespace terracast::batch
