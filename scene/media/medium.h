#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/choice.h"
#include "core/schema.h"
#include "geo/geodesy.h"
#include "scene/ground/sample_width.h"
#include "scene/light/sky.h"
#include "world/tile_store.h"

namespace terracast::scene {

/// The scene in which a medium hangs. All must outlive the medium that is made of it.
struct MediumSite {
  const world::TileStore& store;
  const Sky& sky;
  double sea_level_m;  ///< ellipsoidal
};

/// The light of a ray that passes through a medium.
struct SeenMedium {
  Color transmittance = Color::Ones();
  Color radiance = Color::Zero();  ///< scattered toward the viewer, without what lies before it
  double distance_m = 0.0;         ///< mean distance at which that light is scattered
};

/// A ray that looks through media.
struct MediumRay {
  Eigen::Vector3d origin_world;
  Eigen::Vector3d direction_world;  ///< unit
  double until_m;                   ///< to the surface behind; +inf: the sky
  float from_height_m;              ///< of the viewer above the sea
  const SampleWidth& sample_width;
  double jitter;  ///< in [0, 1), of this ray alone
};

/// Matter in the air of one scene that weakens and scatters light. Ground truth never sees it.
/// threads   safe
class Medium {
 public:
  virtual ~Medium() = default;

  /// False: it changes no ray, and is left out.
  virtual bool is_any() const { return true; }
  /// Share of the sun's light that reaches a point through the medium, the same of all wavelengths.
  virtual double sun_transmittance(const Eigen::Vector3d& point_world) const = 0;
  virtual SeenMedium look(const MediumRay& ray) const = 0;
};

/// Keys of a kind of medium, and its maker.
class MediumOptions {
 public:
  virtual ~MediumOptions() = default;
  virtual void describe(core::SchemaVisitor& visit) = 0;
  virtual std::unique_ptr<MediumOptions> clone() const = 0;
  /// throws   Input, Io: as the medium's files
  virtual std::unique_ptr<Medium> make(const MediumSite& site) const = 0;
};

struct MediumInfo {
  std::string_view name;
  std::string_view summary;
  std::unique_ptr<MediumOptions> (*make)();
  /// It hangs in every scene, and a config does not name it.
  bool is_always = false;
};

/// The table of media, alphabetical.
std::span<const MediumInfo> media();

/// A `[[conditions.media]]` of a config.
struct MediumChoice : core::Choice<MediumInfo> {
  void describe(core::SchemaVisitor& visit);
};

/// The media of a scene: those that always hang there in the order of the table, then those of the config in its order.
/// Those that change no ray are left out. The first is the air.
std::vector<std::unique_ptr<Medium>> make_media(const std::vector<MediumChoice>& chosen,
                                                const MediumSite& site);

}  // namespace terracast::scene
