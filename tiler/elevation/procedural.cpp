#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/hash.h"
#include "core/parallel.h"
#include "tiler/elevation_registry.h"
#include "tiler/erosion.h"
#include "tiler/flow_routing.h"
#include "tiler/gradient_noise.h"

// Seeded land: where it rises and where the sea lies is drawn from noise, the rest is done by
// rivers and slides on one grid over the whole square (coarse first, then refined twice), before
// any tile is cut. A place's map coordinates are the world x and y of its foot on the ellipsoid, in
// grid samples.
namespace terracast::tiler {
namespace {

constexpr int kMarginCells = 8;  ///< of the coarsest grid, beyond the square
constexpr int kNumRefinements = 2;

/// Raised when the land that a seed gives changes.
constexpr int kVersion = 2;

double smooth_step(double lowest, double highest, double value) {
  const double t = std::clamp((value - lowest) / (highest - lowest), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// Where the land rises, in units of half the square's side.
class LandPlan {
 public:
  LandPlan(std::uint64_t seed, const ElevationOptions& entry)
      : has_coast_(entry.has_coast),
        has_islands_(entry.landform == "islands"),
        is_plain_(entry.landform == "plains"),
        has_valleys_(entry.landform == "valleys"),
        coast_(seed, 1),
        warp_x_(seed, 2),
        warp_y_(seed, 3),
        massif_(seed, 4),
        rock_(seed, 5),
        rough_(seed, 6) {
    const double angle = 2.0 * std::numbers::pi * core::random_unit(seed, 7, 0);
    inland_ = {std::cos(angle), std::sin(angle)};
  }

  /// Distance inland from the coast, negative at sea.
  double inland(const Eigen::Vector2d& p) const {
    if (has_islands_) {
      // One large island off the middle, small ones scattered round it, open sea at the rim.
      const double scattered = fractal_noise(coast_, 1.9 * p.x(), 1.9 * p.y(), 6, 0.52);
      const double from_middle = (p + 0.22 * inland_).norm();
      const double rim = smooth_step(0.78, 1.02, p.cwiseAbs().maxCoeff());
      return 0.62 * scattered + 0.33 - 0.5 * from_middle - 0.5 * rim;
    }
    const double wiggle = 0.42 * fractal_noise(coast_, 0.9 * p.x(), 0.9 * p.y(), 6, 0.52);
    const double from_coast = p.dot(inland_) + 0.62 + wiggle;
    return has_coast_ ? from_coast : std::max(from_coast, 0.0) + 0.1;
  }

  bool has_coast() const { return has_coast_; }

  /// Uplift against the highest.
  double uplift(const Eigen::Vector2d& p) const {
    const double inland_distance = inland(p);
    const Eigen::Vector2d bent =
        p + 0.35 * Eigen::Vector2d(fractal_noise(warp_x_, 1.3 * p.x(), 1.3 * p.y(), 3),
                                   fractal_noise(warp_y_, 1.3 * p.x(), 1.3 * p.y(), 3));
    const double hills = fractal_noise(massif_, 1.7 * bent.x(), 1.7 * bent.y(), 4, 0.55);
    if (is_plain_) return 0.1 + 0.5 * smooth_step(-0.1, 0.6, hills);
    if (has_valleys_) {
      // Broad valleys between massifs.
      const double ridge = smooth_step(-0.28, 0.42, hills);
      return 0.02 + ridge * (0.75 + 0.4 * hills);
    }
    if (has_islands_)
      return 0.02 + smooth_step(0.06, 0.42, inland_distance + 0.25 * hills) * (0.5 + 0.55 * hills);
    const double range = smooth_step(0.35, 1.25, inland_distance + 0.55 * hills);
    const double foothills =
        0.16 * smooth_step(-0.05, 0.45, hills) * smooth_step(0.02, 0.25, inland_distance);
    const double plain = 0.012 + 0.03 * smooth_step(0.0, 0.6, inland_distance);
    return plain + foothills + range * (0.62 + 0.5 * hills);
  }

  double erodibility(const Eigen::Vector2d& p) const {
    return std::exp2(1.6 * fractal_noise(rock_, 5.0 * p.x(), 5.0 * p.y(), 4, 0.6));
  }

  double roughness(const Eigen::Vector2d& p) const {
    return fractal_noise(rough_, 24.0 * p.x(), 24.0 * p.y(), 4, 0.6);
  }

  /// Depth of the sea's floor against the relief.
  double depth(const Eigen::Vector2d& p) const {
    const double offshore = std::max(-inland(p), 0.0);
    return 0.02 * smooth_step(0.0, 0.05, offshore) + 0.12 * offshore;
  }

 private:
  bool has_coast_;
  bool has_islands_, is_plain_, has_valleys_;
  GradientNoise coast_, warp_x_, warp_y_, massif_, rock_, rough_;
  Eigen::Vector2d inland_;
};

class ProceduralField : public HeightField {
 public:
  explicit ProceduralField(const ElevationInputs& inputs)
      : frame_(inputs.frame), datum_(inputs.datum) {
    const WorldOptions& options = inputs.options;
    const ElevationOptions& entry = inputs.entry;
    sea_height_m_ = entry.sea_level_m;
    has_sea_ = entry.has_coast;
    // A power of two, so that a level of tiles has the same spacing; 32 m for 51.2 km. Rivers need
    // ground to run on: small worlds are no finer than their mountains.
    spacing_m_ = std::max(std::exp2(std::ceil(std::log2(options.size_m / 2048.0))), 16.0);
    // Of the options alone: a land that is kept is found by it.
    hash_ = core::content_hash(fmt::format("procedural {} {} {} {} {} {}", kVersion, options.seed,
                                           options.size_m, entry.relief_m, entry.sea_level_m,
                                           datum_.name));
    if (!entry.has_coast) hash_ = core::content_hash(hash_ + " no sea");
    if (entry.landform != "coast" || entry.lakes != 0)
      hash_ = core::content_hash(fmt::format("{} {} {}", hash_, entry.landform, entry.lakes));
    half_cells_ =
        static_cast<int>(std::ceil(0.5 * options.size_m / coarsest_spacing_m())) + kMarginCells;
    half_side_m_ = half_cells_ * coarsest_spacing_m();
    if (!take_kept(inputs.kept_lands)) {
      inputs.context.log.debug("{}: procedural land is made", options.name);
      raise_land(options, entry);
    }
    const auto [lowest, highest] =
        std::minmax_element(heights_m_.values.begin(), heights_m_.values.end());
    // The spline overshoots its samples by less than an eighth of their range.
    const double beyond_m = 0.125 * static_cast<double>(*highest - *lowest);
    lowest_m_ = static_cast<double>(*lowest) - beyond_m;
    highest_m_ = static_cast<double>(*highest) + beyond_m;

    world::SourceInfo source;
    source.name = "procedural";
    source.kind = "procedural";
    source.vertical_datum = datum_.name;
    source.spacing_m = spacing_m_;
    source.content_hash = hash_;
    source.licence = entry.licence;
    source.accuracy = entry.accuracy;
    sources_.push_back(source);
    if (!has_sea_) return;
    source.name = "sea";
    source.kind = "sea";
    source.spacing_m = 0.0;  // of a floor without samples
    sources_.push_back(source);
  }

  void map_from_geodetic(std::span<const geo::Geodetic> places,
                         std::span<Eigen::Vector2d> map) const override {
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Eigen::Vector3d foot = frame_.world_from_geodetic(
          {.lat_deg = places[i].lat_deg, .lon_deg = places[i].lon_deg, .height_m = 0.0});
      map[i] = (foot.head<2>().array() + half_side_m_) / spacing_m_;
    }
  }

  double height_m(const Eigen::Vector2d& map) const override { return bicubic(heights_m_, map); }

  FieldFacts facts(const Eigen::Vector2d&) const override {
    FieldFacts facts{};
    facts.source = 0;
    // Without a sea, a hollow below sea_level_m is a lake's, or dry.
    if (has_sea_) facts.sea_height_m = sea_height_m_;
    return facts;
  }

  bool has_sea() const override { return has_sea_; }
  double lowest_m() const override { return lowest_m_; }
  double highest_m() const override { return highest_m_; }
  const geo::VerticalDatum& datum() const override { return datum_; }
  double spacing_m() const override { return spacing_m_; }
  double metres_per_map_unit() const override { return spacing_m_; }
  bool takes_detail() const override { return true; }
  const std::vector<world::SourceInfo>& sources() const override { return sources_; }
  std::string input_hash() const override { return hash_; }

  std::vector<KeptLand> lands() const override { return {{hash_, heights_m_}}; }

 private:
  /// Whether a world's folder keeps this land.
  bool take_kept(std::span<const KeptLand> lands) {
    const auto kept = std::find_if(lands.begin(), lands.end(), [&](const KeptLand& land) {
      return land.input_hash == hash_ && land.heights_m.width == num_samples() &&
             land.heights_m.height == num_samples();
    });
    if (kept == lands.end()) return false;
    heights_m_ = kept->heights_m;
    return true;
  }
  double coarsest_spacing_m() const { return 2.0 * spacing_m_ * (1 << kNumRefinements); }
  /// Of a side of heights_m_.
  int num_samples() const { return 2 * half_cells_ * (2 << kNumRefinements) + 1; }

  void raise_land(const WorldOptions& options, const ElevationOptions& entry) {
    const double relief_m = entry.relief_m;
    const LandPlan plan(static_cast<std::uint64_t>(options.seed), entry);
    const double half_size_m = options.size_m / 2.0;
    double spacing_m = coarsest_spacing_m();

    ErosionInputs land;
    land.heights_m = Grid<float>(2 * half_cells_ + 1, 2 * half_cells_ + 1);
    // Steps are counted so that the coarse grid comes near its steady state.
    constexpr int kSteps[kNumRefinements + 1] = {120, 24, 8};
    for (int pass = 0; pass <= kNumRefinements; ++pass, spacing_m /= 2.0) {
      land.spacing_m = spacing_m;
      if (pass > 0) land.heights_m = refined(land.heights_m);
      prepare(land, plan, half_size_m, relief_m, pass == 0);
      // K dt falls with the spacing of the grid in time, not in space: a finer pass continues the
      // coarse one.
      const ErosionOptions erosion{.num_steps = kSteps[pass],
                                   .stream_power = 4.0,
                                   .talus_slope = 0.8,
                                   .creep = 0.03 * (1 << pass)};
      land.heights_m = erode(land, erosion);
    }
    scale_to_relief(land, relief_m);
    heights_m_ = bent(land.heights_m, static_cast<std::uint64_t>(options.seed));
    if (entry.lakes > 0)
      dig_lakes(static_cast<int>(entry.lakes), static_cast<std::uint64_t>(options.seed));
  }

  /// Hollows as glaciers leave them: where much land drains through a valley, one broad enough.
  void dig_lakes(int num_lakes, std::uint64_t seed) {
    constexpr int kStride = 4;
    const int side = (heights_m_.width - 1) / kStride + 1;
    Grid<float> coarse(side, side);
    std::vector<std::uint8_t> is_outlet(coarse.values.size(), 0);
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        coarse(i, j) = heights_m_.clamped(i * kStride, j * kStride);
        const bool is_rim = i == 0 || j == 0 || i + 1 == side || j + 1 == side;
        is_outlet[coarse.index(i, j)] =
            is_rim || static_cast<double>(coarse(i, j)) <= sea_height_m_ ? 1 : 0;
      }
    const FlowRouting flow = route_flow(coarse, is_outlet);
    const double step_m = kStride * spacing_m_;
    struct Place {
      std::uint64_t draw;
      int i, j;
    };
    std::vector<Place> places;
    for (int j = 10; j + 10 < side; ++j)
      for (int i = 10; i + 10 < side; ++i) {
        const double catchment_km2 =
            static_cast<double>(flow.area[coarse.index(i, j)]) * step_m * step_m * 1e-6;
        if (catchment_km2 > 12.0 && catchment_km2 < 260.0 &&
            static_cast<double>(coarse(i, j)) > sea_height_m_ + 12.0)
          places.push_back({core::random_bits(seed, 30, coarse.index(i, j)), i, j});
      }
    std::sort(places.begin(), places.end(),
              [](const Place& a, const Place& b) { return a.draw < b.draw; });
    const GradientNoise shore(seed, 31);
    std::vector<Eigen::Vector2d> dug;
    for (const Place& place : places) {
      if (static_cast<int>(dug.size()) >= num_lakes) break;
      const Eigen::Vector2d center = kStride * Eigen::Vector2d(place.i, place.j);
      const double reach = core::random_between(900.0, 2100.0, seed, 32, place.draw) / spacing_m_;
      const bool is_apart = std::none_of(dug.begin(), dug.end(), [&](const auto& other) {
        return (other - center).norm() < 5000.0 / spacing_m_;
      });
      if (!is_apart) continue;
      dug.push_back(center);
      const double level_m = static_cast<double>(coarse(place.i, place.j)) + 3.0;
      const int far = static_cast<int>(reach);
      for (int dj = -far; dj <= far; ++dj)
        for (int di = -far; di <= far; ++di) {
          const int i = kStride * place.i + di, j = kStride * place.j + dj;
          if (!heights_m_.contains(i, j)) continue;
          const double away = std::sqrt(static_cast<double>(di * di + dj * dj)) / reach +
                              0.35 * fractal_noise(shore, 5.0 * i / reach, 5.0 * j / reach, 3);
          const double within = smooth_step(0.0, 0.7, 1.0 - away);
          float& height_m = heights_m_(i, j);
          // Valley sides stay: only what is not much higher than the lake is dug.
          const double above_m = static_cast<double>(height_m) - level_m;
          const double share = within * (1.0 - smooth_step(10.0, 60.0, above_m));
          height_m = static_cast<float>(static_cast<double>(height_m) -
                                        share * std::max(above_m + 22.0 * within, 0.0));
        }
    }
  }

  /// Twice the samples, each taken from a place a little aside: rivers that follow the eight
  /// directions of the routing come out winding.
  Grid<float> bent(const Grid<float>& straight, std::uint64_t seed) const {
    Grid<float> fine(2 * straight.width - 1, 2 * straight.height - 1);
    const GradientNoise aside_x(seed, 20);
    const GradientNoise aside_y(seed, 21);
    core::parallel_for(fine.height, [&](std::int64_t row) {
      const int j = static_cast<int>(row);
      for (int i = 0; i < fine.width; ++i) {
        const double x = 0.5 * i;
        const double y = 0.5 * j;
        const Eigen::Vector2d place(x + 2.6 * fractal_noise(aside_x, x / 9.0, y / 9.0, 3),
                                    y + 2.6 * fractal_noise(aside_y, x / 9.0, y / 9.0, 3));
        fine(i, j) = static_cast<float>(bicubic(straight, place));
      }
    });
    return fine;
  }

  void prepare(ErosionInputs& land, const LandPlan& plan, double half_size_m, double relief_m,
               bool is_first) const {
    const int side = land.heights_m.width;
    land.uplift_m = Grid<float>(side, side);
    land.erodibility = Grid<float>(side, side);
    land.is_sea.assign(land.heights_m.values.size(), 0);
    core::parallel_for(side, [&](std::int64_t row) {
      const int j = static_cast<int>(row);
      for (int i = 0; i < side; ++i) {
        const Eigen::Vector2d p((i * land.spacing_m - half_side_m_) / half_size_m,
                                (j * land.spacing_m - half_side_m_) / half_size_m);
        const std::size_t cell = land.heights_m.index(i, j);
        // Without a sea, rivers run out over the grid's rim, beyond the square.
        const bool is_rim = i == 0 || j == 0 || i + 1 == side || j + 1 == side;
        const bool is_sea = plan.inland(p) < 0.0 || (!plan.has_coast() && is_rim);
        land.is_sea[cell] = is_sea ? 1 : 0;
        land.uplift_m.values[cell] = static_cast<float>(0.012 * relief_m * plan.uplift(p));
        land.erodibility.values[cell] = static_cast<float>(plan.erodibility(p));
        float& height_m = land.heights_m.values[cell];
        if (is_sea)
          height_m = static_cast<float>(-plan.depth(p) * relief_m);
        else if (is_first)
          height_m = static_cast<float>(
              relief_m * std::max(0.25 * plan.uplift(p) + 0.05 * plan.roughness(p), 0.001));
        else
          height_m = std::max(height_m, 0.1F);
      }
    });
  }

  void scale_to_relief(ErosionInputs& land, double relief_m) const {
    float highest_m = 1e-3F;
    for (std::size_t cell = 0; cell < land.is_sea.size(); ++cell)
      if (land.is_sea[cell] == 0) highest_m = std::max(highest_m, land.heights_m.values[cell]);
    const float factor = static_cast<float>(relief_m) / highest_m;
    for (float& height_m : land.heights_m.values)
      height_m = height_m * factor + static_cast<float>(sea_height_m_);
  }

  const geo::WorldFrame frame_;
  const geo::VerticalDatum datum_;
  double sea_height_m_ = 0.0;  ///< without a sea, what heights count from
  bool has_sea_ = true;
  double spacing_m_ = 0.0;
  int half_cells_ = 0;  ///< of the coarsest grid
  double half_side_m_ = 0.0;
  Grid<float> heights_m_;
  double lowest_m_ = 0.0;
  double highest_m_ = 0.0;
  std::string hash_;
  std::vector<world::SourceInfo> sources_;
};

}  // namespace

std::unique_ptr<HeightField> make_procedural(const ElevationInputs& inputs) {
  return std::make_unique<ProceduralField>(inputs);
}

}  // namespace terracast::tiler
