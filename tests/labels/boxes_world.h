#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "render/render_stage.h"
#include "world/shape.h"
#include "world/tile_store.h"

/// Boxes above a plane, and a camera before them: labels that follow from closed forms.
namespace terracast::test {

/// A box along the world's axes, a solid of its own.
struct WorldBox {
  std::uint32_t instance_id = 0;
  core::SemanticClass semantic_class = core::SemanticClass::Building;
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();
  std::array<std::uint8_t, 3> color_srgb = world::Finish().color_srgb;

  /// Whether a ray meets it, by its slabs.
  bool is_met(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  std::vector<Eigen::Vector3d> corners() const;
};

/// The prototype of the world's instances reaches so far along its axes, m.
inline const Eigen::Vector3d kPrototypeLow{-1.0, -1.0, 0.0};
inline const Eigen::Vector3d kPrototypeHigh{3.0, 1.0, 1.5};

/// A car-like thing of that prototype.
struct WorldThing {
  std::uint32_t instance_id = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  double heading_rad = 0.0;  ///< anticlockwise from east
  double scale = 1.0;
};

/// A plane at z = 0 with boxes and things over it.
world::TileStore make_boxes_world(const std::filesystem::path& folder,
                                  const std::vector<WorldBox>& boxes,
                                  const std::vector<WorldThing>& things = {});

/// A pinhole of 200 x 160 px and f = 200 px that stands at (0, 0, 50) and looks along +x: a point appears at
/// (100 - 200 y / x, 80 - 200 (z - 50) / x).
render::SequencePlan level_plan(int num_frames = 1);

/// The state of a body at a place that looks along +x.
geo::BodyState body_at(const Eigen::Vector3d& place, int frame = 0);

/// Renders a plan, labels nothing.
capture::SequenceReader render_plan(const world::TileStore& store, const render::SequencePlan& plan,
                                    const std::filesystem::path& folder);

/// A box that moves, along the axes of its frame, as a shape of a thing. Its corners lie on the lattice of 2^-10 m.
scene::MovingShape moving_box(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                              core::SemanticClass semantic_class);

/// Makes labels of one kind with its defaults.
/// things   that move in it
void make_labels(const capture::SequenceReader& sequence, const world::TileStore& store,
                 const std::string& kind, int num_threads = 0,
                 const std::vector<scene::MovingThing>& things = {});
/// The same with keys of a config.
void make_labels_with(const capture::SequenceReader& sequence, const world::TileStore& store,
                      const std::string& toml, const std::vector<scene::MovingThing>& things = {},
                      int num_threads = 0);

}  // namespace terracast::test
