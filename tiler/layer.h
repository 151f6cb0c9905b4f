#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/choice.h"
#include "core/context.h"
#include "core/schema.h"
#include "geo/geodesy.h"
#include "geo/geoid.h"
#include "world/texture.h"
#include "world/tile.h"
#include "world/tile_store.h"

namespace terracast::tiler {

struct SurfaceSample;
class Country;
class ImageryPyramid;
class InstanceIds;
class WorldSurface;

/// What a layer is made from.
struct LayerInputs {
  const geo::WorldFrame& frame;
  double size_m;                ///< of the world's square
  std::uint64_t seed;           ///< the world's and the layer's own
  const WorldSurface& surface;  ///< the ground before any layer
  /// The layers before this one, which it may ask; they live as long.
  std::span<const std::unique_ptr<class Layer>> earlier;
  InstanceIds& ids;                         ///< of the world's things
  std::function<const Country&()> country;  ///< made when it is first asked for
  std::string licence;                      ///< as the config states it
  std::string accuracy;                     ///< as the config states it
  const core::Context& context;
};

/// World z of the ground as tiles of a level show it: on the triangle of their samples round a place.
/// ground_z_world   the ground as it is, asked at three samples at most
/// level            of the quadtree; samples are 2^level m apart
double shown_z_world(
    const std::function<double(const Eigen::Vector2d& place_world)>& ground_z_world,
    const Eigen::Vector2d& place_world, int level);

/// The finished ground, for layers that put things on it. Threads: safe.
class LayerSite {
 public:
  virtual ~LayerSite() = default;
  /// World z of the ground with all layers and all its detail.
  virtual double ground_z_world(const Eigen::Vector2d& place_world) const = 0;
  virtual world::Cover cover(const Eigen::Vector2d& place_world) const = 0;
  /// Whether a layer has walls within some metres (Layer::has_walls_near): coarse tiles may show the ground there
  /// far from where it is.
  virtual bool has_walls_near(const Eigen::Vector2d& place_world, double within_m) const {
    static_cast<void>(place_world);
    static_cast<void>(within_m);
    return false;
  }
  /// Whether no other layer (Layer::holds) and no water holds any of a disc.
  virtual bool is_free(const Eigen::Vector2d& place_world, double radius_m) const = 0;
  /// Whether a layer keeps any of a disc low (Layer::keeps_low).
  virtual bool is_kept_low(const Eigen::Vector2d& place_world, double radius_m) const {
    static_cast<void>(place_world);
    static_cast<void>(radius_m);
    return false;
  }
};

/// A layer of a world, read and checked: what it does to the ground, and what it puts there. All of it
/// is a function of place: the same from any tile, any thread and in any order.
///
/// threads   safe
class Layer {
 public:
  virtual ~Layer() = default;

  /// What the manifest says of it: source, hash, and counts of all that was read, repaired or left out.
  /// Name, kind, licence and accuracy are filled in from the options.
  virtual world::LayerInfo info() const = 0;
  /// Of all that determines it.
  virtual std::string input_hash() const = 0;

  /// What it puts into many places; Instance::prototype counts these.
  virtual std::span<const world::Prototype> prototypes() const { return {}; }
  /// Images on its surfaces; Finish::pattern of Material::Textured counts these, in its prototypes and
  /// in what it adds to tiles.
  virtual std::span<const world::Texture> textures() const { return {}; }

  /// Pictures of the ground; of several the first that knows a place is shown.
  virtual std::span<const std::unique_ptr<ImageryPyramid>> imagery() const { return {}; }
  /// Clouds and the like; VolumePlace::volume counts volumes(), VolumePlace::layer is filled in.
  virtual std::span<const world::Volume> volumes() const { return {}; }
  virtual std::span<const world::VolumePlace> volume_places() const { return {}; }

  /// Its ways, with nodes of their own; WayPart::layer is filled in.
  virtual world::WayNetwork ways() const { return {}; }

  /// By how much it raises the ground along up (below 0: digs), beside what other layers do. Not asked
  /// where the sea is.
  /// ground   without any layer
  virtual double lift_m(const Eigen::Vector2d& place_world, const SurfaceSample& ground) const {
    static_cast<void>(place_world);
    static_cast<void>(ground);
    return 0.0;
  }
  /// What covers the ground, where it knows; of several layers the first that knows of water is
  /// believed, then the first that knows anything. Not asked where the sea is, and beyond the world's square.
  virtual std::optional<world::Cover> cover(const Eigen::Vector2d& place_world,
                                            const SurfaceSample& ground) const {
    static_cast<void>(place_world);
    static_cast<void>(ground);
    return std::nullopt;
  }
  /// How deep water is where cover() says that it is there: from its surface to its bed, along up, m.
  virtual std::optional<double> water_depth_m(const Eigen::Vector2d& place_world,
                                              const SurfaceSample& ground) const {
    static_cast<void>(place_world);
    static_cast<void>(ground);
    return std::nullopt;
  }
  /// Whether it holds any of a disc, so that nothing else may stand there.
  virtual bool holds(const Eigen::Vector2d& place_world, double radius_m) const {
    static_cast<void>(place_world);
    static_cast<void>(radius_m);
    return false;
  }
  /// Whether nothing but grass may grow on any of a disc, on which other things may stand: airfields.
  virtual bool keeps_low(const Eigen::Vector2d& place_world, double radius_m) const {
    static_cast<void>(place_world);
    static_cast<void>(radius_m);
    return false;
  }
  /// Whether it may cut or dam the ground within some metres of a place by banks as steep as walls.
  virtual bool has_walls_near(const Eigen::Vector2d& place_world, double within_m) const {
    static_cast<void>(place_world);
    static_cast<void>(within_m);
    return false;
  }
  /// Adds all that may be shown on a tile: whatever reaches over its square, the same for each tile
  /// over which it reaches. It may leave out what is too small for the tile's level when its place is
  /// in the tile. Provenance::layer and Coating::layer are filled in afterwards.
  virtual void add_objects(const world::TileId& id, const LayerSite& site,
                           world::TileObjects& objects) const {
    static_cast<void>(id);
    static_cast<void>(site);
    static_cast<void>(objects);
  }
};

/// Options of one kind of layer; the derived class describes its keys and makes the layer.
class LayerKind {
 public:
  virtual ~LayerKind() = default;
  virtual void describe(core::SchemaVisitor& visit) = 0;
  /// throws Config: options that contradict each other
  virtual void validate() const {}
  virtual std::unique_ptr<LayerKind> clone() const = 0;
  /// Reads and checks its sources.
  /// throws   Config, Input, Io
  virtual std::unique_ptr<Layer> make(const LayerInputs& inputs) const = 0;
};

struct LayerKindInfo {
  std::string_view name;
  std::string_view summary;
  std::unique_ptr<LayerKind> (*make)();
};

/// The table of kinds.
std::span<const LayerKindInfo> layer_kinds();

/// A `[[layer]]` of a world: its kind, and beside it the kind's own keys.
struct LayerOptions {
  std::string name;  ///< "": the kind's
  std::string kind;
  std::int64_t seed = 0;
  std::string licence;
  std::string accuracy;

  void describe(core::SchemaVisitor& visit);
  void validate() const;

  /// There once describe() was called.
  const LayerKind& kind_options() const { return *kind_options_; }

 private:
  core::KindOptions<LayerKindInfo> kind_options_;
};

}  // namespace terracast::tiler
