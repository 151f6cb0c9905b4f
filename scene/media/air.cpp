#include "scene/ground/ground.h"
#include "scene/media/medium.h"

/// The air of a scene as a medium among others: Sky::air along a ray. Surfaces are shaded through the same air where
/// they are lit (scene/light/hit_shader.h), packet by packet.
namespace terracast::scene {
namespace {

class Air : public Medium {
 public:
  explicit Air(const MediumSite& site)
      : sky_(site.sky), sea_level_m_(static_cast<float>(site.sea_level_m)) {}

  /// The sun's irradiance is that below the air.
  double sun_transmittance(const Eigen::Vector3d&) const override { return 1.0; }

  SeenMedium look(const MediumRay& ray) const override {
    const Eigen::Vector3d end_world = ray.origin_world + ray.until_m * ray.direction_world;
    const AirPath path =
        sky_.air(static_cast<float>(ray.until_m), ray.from_height_m,
                 static_cast<float>(approximate_height_m(end_world)) - sea_level_m_,
                 static_cast<float>(ray.direction_world.dot(sky_.daylight().sun_direction_world)));
    return {.transmittance = path.transmittance,
            .radiance = path.inscatter,
            .distance_m = 0.5 * ray.until_m};
  }

 private:
  const Sky& sky_;
  float sea_level_m_;
};

/// Its one key, the visibility, is the conditions' own.
struct AirOptions : MediumOptions {
  void describe(core::SchemaVisitor&) override {}
  std::unique_ptr<MediumOptions> clone() const override {
    return std::make_unique<AirOptions>(*this);
  }
  std::unique_ptr<Medium> make(const MediumSite& site) const override {
    return std::make_unique<Air>(site);
  }
};

}  // namespace

MediumInfo air_medium() {
  return {.name = "air",
          .summary = "molecules and haze of a clear sky, by conditions.visibility_km",
          .make = [] { return std::unique_ptr<MediumOptions>(std::make_unique<AirOptions>()); },
          .is_always = true};
}

}  // namespace terracast::scene
