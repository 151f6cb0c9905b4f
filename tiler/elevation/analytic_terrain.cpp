#include <algorithm>
#include <cmath>

#include "core/hash.h"
#include "tiler/gradient_noise.h"
#include "tiler/elevation_registry.h"

// Terrain in closed form: worlds with known answers. A place's map coordinates are the world x and
// y of its foot on the ellipsoid, in metres.
namespace terracast::tiler {
namespace {

struct Shape {
  double height_m = 0.0;
  double slope = 0.0;
  double curvature_per_m = 0.0;
  double relief_m = 0.0;
};

class AnalyticField : public HeightField {
 public:
  AnalyticField(const ElevationInputs& inputs, const Shape& shape)
      : frame_(inputs.frame),
        shape_(shape),
        datum_(inputs.datum),
        noise_(static_cast<std::uint64_t>(inputs.options.seed), 0xF7AC),
        // Nominal: the base level of a known surface need not be finer.
        spacing_m_(std::exp2(std::floor(std::log2(inputs.options.size_m / 256.0)))) {
    const ElevationOptions& entry = inputs.entry;
    hash_ = core::content_hash(fmt::format("analytic 1 {} {} {} {} {} {} {}", entry.kind,
                                           shape.height_m, shape.slope, shape.curvature_per_m,
                                           shape.relief_m, inputs.options.seed, datum_.name));
    const double reach_m = 0.8 * inputs.options.size_m + 1000.0;
    const double rise_m = std::abs(shape.slope) * reach_m;
    const double bulge_m = 0.5 * shape.curvature_per_m * reach_m * reach_m;
    lowest_m_ = shape.height_m - rise_m + std::min(bulge_m, 0.0);
    highest_m_ = shape.height_m + rise_m + std::max(bulge_m, 0.0) + shape.relief_m;
    world::SourceInfo source;
    source.name = entry.kind;
    source.kind = "analytic";
    source.vertical_datum = datum_.name;
    source.spacing_m = spacing_m_;
    source.content_hash = hash_;
    source.licence = entry.licence;
    source.accuracy = entry.accuracy;
    sources_.push_back(std::move(source));
  }

  void map_from_geodetic(std::span<const geo::Geodetic> places,
                         std::span<Eigen::Vector2d> map) const override {
    for (std::size_t i = 0; i < places.size(); ++i)
      map[i] =
          frame_
              .world_from_geodetic(
                  {.lat_deg = places[i].lat_deg, .lon_deg = places[i].lon_deg, .height_m = 0.0})
              .head<2>();
  }

  double height_m(const Eigen::Vector2d& map) const override {
    double height_m =
        shape_.height_m + shape_.slope * map.x() + 0.5 * shape_.curvature_per_m * map.squaredNorm();
    if (shape_.relief_m > 0.0) {
      // Twelve octaves from 8 km; the sum stays within 1.3 (measured), so heights within the
      // relief.
      const double sum =
          fractal_noise(noise_, map.x() / 8192.0 + 0.37, map.y() / 8192.0 + 0.61, 12, 0.47);
      height_m += shape_.relief_m * std::clamp(0.5 + sum / 2.6, 0.0, 1.0);
    }
    return height_m;
  }

  FieldFacts facts(const Eigen::Vector2d&) const override { return {}; }
  bool has_sea() const override { return false; }
  double lowest_m() const override { return lowest_m_; }
  double highest_m() const override { return highest_m_; }
  const geo::VerticalDatum& datum() const override { return datum_; }
  double spacing_m() const override { return spacing_m_; }
  double metres_per_map_unit() const override { return 1.0; }
  bool takes_detail() const override { return false; }
  const std::vector<world::SourceInfo>& sources() const override { return sources_; }
  std::string input_hash() const override { return hash_; }

 private:
  const geo::WorldFrame frame_;
  const Shape shape_;
  const geo::VerticalDatum datum_;
  const GradientNoise noise_;
  const double spacing_m_;
  double lowest_m_ = 0.0;
  double highest_m_ = 0.0;
  std::string hash_;
  std::vector<world::SourceInfo> sources_;
};

}  // namespace

std::unique_ptr<HeightField> make_plane(const ElevationInputs& inputs) {
  return std::make_unique<AnalyticField>(inputs, Shape{.height_m = inputs.entry.height_m});
}

std::unique_ptr<HeightField> make_ramp(const ElevationInputs& inputs) {
  return std::make_unique<AnalyticField>(
      inputs, Shape{.height_m = inputs.entry.height_m, .slope = inputs.entry.slope});
}

std::unique_ptr<HeightField> make_paraboloid(const ElevationInputs& inputs) {
  return std::make_unique<AnalyticField>(
      inputs,
      Shape{.height_m = inputs.entry.height_m, .curvature_per_m = inputs.entry.curvature_per_m});
}

std::unique_ptr<HeightField> make_fractal(const ElevationInputs& inputs) {
  return std::make_unique<AnalyticField>(
      inputs, Shape{.height_m = inputs.entry.height_m, .relief_m = inputs.entry.relief_m});
}

}  // namespace terracast::tiler
