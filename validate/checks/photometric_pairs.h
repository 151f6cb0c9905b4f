#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "validate/check.h"
#include "validate/evidence.h"
#include "validate/frames.h"
#include "validate/null_distribution.h"
#include "validate/sampling.h"

/// Patches of one image, carried by its depth and by poses into another, against the colours there.
namespace terracast::validate {

/// What the colours of patches differ by: as they stand, and with red and blue swapped in one of the two images.
struct ColorDifferences {
  std::int64_t num_patches = 0;
  double right = 0.0, swapped = 0.0;
  double right_squares = 0.0, products = 0.0, swapped_squares = 0.0;

  void add(double difference, double swapped_difference);
  ColorDifferences& operator+=(const ColorDifferences& other);
  /// By what factor, as a natural logarithm, the colours fit better with red and blue swapped; 0 where they fit worse.
  /// It knows nothing of fewer than twenty patches.
  Estimate swapped_fits_better(double patches_per_fact) const;
  /// The logarithm the other way: what it would be if one of the two were swapped; +inf where colours are the same.
  double right_fits_better() const;
};

/// What the patches of a pair, or of several, say.
struct PairMatches {
  std::vector<double> shift_x, shift_y;
  std::vector<double> correlation;  ///< what each counts as
  std::vector<double> own;          ///< PatchMatch::own_correlation
  std::int64_t num_level = 0;       ///< left out
  double patches_per_fact = 1.0;
  std::int64_t num_unresolved = 0;
  ColorDifferences colors;
  bool is_of_one_white = true;  ///< whether both cameras' colours are balanced alike
  Evidence::Part part;
};

/// What patches of one pair say; of a tenth of the samples an image, since each has 49 pixels.
PairMatches compare_patches(const ViewPair& pair, const ValidateOptions& options);

/// The least median correlation of images of one place that are all texture.
constexpr double kLeastCorrelation = 0.6;

/// How alike two images, or all pairs of a kind, show one place.
struct Likeness {
  double median = 0.0;
  double most = 0.0;  ///< it, and what it may be more
  double own = 0.0;   ///< median of what patches correlate with their own image beside
  double bound = kLeastCorrelation;
  /// Whether another place would look otherwise: patches are enough, and most of what they show is coarser than noise.
  bool tells = false;
  double share() const { return most / bound; }
};
/// is_sure   whether what the median may be more counts; in a trial, of few patches, it is what it is
Likeness likeness_of(const PairMatches& matches, bool is_sure);

/// The part of a median shift that is sure; in a trial, of few patches, all of it.
inline double size_of(const MedianEstimate& shift, bool is_trial) {
  return is_trial ? std::abs(shift.median) : shift.judged();
}

}  // namespace terracast::validate
