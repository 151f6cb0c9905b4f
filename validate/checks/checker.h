#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "validate/check.h"
#include "validate/frames.h"

namespace terracast::validate {

/// One check over one sequence: sees every frame once, in order, then says what it found. A check
/// that the format gives nothing to measure returns one skipped result.
class Checker {
 public:
  virtual ~Checker() = default;
  /// The newest frame of the window, and its pairs (FrameWindow::pairs).
  virtual void frame(const FrameWindow&, const std::vector<ViewPair>&) {}
  virtual std::vector<CheckResult> finish(const Dataset& dataset, const Sequence& sequence) = 0;
};

struct CheckInfo {
  std::string_view name;
  std::string_view summary;
  std::unique_ptr<Checker> (*make)(const ValidateOptions&);
};

/// How far a sequence's first body may be from its origin, which is that place rounded to 1e-6 deg and
/// whole metres.
constexpr double kOriginBound_m = 1.0;

/// The table of checks, alphabetical.
std::span<const CheckInfo> checks();

/// A check that the format has nothing for.
CheckResult skipped_result(std::string name, std::string why);
/// A check that the format has something for, of which this dataset shows nothing.
CheckResult unseen_result(std::string name, std::string why);

/// Keeps the larger value and where it stands; a value that is not finite counts as 1e9.
void note_worst(CheckResult& result, double value, const std::string& where);

/// Words of `depth_unit` before the factor that it found.
constexpr std::string_view kDepthFactor = ": with depth ";

/// "image_2, frame 7, pixel (12, 300)".
std::string place_of(const View& view);
std::string place_of(const View& view, int x, int y);

/// Pixels of an image drawn by seed: the same for the same seed, camera, frame and salt.
std::vector<Eigen::Vector2i> draw_pixels(const Intrinsics& camera, std::int64_t count,
                                         const ValidateOptions& options, const View& view,
                                         std::uint64_t salt);

}  // namespace terracast::validate
