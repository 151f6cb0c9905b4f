#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "capture/frame_reader.h"
#include "core/context.h"
#include "render/views.h"
#include "world/ray_query.h"
#include "world/tile_store.h"

/// Where what one image of a sequence shows is in another of its images, exactly.
namespace terracast::render {

/// An image of a sequence.
struct ImageOf {
  int frame = 0;
  int camera = 0;
  bool operator==(const ImageOf&) const = default;
};

/// A point of the world that a pixel shows, in another image.
struct Match {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< within the image
  bool is_visible = false;                          ///< and not hidden, by a ray to the very point
};

/// The rays of a sequence's images, cast again: its facts hold ranges as floats, which are not good enough to say
/// what is hidden.
class Matcher {
 public:
  /// throws   Input: the store is not the world of the sequence
  Matcher(const capture::SequenceReader& sequence, const world::TileStore& store,
          const world::RayQueryOptions& tracing = {});

  /// What the centres of pixels of an image show; nothing where that is the sky.
  /// throws    Input: a ray meets something else than the capture has; Io
  std::vector<std::optional<Eigen::Vector3d>> points_world(
      const ImageOf& from, std::span<const Eigen::Vector2i> pixels) const;

  /// Where points of the surface are in an image; nothing where they are not in it. Visibility is decided as in
  /// the capture's own bits.
  std::vector<std::optional<Match>> find(std::span<const Eigen::Vector3d> points_world,
                                         const ImageOf& to) const;

 private:
  const capture::SequenceReader& sequence_;
  ViewTable views_;
  world::RayQuery whole_;
  std::optional<world::RayQuery> in_water_;
};

}  // namespace terracast::render
