#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/hash.h"
#include "core/random.h"
#include "tiler/vector_source.h"

class GDALDataset;

// What reading features is made of.
namespace terracast::tiler {

/// Of places, in whatever unit.
struct Box {
  Eigen::Vector2d lowest = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d highest = Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity());
  void add(const Eigen::Vector2d& at) {
    lowest = lowest.cwiseMin(at);
    highest = highest.cwiseMax(at);
  }
  void add(const Box& other) {
    lowest = lowest.cwiseMin(other.lowest);
    highest = highest.cwiseMax(other.highest);
  }
  bool is_empty() const { return !(lowest.x() <= highest.x()); }
  bool overlaps(const Box& other) const {
    return (lowest.array() <= other.highest.array()).all() &&
           (highest.array() >= other.lowest.array()).all();
  }
};
Box box_of(const std::vector<std::vector<PointsWorld>>& parts);

/// Cuts a ring or a line by a half plane: keeps where side * (at[axis] - limit) <= 0. A ring keeps its
/// inside (Sutherland and Hodgman 1974).
PointsWorld cut(const PointsWorld& line, int axis, double limit, double side, bool is_ring);

/// `"key"=>"value","key"=>"value"`, with \" and \\ inside the quotes; what does not read so is left.
void unpack_tags(std::string_view packed, std::vector<std::pair<std::string, std::string>>& tags);
std::optional<std::uint64_t> whole_number(std::string_view text);
/// "123", "way/123", "w123".
std::optional<std::uint64_t> feature_number(std::string_view text);

/// Of what a feature holds.
class FeatureHash {
 public:
  void add(std::uint64_t bits) { state_ = core::stream_of(state_, bits); }
  void add(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    add(bits);
  }
  void add(std::string_view text) {
    add(core::content_hash64(std::as_bytes(std::span(text.data(), text.size()))));
  }
  std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0;
};

}  // namespace terracast::tiler
