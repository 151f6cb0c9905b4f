#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "capture/frame_reader.h"
#include "core/context.h"
#include "scene/scene.h"
#include "sensors/camera/views.h"
#include "world/ray_query.h"
#include "world/tile_store.h"

/// Where what one image of a sequence shows is in another of its images, exactly.
namespace terracast::labels {

/// An image of a sequence.
struct ImageOf {
  int frame = 0;
  int camera = 0;
  bool operator==(const ImageOf&) const = default;
};

/// A point of a surface that a pixel shows.
struct ShownPoint {
  Eigen::Vector3d point_world = Eigen::Vector3d::Zero();  ///< when its pixel's line is exposed
  std::optional<std::size_t> body = std::nullopt;  ///< of SequenceInfo::moving; nothing: it stands
  Eigen::Vector3d point_body = Eigen::Vector3d::Zero();  ///< in the body's frame
};

/// Such a point for another image's camera, in its image or beside it.
struct Sighting {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double range_m = 0.0;  ///< from where its ray starts
  bool is_in_image = false;
  bool is_visible = false;  ///< in the image, and not hidden, by a ray to the very point
  /// In the image: the instance that hides it; 0: nothing does, or the ground.
  std::uint32_t occluder_id = 0;
};

/// Rays of pixels' centres, cast again, and what they met.
struct Recast {
  std::vector<std::size_t> of_pixel;  ///< of those that were asked for, ascending; the sky has none
  std::vector<world::WorldRay> rays;  ///< unit directions
  std::vector<double> offsets_s;      ///< their times, counted from the frame's
  std::vector<world::SurfaceHit> hits;
  std::vector<world::SurfaceSample> surfaces;
};

/// The rays of a sequence's images, cast again: its facts hold ranges as floats, which are not good enough to say
/// what is hidden. A point of what moves is carried with it to where it is when the other image's line sees it;
/// what moves hides, and is hidden, where it then is.
class Matcher {
 public:
  /// moving   of the sequence; it must outlive this
  /// throws   Input: the store is not the world of the sequence
  Matcher(const capture::SequenceReader& sequence, const world::TileStore& store,
          const scene::MovingBodies& moving, const world::RayQueryOptions& tracing = {});

  /// need     what surfaces shall tell
  /// throws    Input: a ray meets something else than the capture has; Io
  Recast recast(const ImageOf& from, std::span<const Eigen::Vector2i> pixels,
                world::SurfaceNeed need) const;

  /// What the centres of pixels of an image show; nothing where that is the sky.
  /// throws    Input: a ray meets something else than the capture has; Io
  std::vector<std::optional<ShownPoint>> points(const ImageOf& from,
                                                std::span<const Eigen::Vector2i> pixels) const;
  /// facts   of that image
  std::vector<std::optional<ShownPoint>> points(const ImageOf& from,
                                                const capture::CameraFrame& facts,
                                                std::span<const Eigen::Vector2i> pixels) const;

  /// Where points are for an image's camera, in the image or beside it; nothing where it has no image of them, as
  /// behind a pinhole, or what they are of is not there. Visibility is decided as in the capture's own bits.
  std::vector<std::optional<Sighting>> follow(std::span<const ShownPoint> points,
                                              const ImageOf& to) const;

  /// Whether what a point is of is there at a frame; what stands always is.
  bool is_there(const ShownPoint& point, int frame) const;

  /// Scene flow, m, in the world's axes: from where a point is when its pixel shows it to where it is at the time of a
  /// frame; nothing where what it is of is not there.
  std::optional<Eigen::Vector3d> motion(const ShownPoint& point, int to_frame) const;

  /// Where a point is at the time of a frame, in the world; nothing where what it is of is not there.
  std::optional<Eigen::Vector3d> place(const ShownPoint& point, int frame) const;

  /// The world with its water, whatever the cameras stand in.
  const world::RayQuery& whole() const { return scene_.whole(); }
  const geo::CameraModel& model(int camera) const { return *views_.at(0, camera).model; }
  /// Of decoded tiles of imagery, bytes.
  double imagery_budget_bytes() const { return whole().imagery_budget_bytes(); }

 private:
  Recast recast(const ImageOf& from, const capture::CameraFrame& facts,
                std::span<const Eigen::Vector2i> pixels, world::SurfaceNeed need) const;
  scene::SceneAt scene_at(int frame) const;
  const std::vector<std::optional<geo::BodyState>>& bodies_at(int frame) const;

  const capture::SequenceReader& sequence_;
  sensors::ViewTable views_;
  scene::Scene scene_;
};

}  // namespace terracast::labels
