#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "validate/oracle_view.h"

/// Which pixels of an image the oracle asks for: some at random, and those where mistakes hide, found
/// from its own geometry.
namespace terracast::validate {

/// Why a pixel was taken.
enum class PixelReason : std::uint8_t { Random, Grazing, NearEdge, Border, Silhouette };

struct OraclePixel {
  int x = 0;
  int y = 0;
  PixelReason reason = PixelReason::Random;
  std::optional<oracle::ExactHit> hit;  ///< nothing: sky
  /// A ray shifted by a thousandth of a pixel meets another surface.
  bool is_on_silhouette = false;

  Eigen::Vector2d center() const { return {x + 0.5, y + 0.5}; }
};

/// What pixels turned out to show, whatever they were taken for.
struct PixelKinds {
  std::int64_t num_random = 0;
  std::int64_t num_sky = 0;
  std::int64_t num_grazing = 0;       ///< less than 3 degrees between ray and triangle
  std::int64_t num_near_edge = 0;     ///< within a hundredth of a pixel of their triangle's edges
  std::int64_t num_border = 0;        ///< in a cell at the border of its tile
  std::int64_t num_level_change = 0;  ///< of those, where the neighbour has another level
  std::int64_t num_object = 0;        ///< no ground
  std::int64_t num_beside_silhouette = 0;  ///< the pixel beside is 5 % nearer or farther, or sky

  void add(const PixelKinds& other);
};

struct OraclePixels {
  std::vector<OraclePixel> pixels;  ///< the random ones first
  PixelKinds kinds;
};

/// Draws `count` pixels at random, and up to as many again for the other reasons in equal parts. The
/// same for the same seed, camera and frame.
/// cost   about a dozen rays for each of `count`
OraclePixels choose_pixels(const oracle::ExactWorld& terrain, const OracleView& view,
                           std::int64_t count, std::int64_t seed);

}  // namespace terracast::validate
