#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

#include "core/semantic_class.h"

namespace terracast::capture {

using core::semantic_class_names;
using core::SemanticClass;

/// A channel of a camera's facts file (OpenEXR). One geometry-only ray through each pixel's centre
/// feeds all of them.
struct ChannelInfo {
  std::string_view
      name;  ///< in the file; chosen so that image tools do not take it for something else
  std::string_view type;  ///< float, half, uint
  std::string_view unit;
  std::string_view meaning;
  std::string_view invalid;  ///< how sky is written
  bool is_optional = false;  ///< stored where the sequence asks for it
};

/// The table of channels: range_m, normal.x, normal.y, normal.z, semantic_id, instance_id,
/// primitive_id, flags, and bottom_range_m where it is asked for.
std::span<const ChannelInfo> channels();

/// Range of a sky pixel.
inline constexpr float kSkyRange_m = std::numeric_limits<float>::infinity();
/// Range of a pixel into which no ray comes: beyond a fisheye's image circle.
inline constexpr float kNoRange_m = std::numeric_limits<float>::quiet_NaN();
/// Primitive of a sky pixel, and of one without a ray.
inline constexpr std::uint32_t kNoPrimitive = 0xffffffffu;
/// The tile's index stands above this bit of a primitive id.
inline constexpr int kPrimitiveTileShift = 17;
/// A primitive id from here up is of an object, no terrain having a tile of this index: added to it is
/// the triangle of the object's shape, modulo kMaxObjectPrimitives. Which object, instance_id tells.
inline constexpr std::uint32_t kObjectPrimitives = ((1u << 15) - 1) << kPrimitiveTileShift;
/// One less than there are ids from there up, for kNoPrimitive.
inline constexpr std::uint32_t kMaxObjectPrimitives = (1u << kPrimitiveTileShift) - 1;

/// Whether a pixel may have this range and this class: the sky is infinitely far, what no ray comes from
/// is nowhere, and all else is somewhere before the camera.
bool agree(float range_m, std::uint32_t semantic_id);

/// Bits of the channel `flags`. Visibility is that of the exact hit point, by a ray.
enum FactFlag : std::uint32_t {
  kEdge = 1u << 0,  ///< a ray shifted by 1e-3 px meets another object
  kVisibleNext =
      1u << 1,  ///< seen by the same camera in the next frame (in its image and not hidden)
  kVisiblePrevious = 1u << 2,  ///< … in the previous frame
};
/// Seen by the sequence's camera number `camera_index` (of the same rig) at the same time.
constexpr std::uint32_t visible_in_camera(int camera_index) { return 1u << (8 + camera_index); }
inline constexpr int kMaxCameras = 24;

/// Flags that are found together, each for the price of the rays that it takes.
struct FlagGroup {
  std::string_view name;
  std::uint32_t bits;
};
/// edge, next, previous, cameras.
std::span<const FlagGroup> flag_groups();
inline constexpr std::uint32_t kAllFlags = 0xffffffffu;

}  // namespace terracast::capture
