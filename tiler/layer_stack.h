#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tiler/dryness.h"
#include "tiler/layer.h"
#include "tiler/surface.h"
#include "tiler/told_cover.h"
#include "world/raster_info.h"

namespace terracast::tiler {

/// By how much of what layers raise the ground by it is raised at a place: 1, fading out over the square's last
/// hundred metres to 0 at its border and beyond.
double lift_share(const Eigen::Vector2d& place_world, double half_size_m);

/// The layers of a world together, and what covers dry land where they say nothing. Threads: safe.
class LayerStack {
 public:
  /// No layer.
  LayerStack() = default;
  /// Makes all layers of the surface's options, in their order.
  /// surface   the ground without any; must outlive the stack
  /// throws    as LayerKind::make()
  LayerStack(const WorldSurface& surface, const core::Context& context);
  /// Of layers that are there, which are called by their numbers.
  /// size_m   of the world's square
  LayerStack(double size_m, std::vector<std::unique_ptr<Layer>> layers);

  bool is_empty() const { return layers_.empty(); }
  /// Whether a layer says from a raster what covers the ground.
  bool has_cover_raster() const;
  const std::vector<world::LayerInfo>& infos() const { return infos_; }
  /// Of all layers; Instance::prototype of a tile's objects counts these.
  const std::vector<world::Prototype>& prototypes() const { return prototypes_; }
  /// Of all layers; Finish::pattern of what is Textured counts these.
  const std::vector<world::Texture>& textures() const { return textures_; }
  /// Of all layers, with the layer's number.
  const std::vector<std::pair<int, const ImageryPyramid*>>& imagery() const { return imagery_; }
  /// Of all layers; VolumePlace::volume of the places counts these.
  const std::vector<world::Volume>& volumes() const { return volumes_; }
  const std::vector<world::VolumePlace>& volume_places() const { return volume_places_; }
  /// Of all layers; what different ones know does not meet.
  world::WayNetwork ways() const;
  /// Of each layer, in its order of priority; none of those that read no raster of land cover.
  std::vector<std::vector<world::CoverRasterInfo>> cover_rasters() const;
  /// What they say; lives no longer than the stack.
  world::CoverRows cover_rows() const;
  std::string input_hash() const;

  /// What the layers make of the ground at a place of the world's square, what they raise it by times lift_share().
  /// sample   without any layer
  SurfaceSample shaped(const Eigen::Vector2d& place_world, SurfaceSample sample) const;
  // Parts of that, for less.
  double shaped_z_world(const Eigen::Vector2d& place_world, const SurfaceSample& sample) const;
  world::Cover shaped_cover(const Eigen::Vector2d& place_world, const SurfaceSample& sample) const;
  bool is_shaped_water(const Eigen::Vector2d& place_world, const SurfaceSample& sample) const;

  /// Puts into a tile what reaches over its square: sorted by layer, feature and id; objects_top_steps
  /// is set. Objects whose place is in the tile are left out where its level shows nothing of them.
  /// throws   Internal: an id that is 0 or there twice, a texture that its layer lacks
  void add_objects(world::Tile& tile) const;

  /// How dry the land is; null: humid.
  const Dryness* dryness() const { return dryness_.get(); }

 private:
  void add(std::unique_ptr<Layer> layer, const LayerOptions& options);
  friend std::shared_ptr<const WorldSurface> layered_surface(
      std::shared_ptr<const WorldSurface> surface, LayerStack layers);

  /// Whether layers are asked of a place with such a sample.
  bool is_layered(const Eigen::Vector2d& place_world, const SurfaceSample& sample) const;
  /// What covers a place of which no layer tells.
  world::Cover untold_cover(const Eigen::Vector2d& place_world, const SurfaceSample& sample) const;

  const WorldSurface* bare_ = nullptr;  ///< the ground without them, once they lie on one
  std::vector<std::unique_ptr<Layer>> layers_;
  ToldCovers told_;
  std::vector<world::LayerInfo> infos_;
  std::vector<world::Prototype> prototypes_;
  std::vector<double> reaches_m_;             ///< of the prototypes
  std::vector<std::size_t> first_prototype_;  ///< of each layer
  std::vector<world::Texture> textures_;
  std::vector<std::size_t> first_texture_;  ///< of each layer
  std::vector<std::pair<int, const ImageryPyramid*>> imagery_;
  std::vector<world::Volume> volumes_;
  std::vector<world::VolumePlace> volume_places_;
  double half_size_m_ = 0.0;
  std::shared_ptr<const Dryness> dryness_;  ///< null: the land is humid
  double tree_line_m_ = 0.0;
};

/// A surface and layers as one.
std::shared_ptr<const WorldSurface> layered_surface(std::shared_ptr<const WorldSurface> surface,
                                                    LayerStack layers);
/// A surface and its own layers as one; itself where its options name no layer and no aridity. Logs how dry
/// the land is taken to be.
std::shared_ptr<const WorldSurface> layered_surface(std::shared_ptr<const WorldSurface> surface,
                                                    const core::Context& context);

}  // namespace terracast::tiler
