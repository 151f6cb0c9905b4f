#include "tiler/layered_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "tiler/geodesy_cells.h"
#include "tiler/known_rasters.h"
#include "tiler/void_filling.h"

namespace terracast::tiler {
namespace {

/// Map coordinates are known this far beyond the square: the interpolation of samples and the lean
/// of up against z reach out of it.
constexpr double kBeyondSquare_m = 1000.0;

double smooth_step(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// A field's map coordinates as a function of the foot's: exact at nodes, quadratic between them.
class MapGrid {
 public:
  MapGrid(const geo::WorldFrame& frame, const HeightField& field, double half_side_m)
      : half_side_m_(half_side_m) {
    constexpr double kWidest_m = 512.0;
    constexpr double kClosest_m = 32.0;
    constexpr double kMostNodes = 1e6;
    constexpr double kGood_m = 1e-6;
    constexpr double kWorst_m = 1e-3;
    for (spacing_m_ = kWidest_m;; spacing_m_ /= 2.0) {
      fill(frame, field);
      const double error_m = probe(frame, field) * field.metres_per_map_unit();
      const double next_nodes = std::pow(4.0 * half_side_m_ / spacing_m_, 2.0);
      if (error_m <= kGood_m) return;
      if (spacing_m_ > kClosest_m && next_nodes < kMostNodes) continue;
      if (error_m > kWorst_m)
        core::fail(core::ErrorKind::Input,
                   "{}: its projection bends so much within the world's square that places are "
                   "only good to {:.2g} m; warp it to UTM or to latitude and longitude",
                   field.sources().front().name, error_m);
      return;
    }
  }

  Eigen::Vector2d at(const Eigen::Vector2d& foot) const {
    const Eigen::Array2d place = (foot.array() + half_side_m_) / spacing_m_;
    const int i = cell_of(place.x());
    const int j = cell_of(place.y());
    const std::array<double, 3> wx = weights(place.x() - i);
    const std::array<double, 3> wy = weights(place.y() - j);
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (int dj = 0; dj < 3; ++dj) {
      const Eigen::Vector2d* row = &nodes_.values[nodes_.index(i, j + dj)];
      sum += wy[static_cast<std::size_t>(dj)] * (wx[0] * row[0] + wx[1] * row[1] + wx[2] * row[2]);
    }
    return sum;
  }

 private:
  /// First node of the cell of 3 x 3 nodes.
  int cell_of(double place) const {
    return 2 * std::clamp(static_cast<int>(std::floor(0.5 * place)), 0, (nodes_.width - 3) / 2);
  }
  /// Of nodes 0, 1 and 2 at t.
  static std::array<double, 3> weights(double t) {
    return {0.5 * (t - 1.0) * (t - 2.0), t * (2.0 - t), 0.5 * t * (t - 1.0)};
  }
  static void map_of_feet(const geo::WorldFrame& frame, const HeightField& field,
                          std::span<const Eigen::Vector2d> feet, std::span<Eigen::Vector2d> map) {
    std::vector<geo::Geodetic> places;
    places.reserve(feet.size());
    for (const Eigen::Vector2d& foot : feet)
      places.push_back(place_at_height(frame, foot.x(), foot.y(), 0.0, 1e-9).place);
    field.map_from_geodetic(places, map);
  }
  void fill(const geo::WorldFrame& frame, const HeightField& field) {
    const int num_cells = static_cast<int>(std::ceil(half_side_m_ / spacing_m_));  // of 2 nodes
    const int side = 2 * num_cells + 1;
    nodes_ = Grid<Eigen::Vector2d>(side, side, Eigen::Vector2d::Zero());
    core::parallel_for(side, [&](std::int64_t row) {
      const int j = static_cast<int>(row);
      std::vector<Eigen::Vector2d> feet;
      for (int i = 0; i < side; ++i)
        feet.emplace_back(i * spacing_m_ - half_side_m_, j * spacing_m_ - half_side_m_);
      map_of_feet(frame, field, feet,
                  std::span(nodes_.values).subspan(nodes_.index(0, j), feet.size()));
    });
  }
  /// The largest error found between nodes, in map units.
  double probe(const geo::WorldFrame& frame, const HeightField& field) const {
    constexpr int kProbes = 16;
    std::vector<Eigen::Vector2d> feet;
    for (int j = 0; j < kProbes; ++j)
      for (int i = 0; i < kProbes; ++i) {
        // Where a quadratic through three nodes errs most: 0.42 of a node's spacing from a node.
        const auto between = [&](int k) {
          const double node = std::floor((k + 0.5) / kProbes * 2.0 * half_side_m_ / spacing_m_);
          return std::min((node + 0.42) * spacing_m_ - half_side_m_, half_side_m_);
        };
        feet.emplace_back(between(i), between(j));
      }
    std::vector<Eigen::Vector2d> map(feet.size());
    map_of_feet(frame, field, feet, map);
    double worst = 0.0;
    for (std::size_t k = 0; k < feet.size(); ++k)
      worst = std::max(worst, (at(feet[k]) - map[k]).norm());
    return worst;
  }

  double half_side_m_;
  double spacing_m_ = 0.0;
  Grid<Eigen::Vector2d> nodes_;
};

/// The ground at a place, as one field or several blended have it.
struct GroundFacts {
  double height_m = 0.0;
  FieldFacts facts;

  bool is_sea() const { return facts.sea_height_m && height_m <= *facts.sea_height_m; }
  double surface_m() const { return is_sea() ? *facts.sea_height_m : height_m; }
};

/// The sea's height where one of two may be sea: where the other counts more it sinks, out of reach
/// of low land that is none.
std::optional<double> blended_sea_m(const GroundFacts& below, const GroundFacts& above,
                                    double share) {
  constexpr double kSink_m = 1000.0;
  if (below.facts.sea_height_m && above.facts.sea_height_m)
    return *below.facts.sea_height_m +
           share * (*above.facts.sea_height_m - *below.facts.sea_height_m);
  if (below.facts.sea_height_m) return *below.facts.sea_height_m - kSink_m * share / (1.0 - share);
  if (above.facts.sea_height_m) return *above.facts.sea_height_m - kSink_m * (1.0 - share) / share;
  return std::nullopt;
}

GroundFacts blended(const GroundFacts& below, const GroundFacts& above, double share) {
  GroundFacts ground;
  const FieldFacts& counting = share >= 0.5 ? above.facts : below.facts;
  ground.facts.source = counting.source;
  ground.facts.is_shelf = counting.is_shelf;
  ground.facts.sea_height_m = blended_sea_m(below, above, share);
  const auto mix = [share](double a, double b) { return a + share * (b - a); };
  if (below.is_sea() && above.is_sea()) {
    ground.height_m = mix(below.height_m, above.height_m);
    ground.facts.floor_depth_m = mix(below.facts.floor_depth_m, above.facts.floor_depth_m);
  } else {
    ground.height_m = mix(below.surface_m(), above.surface_m());
  }
  return ground;
}

class LayeredField : public HeightField, public KnownRasters {
 public:
  LayeredField(const geo::WorldFrame& frame, double size_m, std::vector<FieldLayer> layers,
               double fit_m)
      : frame_(frame), half_side_m_(0.5 * size_m + kBeyondSquare_m) {
    TERRACAST_CHECK(!layers.empty() && layers.front().share.values.empty(), "no base");
    for (FieldLayer& layer : layers) add(std::move(layer));
    if (fit_m > 0.0 && layers_.size() > 1) fit_base(fit_m);
    find_bounds();
    hash_fields();
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

  double height_m(const Eigen::Vector2d& foot) const override { return ground(foot).height_m; }
  FieldFacts facts(const Eigen::Vector2d& foot) const override { return ground(foot).facts; }

  double detail_share(const Eigen::Vector2d& foot, int octave) const override {
    double share = base().level >= octave ? 1.0 : 0.0;
    for (std::size_t i = 1; i < layers_.size(); ++i) {
      const double above = layers_[i].share_at(layers_[i].map.at(foot));
      share += above * ((layers_[i].level >= octave ? 1.0 : 0.0) - share);
    }
    return share;
  }

  bool has_sea() const override {
    return std::any_of(layers_.begin(), layers_.end(),
                       [](const Layer& layer) { return layer.field->has_sea(); });
  }
  bool has_insets() const override {
    return std::any_of(layers_.begin(), layers_.end(),
                       [&](const Layer& layer) { return layer.level != base().level; });
  }
  double lowest_m() const override { return lowest_m_; }
  double highest_m() const override { return highest_m_; }
  const geo::VerticalDatum& datum() const override { return base().field->datum(); }
  double spacing_m() const override { return base().field->spacing_m(); }
  double widest_spacing_m() const override {
    double widest_m = 0.0;
    for (const Layer& layer : layers_) widest_m = std::max(widest_m, layer.field->spacing_m());
    return widest_m;
  }
  double metres_per_map_unit() const override { return 1.0; }
  bool takes_detail() const override { return true; }
  const std::vector<world::SourceInfo>& sources() const override { return sources_; }
  std::vector<std::optional<world::RasterInfo>> rasters() const override { return rasters_; }
  std::string input_hash() const override { return hash_; }
  std::vector<KeptLand> lands() const override {
    std::vector<KeptLand> all;
    for (const Layer& layer : layers_)
      for (KeptLand& land : layer.field->lands()) all.push_back(std::move(land));
    return all;
  }

 private:
  struct Layer {
    std::unique_ptr<HeightField> field;
    Grid<float> share;
    MapGrid map;
    int level = 0;                  ///< that its spacing stands for
    std::uint8_t first_source = 0;  ///< row of its sources among ours

    double share_at(const Eigen::Vector2d& at) const {
      return std::clamp(bicubic(share, at), 0.0, 1.0);
    }
    GroundFacts at(const Eigen::Vector2d& map_place) const {
      GroundFacts ground{.height_m = field->height_m(map_place), .facts = field->facts(map_place)};
      ground.facts.source = static_cast<std::uint8_t>(ground.facts.source + first_source);
      return ground;
    }
  };

  const Layer& base() const { return layers_.front(); }

  void add(FieldLayer layer) {
    TERRACAST_CHECK(sources_.size() + layer.field->sources().size() < 250, "too many sources");
    MapGrid map(frame_, *layer.field, half_side_m_);
    const int level = static_cast<int>(std::floor(std::log2(layer.field->spacing_m()) + 1e-3));
    const auto first_source = static_cast<std::uint8_t>(sources_.size());
    sources_.insert(sources_.end(), layer.field->sources().begin(), layer.field->sources().end());
    const auto rasters = rasters_of(*layer.field);
    rasters_.insert(rasters_.end(), rasters.begin(), rasters.end());
    layers_.push_back({.field = std::move(layer.field),
                       .share = std::move(layer.share),
                       .map = std::move(map),
                       .level = level,
                       .first_source = first_source});
  }

  GroundFacts base_ground(const Eigen::Vector2d& foot) const {
    GroundFacts ground = base().at(base().map.at(foot));
    if (!correction_m_.values.empty())
      ground.height_m +=
          bicubic(correction_m_, Eigen::Vector2d((foot.array() + half_side_m_) / fit_spacing_m_));
    return ground;
  }

  GroundFacts ground(const Eigen::Vector2d& foot) const {
    // What lies under a layer that counts fully is not asked.
    std::size_t first = layers_.size() - 1;
    while (first > 0 && layers_[first].share_at(layers_[first].map.at(foot)) < 1.0) --first;
    GroundFacts ground =
        first == 0 ? base_ground(foot) : layers_[first].at(layers_[first].map.at(foot));
    for (std::size_t i = first + 1; i < layers_.size(); ++i) {
      const Eigen::Vector2d place = layers_[i].map.at(foot);
      const double share = layers_[i].share_at(place);
      if (share > 0.0) ground = blended(ground, layers_[i].at(place), share);
    }
    return ground;
  }

  /// Raises and lowers the base so that it fits the layer above where that ends. Two membranes go
  /// out from there: what the base lacks, which carries its ridges and valleys, and the ground
  /// itself. Valleys that the first would sink below both the base and the second do not: land
  /// does not drown.
  void fit_base(double fit_m) {
    fit_spacing_m_ = base().field->spacing_m();
    const int side = static_cast<int>(std::ceil(2.0 * half_side_m_ / fit_spacing_m_)) + 1;
    Grid<double> base_m(side, side);
    Grid<double> ground_m(side, side);
    Grid<std::uint8_t> is_beyond(side, side, 0);
    const Layer& measured = layers_[1];
    core::parallel_for(side, [&](std::int64_t row) {
      const int j = static_cast<int>(row);
      for (int i = 0; i < side; ++i) {
        const Eigen::Vector2d foot(i * fit_spacing_m_ - half_side_m_,
                                   j * fit_spacing_m_ - half_side_m_);
        base_m(i, j) = base().field->height_m(base().map.at(foot));
        const Eigen::Vector2d place = measured.map.at(foot);
        is_beyond(i, j) = measured.share_at(place) <= 0.0 ? 1 : 0;
        if (is_beyond(i, j) != 0) {
          ground_m(i, j) = base_m(i, j);
          continue;
        }
        const GroundFacts ground = measured.at(place);
        ground_m(i, j) = ground.height_m - (ground.is_sea() ? ground.facts.floor_depth_m : 0.0);
      }
    });
    const Grid<float> distance_m = distance_to_others(is_beyond, {fit_spacing_m_, fit_spacing_m_});
    Grid<std::uint8_t> is_between = is_beyond;
    for (std::size_t k = 0; k < is_between.values.size(); ++k)
      if (static_cast<double>(distance_m.values[k]) >= fit_m) is_between.values[k] = 0;
    Grid<double> lack_m = ground_m;
    for (std::size_t k = 0; k < lack_m.values.size(); ++k) lack_m.values[k] -= base_m.values[k];
    fill_from_surroundings(lack_m, is_between);
    fill_from_surroundings(ground_m, is_between);
    correction_m_ = Grid<float>(side, side, 0.0F);
    for (std::size_t k = 0; k < is_between.values.size(); ++k) {
      const double share = 1.0 - smooth_step(static_cast<double>(distance_m.values[k]) / fit_m);
      const double fitted_m = base_m.values[k] + share * lack_m.values[k];
      const double lowest_m = std::min(base_m.values[k], ground_m.values[k]);
      correction_m_.values[k] = static_cast<float>(std::max(fitted_m, lowest_m) - base_m.values[k]);
    }
  }

  void find_bounds() {
    lowest_m_ = base().field->lowest_m();
    highest_m_ = base().field->highest_m();
    if (!correction_m_.values.empty()) {
      const auto [least, most] =
          std::minmax_element(correction_m_.values.begin(), correction_m_.values.end());
      // The spline overshoots its samples by less than an eighth of their range.
      const double beyond_m = 0.125 * static_cast<double>(*most - *least);
      lowest_m_ += std::min(static_cast<double>(*least) - beyond_m, 0.0);
      highest_m_ += std::max(static_cast<double>(*most) + beyond_m, 0.0);
    }
    for (const Layer& layer : layers_) {
      lowest_m_ = std::min(lowest_m_, layer.field->lowest_m());
      highest_m_ = std::max(highest_m_, layer.field->highest_m());
    }
  }

  void hash_fields() {
    std::string content = "layered 1";
    for (const Layer& layer : layers_)
      content += fmt::format(" {} {}", layer.field->input_hash(),
                             core::content_hash(std::as_bytes(std::span(layer.share.values))));
    content += core::content_hash(std::as_bytes(std::span(correction_m_.values)));
    hash_ = core::content_hash(content);
  }

  const geo::WorldFrame frame_;
  double half_side_m_;
  std::vector<Layer> layers_;
  Grid<float> correction_m_;  ///< of the base, by feet; empty: none
  double fit_spacing_m_ = 1.0;
  double lowest_m_ = 0.0;
  double highest_m_ = 0.0;
  std::vector<world::SourceInfo> sources_;
  std::vector<std::optional<world::RasterInfo>> rasters_;  ///< of sources_
  std::string hash_;
};

}  // namespace

std::unique_ptr<HeightField> make_layered_field(const geo::WorldFrame& frame, double size_m,
                                                std::vector<FieldLayer> layers, double fit_m) {
  return std::make_unique<LayeredField>(frame, size_m, std::move(layers), fit_m);
}

}  // namespace terracast::tiler
