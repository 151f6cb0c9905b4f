#include "tiler/buildings/town.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "core/parallel.h"
#include "core/random.h"
#include "tiler/buildings/building_draft.h"
#include "tiler/buildings/building_tags.h"
#include "tiler/buildings/raised_bodies.h"
#include "world/tile.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using world::kHeightStep_m;

/// So wide a piece of ground says how densely a place is built.
constexpr double kDensityCell_m = 96.0;
/// Houses within so far choose from the same colours.
constexpr double kTownCell_m = 1500.0;
/// Share of a footprint in another by which it is the same building.
constexpr double kSame = 0.9;
/// Less and it only touches it.
constexpr double kTouches = 0.06;
/// An outline of which so much is mapped as parts stands as its parts alone.
constexpr double kCoveredByParts = 0.6;
constexpr double kPartOfOutline = 0.6;
/// A neighbour nearer than this leaves no room for eaves.
constexpr double kAttached_m = 0.9;
/// A raster that knows less than this shows no building: it is older, or a tree was taken away.
constexpr double kLeastRaster_m = 1.8;

std::uint64_t cell_key(double x, double y, double cell_m) {
  const auto cell = [&](double at) {
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::floor(at / cell_m)));
  };
  return static_cast<std::uint64_t>(cell(y)) << 32U | cell(x);
}

class TownBuilder {
 public:
  TownBuilder(const std::vector<VectorFeature>& features, const HeightRaster* raster,
              const TownGround& ground, double size_m, std::uint64_t seed,
              const MeasuredHeights& measured_m)
      : raster_(raster),
        measured_m_(measured_m),
        ground_(ground),
        half_size_m_(0.5 * size_m),
        seed_(seed) {
    take(features);
    drop_what_is_wet();
    drop_copies();
    drop_what_is_crowded();
    for (std::size_t i = 0; i < drafts_.size(); ++i)
      if (!drafts_[i].is_dropped)
        index_.add(static_cast<std::uint32_t>(i), drafts_[i].building.lowest_world,
                   drafts_[i].building.highest_world);
    index_.finish();
    drop_what_earlier_layers_have();
    drop_what_is_there_twice();
    replace_by_parts();
    measure_density();
    design();
  }

  Town take_town() {
    Town town;
    for (BuildingDraft& draft : drafts_) {
      if (draft.is_dropped) continue;
      town.index.add(static_cast<std::uint32_t>(town.buildings.size()), draft.building.lowest_world,
                     draft.building.highest_world);
      town.buildings.push_back(std::move(draft.building));
    }
    town.index.finish();
    const RaisedCounts raised = settle_raised_bodies(town.buildings, town.index, ground_.height_m);
    town.num_pairs = num_pairs_ + raised.num_pairs;
    const auto count = [&](const char* name, std::int64_t value) {
      if (value > 0) town.counts.emplace_back(name, value);
    };
    town.counts.emplace_back("buildings", static_cast<std::int64_t>(town.buildings.size()));
    count("heights from height", heights_[0]);
    count("heights from levels", heights_[1]);
    count("heights from the raster", heights_[2]);
    count("heights guessed", heights_[3]);
    count("absurd heights clamped", num_clamped_);
    count("footprints repaired", footprint_counts_.num_repaired);
    count("footprints simplified", footprint_counts_.num_simplified);
    count("footprints freed of what is too narrow for walls that stand back",
          footprint_counts_.num_narrow);
    count("footprints without an area", footprint_counts_.num_too_small);
    count("footprints too large", footprint_counts_.num_too_large);
    count("footprints beyond the square", num_beyond_);
    count("footprints in water", num_wet_);
    count("footprints that another layer of buildings has", num_earlier_);
    count("footprints across another layer's buildings", num_across_earlier_);
    count("footprints in others left out", num_same_);
    count("footprints left out in crowds of others", num_crowded_);
    count("footprints across others", num_crossing_);
    count("outlines replaced by parts", num_replaced_);
    count("footprints on roads", num_taken_);
    count("raised bodies that nothing carries", raised.num_grounded);
    count("raised bodies brought down to what is below them", raised.num_lowered);
    return town;
  }

 private:
  void take(const std::vector<VectorFeature>& features) {
    std::unordered_set<std::uint64_t> keys;
    std::unordered_map<std::uint64_t, std::uint64_t> num_of;
    for (const VectorFeature& feature : features) {
      if (feature.kind != FeatureKind::Area) continue;
      for (const auto& rings : feature.parts_world)
        for (Footprint& footprint : footprints_of(rings, footprint_counts_)) {
          BuildingDraft draft;
          draft.building.feature = feature.number;
          const std::uint64_t count = num_of[feature.number]++;
          draft.building.key =
              count == 0 ? feature.number : core::mix_bits(feature.number ^ core::mix_bits(count));
          while (!keys.insert(draft.building.key).second)
            draft.building.key = core::mix_bits(draft.building.key);
          draft.tags = &feature.tags;
          draft.building.is_part = is_tagged_part(feature.tags);
          draft.area_m2 = area_m2(footprint.rings);
          draft.building.own = core::random_bits(seed_, draft.building.key, 0);
          set_box(footprint, draft.building);
          draft.building.footprint = std::move(footprint);
          // What reaches over the border would stand on the apron.
          if (draft.building.lowest_world.cwiseAbs().maxCoeff() > half_size_m_ ||
              draft.building.highest_world.cwiseAbs().maxCoeff() > half_size_m_) {
            ++num_beyond_;
            continue;
          }
          drafts_.push_back(std::move(draft));
        }
    }
    core::parallel_for_blocks(static_cast<std::int64_t>(drafts_.size()), 256,
                              [&](std::int64_t begin, std::int64_t end) {
                                for (std::int64_t i = begin; i < end; ++i) {
                                  BuildingDraft& draft = drafts_[static_cast<std::size_t>(i)];
                                  draft.inside_world = places_within(draft.building);
                                }
                              });
  }

  static void set_box(const Footprint& footprint, Building& building) {
    Vector2i lowest = footprint.rings[0][0];
    Vector2i highest = lowest;
    for (const Vector2i& corner : footprint.rings[0]) {
      lowest = lowest.cwiseMin(corner);
      highest = highest.cwiseMax(corner);
    }
    const Vector2d place = footprint.place_m.cast<double>();
    building.lowest_world = place + kHeightStep_m * lowest.cast<double>();
    building.highest_world = place + kHeightStep_m * highest.cast<double>();
  }

  void drop_what_is_wet() {
    for (BuildingDraft& draft : drafts_) {
      bool is_wet = ground_.is_water(draft.building.footprint.place_m.cast<double>());
      for (const Vector2i& corner : draft.building.footprint.rings[0]) {
        if (!is_wet) break;
        is_wet = ground_.is_water(draft.building.footprint.place_m.cast<double>() +
                                  kHeightStep_m * corner.cast<double>());
      }
      if (!is_wet) continue;
      draft.is_dropped = true;
      ++num_wet_;
    }
  }

  /// Before pairs of them are looked at: they would be the square of their number.
  void drop_copies() {
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < drafts_.size(); ++i)
      if (!drafts_[i].is_dropped) rows.push_back(i);
    std::sort(rows.begin(), rows.end(), [&](std::size_t a, std::size_t b) {
      return comes_before_copies(drafts_[a], drafts_[b]);
    });
    for (std::size_t k = 1; k < rows.size(); ++k) {
      if (!are_copies(drafts_[rows[k - 1]], drafts_[rows[k]])) continue;
      drafts_[rows[k]].is_dropped = true;
      ++num_same_;
    }
  }

  void drop_what_is_crowded() {
    std::vector<std::size_t> rows(drafts_.size());
    std::iota(rows.begin(), rows.end(), std::size_t{0});
    std::sort(rows.begin(), rows.end(),
              [&](std::size_t a, std::size_t b) { return goes_before(drafts_[a], drafts_[b]); });
    std::unordered_map<std::uint64_t, std::size_t> num_in;  // of each cell
    for (const std::size_t i : rows) {
      BuildingDraft& draft = drafts_[i];
      if (draft.is_dropped) continue;
      const std::vector<std::uint64_t> cells =
          BoxIndex::cells_of(draft.building.lowest_world, draft.building.highest_world);
      draft.is_dropped = std::any_of(cells.begin(), cells.end(), [&](std::uint64_t cell) {
        return num_in[cell] >= kMostInCell;
      });
      if (draft.is_dropped)
        ++num_crowded_;
      else
        for (const std::uint64_t cell : cells) ++num_in[cell];
    }
  }

  std::vector<std::uint32_t> near(const BuildingDraft& draft, double margin_m) const {
    std::vector<std::uint32_t> rows =
        index_.rows_in(draft.building.lowest_world.array() - margin_m,
                       draft.building.highest_world.array() + margin_m);
    num_pairs_ += static_cast<std::int64_t>(rows.size());
    return rows;
  }

  /// Buildings of earlier layers whose boxes come so near to a draft's.
  std::vector<const Building*> near_of_earlier(const BuildingDraft& draft, double margin_m) const {
    const Vector2d lowest = draft.building.lowest_world.array() - margin_m;
    const Vector2d highest = draft.building.highest_world.array() + margin_m;
    std::vector<const Building*> others;
    for (const Town* town : ground_.earlier) {
      const std::vector<std::uint32_t> rows = town->index.rows_in(lowest, highest);
      num_pairs_ += static_cast<std::int64_t>(rows.size());
      for (const std::uint32_t row : rows) {
        const Building& other = town->buildings[row];
        if ((other.lowest_world.array() <= highest.array()).all() &&
            (other.highest_world.array() >= lowest.array()).all())
          others.push_back(&other);
      }
    }
    return others;
  }

  double share_in_earlier(const BuildingDraft& draft) const {
    const std::vector<const Building*> others = near_of_earlier(draft, 0.0);
    if (others.empty() || draft.inside_world.empty()) return 0.0;
    const auto num_in = std::count_if(
        draft.inside_world.begin(), draft.inside_world.end(), [&](const Vector2d& place) {
          return std::any_of(others.begin(), others.end(),
                             [&](const Building* other) { return contains_world(*other, place); });
        });
    return static_cast<double>(num_in) / static_cast<double>(draft.inside_world.size());
  }

  /// The earlier layer's stands, however good the later's is: as layers go before each other
  /// everywhere. Parts go with their outline, so that no building is there in pieces.
  void drop_what_earlier_layers_have() {
    if (ground_.earlier.empty()) return;
    const auto for_each = [&](const auto& work) {
      core::parallel_for_blocks(static_cast<std::int64_t>(drafts_.size()), 64,
                                [&](std::int64_t begin, std::int64_t end) {
                                  for (std::int64_t i = begin; i < end; ++i)
                                    if (!drafts_[static_cast<std::size_t>(i)].is_dropped)
                                      work(static_cast<std::size_t>(i));
                                });
    };
    for_each([&](std::size_t i) { drafts_[i].share_earlier = share_in_earlier(drafts_[i]); });
    const auto is_theirs = [](const BuildingDraft& draft) {
      return draft.share_earlier >= kShareOfEarlier;
    };
    std::vector<char> goes(drafts_.size(), 0);
    for_each([&](std::size_t i) {
      const BuildingDraft& draft = drafts_[i];
      bool has_outline = false;
      bool stands = false;
      if (draft.building.is_part)
        for (const std::uint32_t j : near(draft, 0.0)) {
          const BuildingDraft& outline = drafts_[j];
          if (outline.building.is_part || outline.is_dropped ||
              share_in(draft, outline) < kPartOfOutline)
            continue;
          has_outline = true;
          stands = stands || !is_theirs(outline);
        }
      goes[i] = (has_outline ? !stands : is_theirs(draft)) ? 1 : 0;
    });
    for (std::size_t i = 0; i < drafts_.size(); ++i) {
      if (goes[i] == 0) continue;
      drafts_[i].is_dropped = true;
      ++num_earlier_;
    }
  }

  void drop_what_is_there_twice() {
    // All verdicts before any is carried out, so that their order does not matter.
    std::vector<char> is_same(drafts_.size(), 0);
    std::vector<char> crosses(drafts_.size(), 0);
    core::parallel_for_blocks(
        static_cast<std::int64_t>(drafts_.size()), 64, [&](std::int64_t begin, std::int64_t end) {
          for (std::int64_t k = begin; k < end; ++k) {
            const auto i = static_cast<std::size_t>(k);
            const BuildingDraft& draft = drafts_[i];
            if (draft.is_dropped) continue;
            for (const std::uint32_t j : near(draft, 0.0)) {
              const BuildingDraft& other = drafts_[j];
              if (j == i || other.is_dropped || other.building.is_part != draft.building.is_part)
                continue;
              if (!goes_before(other, draft)) continue;
              const double share = share_in(draft, other);
              if (draft.building.is_part) {
                // Parts stand over each other and in each other; only the very same is there twice.
                if (share >= kSame && draft.area_m2 > 0.98 * other.area_m2 &&
                    *draft.tags == *other.tags)
                  is_same[i] = 1;
              } else if (share >= kSame) {
                is_same[i] = 1;
              } else if (share > kTouches) {
                crosses[i] = 1;
              }
            }
          }
        });
    for (std::size_t i = 0; i < drafts_.size(); ++i) {
      if (is_same[i] != 0) {
        drafts_[i].is_dropped = true;
        ++num_same_;
      } else if (crosses[i] != 0) {
        ++num_crossing_;
      }
    }
  }

  void replace_by_parts() {
    std::vector<double> covered(drafts_.size(), 0.0);
    std::vector<std::size_t> owner(drafts_.size(), drafts_.size());
    for (std::size_t i = 0; i < drafts_.size(); ++i) {
      const BuildingDraft& part = drafts_[i];
      if (!part.building.is_part || part.is_dropped) continue;
      double best = kPartOfOutline;
      for (const std::uint32_t j : near(part, 0.0)) {
        const BuildingDraft& outline = drafts_[j];
        if (outline.building.is_part || outline.is_dropped) continue;
        const double share = share_in(part, outline);
        if (share < best) continue;
        best = share;
        owner[i] = j;
      }
    }
    // By what of an outline lies in parts, and not by their areas: they lie over each other.
    std::vector<std::vector<std::size_t>> parts(drafts_.size());
    for (std::size_t i = 0; i < drafts_.size(); ++i)
      if (owner[i] < drafts_.size()) parts[owner[i]].push_back(i);
    for (std::size_t j = 0; j < drafts_.size(); ++j) {
      if (parts[j].empty()) continue;
      BuildingDraft& outline = drafts_[j];
      std::size_t num_in = 0;
      for (const Vector2d& place : outline.inside_world)
        for (const std::size_t i : parts[j])
          if (contains_world(drafts_[i].building, place)) {
            ++num_in;
            break;
          }
      for (const std::size_t i : parts[j]) {
        Building& part = drafts_[i].building;
        const Vector2i from_outline =
            (outline.building.footprint.place_m - part.footprint.place_m) *
            static_cast<int>(1.0 / kHeightStep_m);
        for (const Vector2i& corner : outline.building.footprint.rings[0])
          part.ground_steps.push_back(corner + from_outline);
        part_of_[i] = j;
      }
      if (static_cast<double>(num_in) <
          kCoveredByParts * static_cast<double>(outline.inside_world.size()))
        continue;
      outline.is_dropped = true;
      ++num_replaced_;
    }
  }

  void measure_density() {
    const auto add = [&](const Building& building, double built_m2) {
      const Vector2i& at = building.footprint.place_m;
      built_m2_[cell_key(at.x(), at.y(), kDensityCell_m)] += built_m2;
    };
    for (const BuildingDraft& draft : drafts_)
      if (!draft.is_dropped) add(draft.building, draft.area_m2);
    for (const Town* town : ground_.earlier)
      for (const Building& building : town->buildings)
        add(building, area_m2(building.footprint.rings));
  }

  double share_built(const Vector2d& at) const {
    double built = 0.0;
    for (const double dy : {-kDensityCell_m, 0.0, kDensityCell_m})
      for (const double dx : {-kDensityCell_m, 0.0, kDensityCell_m}) {
        const auto found = built_m2_.find(cell_key(at.x() + dx, at.y() + dy, kDensityCell_m));
        if (found != built_m2_.end()) built += found->second;
      }
    return built / (9.0 * kDensityCell_m * kDensityCell_m);
  }

  std::vector<bool> attached_edges(std::size_t row) const {
    const BuildingDraft& draft = drafts_[row];
    const Footprint& footprint = draft.building.footprint;
    std::vector<bool> attached;
    std::vector<const Building*> others = near_of_earlier(draft, kAttached_m + 0.1);
    for (const std::uint32_t j : near(draft, kAttached_m + 0.1))
      if (j != row && !drafts_[j].is_dropped) others.push_back(&drafts_[j].building);
    for (const auto& ring : footprint.rings)
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const Vector2d a = ring[i].cast<double>();
        const Vector2d b = ring[(i + 1) % ring.size()].cast<double>();
        const Vector2d along = (b - a).normalized();
        const Vector2d outward(along.y(), -along.x());
        const auto holds_place_beside = [&](const Building* other) {
          for (const double share : {0.04, 0.27, 0.5, 0.73, 0.96})
            for (const double out_m : {0.15, kAttached_m})
              if (contains_world(*other, footprint.place_m.cast<double>() +
                                             kHeightStep_m * (a + share * (b - a)) +
                                             out_m * outward))
                return true;
          return false;
        };
        attached.push_back(std::any_of(others.begin(), others.end(), holds_place_beside));
      }
    return attached;
  }

  double share_at_sea(const Building& building) const {
    constexpr double kOutside_m = 30.0;
    constexpr double kStep_m = 10.0;
    const Vector2d place = building.footprint.place_m.cast<double>();
    const auto& ring = building.footprint.rings.front();
    int num = 0;
    int num_at_sea = 0;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vector2d a = kHeightStep_m * ring[i].cast<double>();
      const Vector2d edge = kHeightStep_m * ring[(i + 1) % ring.size()].cast<double>() - a;
      const Vector2d outward = Vector2d(edge.y(), -edge.x()).normalized();
      const int num_steps = 1 + static_cast<int>(edge.norm() / kStep_m);
      for (int k = 0; k < num_steps; ++k) {
        const Vector2d at = place + a + (k + 0.5) / num_steps * edge + kOutside_m * outward;
        ++num;
        num_at_sea += ground_.is_sea(at) ? 1 : 0;
      }
    }
    return static_cast<double>(num_at_sea) / num;
  }

  void design() {
    core::parallel_for_blocks(static_cast<std::int64_t>(drafts_.size()), 64,
                              [&](std::int64_t begin, std::int64_t end) {
                                for (std::int64_t k = begin; k < end; ++k)
                                  if (!drafts_[static_cast<std::size_t>(k)].is_dropped)
                                    design(static_cast<std::size_t>(k));
                              });
    for (BuildingDraft& draft : drafts_) {
      if (draft.is_dropped) continue;
      const BuildingDesign& design = draft.building.design;
      ++heights_[static_cast<std::size_t>(design.height_source)];
      num_clamped_ += design.was_clamped ? 1 : 0;
      num_across_earlier_ += draft.share_earlier > kTouches ? 1 : 0;
      num_taken_ += ground_.is_taken(draft.building.footprint.place_m.cast<double>()) ? 1 : 0;
    }
  }

  void design(std::size_t row) {
    BuildingDraft& draft = drafts_[row];
    Building& building = draft.building;
    const Vector2d at = building.footprint.place_m.cast<double>();
    building.attached = attached_edges(row);
    const Rectangle box = rectangle_round(building.footprint.rings.front());
    Surroundings around;
    around.area_m2 = draft.area_m2;
    around.width_m = box.width_steps * kHeightStep_m;
    around.length_m = box.length_steps * kHeightStep_m;
    around.num_corners = num_corners(building.footprint.rings);
    around.share_built = share_built(at);
    around.is_attached = std::find(building.attached.begin(), building.attached.end(), true) !=
                         building.attached.end();
    // Just a building.
    if (flag_from_tag(BuildingTags(*draft.tags).value("building")) == true)
      around.share_at_sea = share_at_sea(building);
    around.latitude_deg = ground_.latitude_deg;
    around.height_m = ground_.height_m(at);
    const std::optional<double> raster_m = raster_height_m(draft);
    // Parts go with their building, houses with their neighbours.
    std::uint64_t own = building.own;
    if (const auto found = part_of_.find(row); found != part_of_.end())
      own = drafts_[found->second].building.own;
    const std::uint64_t town =
        core::random_bits(seed_, cell_key(at.x(), at.y(), kTownCell_m), 0x746f776eULL);
    building.design =
        design_building(*draft.tags, draft.building.is_part, around, raster_m, town, own);
  }

  /// Above the lowest ground, from which walls go up; nothing where no raster knows one.
  std::optional<double> raster_height_m(const BuildingDraft& draft) const {
    const Footprint& footprint = draft.building.footprint;
    if (const auto found = measured_m_.find(draft.building.feature); found != measured_m_.end())
      return found->second + middle_above_lowest_m(draft);
    if (raster_ == nullptr) return std::nullopt;
    const std::optional<double> median_m = raster_->median_m(footprint);
    return median_m && *median_m >= kLeastRaster_m ? median_m : std::nullopt;
  }

  /// How far the ground in the middle of a footprint, from its lowest to its highest, is above the
  /// lowest at its corners: on a slope a height above the ground is one above that.
  double middle_above_lowest_m(const BuildingDraft& draft) const {
    if (draft.inside_world.empty()) return 0.0;
    const Footprint& footprint = draft.building.footprint;
    std::vector<double> heights_m;
    for (const Vector2d& place : draft.inside_world) heights_m.push_back(ground_.height_m(place));
    const auto middle = heights_m.begin() + static_cast<std::ptrdiff_t>(heights_m.size() / 2);
    std::nth_element(heights_m.begin(), middle, heights_m.end());
    double lowest_m = *middle;
    for (const Vector2i& corner : footprint.rings.front())
      lowest_m = std::min(lowest_m, ground_.height_m(footprint.place_m.cast<double>() +
                                                     kHeightStep_m * corner.cast<double>()));
    return *middle - lowest_m;
  }

  const HeightRaster* raster_;
  const MeasuredHeights& measured_m_;
  const TownGround& ground_;
  double half_size_m_;
  std::uint64_t seed_;
  std::vector<BuildingDraft> drafts_;
  BoxIndex index_;
  std::unordered_map<std::size_t, std::size_t> part_of_;
  std::unordered_map<std::uint64_t, double> built_m2_;
  FootprintCounts footprint_counts_;
  std::array<std::int64_t, kNumHeightSources> heights_ = {};
  std::int64_t num_clamped_ = 0;
  std::int64_t num_beyond_ = 0;
  std::int64_t num_wet_ = 0;
  std::int64_t num_earlier_ = 0;
  std::int64_t num_across_earlier_ = 0;
  std::int64_t num_same_ = 0;
  std::int64_t num_crowded_ = 0;
  std::int64_t num_crossing_ = 0;
  std::int64_t num_replaced_ = 0;
  std::int64_t num_taken_ = 0;
  mutable std::atomic<std::int64_t> num_pairs_ = 0;
};

}  // namespace

Town build_town(const std::vector<VectorFeature>& features, const HeightRaster* raster,
                const TownGround& ground, double size_m, std::uint64_t seed,
                const MeasuredHeights& measured_m) {
  return TownBuilder(features, raster, ground, size_m, seed, measured_m).take_town();
}

}  // namespace terracast::tiler
